// SPDX-License-Identifier: GPL-3.0-or-later
// hostile.mjs - raw bytes for a running daemon (BCD_URL, BCD_PID), from clients that mean no good:
// each gets the right status or none, and whoever else asks is served within a second, as a rule: what
// the machine does besides may cost a few of them more.
import net from 'node:net';
import { readFileSync, readdirSync } from 'node:fs';
import { expect, finish, long, sleep, test, url } from './tools.mjs';

const { hostname, port } = new URL(url);
const pid = process.env.BCD_PID;
const HOST = 'Host: localhost\r\n';
const GET = `GET /healthz HTTP/1.1\r\n${HOST}\r\n`;
const SECOND = 1000, PATIENCE = 30000;

// ------------------------------------------------------------------------------- clients
// A connection: .text is what came so far (latin1), .closed whether the server has hung up.
function dial() {
  const socket = net.connect({ host: hostname, port, allowHalfOpen: true });
  const client = { socket, text: '', closed: false };
  client.open = new Promise((resolve) => socket.once('connect', resolve));
  client.gone = new Promise((resolve) => {
    const end = () => { client.closed = true; resolve(); };
    for (const event of ['end', 'close', 'error'])
      socket.on(event, end);
  });
  socket.on('data', (bytes) => { client.text += bytes.toString('latin1'); });
  client.say = (bytes) => socket.writable && socket.write(Buffer.from(bytes, 'latin1'));
  client.leave = () => socket.destroy();
  return client;
}

async function until(condition, ms) {
  for (const end = Date.now() + ms; Date.now() < end && !condition();)
    await sleep(5);
  return condition();
}

const statuses = ({ text }) => [...text.matchAll(/HTTP\/1\.1 (\d{3})/g)].map((m) => Number(m[1]));
const final = (client) => statuses(client).filter((status) => status !== 100);

// What `bytes` on a connection of their own are answered with: waits for `count` answers, or the end;
// then for the server to hang up, if it is to.
async function talk(bytes, count = 1, closes = false) {
  const client = dial();
  client.say(bytes);
  await until(() => client.closed || final(client).length >= count, PATIENCE);
  await until(() => client.closed, closes ? PATIENCE : 20);
  client.leave();
  return client;
}

// How long another client waits for an answer, from the connection's begin, while `body` goes on.
async function othersDuring(body) {
  const waits = [];
  let over = false;
  const others = (async () => {
    while (!over) {
      const begin = performance.now();
      const { text, closed } = await talk(GET);
      expect(/^HTTP\/1\.1 200/.test(text), 'another client got', text.slice(0, 200), closed);
      waits.push(performance.now() - begin - 20);
      await sleep(20);
    }
  })();
  try {
    await body();
  } finally {
    over = true;
    await others;
  }
  waits.sort((a, b) => a - b);
  const usual = waits[Math.floor(0.8 * (waits.length - 1))];
  expect(usual < SECOND, 'other clients waited', usual, 'to', waits.at(-1), 'ms;', waits.length, 'were served');
}

