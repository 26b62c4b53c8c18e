// SPDX-License-Identifier: GPL-3.0-or-later
// requests.mjs - random requests, good and bad, for every operation that schema/openapi.json tells
// of: each answer must be one that it declares - status, content type, headers, body - and none may
// be the server's own fault.
import { ask, expect, fc, finish, forAll, long, readJson, sleep, test, validator } from './tools.mjs';
import { anyJob, deref, fromSchema, mutated, mutation } from './jobs.mjs';

const document = readJson('schema/openapi.json');
const root = { components: document.components };
const ajv = validator();
ajv.addKeyword('components');
ajv.addKeyword('example');
ajv.addSchema({ $id: 'urn:bcdd:openapi', ...root }, undefined, false);
const resolve = (value) => (value?.$ref ? deref(value.$ref, root) : value);
const compiled = new Map();
function validFor(schema) {
  const key = JSON.stringify(schema);
  if (!compiled.has(key))
    compiled.set(key, schema.$ref ? ajv.getSchema(`urn:bcdd:openapi${schema.$ref}`)
                                  : ajv.compile(schema));
  return compiled.get(key);
}

const operations = Object.entries(document.paths).flatMap(([path, item]) =>
  Object.entries(item).map(([method, operation]) => ({
    path, method: method.toUpperCase(), operation, id: operation.operationId,
    parameters: operation.parameters.map(resolve) })));
const names = Object.keys(document.components.schemas.Results.properties);

// ------------------------------------------------------------- what is known of the server
const pool = { ids: [], cursors: [], etags: [] };
const owned = {}; // headers of somebody who may do all

function learn({ json, headers }) {
  if (headers.etag && pool.etags.length < 1000)
    pool.etags.push(headers.etag);
  for (const item of [json, json?.jobs, json?.sweeps, json?.tokens].flat())
    if (typeof item?.id === 'string' && item.id !== pool.own && pool.ids.length < 200)
      pool.ids.push(item.id);
  if (typeof json?.next === 'string')
    pool.cursors.push(json.next);
}

// ------------------------------------------------------------------- requests at random
const junk = fc.oneof(fc.string({ unit: 'grapheme', maxLength: 20 }),
                      fc.constantFrom('', '0', '-1', '1', '1e9', 'NaN', 'null', 'true', "' OR 1=1--", '..',
                                      '9223372036854775808', '2026-01-01T00:00:00Z', '0.3..0.5', '\u0000'));

// [text, whether it is what the document says].
function queryValue(parameter) {
  const schema = parameter.schema.type === 'array' ? parameter.schema.items : parameter.schema;
  if (parameter.name === 'wait') // nobody waits here
    return fc.constantFrom(['0', false], ['0.01', false], ['x', false], ['1e9', false]);
  if (schema.type === 'string' && !schema.enum && !schema.pattern)
    return fc.oneof(junk, fc.nat(1000).map((n) => pool.cursors[n % (pool.cursors.length || 1)] ?? '0'))
      .map((value) => [value, false]);
  const there = parameter.name !== 'sweep'; // one may have to be there
  const good = fromSchema(schema, root).map((v) => [String(v), there]);
  return fc.oneof({ weight: 3, arbitrary: good }, junk.map((v) => [v, false]));
}

const fields = Object.keys(document.components.schemas.Job.properties)
  .concat(['potential.amplitude', 'potential.type', 'observables.msd.first', 'derived.time_step',
           'results.energy.energy', 'diameter>', 'diameter<', 'tag', 'nothing']);

function query(operation) {
  const rows = operation.parameters.filter((p) => p.in === 'query' && p.name !== 'filters');
  const known = fc.subarray(rows, { maxLength: Math.min(3, rows.length) })
    .chain((some) => fc.tuple(...some.map((p) =>
      queryValue(p).map(([value, good]) => ({ name: p.name, value, good })))));
  const filters = operation.parameters.some((p) => p.name === 'filters');
  const more = fc.array(fc.record({
    name: filters ? fc.oneof(fc.constantFrom(...fields), junk) : junk,
    value: fc.oneof(fc.constantFrom('0.5', '1', 'cosine', 'bcd', '0.1..1', '..1', '1..'), junk),
    good: fc.constant(false) }), { maxLength: 2 });
  return fc.tuple(known, fc.oneof({ weight: 3, arbitrary: fc.constant([]) },
                                               { weight: filters ? 3 : 1, arbitrary: more }))
    .map(([some, others]) => [...some, ...others]);
}

