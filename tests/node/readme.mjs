// SPDX-License-Identifier: GPL-3.0-or-later
// readme.mjs - what README.md says is done: its commands are run as they stand there, against the
// test's own daemon, and every request it names is one of the description.
import { spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { ask, expect, finish, readJson, sleep, test, url } from './tools.mjs';

const readme = readFileSync('README.md', 'utf8');
const document = readJson('schema/openapi.json');
const work = mkdtempSync(join(tmpdir(), 'readme'));
const job = { particles: 4, length: 8, diameter: 0.5, time: 0.5, time_step: 0.01,
              potential: { type: 'cosine', amplitude: 2 },
              observables: { msd: { points: 5 }, density: { bins: 8 }, energy: {} } };
for (const name of ['tests', 'engine', 'schema'])
  symlinkSync(resolve(name), join(work, name));
symlinkSync(resolve(process.env.B ?? 'build'), join(work, 'build'));
symlinkSync(process.env.BCD_DATA, join(work, 'data'));
writeFileSync(join(work, 'JOB.json'), JSON.stringify(job));

// Commands of the indented blocks, lines that belong together joined; and those within `...`.
function commands() {
  const found = [];
  let open = null;
  for (const line of readme.split('\n')) {
    const text = line.replace(/^ {4}/, '');
    if (open === null && !(line.startsWith('    ') && /^(curl|build\/|make |bcd )/.test(text)))
      continue;
    open = open === null ? text : `${open}\n${text}`;
    if ((open.match(/'/g) ?? []).length % 2 === 0 && !open.endsWith('\\')) {
      found.push(open);
      open = null;
    }
  }
  for (const [, text] of readme.matchAll(/`((?:build\/bcd|bcd|make) [^`\n]*)`/g))
    found.push(text);
  return [...new Set(found)].filter((c) => !/\bN$/.test(c));
}

// What takes long is asked for less.
const shorter = [
  // A command with options and nothing to work on is a name: the options must be its own.
  [/^build\/bcd [a-z]+( --[a-z-]+)*$/, (c) => {
    const [, name, ...options] = c.split(' ');
    return ['true', ...options.map((o) => `build/bcd help ${name} | grep -e ' *${o}'`),
            `build/bcd help ${name === 'help' ? '' : name}`].join(' && ');
  }],
  [/^make /, (c) => `make -n -C '${resolve('.')}' ${c.slice(5)}`],
  [/bcd report figures/, (c) => c.replace(/ *(#.*)?$/, ' --jobs')],
  [/bcd (report|bench)\b/, (c) => c.replace(/ *(#.*)?$/, ' --help')],
];

let id, sweep, files = 0;
function run(command) {
  let text = command.replaceAll('http://127.0.0.1:8080', url).replace(/\bID\b/g, id)
    .replace(/\bSWEEP\b/g, sweep).replace(/\bDIR\b/g, 'data').replace(/\bFILE\b/g, `file${files++}`)
    .replace(/^bcd /, 'build/bcd ');
  const rule = shorter.find(([pattern]) => pattern.test(text));
  if (rule)
    text = rule[1](text);
  if (/^curl /.test(text))
    text = text.replace(/^curl /, `curl --fail-with-body -m ${/events/.test(text) ? 1 : 60} `);
  return new Promise((done) => {
    const child = spawn('sh', ['-c', text], { cwd: work, env: { ...process.env, BCD_URL: url },
                                              stdio: ['ignore', 'pipe', 'pipe'] });
    let out = '';
    child.stdout.on('data', (d) => { out += d; });
    child.stderr.on('data', (d) => { out += d; });
    child.on('close', (status) => done({ status, out, text }));
  });
}

const all = commands();
await test('there are commands to run', () => expect(all.length >= 12, all));

await test('the first job', async () => {
  const submit = all.find((c) => c.startsWith('curl') && c.includes("-d '{"));
  const { status, out } = await run(submit);
  expect(status === 0, out);
  id = JSON.parse(out).id;
  for (let i = 0; i < 3000; i++) {
    const { json } = await ask('GET', `/v1/jobs/${id}`);
    if (json.state === 'done')
      return;
    expect(['queued', 'running'].includes(json.state), json);
    await sleep(20);
  }
  throw new Error('is never done');
});

for (const command of all) {
  const name = command.split('\n')[0].replace(/ *#.*/, '');
  if (name.startsWith('build/bcdd --'))
    await test(name, async () => {
      const text = command.replace(':8080', ':0').replace('data data', `data '${join(work, 'other')}'`);
      const child = spawn('sh', ['-c', `exec ${text}`], { cwd: work, stdio: ['ignore', 'pipe', 'ignore'] });
      const line = await new Promise((done) => child.stdout.once('data', (d) => done(String(d))));
      child.kill('SIGTERM');
      expect(/^listening on http:\/\/127\.0\.0\.1:\d+\n/.test(line), line);
    });
  else
    await test(name.replace(/#/g, ''), async () => {
      const { status, out, text } = await run(command);
      // What is done cannot be cancelled: the job was faster than the reader.
      const late = /DELETE/.test(text) && out.includes('"status":409');
      const stream = /events/.test(text) && status === 28; // goes on until the reader leaves
      expect(status === 0 || late || stream, text, status, out.slice(0, 2000));
      if (/sweeps -d/.test(text))
        sweep = JSON.parse(out).id;
      expect(out.length > 0 || />|-o |backup/.test(text), text, 'says nothing');
    });
}

await test('every request named is one of the description', () => {
  const named = [...readme.matchAll(/`(GET|POST|PUT|DELETE) (\/[^`?\s]*)[^`]*`/g)];
  expect(named.length >= 3, named.length);
  for (const [, method, path] of named) {
    const pattern = Object.keys(document.paths).find((p) =>
      new RegExp(`^${p.replace(/\./g, '\\.').replace(/\{\w+\}/g, '([A-Z]+|[a-z0-9_-]+)')}$`).test(path));
    expect(pattern && document.paths[pattern][method.toLowerCase()], method, path);
  }
});

rmSync(work, { recursive: true, force: true });
finish();
