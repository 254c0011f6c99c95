// SPDX-License-Identifier: Apache-2.0
// Comunica as it is published, from the root of a robot. Run by whole_robot_test.py:
//   node comunica.mjs MODULES ROOT < QUERIES
// QUERIES is JSON: {"all": QUERY, "questions": {NAME: QUERY}}. Each question starts at the root with an empty cache: the query `all` finds the
// document of the whole robot there, the question is for that document. Prints for each question a line of JSON: name, rows (arrays of texts,
// in the order of the variables), requests, seconds.
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [modules, root] = process.argv.slice(2);
const {all, questions} = JSON.parse(readFileSync(0, 'utf8'));
const require = createRequire(join(modules, 'node_modules/'));
const {QueryEngine} = require('@comunica/query-sparql');

for (const [name, query] of Object.entries(questions)) {
  const started = performance.now();
  const requests = [];
  const counting = async (input, init) => {
    const response = await fetch(input, init);
    requests.push(`${init?.method ?? 'GET'} ${input.url ?? input} ${response.status} ${response.headers.get('content-type')}`);
    return response;
  };
  const engine = new QueryEngine();
  const ask = async (text, source) => {
    const found = await engine.query(text, {sources: [source], fetch: counting});
    const variables = (await found.metadata()).variables.map(v => v.variable ?? v);
    const bindings = await (await found.execute()).toArray();
    return bindings.map(row => variables.map(v => row.get(v)?.value ?? null));
  };
  await engine.invalidateHttpCache();
  const [[document]] = await ask(all, root);
  const rows = await ask(query, document);
  console.log(JSON.stringify({name, rows, requests, seconds: (performance.now() - started) / 1000}));
}