function tame(body) {
  for (const job of [body, body?.base]) {
    if (typeof job?.particles === 'number')
      job.particles = Math.min(job.particles, 1000);
    if (typeof job?.realizations === 'number')
      job.realizations = Math.min(job.realizations, 10);
  }
  for (const axis of Object.values(body?.axes ?? {}))
    for (const key of ['points', 'count'])
      if (typeof axis?.[key] === 'number')
        axis[key] = Math.min(axis[key], 5);
  return body;
}

function bodyText(operation) {
  const content = operation.operation.requestBody?.content;
  if (!content)
    return fc.oneof({ weight: 6, arbitrary: fc.constant({}) }, junk.map((text) => ({ text })));
  const { schema, example } = content['application/json'];
  const whole = schema.$ref.endsWith('/Job') ? anyJob(resolve(schema)) : fromSchema(schema, root);
  const good = fc.oneof(fc.constant(example), whole.map(tame))
    .map((value) => ({ text: JSON.stringify(value), good: true }));
  const near = fc.tuple(fc.oneof(fc.constant(example), whole.map(tame)), mutation)
    .map(([value, { place, kind, other }]) =>
      ({ text: JSON.stringify(tame(mutated(value, place, kind, other))) }));
  const bad = fc.oneof(junk, fc.json({ maxDepth: 3 }),
                       fc.constantFrom('{', '[]', 'null', '{"a":1,"a":2}', '[[[[[[[[[[[[[[[[[[[[[[[',
                                       '{"particles":1e400}', '\ufeff{}', '{"particles":NaN}'))
    .map((text) => ({ text }));
  return fc.oneof({ weight: 4, arbitrary: good }, { weight: 4, arbitrary: near },
                  { weight: 1, arbitrary: bad });
}

const odd = fc.record({
  'Idempotency-Key': fc.constantFrom('a', 'k-1', ' ', 'x'.repeat(256), 'a b'),
  'If-None-Match': fc.oneof(fc.constantFrom('*', '"x"', 'W/"x"', ''),
                            fc.nat(1000).map((n) => pool.etags[n % (pool.etags.length || 1)] ?? '"y"')),
  'Content-Type': fc.constantFrom('text/plain', 'application/json; charset=utf-8', 'multipart/form-data', ''),
  'Authorization': fc.oneof(fc.constantFrom('Bearer x', 'Bearer bcd_aaaa', 'Basic YTpi', 'Bearer', ''),
                            fc.nat(1).map(() => `Bearer ${pool.reader}`)),
  'Accept': fc.constantFrom('text/html', '*/*'),
  'Accept-Encoding': fc.constantFrom('gzip, br', 'identity', 'gzip;q=0', ';', ''),
  'X-Request-Id': fc.constantFrom('abc', 'a b', 'x'.repeat(200)),
  'Last-Event-ID': fc.constantFrom('0', 'x', '-1'),
}, { requiredKeys: [] });

function request(operation) {
  const usual = operation.path.startsWith('/v1/sweeps/') ? [pool.sweep, pool.sweep, pool.open]
                                                         : [pool.done, pool.done, pool.long, pool.cancelled];
  const id = fc.oneof({ weight: 3, arbitrary: fc.constantFrom(...usual) },
                      { weight: 2, arbitrary: fc.nat(10000).map((n) =>
                        pool.ids[n % (pool.ids.length || 1)] ?? 'j0') },
                      fc.stringMatching(/^[a-z0-9-]{1,70}$/));
  const name = fc.oneof({ weight: 4, arbitrary: fc.constantFrom(...names) },
                        fc.stringMatching(/^[a-z0-9_]{1,70}$/));
  const file = fc.constantFrom('main.js', 'style.css', 'icon.svg', 'main', 'index.html', '..');
  return fc.record({
    id, name, file, query: query(operation), body: bodyText(operation),
    head: operation.method === 'GET' ? fc.nat(5).map((n) => n === 0) : fc.constant(false),
    headers: fc.oneof({ weight: 3, arbitrary: fc.constant({}) }, odd) });
}

