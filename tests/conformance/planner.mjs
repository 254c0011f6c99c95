// SPDX-License-Identifier: Apache-2.0
// Comunica as it is published follows links, and answers queries. Run by planner_queries_test.py:
//   node planner.mjs MODULES ROOT MOST < QUERIES
// QUERIES is JSON: {NAME: QUERY}. The engine that follows links begins at the root with the pattern ?s ?p ?o, which everything matches, so it reads all
// documents that the triples of documents name. It gives a triple once for each document that has it, so the triples go to a store, and the engine for
// stores evaluates the queries there. Bounds: documents of other servers are not fetched, and of the robot at most MOST; Comunica's queue takes 1,000
// links, and what it leaves out of a large robot is in the document of the whole robot, too. Prints lines of JSON: first {documents, triples, seconds},
// then for each query {name, rows, seconds}; rows are arrays of texts in the order of the variables.
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [modules, root, most] = process.argv.slice(2);
const questions = JSON.parse(readFileSync(0, 'utf8'));
const require = createRequire(join(modules, 'node_modules/'));
const {Store} = require('n3');
const {QueryEngine: TraversingEngine} = require('@comunica/query-sparql-link-traversal');
const {QueryEngine} = require('@comunica/query-sparql');

const nothing = '{"head": {"vars": []}, "results": {"bindings": []}}';
let documents = 0;
const bounded = async (input, init) => {
  const url = new URL(input.url ?? input);
  if (!url.href.startsWith(root)) return new Response('', {status: 404});
  // What ends with /sparql is an endpoint for this engine, which would ask there instead of reading documents.
  if (url.pathname.endsWith('/sparql')) return new Response(nothing, {headers: {'content-type': 'application/sparql-results+json'}});
  if (++documents > most) throw new Error(`more than ${most} documents`);
  const response = await fetch(input, init);
  const whole = new Response(await response.arrayBuffer(), response);  // the engine leaves what it cannot read on the way, and the connection open
  Object.defineProperty(whole, 'url', {value: response.url});
  return whole;
};

let started = performance.now();
const stream = await new TraversingEngine().queryQuads('CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }', {sources: [root], fetch: bounded, lenient: true});
const store = new Store(await stream.toArray());
console.log(JSON.stringify({documents, triples: store.size, seconds: (performance.now() - started) / 1000}));

const engine = new QueryEngine();
for (const [name, query] of Object.entries(questions)) {
  started = performance.now();
  const found = await engine.query(query, {sources: [store]});
  const variables = (await found.metadata()).variables.map(v => v.variable ?? v);
  const rows = (await (await found.execute()).toArray()).map(row => variables.map(v => row.get(v)?.value ?? null));
  console.log(JSON.stringify({name, rows, seconds: (performance.now() - started) / 1000}));
}
