// SPDX-License-Identifier: Apache-2.0
// What rdf-validate-shacl and shacl-engine make of bodies. Run by random_bodies_test.py:
//   node random_bodies_node.mjs MODULES DIR rdf-validate-shacl|shacl-engine
// DIR/bodies.txt has blocks of N-Triples, each after a line `= NUMBER SHAPES SHAPE`: the file of DIR with the shapes, and the one that judges. The
// focus node is the object of <urn:focus>. Each line of the output is a number with 1 (conforms), 0 or an error.
import {createRequire} from 'node:module';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

const [modules, dir, name] = process.argv.slice(2);
const require = createRequire(join(modules, 'node_modules/'));
const imported = async (path) => import(pathToFileURL(join(modules, 'node_modules', path)));
const n3 = require('n3');
const factory = (await imported('rdf-validate-shacl/src/defaultEnv.js')).default;

const datasetOf = (text) => factory.dataset(new n3.Parser({format: 'N-Triples', factory}).parse(text));

const engines = {
  'rdf-validate-shacl': async () => {
    const Validator = (await imported('rdf-validate-shacl/index.js')).default;
    return (shapes) => {
      const validator = new Validator(shapes, {factory});
      return (data, focus, shape) => {
        validator.setDataGraph(data);
        return validator.nodeConformsToShape(focus, shape);
      };
    };
  },
  'shacl-engine': async () => {
    const {Validator} = await imported('shacl-engine/index.js');
    return (shapes) => {
      const validator = new Validator(shapes, {factory});
      return async (data, focus, shape) => (await validator.validate({dataset: data, terms: [focus]}, [{terms: [shape]}])).conforms;
    };
  },
};

const engine = await engines[name]();
const judges = new Map();
for (const block of readFileSync(join(dir, 'bodies.txt'), 'utf8').split(/^= /m).slice(1)) {
  const end = block.indexOf('\n');
  const [number, file, shape] = block.slice(0, end).split(' ');
  if (!judges.has(file)) judges.set(file, engine(datasetOf(readFileSync(join(dir, file), 'utf8'))));
  let verdict;
  try {
    const data = datasetOf(block.slice(end + 1));
    const [marker] = data.match(null, factory.namedNode('urn:focus'));
    data.delete(marker);
    verdict = await judges.get(file)(data, marker.object, factory.namedNode(shape)) ? '1' : '0';
  } catch (error) {
    verdict = String(error.message).split('\n')[0];
  }
  console.log(number, verdict);
}
