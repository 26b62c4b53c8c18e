// SPDX-License-Identifier: GPL-3.0-or-later
// rights.mjs - every operation of schema/openapi.json, asked by everybody: who has no token, or one
// that is none, gets 401; who has one of too low a role 403; who has the right one neither. What is
// somebody else's stays as it is. Every answer has the headers that browsers are to be told by, and
// no other page may read it. The tokens used are written to the file BCD_TOKENS, for the log to be
// searched for them.
import { writeFileSync } from 'node:fs';
import { ask, expect, finish, readJson, test } from './tools.mjs';

const document = readJson('schema/openapi.json');
const roles = ['nobody', 'worker', 'reader', 'submitter', 'operator', 'admin'];
const examples = { id: 'j0', name: 'energy', owner: 'anna', file: 'nothing.js' };

const operations = Object.entries(document.paths).flatMap(([path, item]) =>
  Object.entries(item).map(([method, operation]) => ({
    method: method.toUpperCase(), operation, id: operation.operationId, path,
    at: path.replace(/\{(\w+)\}/g, (_, key) => examples[key]),
    // "For readers and above.", "For admin.", "For anybody.", "For workers and admins."
    role: /For (anybody|worker|reader|submitter|operator|admin)s?( and (above|admins))?\.$/.exec(operation.description)?.[1],
    body: operation.requestBody && JSON.stringify(operation.requestBody.content['application/json'].example) })));

// Workers stand apart: what is for them is for them and admins alone.
const may = (role, operation) => operation.role === 'anybody' || role === 'admin' ||
  (operation.role === 'worker' ? role === 'worker' : roles.indexOf(role) >= roles.indexOf(operation.role));

const tokens = { nobody: undefined };
const as = (role) => (tokens[role] ? { authorization: `Bearer ${tokens[role]}` } : {});
const send = ({ method, at, body }, headers) => ask(method, at, { body, headers });

// ---------------------------------------------------------------- what every answer has
const strict = {
  'x-content-type-options': /^nosniff$/, 'referrer-policy': /^no-referrer$/, 'x-frame-options': /^DENY$/,
  'cross-origin-resource-policy': /^same-origin$/, 'cross-origin-opener-policy': /^same-origin$/,
  'cache-control': /^(no-store|private, .*)$/, 'x-request-id': /^[A-Za-z0-9._-]{1,64}$/,
};
// The page at / and what belongs to it are public files with a policy of their own.
function isStrict(answer, where, path) {
  const file = (path === '/' || path?.startsWith('/page/')) && answer.status === 200;
  for (const [name, value] of Object.entries(strict))
    expect(value.test(answer.headers[name] ?? '') || (file && name === 'cache-control'), where, name,
           answer.headers[name], 'of', answer.status);
  const policy = answer.headers['content-security-policy'] ?? '';
  expect(/^default-src 'none'/.test(policy), where, policy);
  expect(!/unsafe-|https?:|\*/.test(policy) || answer.type === 'image/svg+xml', where, policy);
  expect(!/script-src/.test(policy) || file, where, policy);
  for (const name of Object.keys(answer.headers))
    expect(!/^(access-control-|server$|x-powered-by$|set-cookie$)/.test(name), where, name);
  if (answer.type === 'application/problem+json')
    expect(!/bcd_[a-z2-7]{10}/.test(answer.text), where, 'shows a token', answer.text);
}

// -------------------------------------------------------------------------- who there is
await test('the document tells of each operation whom it is for', () => {
  for (const { id, role, operation } of operations) {
    expect(role, id, operation.description);
    expect((role === 'anybody') === (operation.security.length === 0), id, operation.security);
    expect(role === 'anybody' || ('401' in operation.responses && '403' in operation.responses), id,
           Object.keys(operation.responses));
  }
  for (const role of roles.slice(1))
    expect(operations.some((o) => o.role === role), 'nothing is for', role);
});

await test('a token of each role, and one that was revoked', async () => {
  const made = {};
  for (const role of ['admin', 'operator', 'submitter', 'reader', 'worker', 'stranger', 'revoked']) {
    const { status, json } = await ask('POST', '/v1/tokens', { headers: as('admin'), body: JSON.stringify(
      { owner: role, role: roles.includes(role) ? role : 'submitter', name: role }) });
    expect(status === 201, status, json);
    made[role] = json.id;
    tokens[role] = json.token;
  }
  const { status } = await ask('DELETE', `/v1/tokens/${made.revoked}`, { headers: as('admin') });
  expect(status === 200, status);
  writeFileSync(process.env.BCD_TOKENS, Object.values(tokens).filter(Boolean).join('\n') + '\n');
});

