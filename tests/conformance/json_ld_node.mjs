// SPDX-License-Identifier: Apache-2.0
// What jsonld.js makes of our JSON-LD, and n3 of our Turtle and N-Triples. Run by json_ld_test.py:
//   node json_ld_node.mjs MODULES DIR
// For each graph N of DIR the three are compared as canonical N-Quads; N.*.back.jsonld are written for us to read.
import {createRequire} from 'node:module';
import {readFileSync, readdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

const [modules, dir] = process.argv.slice(2);
const require = createRequire(join(modules, 'node_modules/'));
const jsonld = require('jsonld');
const n3 = require('n3');

const text = (name) => readFileSync(join(dir, name), 'utf8');
const contextIri = 'http://localhost/ns/context.jsonld';
const context = JSON.parse(text('context.jsonld'));
const documentLoader = async (url) => {
  if (!new URL(url).pathname.endsWith('/ns/context.jsonld')) throw new Error('not to be fetched: ' + url);
  return {contextUrl: null, documentUrl: url, document: context};
};
const options = {documentLoader, safe: false};

const asQuads = (source, format) => {
  const quads = new n3.Parser({format}).parse(source);
  return new Promise((resolve, reject) => {
    const writer = new n3.Writer({format: 'N-Quads'});
    writer.addQuads(quads);
    writer.end((error, result) => (error ? reject(error) : resolve(result)));
  });
};
// jsonld.js makes a canonical xsd:double of strings, too, where JSON-LD-API 1.1 8.2.2 has it of numbers only, and of "INF" "NaN": these
// are compared as it has them.
const double = /"([^"]*)"\^\^<http:\/\/www\.w3\.org\/2001\/XMLSchema#double>/g;
const withDoubles = (quads) => quads.replace(double, (whole, digits) =>
  whole.replace(digits, parseFloat(digits).toExponential(15).replace(/(\d)0*e\+?/, '$1E')));
const canonical = (quads) => jsonld.canonize(quads, {
  inputFormat: 'application/n-quads',
  algorithm: 'RDFC-1.0',
  safe: false,
  canonizeOptions: {maxWorkFactor: Infinity}
});

let compared = 0;
const faults = [];
for (const file of readdirSync(dir).filter((name) => /^\d+\.nt$/.test(name)).sort()) {
  const name = file.slice(0, -3);
  const wanted = await canonical(withDoubles(await asQuads(text(file), 'N-Triples')));
  const check = async (what, make) => {
    try {
      const found = await canonical(await make());
      ++compared;
      if (found !== wanted) faults.push(`${name} as ${what}:\n--- wanted\n${wanted}--- found\n${found}`);
    } catch (error) {
      faults.push(`${name} as ${what}: ${error}`);
    }
  };
  await check('Turtle', async () => withDoubles(await asQuads(text(name + '.ttl'), 'Turtle')));
  for (const variant of ['.jsonld', '.ref.jsonld']) {
    const ours = JSON.parse(text(name + variant));
    await check('JSON-LD' + variant, () => jsonld.toRDF(ours, {...options, format: 'application/n-quads'}));
  }
  // Back: what it writes, not what it read.
  const parsed = await jsonld.fromRDF(await asQuads(text(file), 'N-Triples'), {format: 'application/n-quads'});
  const back = (what, document) => writeFileSync(join(dir, `${name}.${what}.back.jsonld`), JSON.stringify(document));
  back('expanded', parsed);
  back('native', await jsonld.expand(JSON.parse(text(name + '.jsonld')), options));
  back('flattened', await jsonld.flatten(parsed, null, options));
  try {
    back('compacted', await jsonld.compact(parsed, contextIri, options));
    back('inlined', await jsonld.compact(parsed, context, options));
  } catch (error) {
    // By its rules an IRI that looks like a compact one cannot be written under a context that has the prefix.
    if (error.details?.code !== 'IRI confused with prefix') throw error;
  }
}
console.log(`jsonld.js, n3: ${compared} documents compared, ${faults.length} differ`);
for (const fault of faults) console.log(fault);
process.exit(faults.length ? 1 : 0);
