// SPDX-License-Identifier: Apache-2.0
// ---- control: a lease of a Thing and of what is below it

const controlFor = (iri) => undefined;