// ------------------------------------------------------------------------------ the walk
const wrong = () => ({
  'no token': {}, 'an empty one': { authorization: '' }, 'a word': { authorization: 'Bearer' },
  'another scheme': { authorization: `Basic ${Buffer.from(`admin:${tokens.admin}`).toString('base64')}` },
  'the token alone': { authorization: tokens.admin },
  'one that is none': { authorization: `Bearer bcd_${'a'.repeat(52)}` },
  'one letter off': { authorization: `Bearer ${tokens.admin.slice(0, -1)}${tokens.admin.endsWith('a') ? 'b' : 'a'}` },
  'one letter too many': { authorization: `Bearer ${tokens.admin}a` },
  'the beginning of one': { authorization: `Bearer ${tokens.admin.slice(0, 40)}` },
  'two tokens': { authorization: `Bearer ${tokens.admin}, Bearer ${tokens.reader}` },
  'one in capitals': { authorization: `Bearer ${tokens.admin.toUpperCase()}` },
  'a revoked one': { authorization: `Bearer ${tokens.revoked}` },
});

await test('without a token that is good nobody is let in', async () => {
  for (const operation of operations.filter((o) => o.role !== 'anybody'))
    for (const [what, headers] of Object.entries(wrong())) {
      const where = `${operation.id} with ${what}:`;
      const answer = await send(operation, headers);
      expect(answer.status === 401, where, answer.status, answer.text);
      expect(answer.headers['www-authenticate'] === 'Bearer realm="bcdd"', where, answer.headers);
      expect(answer.json.type.endsWith(':unauthorized') || answer.json.status === 401, where, answer.text);
      isStrict(answer, where);
    }
});

await test('a token in the address is none', async () => {
  for (const name of ['token', 'access_token', 'authorization']) {
    const { status } = await ask('GET', `/v1/jobs?${name}=${tokens.admin}`);
    expect(status === 401, name, status);
  }
});

await test('with too low a role neither, whatever there is or is not', async () => {
  for (const operation of operations)
    for (const role of roles.slice(1).filter((r) => !may(r, operation))) {
      const answer = await send(operation, as(role));
      expect(answer.status === 403, operation.id, role, answer.status, answer.text);
      isStrict(answer, `${operation.id} ${role}`);
    }
});

await test('with the least role that it is for, it is answered', async () => {
  for (const operation of operations.filter((o) => o.id !== 'getBackup')) {
    const answer = await send(operation, operation.role === 'anybody' ? {} : as(operation.role));
    expect(answer.status !== 401 && answer.status !== 403 && answer.status < 500 || answer.status === 503,
           operation.id, answer.status, answer.text.slice(0, 300));
    isStrict(answer, operation.id, operation.path);
    if (answer.json?.token && operation.id === 'createToken')
      expect(answer.headers['cache-control'] === 'no-store', answer.headers);
  }
});

// ------------------------------------------------------------------- what is somebody's own
const job = { particles: 2, length: 4, diameter: 0.5, time: 1e6, time_step: 0.01, seed: 77,
              observables: { energy: {} } };

