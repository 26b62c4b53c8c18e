// SPDX-License-Identifier: GPL-3.0-or-later
// soak.mjs - a daemon (BCD_URL, BCD_PID, BCD_DATA) at work for BCD_SECONDS: jobs, sweeps, results in
// every form, lists, streams that are left, cancellations, requests that are wrong. After the first
// third its memory and descriptors do not grow any more.
import http from 'node:http';
import { readFileSync, readdirSync, statSync } from 'node:fs';
import { ask, expect, finish, sleep, test, url } from './tools.mjs';

const seconds = Number(process.env.BCD_SECONDS ?? 6), pid = process.env.BCD_PID;
const tiny = (seed) => ({ particles: 4, length: 8, diameter: 0.5, time: 0.2, time_step: 0.01, seed,
                          potential: { type: 'cosine', amplitude: 2 }, stability: 'ignored',
                          label: `number ${seed}`, tags: [`t${seed % 7}`],
                          observables: { energy: {}, msd: { points: 3, last: 0.1 }, density: { bins: 8 } } });
const use = () => ({
  fds: readdirSync(`/proc/${pid}/fd`).length,
  kept: statSync(`${process.env.BCD_DATA}/bcd.sqlite`).size / 1024,
  kib: Number(/VmRSS:\s*(\d+)/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'))[1]) });
let seed = 0, jobs = 0, requests = 0;

async function get(path, wanted = 200) {
  requests++;
  const answer = await ask('GET', path);
  expect(answer.status === wanted, path, answer.status, answer.text.slice(0, 200));
  return answer;
}

async function post(path, body, wanted) {
  requests++;
  const answer = await ask('POST', path, { body: JSON.stringify(body) });
  expect(wanted.includes(answer.status), path, answer.status, answer.text.slice(0, 300));
  return answer.json;
}

// A stream that is listened to for a moment, and left.
const listen = (path) => new Promise((resolve, reject) => {
  const { hostname, port } = new URL(url);
  const request = http.get({ hostname, port, path }, (answer) => {
    answer.on('data', () => {});
    answer.on('error', () => {});
    setTimeout(() => { request.destroy(); resolve(); }, 30);
  });
  request.on('error', reject);
});

async function job() {
  const { id } = await post('/v1/jobs', tiny(++seed), [202]);
  let state;
  do
    ({ state } = (await get(`/v1/jobs/${id}?wait=10`)).json);
  while (state === 'queued' || state === 'running');
  expect(state === 'done', state);
  for (const form of ['', '.csv', '.svg'])
    await get(`/v1/jobs/${id}/results/${['energy', 'msd', 'density'][seed % 3]}${form}`);
  jobs++;
}

async function others() {
  await get(`/v1/jobs?tag=t${seed % 7}&seed>=${Math.max(1, seed - 50)}&sort=-results.energy.energy&limit=20`);
  await get('/v1/jobs/jnothing', 404);
  await get('/metrics');
  await post('/v1/jobs', { ...tiny(seed), force: 'much' }, [422]);
  await post('/v1/jobs', tiny(seed), [200]);
  await post('/v1/estimate', tiny(seed), [200]);
  await listen('/v1/events');
  const { id } = await post('/v1/jobs', { ...tiny(++seed), time: 1e5 }, [202]);
  await sleep(20);
  requests++;
  expect((await ask('DELETE', `/v1/jobs/${id}`)).status === 200, 'not cancelled');
}

async function sweep() {
  const base = tiny(0);
  const { id } = await post('/v1/sweeps', { base, axes: {
    '/seed': { first: 1e6 + 10 * ++seed, count: 5 }, '/diameter': [0.25, 0.5] } }, [202]);
  while ((await get(`/v1/sweeps/${id}`)).json.states.done < 10)
    await sleep(20);
  for (const form of ['', '.csv', '.ndjson', '.npz', '.svg'])
    await get(`/v1/sweeps/${id}/results/energy${form}`);
  jobs += 10;
}

async function work(until) {
  for (let i = 0; Date.now() < until; i++) {
    await Promise.all([job(), job(), job(), job()]);
    if (i % 5 === 0)
      await others();
    if (i % 10 === 3)
      await sweep();
  }
}

await test('memory and descriptors stay as they are', async () => {
  const begin = Date.now(), samples = [];
  for (let third = 1; third <= 3; third++) {
    await work(begin + third * seconds * 1000 / 3);
    await sleep(300); // streams that were left are noticed
    for (let i = 0; third === 3 && i < 1000 && use().fds > samples[0].fds + 2; i++)
      await sleep(20); // at last, however busy the machine
    samples.push(use());
    console.log(`# ${Math.round((Date.now() - begin) / 1000)} s: ${jobs} jobs, ${requests} requests,`,
                `${samples.at(-1).kib} KiB, ${samples.at(-1).fds} descriptors`);
  }
  const [warm, , end] = samples;
  expect(jobs > seconds, 'too few jobs', jobs);
  // What may grow is what SQLite keeps of the database, up to STORE_CACHE_KIB and a bit for readers.
  const pages = ({ kept }) => Math.min(kept, 80 * 1024);
  expect(end.kib < warm.kib + 1.4 * (pages(end) - pages(warm)) + 16 * 1024, samples);
  expect(end.fds <= warm.fds + 2, samples);
});
finish();
