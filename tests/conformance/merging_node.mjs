// SPDX-License-Identifier: Apache-2.0
// What rdf-validate-shacl and shacl-engine find in whole graphs. Run by merging_test.py:
//   node merging_node.mjs MODULES rdf-validate-shacl|shacl-engine < TASKS
// TASKS is JSON: an array of {name, data, shapes}, the last two files of N-Triples. Prints for each task a line of JSON: name, seconds, and results, each
// an array of focus node, path, value, component, shape and message.
import {createRequire} from 'node:module';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

const [modules, name] = process.argv.slice(2);
const require = createRequire(join(modules, 'node_modules/'));
const imported = async (path) => import(pathToFileURL(join(modules, 'node_modules', path)));
const n3 = require('n3');
const factory = (await imported('rdf-validate-shacl/src/defaultEnv.js')).default;

const datasets = new Map();
const datasetOf = (file) => {
  if (!datasets.has(file)) datasets.set(file, factory.dataset(new n3.Parser({format: 'N-Triples', factory}).parse(readFileSync(file, 'utf8'))));
  return datasets.get(file);
};
const text = (term) => !term ? '' : Array.isArray(term) ? term.map(text).join(' / ') : term.termType === 'BlankNode' ? '_' : term.value ?? '';

const engines = {
  'rdf-validate-shacl': async () => {
    const Validator = (await imported('rdf-validate-shacl/index.js')).default;
    return async (data, shapes) => {
      const report = await new Validator(shapes, {factory}).validate(data);
      return report.results.map(r => [r.focusNode, r.path, r.value, r.sourceConstraintComponent, r.sourceShape, r.message].map(text));
    };
  },
  'shacl-engine': async () => {
    const {Validator} = await imported('shacl-engine/index.js');
    return async (data, shapes) => {
      const report = await new Validator(shapes, {factory}).validate({dataset: data});
      return report.results.map(r => [r.focusNode?.term, r.path?.map(step => step.predicates ?? step), r.value?.term, r.constraintComponent, r.shape?.ptr?.term,
                                      r.message].map(text));
    };
  },
};

const judge = await engines[name]();
for (const task of JSON.parse(readFileSync(0, 'utf8'))) {
  const started = performance.now();
  const results = await judge(datasetOf(task.data), datasetOf(task.shapes));
  console.log(JSON.stringify({name: task.name, seconds: (performance.now() - started) / 1000, results}));
}