const use = () => ({
  fds: readdirSync(`/proc/${pid}/fd`).length,
  kib: Number(/VmRSS:\s*(\d+)/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'))[1]) });

async function crowd(clients, count, hello) {
  for (let i = 0; i < count; i++) {
    const client = dial();
    clients.push(client);
    const words = hello(i, client);
    if (words)
      client.say(words);
    if (i % 100 === 99)
      await Promise.race([client.open, sleep(50)]); // those that wait to be let in do not connect
  }
}

// Clients that leave at the end, whatever happened, and leave nothing behind.
async function alone(body) {
  const before = use(), clients = [];
  try {
    await body(clients, before);
  } finally {
    clients.forEach((client) => client.leave());
  }
  expect(await until(() => use().fds <= before.fds + 1, PATIENCE), before, use());
}

// ------------------------------------------------------------------------------- requests
const post = (heads, body = '{}') => `POST /v1/estimate HTTP/1.1\r\n${HOST}${heads}\r\n${body}`;
const get = (heads, path = '/healthz') => `GET ${path} HTTP/1.1\r\n${heads}\r\n`;
const chunks = (body) => post('Transfer-Encoding: chunked\r\n', body);
const many = 'a'.repeat(40000);

// [what, bytes, status, hangs up]. Status 0: closed without a word. What stands in an answer that is
// not application/problem+json is the library's own, which nobody can change.
const cases = [
  ['two lengths', post('Content-Length: 2\r\nContent-Length: 2\r\n'), 400, true],
  ['two lengths that differ', post('Content-Length: 2\r\nContent-Length: 5\r\n'), 400, true],
  ['length and chunks', post('Content-Length: 2\r\nTransfer-Encoding: chunked\r\n'), 400, true],
  ['chunks twice', post('Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n'), 400, true],
  ['a coding that is not known', post('Transfer-Encoding: gzip, chunked\r\n'), 400, true],
  ['a negative length', post('Content-Length: -2\r\n'), 400, true],
  ['a length beyond 64 bits', post('Content-Length: 99999999999999999999999\r\n'), 413, true],
  ['a long length', post('Content-Length: 1048577\r\n'), 413, true],
  ['a length in two lines', post('Content-Length:\r\n 2\r\n'), 400, true],
  ['chunks in two lines', post('Content-Length: 2\r\nTransfer-Encoding:\r\n chunked\r\n'), 400, true],
  ['a blank before the colon', post('Transfer-Encoding : chunked\r\nContent-Length: 2\r\n'), 400, true],
  ['a chunk without a size', chunks('zz\r\n{}\r\n0\r\n\r\n'), 400, true],
  ['a chunk of negative size', chunks('-2\r\n{}\r\n0\r\n\r\n'), 400, true],
  ['a chunk beyond 64 bits', chunks('ffffffffffffffffffff\r\n{}'), 413, true],
  ['a chunk longer than it says', chunks('2\r\n{}xx0\r\n\r\n'), 400, true],
  ['a chunk with extensions', chunks('2;a=b\r\n{}\r\n0\r\nTrailer: x\r\n\r\n'), 422, false],
  ['a long path', get(HOST, `/${many}`), 414, true],
  ['a long query', get(HOST, `/v1/jobs?label=${many}`), 414, true],
  ['a long header', get(`${HOST}X: ${many}\r\n`), 431, true],
  ['many headers', get(HOST + 'a:b\r\n'.repeat(5000)), 431, true],
  ['a long method', `${many} / HTTP/1.1\r\n${HOST}\r\n`, 414, true],
  ['many parameters', get(HOST, `/v1/jobs?${'a=1&'.repeat(100)}`), 400, false],
  ['more than the library can hold', get(HOST, `/v1/jobs?${'a=1&'.repeat(1000)}`), 408, true],
  ['bad UTF-8 in a path', get(HOST, '/\xff\xfe'), 404, false],
  ['bad UTF-8 in a query', get(HOST, '/v1/jobs?label=%ff'), 400, false],
  ['raw bad UTF-8 in a query', get(HOST, '/v1/jobs?label=\xff'), 400, false],
  ['bad UTF-8 in headers', get(`${HOST}X-Request-Id: \xff\r\nIf-None-Match: \xfe\r\n`), 200, false],
  ['bad UTF-8 for a token', get(`${HOST}Authorization: Bearer \xff\r\n`, '/v1/jobs'), 401, false],
  ['bad UTF-8 in a body', post('Content-Length: 5\r\n', '{"\xff":1}'.slice(0, 5)), 400, false],
  ['an encoded NUL in a query', get(HOST, '/v1/jobs?label=%00'), 400, false],
  ['an encoded NUL in a path', get(HOST, '/v1/jobs/a%00'), 404, false],
  ['a NUL in a name', get(`${HOST}Content-Le\0ngth: 2\r\n`), 400, true],
  ['a NUL in a body', post('Content-Length: 3\r\n', '{\0}'), 400, false],
  ['another type', post('Content-Type: text/html\r\nContent-Length: 2\r\n'), 415, false],
  ['a form', post('Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 2\r\n'), 415, false],
  ['another host (DNS rebinding)', get('Host: evil.example\r\n'), 421, true],
  ['another host with our port', get(`Host: evil.example:${port}\r\n`), 421, true],
  ['a host like ours', get('Host: 127.0.0.1.evil.example\r\n'), 421, true],
  ['no host', get(''), 400, true],
  ['two hosts', get(HOST + HOST), 400, true],
  ['a page of another origin', get(`${HOST}Origin: http://evil.example\r\n`), 403, true],
  ['a whole address', get(HOST, 'http://localhost/healthz'), 200, false],
  ['a whole address elsewhere', get(HOST, 'http://evil.example/healthz'), 421, true],
  ['a whole address with a user', get(HOST, 'http://u:p@localhost/healthz'), 421, true],
  ['an address of no kind', get(HOST, 'file:///etc/passwd'), 400, true],
  ['a path that climbs', get(HOST, '/../../etc/passwd'), 404, false],
  ['TRACE', `TRACE /healthz HTTP/1.1\r\n${HOST}X-Secret: s\r\n\r\n`, 405, false],
  ['CONNECT', `CONNECT evil.example:443 HTTP/1.1\r\n${HOST}\r\n`, 400, true],
  ['OPTIONS *', `OPTIONS * HTTP/1.1\r\n${HOST}\r\n`, 400, true],
  ['OPTIONS', `OPTIONS /healthz HTTP/1.1\r\n${HOST}\r\n`, 405, false],
  ['Expect: 100-continue', post('Expect: 100-continue\r\nContent-Length: 2\r\n'), 422, false],
  ['an expected body that is too long', post('Expect: 100-continue\r\nContent-Length: 9999999\r\n', ''), 413, true],
  ['HTTP/2', 'PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n', 505, true],
  ['HTTP/0.9', 'GET /healthz\r\n\r\n', 400, true],
  ['TLS', '\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n', 0, true],
  ['a header without a colon', get(`${HOST}abc\r\n`), 400, true],
  ['a header that goes on before the first', `GET /healthz HTTP/1.1\r\n x\r\n${HOST}\r\n`, 400, true],
  ['an upgrade', get(`${HOST}Connection: Upgrade\r\nUpgrade: websocket\r\n`), 200, false],
];

await test('what is wrong with a request is told, and where it ends is not left in doubt', async () => {
  for (const [what, bytes, status, closes] of cases) {
    const smuggled = `GET /v1/smuggled HTTP/1.1\r\n${HOST}\r\n`;
    const client = await talk(closes ? bytes + smuggled : bytes, 1, closes);
    const got = final(client);
    expect((got[0] ?? 0) === status, what, got, client.text.slice(0, 300));
    expect(client.closed === closes, what, 'closed:', client.closed, client.text.slice(0, 300));
    expect(!got.includes(404) || status === 404, what, 'let something through:', client.text);
    expect(!/root:|X-Secret/.test(client.text), what, 'tells', client.text);
    if (!client.text.includes('<html>') && status)
      for (const header of ['X-Content-Type-Options: nosniff', 'Content-Security-Policy: default-src \'none\''])
        expect(client.text.includes(header), what, 'without', header, client.text);
  }
});

await test('requests one behind the other are answered in their order', async () => {
  const one = (i) => `GET /v1/jobs/j${i} HTTP/1.1\r\n${HOST}X-Request-Id: r${i}\r\n\r\n`;
  const client = await talk(Array.from({ length: 200 }, (_, i) => one(i)).join(''), 200);
  const ids = [...client.text.matchAll(/X-Request-Id: r(\d+)/g)].map((m) => Number(m[1]));
  expect(ids.length === 200 && ids.every((id, i) => id === i), ids.length);
});

await test('clients that leave at any moment leave nothing behind', async () => {
  const before = use();
  const whole = post('Content-Length: 2000\r\n', 'x'.repeat(1000));
  await othersDuring(async () => {
    for (let i = 0; i < 300; i++) {
      const client = dial();
      await client.open;
      client.say((i % 3 ? whole : GET).slice(0, 1 + (i * 7) % whole.length));
      if (i % 2)
        client.socket.resetAndDestroy();
      else
        client.leave();
    }
  });
  expect(await until(() => use().fds <= before.fds, PATIENCE), before, use());
});

await test('a body without end is refused, and not kept', () => alone(async (clients, before) => {
  await othersDuring(async () => {
    await crowd(clients, 20, () => post('Transfer-Encoding: chunked\r\n', ''));
    const piece = `10000\r\n${'x'.repeat(65536)}\r\n`;
    for (let i = 0; i < 40; i++) { // 20 x 2.6 MB
      clients.forEach((client) => client.socket.writableLength < 1 << 20 && client.say(piece));
      await sleep(5);
    }
    for (const client of clients)
      client.say('0\r\n\r\n');
    expect(await until(() => clients.every((c) => final(c)[0] === 413 || c.closed), PATIENCE), clients.map(final));
  });
  expect(use().kib < before.kib + 64 * 1024, before, use());
}));

// Each takes more room than there is: nobody else is kept waiting, whatever they do or do not do.
// The limits of the server are LIMIT_CONNECTIONS_MAX and its neighbours in limits.h.
const idlers = {
  'have asked once': () => GET,
  'send headers for ever': () => `GET /healthz HTTP/1.1\r\n${HOST}X-Slow: `,
  'send bodies for ever': () => post('Content-Length: 1000\r\n', 'x'),
  'say nothing': () => '',
  'do all of this': (i) => ['', GET, `GET /healthz HTTP/1.1\r\n${HOST}`, post('Content-Length: 9\r\n', '')][i % 4],
};
for (const [what, hello] of Object.entries(idlers).slice(long ? 0 : -2))
  for (const count of what === 'say nothing' ? [1000, 2500] : [2500])
    await test(`${count} clients that ${what}`, () => alone(async (clients, before) => {
      await othersDuring(async () => {
        await crowd(clients, count, hello);
        for (let i = 0; i < 6; i++) { // one byte now and then is activity
          await sleep(100);
          if (what !== 'have asked once' && what !== 'say nothing')
            clients.filter((c) => !c.closed).forEach((c) => c.say('x'));
        }
      });
      const most = use();
      expect(most.fds < 2700 && most.kib < before.kib + 200 * 1024, most);
      if (count === 1000)
        expect(clients.every((c) => !c.closed), 'some of them were ended without need');
    }));

await test('clients that do not read what they asked for', () => alone(async (clients, before) => {
  await othersDuring(async () => {
    await crowd(clients, long ? 500 : 200, (i, { socket }) => {
      socket.pause();
      return `GET /openapi.json HTTP/1.1\r\n${HOST}\r\n`.repeat(50); // of 100 kB each
    });
    await sleep(1000);
    expect(use().kib < before.kib + 300 * 1024, before, use());
  });
}));

await test('after all of it nothing is left', async () => {
  const { text } = await talk(GET);
  expect(/^HTTP\/1\.1 200/.test(text), text);
  const last = use();
  console.log(`# ${last.kib} KiB, ${last.fds} descriptors`);
});
finish();