const spelled = (text) => encodeURIComponent(text.toWellFormed?.() ?? text);

async function send(operation, { id, name, file, query: parts, body, head, headers }) {
  const path = operation.path.replace(/\{(\w+)\}/g, (_, key) => ({ name, file })[key] ?? id);
  const search = parts.map((p) => `${spelled(p.name)}=${spelled(p.value)}`).join('&');
  const answer = await ask(head ? 'HEAD' : operation.method, search ? `${path}?${search}` : path,
                           { body: body.text, headers: { ...owned, ...headers } });
  learn(answer);
  return answer;
}

// -------------------------------------------------------------------------- judgement
function judge(operation, answer, head) {
  const where = `${operation.method} ${operation.path}: ${answer.status} ${answer.type}`;
  const declared = resolve(operation.operation.responses[answer.status]);
  expect(declared, where, 'is not declared', answer.text.slice(0, 500));
  expect(answer.status < 500 || answer.status === 503, where, answer.text);
  expect(answer.headers['x-request-id'], where, 'has no X-Request-Id');
  for (const [name, { required, schema }] of Object.entries(declared.headers ?? {})) {
    const value = answer.headers[name.toLowerCase()];
    expect(value !== undefined || !required, where, name, 'is missing');
    expect(value === undefined || validFor(schema)(value), where, name, value);
  }
  const content = declared.content ?? {};
  if (Object.keys(content).length === 0) {
    expect(answer.text === '', where, 'has a body');
    return;
  }
  expect(answer.type in content, where, 'is not among', Object.keys(content));
  if (head) {
    expect(answer.text === '', where, 'HEAD with a body');
    return;
  }
  if (answer.json !== undefined) {
    const valid = validFor(content[answer.type].schema);
    expect(valid(answer.json), where, answer.text.slice(0, 1500), valid.errors?.slice(0, 5));
    if (answer.type === 'application/problem+json')
      expect(answer.json.status === answer.status, where, answer.json.status);
  } else {
    expect(!/json/.test(answer.type) || /ndjson/.test(answer.type), where, 'is no JSON');
    const lines = answer.text.split('\n');
    if (answer.type === 'application/x-ndjson')
      expect(lines.pop() === '' && lines.every((line) => JSON.parse(line)), where, 'ends early');
    if (answer.type === 'text/event-stream')
      for (const line of lines.slice(0, -2).filter((l) => l.startsWith('data:')))
        expect(typeof JSON.parse(line.slice(5)) === 'object', where, line);
    expect(answer.type !== 'image/svg+xml' || answer.text.endsWith('</svg>\n'), where, 'ends early');
  }
}

// ------------------------------------------------------------------ one job and another
const tiny = (seed) => ({ particles: 2, length: 4, diameter: 0.5, time: 0.1, time_step: 0.01, seed,
                          observables: { energy: {}, msd: { points: 3 } } });
const find = (id) => operations.find((o) => o.id === id);

async function call(id, at, body) {
  const operation = find(id);
  const answer = await ask(operation.method, operation.path.replace('{id}', at).replace('{name}', 'energy'),
                           { body: body && JSON.stringify(body), headers: owned });
  judge(operation, answer, false);
  learn(answer);
  return answer;
}

async function ended(id) {
  for (let i = 0; i < 6000; i++) {
    const { json } = await call('getJob', id);
    if (!['queued', 'running'].includes(json.state))
      return json.state;
    await sleep(10);
  }
  throw new Error(`${id} does not end`);
}

const answers = new Map(); // operation -> statuses seen

if (find('createToken'))
  await test('the first token, which all that follows shows', async () => {
    const { status, json } = await ask('POST', '/v1/tokens', {
      body: JSON.stringify({ owner: 'tester', role: 'admin', name: 'these tests' }) });
    expect(status === 201, status, json);
    pool.own = json.id;
    owned.authorization = `Bearer ${json.token}`;
    expect((await ask('GET', '/v1/jobs')).status === 401, 'nobody is let in');
    const reader = await ask('POST', '/v1/tokens', {
      body: JSON.stringify({ owner: 'reader', role: 'reader' }), headers: owned });
    pool.reader = reader.json.token;
  });

