// SPDX-License-Identifier: GPL-3.0-or-later
// page.mjs - the web page in a browser: what a physicist does with it. page_long.mjs does more.
import { readdirSync } from 'node:fs';
import { gunzipSync } from 'node:zlib';
import { ask, expect, finish, test, url } from './tools.mjs';
import { openBrowser, openTab, visit } from './browser.mjs';

const browser = await openBrowser();
const { tab, faults } = await openTab(browser);

const rods = { particles: 40, length: 50, diameter: 0.5, label: 'rods in wells', tags: ['page'],
               potential: { type: 'cosine', amplitude: 4 }, initial: 'equilibrium', time: 2, realizations: 4,
               observables: { msd: { first: 0.01, last: 0.5, points: 10 }, density: { bins: 20 },
                              cluster_sizes: { gap: 0.1 }, energy: {}, trajectory: { every: 0.05 } } };
const submit = async (job) => (await ask('POST', '/v1/jobs', { body: JSON.stringify(job) })).json;
const done = async (id) => (await ask('GET', `/v1/jobs/${id}?wait=30`)).json;

await test('the page weighs less than 200 kB, and half of that as it is sent', async () => {
  let sent = 0, whole = 0;
  for (const name of ['../', ...readdirSync('server/page').filter((f) => f !== 'index.html')]) {
    const plain = await ask('GET', new URL(`${url}/page/${name}`).pathname);
    const packed = await ask('GET', new URL(`${url}/page/${name}`).pathname, { headers: { 'accept-encoding': 'gzip' } });
    expect(plain.status === 200 && packed.headers['content-encoding'] === 'gzip', name, plain.status);
    expect(gunzipSync(packed.bytes).equals(plain.bytes), name);
    sent += packed.bytes.length;
    whole += plain.bytes.length;
  }
  console.log(`# ${sent} bytes sent, ${whole} as they are read`);
  expect(sent > 1000 && sent < 100000, sent);
  expect(whole < 200000, whole);
});

const long = await submit({ ...rods, time: 1e5, label: 'a long one', observables: { energy: {} } });
expect(long.id, long);
await test('a job is watched in the queue as it goes on, and cancelled', async () => {
  await visit(tab, '#jobs');
  const row = tab.locator(`tr[data-id=${long.id}]`);
  await row.getByText('running').waitFor();
  expect((await row.locator('a').first().textContent()) === 'a long one');
  const before = await row.locator('progress').getAttribute('value');
  await tab.waitForFunction(([id, old]) => document.querySelector(`tr[data-id=${id}] progress`)?.value > old,
                            [long.id, Number(before)]);
  expect((await tab.locator('[data-state=running] b').textContent()) === '1', 'counts');
  await row.getByRole('button', { name: 'Cancel' }).click();
  await row.getByText('cancelled').waitFor();
  expect((await done(long.id)).state === 'cancelled');
});

const { id } = await submit(rods);
await test('plots come when it is done', async () => {
  await visit(tab, `#job/${id}`);
  await tab.locator('.figure svg.plot').nth(4).waitFor();
  const titles = await tab.locator('.figure h3').allTextContents();
  for (const title of ['Mean squared displacement', 'Local slope d log MSD / d log t', 'Density', 'Energy',
                       'Density: distance from theory in standard errors', 'Cluster sizes', 'Space and time'])
    expect(titles.includes(title), title, titles);
  const points = await tab.locator('.paper .points .shape').first().getAttribute('d');
  expect((points.match(/M/g) ?? []).length === 10, 'points drawn', points);
  expect((await tab.locator('.paper .points .error').count()) > 0, 'error bars');
});

await test('values are read with arrow keys', async () => {
  await tab.locator('.paper').first().focus();
  await tab.keyboard.press('ArrowRight');
  const table = (await ask('GET', `/v1/jobs/${id}/results/msd`)).json;
  const said = await tab.locator('.says').first().textContent();
  expect(said.includes(`lag ${Number(table.lag[0].toPrecision(5))}`) && said.includes('±'), said);
});

await test('another job lies over it, and the link holds that', async () => {
  const other = await submit({ ...rods, label: 'shorter rods', diameter: 0.2 });
  await done(other.id);
  await tab.locator('#overlay').fill(other.id);
  await tab.keyboard.press('Enter');
  await tab.locator('.legend').getByText('shorter rods').first().waitFor();
  expect(tab.url().endsWith(`#job/${id}?with=${other.id}`), tab.url());
  await tab.reload();
  await tab.locator('.legend').getByText('shorter rods').first().waitFor();
  expect((await tab.locator('.paper').first().locator('.s1 .shape').count()) === 1);
});

await test('plots are saved as SVG and CSV', async () => {
  const save = async (kind) => {
    const [file] = await Promise.all([tab.waitForEvent('download'),
                                      tab.locator(`[data-save=${kind}]`).first().click()]);
    const parts = [];
    for await (const part of await file.createReadStream())
      parts.push(part);
    return Buffer.concat(parts).toString();
  };
  const svg = await save('svg'), csv = await save('csv');
  expect(svg.startsWith('<svg') && svg.includes('stroke="rgb(') && !svg.includes('class='), svg.slice(0, 300));
  const lines = csv.trim().split('\n');
  expect(lines[0] === 'series,lag,msd,stderr' && lines.filter((l) => l.startsWith('rods in wells')).length === 10,
         lines.slice(0, 3), lines.length);
});

await test('filters are the query string of the API, wrong ones are told', async () => {
  await visit(tab, '#jobs');
  await tab.locator('#filter').fill('diameter=0.1..0.3');
  await tab.keyboard.press('Enter');
  await tab.waitForFunction(() => document.querySelectorAll('tbody tr').length === 1);
  expect(tab.url().endsWith('#jobs?diameter=0.1..0.3'), tab.url());
  await tab.locator('#filter').fill('state=nonsense');
  await tab.keyboard.press('Enter');
  await tab.locator('.fault').getByText('state: ').waitFor();
});

await test('what the server says is never markup', async () => {
  const label = '<img src=x onerror=alert(1)><b>bold</b>';
  const { id: odd } = await submit({ ...rods, label, time: 0.5, observables: { energy: {} } });
  await done(odd);
  await visit(tab, `#job/${odd}`);
  expect((await tab.locator('h1').textContent()) === label);
  await visit(tab, '#jobs');
  await tab.locator(`tr[data-id=${odd}]`).waitFor();
  expect((await tab.locator('main img, main b:has-text("bold")').count()) === 0);
});

await test('nothing was wrong meanwhile', () => {
  const real = faults.filter((f) => !/status of 400/.test(f));
  expect(real.length === 0, real);
});
await browser.close();
finish();
