// SPDX-License-Identifier: GPL-3.0-or-later
// openapi.mjs - the API's description is OpenAPI 3.1, complete in itself, and served.
import { readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { ask, expect, finish, modules, readJson, require, test, validator } from './tools.mjs';
import { deref } from './jobs.mjs';

const { Validator } = await import(
  pathToFileURL(`${modules}/@seriousme/openapi-schema-validator/index.js`));
const { lint, createConfig } = require('@redocly/openapi-core');
const text = readFileSync('schema/openapi.json', 'utf8');
const document = readJson('schema/openapi.json');

await test('it is served', async () => {
  const answer = await ask('GET', '/openapi.json');
  expect(answer.status === 200 && answer.type === 'application/json', answer.status, answer.type);
  expect(answer.text === text, 'another text than schema/openapi.json');
});

await test('it is OpenAPI 3.1', async () => {
  const checker = new Validator();
  const result = await checker.validate(structuredClone(document));
  expect(result.valid, result.errors);
  expect(checker.version === '3.1', checker.version);
});

await test('a linter has nothing against it', async () => {
  const config = await createConfig({ extends: ['recommended-strict'] });
  const problems = await lint({ ref: 'schema/openapi.json', config });
  expect(problems.length === 0, problems.map((p) => [p.ruleId, p.message, p.location[0]?.pointer]));
});

function references(value) {
  if (value === null || typeof value !== 'object')
    return [];
  return Object.entries(value).flatMap(([key, inner]) =>
    key === '$ref' && typeof inner === 'string' ? [inner] : references(inner));
}

await test('every reference leads somewhere, every component is referred to', () => {
  const used = new Set(references(document));
  for (const ref of used) {
    let found;
    try { found = deref(ref, document); } catch { /* told below */ }
    expect(found !== undefined, `${ref} is missing: schema/components.json`);
  }
  for (const kind of ['schemas', 'parameters', 'responses'])
    for (const name of Object.keys(document.components[kind]))
      expect(used.has(`#/components/${kind}/${name}`), `${kind}/${name} is used nowhere`);
});

await test('every schema is one that a strict validator takes, every example is by its schema', () => {
  const ajv = validator();
  ajv.addSchema({ $id: 'urn:bcdd:openapi', ...{ components: document.components } }, undefined, false);
  ajv.addKeyword('components');
  for (const name of Object.keys(document.components.schemas))
    ajv.getSchema(`urn:bcdd:openapi#/components/schemas/${name}`);
  for (const [path, item] of Object.entries(document.paths))
    for (const [method, operation] of Object.entries(item)) {
      for (const { example, schema } of Object.values(operation.requestBody?.content ?? {})) {
        const valid = ajv.getSchema(`urn:bcdd:openapi${schema.$ref}`);
        expect(valid(example), method, path, valid.errors);
      }
    }
});

await test('summaries are told apart, operations named once', () => {
  const operations = Object.values(document.paths).flatMap((item) => Object.values(item));
  expect(operations.length > 15, operations.length);
  expect(new Set(operations.map((o) => o.operationId)).size === operations.length);
  for (const o of operations)
    expect(o.summary && o.description && o.tags.length === 1 && o.security, o.operationId);
});
finish();