// Something to ask about: a job of each state that can be had.
await test('jobs and sweeps that are done, run, are cancelled', async () => {
  const all = Object.fromEntries(names.map((name) => [name, name === 'trajectory' ? { every: 0.1 } : {}]));
  const done = await call('submitJob', '', { ...tiny(1), observables: all, stability: 'ignored' });
  expect(await ended(done.json.id) === 'done');
  pool.done = done.json.id;
  const axes = { '/diameter': [0.25, 0.5], '/seed': { first: 1, count: 2 } };
  pool.sweep = (await call('submitSweep', '', { base: tiny(1), axes })).json.id;
  for (let i = 0; (await call('getSweep', pool.sweep)).json.states.done < 4; i++) {
    expect(i < 6000, 'the sweep does not end');
    await sleep(10);
  }
  const long = { ...tiny(2), time: 1e6, label: 'a long one', tags: ['long', 'x'] };
  pool.long = (await call('submitJob', '', long)).json.id;
  const cancelled = await call('submitJob', '', { ...long, seed: 3, priority: -1 });
  await call('cancelJob', cancelled.json.id);
  pool.cancelled = cancelled.json.id;
  for (let i = 0; (await call('getJob', pool.long)).json.state !== 'running'; i++) {
    expect(i < 6000, 'it does not start');
    await sleep(10);
  }
  pool.open = (await call('submitSweep', '', { base: { ...tiny(5), time: 1e6 }, axes })).json.id;
});

await test('every example of the document is taken', async () => {
  const made = {}; // "jobs" -> the id of one
  for (const { operation, path, method, id } of operations) {
    const content = operation.requestBody?.content['application/json'];
    if (!content)
      continue;
    const kind = path.split('/')[2];
    const at = path.replace(/\{\w+\}/, made[kind] ?? 'anna');
    const answer = await ask(method, at, { body: JSON.stringify(content.example), headers: owned });
    expect(answer.status < 300, id, at, answer.status, answer.text);
    judge({ operation, path, method }, answer, false);
    made[kind] ??= answer.json.id;
    learn(answer);
  }
});

const many = ({ id, operation }) => (id === 'computeTheory' ? 20 : operation.requestBody ? 50 : 20);
for (const operation of operations)
  await test(`${operation.method} ${operation.path} (${operation.id})`, () =>
    forAll(many(operation), request(operation), async (asked) => {
      const answer = await send(operation, asked);
      const seen = answers.get(operation.id) ?? new Set();
      answers.set(operation.id, seen.add(answer.status));
      judge(operation, answer, asked.head);
      if (answer.status === 400 && answer.json?.type.endsWith(':bad-query'))
        expect(!asked.query.every((p, i) => p.good && asked.query.findIndex((q) => q.name === p.name) === i),
               'refused what the document allows', answer.text);
      if (asked.body.good && Object.keys(asked.headers).length === 0)
        expect(!(answer.json?.type ?? '').endsWith(':not-json') && answer.status !== 415, answer.text);
    }));

await test('methods that a path has not are told by those that it has', async () => {
  for (const [path, item] of Object.entries(document.paths)) {
    const has = Object.keys(item).map((m) => m.toUpperCase());
    for (const method of ['GET', 'POST', 'PUT', 'PATCH', 'DELETE', 'OPTIONS', 'TRACE']) {
      if (has.includes(method))
        continue;
      const at = path.replace('{name}', 'msd').replace(/\{\w+\}/, 'j0');
      const answer = await ask(method, at, { headers: owned });
      expect(answer.status === 405 && answer.json.type.endsWith(':method-not-allowed'), method, path,
             answer.status, answer.text);
      const allow = answer.headers.allow.split(', ').filter((m) => m !== 'HEAD').sort();
      expect(JSON.stringify(allow) === JSON.stringify(has.sort()), method, path, allow);
    }
  }
});

const segments = fc.constantFrom('v1', 'jobs', 'results', '..', '%2e%2e', '', 'msd.csv');
await test('paths that are not in the document are not there', () =>
  forAll(60, fc.array(fc.oneof(segments, junk.map(spelled)), { maxLength: 4 }), async (parts) => {
    const path = `/${parts.join('/')}`;
    const known = Object.keys(document.paths).some((p) =>
      new RegExp(`^${p.replace(/\./g, '\\.').replace(/\{\w+\}/g, '[a-z0-9_-]+')}$`).test(path));
    const answer = await ask('GET', path, { headers: owned });
    expect(known || answer.status === 404 || answer.status === 400, path, answer.status);
    expect(known || answer.type === 'application/problem+json', path, answer.type);
  }));