await test('what is somebody else\'s stays as it is', async () => {
  const made = await ask('POST', '/v1/jobs', { headers: as('submitter'), body: JSON.stringify(job) });
  expect(made.status === 202 && made.json.owner === 'submitter', made.status, made.text);
  const swept = await ask('POST', '/v1/sweeps', { headers: as('submitter'), body: JSON.stringify(
    { base: { ...job, seed: 78 }, axes: { '/diameter': [0.25, 0.3] } }) });
  expect(swept.status === 202, swept.status, swept.text);
  const at = { job: `/v1/jobs/${made.json.id}`, sweep: `/v1/sweeps/${swept.json.id}` };
  const attempts = [
    ['DELETE', at.job], ['DELETE', at.sweep], ['POST', `${at.sweep}/retry`],
    ['POST', `${at.sweep}/extend`, { axes: { '/diameter': [0.35] } }] ];
  for (const [method, path, body] of attempts)
    for (const [who, status] of [['nobody', 401], ['reader', 403], ['stranger', 403]]) {
      const answer = await ask(method, path, { headers: as(who), body: body && JSON.stringify(body) });
      expect(answer.status === status, who, method, path, answer.status, answer.text);
      isStrict(answer, path);
    }
  // The same job of somebody else is that job, and still its first owner's.
  const again = await ask('POST', '/v1/jobs', { headers: as('stranger'), body: JSON.stringify({ ...job, label: 'mine' }) });
  expect(again.status === 200 && again.json.owner === 'submitter' && again.json.label !== 'mine', again.text);
  const still = await ask('GET', at.job, { headers: as('reader') });
  expect(['queued', 'running'].includes(still.json.state), still.json.state);
  const points = await ask('GET', at.sweep, { headers: as('reader') });
  expect(points.json.states.cancelled === 0 && points.json.jobs === 2, points.text);
  for (const [path, who] of [[at.job, 'submitter'], [at.sweep, 'operator']])
    expect((await ask('DELETE', path, { headers: as(who) })).status === 200, path, who);
});

await test('an Idempotency-Key tells nothing of others', async () => {
  const keyed = (who, seed) => ask('POST', '/v1/jobs', {
    headers: { ...as(who), 'idempotency-key': 'same' }, body: JSON.stringify({ ...job, seed }) });
  const first = await keyed('submitter', 81), second = await keyed('stranger', 82);
  expect(first.status === 202 && second.status === 202 && first.json.id !== second.json.id, second.text);
  for (const { json } of [first, second])
    await ask('DELETE', `/v1/jobs/${json.id}`, { headers: as('admin') });
});

await test('nobody gives themselves more', async () => {
  const me = await ask('GET', '/v1/me', { headers: as('submitter') });
  expect(me.json.owner === 'submitter' && me.json.role === 'submitter', me.text);
  for (const who of ['reader', 'submitter', 'operator'])
    for (const [method, path, body] of [
      ['POST', '/v1/tokens', { owner: who, role: 'admin' }], ['PUT', `/v1/owners/${who}`, { queued_points: 1e6 }],
      ['GET', '/v1/tokens'], ['GET', '/v1/audit'], ['GET', '/v1/backup'] ]) {
      const { status } = await ask(method, path, { headers: as(who), body: body && JSON.stringify(body) });
      expect(status === 403, who, method, path, status);
    }
  // A job's owner is who asks, whatever the body says.
  const forged = await ask('POST', '/v1/jobs', { headers: as('submitter'), body: JSON.stringify({ ...job, owner: 'admin' }) });
  expect(forged.status === 422 && forged.json.errors[0].pointer === '/owner', forged.text);
});

// ------------------------------------------------------------------------------ browsers
await test('pages of other origins get nothing, and are told nothing', async () => {
  const foreign = ['http://evil.example', 'https://evil.example', 'null', 'http://127.0.0.1:1', 'http://localhost.evil.example'];
  for (const operation of operations)
    for (const origin of foreign) {
      const answer = await send(operation, { ...as('admin'), origin });
      expect(answer.status === 403, operation.id, origin, answer.status);
      isStrict(answer, operation.id);
    }
});

await test('OPTIONS tells methods, and lets no page in', async () => {
  for (const { path, at } of operations) {
    for (const headers of [{}, as('admin')]) {
      const answer = await ask('OPTIONS', at, { headers });
      expect(answer.status === 405 || answer.status === 204, path, answer.status);
      expect(answer.headers.allow, path, answer.headers);
      isStrict(answer, path);
    }
    const preflight = await ask('OPTIONS', at, { headers: {
      origin: 'http://evil.example', 'access-control-request-method': 'DELETE',
      'access-control-request-headers': 'authorization' } });
    expect(preflight.status === 403, path, preflight.status);
    isStrict(preflight, path);
  }
});

await test('what is not there is as strict', async () => {
  for (const [method, path] of [['GET', '/nothing'], ['GET', '/v1/../etc/passwd'], ['PUT', '/v1/jobs'], ['TRACE', '/v1/jobs']])
    for (const headers of [{}, as('admin')])
      isStrict(await ask(method, path, { headers }), path);
});
finish();
