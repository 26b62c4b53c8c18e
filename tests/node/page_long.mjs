// SPDX-License-Identifier: GPL-3.0-or-later
// page_long.mjs - the web page with 10^5 jobs in motion, and every view of it for everybody.
import { mkdirSync } from 'node:fs';
import { ask, expect, finish, sleep, test, url } from './tools.mjs';
import { openBrowser, openTab, violations, visit } from './browser.mjs';

const browser = await openBrowser();
const post = async (path, body) => (await ask('POST', path, { body: JSON.stringify(body) })).json;

const base = { particles: 4, length: 8, time: 0.2, potential: { type: 'cosine', amplitude: 2 },
               observables: { energy: {} } };
const many = await post('/v1/sweeps', { base, label: 'many points', axes: { '/diameter': { from: 0, to: 0.9, points: 50 },
  '/potential/amplitude': { from: 0, to: 6, points: 40 }, '/seed': { first: 1, count: 50 } } });
expect(many.jobs === 100000, many);

await test('first paint within half a second at 10^5 jobs, the list within two', async () => {
  const paints = [], lists = [];
  for (let i = 0; i < 5; i++) {
    const { tab, context } = await openTab(browser);
    const began = Date.now();
    await tab.goto(`${url}/`);
    await tab.locator('.jobs tbody tr').nth(49).waitFor();
    lists.push(Date.now() - began);
    paints.push(await tab.evaluate(() => performance.getEntriesByName('first-contentful-paint')[0].startTime));
    await context.close();
  }
  const middle = (values) => values.sort((a, b) => a - b)[2];
  console.log(`# first paint ${Math.round(middle(paints))} ms, the list ${middle(lists)} ms (medians of 5)`);
  expect(paints[0] < 500, paints); // the best: others may be using the machine
  expect(lists[0] < 2000, lists);
});

const { tab, faults } = await openTab(browser);
await test('pages follow each other, whatever happens meanwhile', async () => {
  await visit(tab, '#jobs');
  const seen = new Set(), times = [];
  for (let i = 0; i < 6; i++) {
    await tab.locator('.jobs tbody tr').nth(49).waitFor();
    for (const id of await tab.locator('.jobs tbody tr').evaluateAll((rows) => rows.map((r) => r.dataset.id)))
      seen.add(id);
    const first = await tab.locator('.jobs tbody tr').first().getAttribute('data-id'), began = Date.now();
    await tab.getByRole('link', { name: 'Next page' }).click();
    await tab.waitForFunction((old) => {
      const row = document.querySelector('.jobs tbody tr');
      return row && row.dataset.id !== old;
    }, first);
    times.push(Date.now() - began);
  }
  console.log(`# next pages: ${times.join(' ')} ms`);
  expect(seen.size === 300, seen.size);
  expect(times.sort((a, b) => a - b)[1] < 1000, times);
});

await test('the queue stays quick to the hand while thousands of jobs end', async () => {
  await visit(tab, '#jobs?state=running');
  await tab.evaluate(() => {
    globalThis.blocked = [];
    new PerformanceObserver((list) => globalThis.blocked.push(...list.getEntries().map((e) => e.duration)))
      .observe({ type: 'longtask' });
  });
  const ended = async () => (await ask('GET', `/v1/sweeps/${many.id}`)).json.states.done;
  const before = await ended();
  await visit(tab, '#jobs');
  await sleep(5000);
  const blocked = await tab.evaluate(() => globalThis.blocked), after = await ended();
  console.log(`# ${after - before} jobs ended in 5 s; longest pause of the page ${Math.round(Math.max(0, ...blocked))} ms`);
  expect(after > before, before, after);
  expect(Math.max(0, ...blocked) < 500, blocked);
  await tab.waitForFunction((least) => Number(document.querySelector('[data-state=done] b').textContent.replaceAll(',', '')) >= least,
                            after, { timeout: 5000 });
});

await test('filters and a cancel among 10^5', async () => {
  await tab.locator('#filter').fill(`sweep=${many.id}&state=queued&diameter=0.9`);
  await tab.keyboard.press('Enter');
  await tab.locator('.jobs tbody tr').nth(9).waitFor();
  await tab.waitForURL(/diameter=0.9/);
  const row = tab.locator('.jobs tbody tr').last(), id = await row.getAttribute('data-id');
  await row.getByRole('button', { name: 'Cancel' }).click();
  await tab.locator(`tr[data-id=${id}]`).getByText('cancelled').waitFor();
});

await test('the map of a sweep of 10^5 points', async () => {
  const began = Date.now();
  await visit(tab, `#sweep/${many.id}`);
  await tab.locator('.plot a').nth(1999).waitFor({ state: 'attached', timeout: 30000 });
  console.log(`# drawn after ${Date.now() - began} ms`);
  await tab.getByRole('button', { name: 'Cancel' }).click();
  await tab.waitForFunction(async (id) => (await (await fetch(`/v1/sweeps/${id}`)).json()).states.queued === 0, many.id,
                            { timeout: 120000, polling: 500 });
});

