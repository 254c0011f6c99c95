// SPDX-License-Identifier: Apache-2.0
// Comunica as it is published, with a SPARQL endpoint as its source. Run by clients_test.py:
//   node comunica_sparql.mjs MODULES ENDPOINT < QUERIES
// QUERIES is JSON: {NAME: QUERY}. Prints {NAME: ANSWER}: rows as arrays of texts, triples likewise, or a boolean.
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [modules, endpoint] = process.argv.slice(2);
const require = createRequire(join(modules, 'node_modules/'));
const {QueryEngine} = require('@comunica/query-sparql');
const engine = new QueryEngine();
const answers = {};
for (const [name, query] of Object.entries(JSON.parse(readFileSync(0, 'utf8')))) {
  const found = await engine.query(query, {sources: [{type: 'sparql', value: endpoint}]});
  if (found.resultType === 'boolean') {
    answers[name] = await found.execute();
  } else if (found.resultType === 'quads') {
    answers[name] = (await (await found.execute()).toArray()).map(q => [q.subject.value, q.predicate.value, q.object.value]);
  } else {
    const variables = (await found.metadata()).variables.map(v => v.variable ?? v);
    answers[name] = (await (await found.execute()).toArray()).map(row => variables.map(v => row.get(v)?.value ?? null));
  }
}
console.log(JSON.stringify(answers));