// -------------------------------------------------------------------------- sequences
// Any order of these on a few jobs: what each answers follows from what went before.
const step = fc.record({ what: fc.constantFrom('submit', 'submit', 'get', 'cancel', 'results', 'wait',
                                               'list'),
                         seed: fc.integer({ min: 1, max: 4 }) });
let base = 1000;
await test('all that was submitted can be cancelled', async () => {
  for (const state of ['queued', 'running'])
    for (let more = true; more;) {
      const { json } = await ask('GET', `/v1/jobs?state=${state}&limit=1000`, { headers: owned });
      more = json.jobs.length === 1000;
      for (const { id } of json.jobs)
        await call('cancelJob', id);
    }
});

await test('jobs keep to their states, whatever is asked in whatever order', () =>
  forAll(8, fc.array(step, { minLength: 3, maxLength: 12 }), async (steps) => {
    base += 10;
    const jobs = new Map(); // seed -> { id, state as far as it is certain }
    for (const { what, seed } of steps) {
      const job = jobs.get(seed);
      if (what === 'submit') {
        const { status, json } = await call('submitJob', '', tiny(base + seed));
        const again = job && job.state !== 'cancelled' && job.state !== 'failed';
        expect(status === (again ? 200 : 202), 'submit', status, job);
        expect(!again || json.id === job.id, json.id, job);
        if (!again)
          jobs.set(seed, { id: json.id, state: 'open' });
      } else if (!job) {
        expect((await call('getJob', 'jnothing')).status === 404);
      } else if (what === 'get') {
        const { json } = await call('getJob', job.id);
        expect(job.state === 'open' || json.state === job.state, json.state, job);
      } else if (what === 'cancel') {
        const { status, json } = await call('cancelJob', job.id);
        expect(status === 200 ? json.state === 'cancelled' && job.state !== 'done'
                              : status === 409 && job.state !== 'cancelled', status, job);
        job.state = status === 200 ? 'cancelled' : 'done';
      } else if (what === 'wait') {
        job.state = await ended(job.id);
      } else if (what === 'results') {
        const { status } = await call(seed % 2 ? 'getResults' : 'getResult', job.id);
        expect(job.state === 'done' ? status === 200 : job.state === 'open' || status === 409, status, job);
        if (status === 200)
          job.state = 'done';
      } else {
        const { json } = await call('listJobs', '');
        expect(json.jobs.some((j) => j.id === job.id), job);
      }
    }
  }));

await test('what a client has already is not sent again', async () => {
  for (const id of ['getResult', 'getResults']) {
    const { headers } = await call(id, pool.done);
    expect(headers.etag, id, 'has no ETag');
    const operation = find(id);
    const path = operation.path.replace('{id}', pool.done).replace('{name}', 'energy');
    const again = await ask('GET', path, { headers: { ...owned, 'if-none-match': headers.etag } });
    expect(again.status === 304, id, again.status);
    judge(operation, again, false);
  }
});

if (long)
  await test('a report that was measured is as described', async () => {
  await call('stopWorkPrecision', '').catch(() => {});
  const begin = () => ask('POST', '/v1/reports/work-precision?budget=0.01', { headers: owned });
  for (let i = 0; i < 600 && (await begin()).status !== 202; i++)
    await sleep(50);
  let answer;
  for (let i = 0; i < 3000 && answer?.status !== 200; i++) {
    answer = await call('getWorkPrecision', '');
    if (answer.status !== 200)
      await sleep(100);
  }
  expect(answer.status === 200, 'is never done', answer.text);
  expect((await call('getWorkPrecisionCsv', '')).status === 200);
  expect((await call('getWorkPrecisionPicture', '')).status === 200);
});

await test('what can be done was done', () => {
  for (const id of ['submitJob', 'listJobs', 'getJob', 'estimateJob', 'computeTheory'])
    expect([200, 202].some((s) => answers.get(id).has(s)), id, [...answers.get(id)]);
});
for (const [id, seen] of answers)
  console.log(`# ${id}: ${[...seen].sort().join(' ')}`);
finish();