// ----------------------------------------------------------------------- every view, in both themes
const rods = { particles: 20, length: 25, diameter: 0.5, label: 'rods', potential: { type: 'cosine', amplitude: 3 },
               initial: 'equilibrium', time: 2, realizations: 4, observables: { msd: { points: 10 }, density: {},
               contact_density: { gap: 0.05 }, pair_distribution: {}, energy: {}, current: {}, cluster_sizes: { gap: 0.1 },
               contact_force: {}, trajectory: { every: 0.05 } }, method: 'bcd' };
const job = await post('/v1/jobs', rods), other = await post('/v1/jobs', { ...rods, diameter: 0.3, label: 'shorter' });
const small = await post('/v1/sweeps', { base: { ...base, observables: { msd: {}, density: {} } },
  axes: { '/diameter': [0.1, 0.3], '/potential/amplitude': [0, 2] } });
for (const { id } of [job, other])
  expect((await ask('GET', `/v1/jobs/${id}?wait=60`)).json.state === 'done');
for (let i = 0; (await ask('GET', `/v1/sweeps/${small.id}`)).json.states.done < 4 && i < 300; i++)
  await sleep(100);
await ask('POST', '/v1/reports/work-precision?budget=0.01');
for (let i = 0; (await ask('GET', '/v1/reports/work-precision?begin=false')).status !== 200 && i < 1200; i++)
  await sleep(100);
await test('the stability report: every method at every extreme, and no silent failure', async () => {
  expect((await ask('POST', '/v1/reports/stability')).status === 202);
  let report, found = 0;
  for (let i = 0; i < 9000 && report?.status !== 200; i++) {
    await sleep(100);
    report = await ask('GET', '/v1/reports/stability?begin=false');
    expect(report.status === 200 || report.status === 202, report.status, report.text);
    expect(report.status === 200 || (report.json.entries ?? []).length >= found);
    found = (report.json.entries ?? []).length;
  }
  const { entries, tried, failed } = report.json, csv = (await ask('GET', '/v1/reports/stability.csv')).text;
  expect(failed === 0 && tried === entries.length && tried > 200, tried, entries.filter((e) => e.failed));
  expect(csv.split('\r\n').length === tried + 2, csv.slice(0, 200));
  expect((await ask('GET', '/v1/reports/stability.svg')).text.split('<rect').length === tried + 2);
  expect((await ask('GET', '/v1/reports')).json.reports.every((r) => r.measured_at && r.state === 'idle'));
});

const views = { queue: '#jobs', job: `#job/${job.id}`, overlay: `#job/${job.id}?with=${other.id}`, sweeps: '#sweeps',
                sweep: `#sweep/${small.id}`, submit: '#submit', reports: '#reports', missing: '#job/jnone' };
for (const theme of ['light', 'dark'])
  await test(`axe-core finds nothing serious in any view, ${theme}`, async () => {
    const one = await openTab(browser, { theme });
    const found = {};
    for (const [name, view] of Object.entries(views)) {
      await visit(one.tab, view);
      await one.tab.waitForTimeout(1000);
      const bad = await violations(one.tab);
      if (bad.length)
        found[name] = bad;
      if (process.env.BCD_PICTURES) {
        mkdirSync(process.env.BCD_PICTURES, { recursive: true });
        await one.tab.screenshot({ path: `${process.env.BCD_PICTURES}/${name}-${theme}.png`, fullPage: true });
      }
    }
    await one.context.close();
    expect(Object.keys(found).length === 0, found);
    expect(one.faults.length === 0, one.faults);
  });

await test('all of it by keyboard: to a job, into its plot, and back', async () => {
  await visit(tab, '#jobs?label=rods');
  await tab.locator('.jobs tbody tr').first().waitFor();
  await tab.locator('#filter').focus();
  for (let i = 0; i < 12 && !(await tab.evaluate(() => document.activeElement.matches('.what a'))); i++)
    await tab.keyboard.press('Tab');
  await tab.keyboard.press('Enter');
  await tab.waitForURL(/#job\//);
  await tab.locator('.paper').first().waitFor();
  for (let i = 0; i < 40 && !(await tab.evaluate(() => document.activeElement.matches('.paper'))); i++)
    await tab.keyboard.press('Tab');
  await tab.keyboard.press('ArrowRight');
  expect((await tab.locator('.says').first().textContent()).includes('msd'));
  await tab.keyboard.press('+');
  await tab.keyboard.press('0');
  await tab.goBack();
  await tab.locator('.jobs').waitFor();
});

await test('printing leaves the plots and drops the tools', async () => {
  await visit(tab, views.job);
  await tab.locator('.figure svg.plot').first().waitFor();
  await tab.emulateMedia({ media: 'print' });
  const seen = await tab.evaluate(() => ({ tools: getComputedStyle(document.querySelector('.tools')).display,
    plot: document.querySelector('.paper svg').getBoundingClientRect().height,
    paper: getComputedStyle(document.body).backgroundColor }));
  await tab.emulateMedia({ media: null });
  expect(seen.tools === 'none' && seen.plot > 100 && seen.paper === 'rgb(251, 250, 247)', seen);
});

await test('nothing was wrong meanwhile', () => expect(faults.length === 0, faults));
await browser.close();
finish();
