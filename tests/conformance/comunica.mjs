// Comunica as it is published, from the root of a robot. Run by whole_robot_test.py:
//   node comunica.mjs MODULES ROOT QUERY_FOR_ALL QUERY QUERY_BY_GRAPH
// The last line of the output: rows of QUERY, rows of QUERY_BY_GRAPH, requests up to the first of these.
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [modules, root, queryForAll, query, queryByGraph] = process.argv.slice(2);
const require = createRequire(join(modules, 'node_modules/'));
const {QueryEngine} = require('@comunica/query-sparql');

const requests = [];
const counting = async (input, init) => {
  const response = await fetch(input, init);
  requests.push(`${init?.method ?? 'GET'} ${input.url ?? input} ${response.status} ${response.headers.get('content-type')}`);
  return response;
};
const engine = new QueryEngine();
const rows = async (text, source) => (await engine.queryBindings(text, {sources: [source], fetch: counting})).toArray();

const [link] = await rows(queryForAll, root);
const all = link.get('all').value;
const angles = await rows(query, all);
for (const row of angles) console.log(row.get('joint').value, row.get('angle').value, row.get('unit').value);
const count = requests.length;
const byGraph = await rows(queryByGraph, all);
for (const request of requests) console.log(request);
console.log(angles.length, byGraph.length, count);
