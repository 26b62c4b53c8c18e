// SPDX-License-Identifier: GPL-3.0-or-later
// page.mjs - the web page in a browser: what a physicist does with it. page_long.mjs does more.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { gunzipSync } from 'node:zlib';
import { ask, expect, finish, test, url } from './tools.mjs';
import { openBrowser, openTab, startDaemon, violations, visit } from './browser.mjs';

const browser = await openBrowser();
const { tab, faults } = await openTab(browser);

const rods = { particles: 40, length: 50, diameter: 0.5, label: 'rods in wells', tags: ['page'],
               potential: { type: 'cosine', amplitude: 4 }, initial: 'equilibrium', time: 2, realizations: 4,
               observables: { msd: { first: 0.01, last: 0.5, points: 10 }, density: { bins: 20 },
                              cluster_sizes: { gap: 0.1 }, energy: {}, trajectory: { every: 0.05 } } };
const submit = async (job) => (await ask('POST', '/v1/jobs', { body: JSON.stringify(job) })).json;
const done = async (id) => (await ask('GET', `/v1/jobs/${id}?wait=60`)).json;

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
  await tab.locator('[data-state=running] b').getByText('1', { exact: true }).waitFor(); // counts
  await row.getByRole('button', { name: 'Cancel' }).click();
  await row.getByText('cancelled').waitFor();
  expect((await done(long.id)).state === 'cancelled');
  await row.getByRole('button', { name: 'Retry' }).click();
  await tab.waitForURL(/#job\/j/);
  const again = tab.url().split('/').at(-1);
  expect(again !== long.id, again);
  await tab.locator('.head [data-do=cancel]').click(); // not that of the list, which may still be there
  await tab.locator('.head .state.cancelled').waitFor();
  expect((await done(again)).state === 'cancelled');
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
  await tab.locator('.figure', { hasText: 'MSD over that of rods in wells' }).locator('.s1 .error').waitFor();
  const told = await tab.locator('.figure', { hasText: 'Spreading' }).locator('tbody tr').nth(1).locator('td').allTextContents();
  const table = (await ask('GET', `/v1/jobs/${other.id}/results/msd`)).json, [last] = table.lag.slice(-1);
  expect(told[0] === 'shorter rods' && Number(told[3]) === Number(last.toPrecision(4)) &&
         Math.abs(parseFloat(told[4]) / (table.msd.at(-1) / 2 / last) - 1) < 0.05 && told[4].includes('±') && told[5] === '1', told, table);
});

await test('the link holds axes, zoom and what is hidden, of each plot', async () => {
  const figure = tab.locator('.figure').first(), before = tab.url();
  const seen = async () => ({ labels: await figure.locator('.paper .axes text').allTextContents(),
                              shapes: await figure.locator('.paper .shape').count() });
  const whole = await seen();
  await figure.getByRole('button', { name: 'log y' }).click();
  await figure.locator('.paper').focus();
  await tab.keyboard.press('+');
  await figure.getByLabel('shorter rods').uncheck();
  const mine = await seen(), link = tab.url();
  expect(mine.shapes === 1 && whole.shapes === 2 && mine.labels.join() !== whole.labels.join(), whole, mine);
  expect(link.startsWith(`${before}&plot.msd=y:linear,in:`) && link.endsWith(',off:c1'), link);
  const other = await openTab(browser);
  await other.tab.goto(link);
  const there = other.tab.locator('.figure').first();
  await there.locator('.paper svg').waitFor();
  expect((await there.locator('.paper .axes text').allTextContents()).join() === mine.labels.join(), mine.labels);
  expect(!(await there.getByLabel('shorter rods').isChecked()) && (await there.locator('.paper .shape').count()) === 1);
  expect((await other.tab.locator('.paper').nth(1).locator('.shape').count()) === 2, 'other plots');
  expect(other.faults.length === 0, other.faults);
  await other.tab.goto(`${before}&plot.msd=y:none,in:3:1:x,off:nobody,:,gap`); // nonsense is passed over
  await other.tab.reload();
  await there.locator('.paper svg').waitFor();
  expect((await there.locator('.paper .axes text').allTextContents()).join() === whole.labels.join(), whole.labels);
  expect(other.faults.length === 0, other.faults);
  await other.context.close();
  await figure.getByRole('button', { name: 'log y' }).click(); // shows the whole, too
  await figure.getByLabel('shorter rods').check();
  expect(tab.url() === before, tab.url());
});

await test('slopes have error bars; the law t^½ is known, or is fitted where the curve is like it', async () => {
  const slopes = tab.locator('.figure', { hasText: 'Local slope' });
  expect((await slopes.locator('.points .error').first().getAttribute('d')).split('M').length > 4, 'bars');
  const found = await tab.evaluate(async () => {
    const { localSlope, ratio, rootOfTime, singleFile } = await import('/page/guides.js');
    const lag = [0.01, 0.1, 1, 10, 100, 1000, 10000], bend = lag.map((t) => 2 * t / (1 + t / Math.sqrt(t))); // 2 t, then 2 t^(1/2)
    return { slope: localSlope([1, 2, 4], [3, 6, 12], [0.3, 9, 0.9]), root: rootOfTime({ lag, msd: bend }),
             none: rootOfTime({ lag, msd: lag }),
             ratio: ratio({ lag: [1, 4, 16], msd: [1, 2, 4], stderr: [0.1, 0.2, 0.4] }, { lag: [0.5, 2, 8, 20], msd: [1, 1, 1, 1], stderr: [0, 0, 0, 0] }),
             known: singleFile({ job: { particles: 50, length: 100, diameter: 0.5, boundary: 'periodic' }, derived: { diffusion: Math.PI } }),
             wells: singleFile({ job: { particles: 50, length: 100, diameter: 0.5, boundary: 'periodic', potential: {} }, derived: {} }) };
  });
  const near = (a, b) => Math.abs(a - b) < 1e-9;
  expect(near(found.slope.y[0], 1) && near(found.slope.error[0], Math.hypot(0.1, 0.075) / Math.log(4)), found);
  expect(found.root.from === 100 && found.root.to === 1000 && found.root.factor > 1.5 && found.root.factor < 2, found);
  expect(found.ratio.x.join() === '2,8' && near(found.ratio.y[0], 1 / Math.sqrt(2)) && near(found.ratio.y[1], 1 / Math.sqrt(8)) &&
         near(found.ratio.error[1], 0.1 / Math.sqrt(8)), found.ratio);
  expect(found.none === null && near(found.known, 3) && found.wells === null, found);
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

await test('what changes all the time is read again and again, the last change too', async () => {
  const calls = await tab.evaluate(async () => {
    const { paced } = await import('/page/dom.js');
    const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    let now = 0;
    const read = [], reload = paced(() => 50, async () => {
      const then = now;
      await sleep(20);
      read.push(then);
    });
    for (; read.length < 3 && now < 2000; now++) { // never quiet for as long as its pause
      reload();
      await sleep(5);
    }
    const meanwhile = read.length;
    reload();
    for (let i = 0; read.at(-1) !== now && i < 2000; i++)
      await sleep(5);
    return { meanwhile, last: read.at(-1) === now };
  });
  expect(calls.meanwhile === 3 && calls.last, calls);
});

// --------------------------------------------------------------------------- submitting
const field = (pointer) => tab.locator(`[data-pointer="${pointer}"] input, [data-pointer="${pointer}"] select`).first();

await test('the scene, the estimate and the line for curl follow what is typed', async () => {
  await visit(tab, '#submit');
  await tab.getByText('of one core').waitFor();
  const errors = tab.locator('.facts div', { hasText: 'density' }).filter({ hasText: '%' }).last().locator('dd');
  await tab.getByText(/Statistical errors, from a sample of \d+ realizations/).waitFor({ timeout: 60000 });
  expect(/^0\.\d+ %$/.test(await errors.textContent()), await errors.textContent());
  const rodsDrawn = await tab.locator('.scene .rod').count();
  expect(rodsDrawn > 3, rodsDrawn);
  const memory = tab.locator('.facts div', { hasText: 'steps' }).locator('dd').first();
  const before = await memory.textContent();
  await field('/time').fill('2000');
  await tab.waitForFunction(([old]) => ![...document.querySelectorAll('.facts dd')].some((d) => d.textContent === old), [before]);
  await field('/diameter').fill('0.9');
  await tab.locator('code', { hasText: '"diameter":0.9' }).waitFor();
  const widths = await tab.locator('.scene .rod').first().getAttribute('width');
  expect(Number(widths) > 20, widths);
});

await test('wrong input is told beside its field', async () => {
  await field('/particles').fill('many');
  await tab.locator('[data-pointer="/particles"] .fault', { hasText: 'must be' }).waitFor();
  expect((await field('/particles').getAttribute('aria-invalid')) === 'true');
  await field('/particles').fill('80');
  await field('/potential').selectOption('expression');
  await tab.locator('[data-pointer="/potential/energy"] .fault', { hasText: 'required' }).waitFor();
  await field('/potential/energy').fill('3*cos(2*pi*x)');
  await field('/potential/period').fill('1');
  await tab.locator('[data-pointer="/diameter"] .fault', { hasText: 'must not exceed length' }).waitFor();
});

await test('a scene of a paper is chosen, made smaller and submitted; the link holds it', async () => {
  await tab.locator('#preset').selectOption('2022-fig3-sigma0.5-rho0.5');
  await tab.getByText('10.1103/PhysRevE.106.054606').waitFor();
  await field('/time').fill('0.5');
  await field('/realizations').fill('2');
  await tab.locator('code', { hasText: '"time":0.5' }).waitFor();
  await tab.reload();
  await tab.locator('#send').waitFor();
  expect((await field('/particles').inputValue()) === '50' && (await field('/time').inputValue()) === '0.5');
  await tab.locator('#send').click();
  await tab.waitForURL(/#job\/j/);
  const record = await done(tab.url().split('/').at(-1));
  expect(record.state === 'done' && record.job.potential.amplitude === 6 && record.tags[0] === '2022-fig3', record);
  await tab.locator('h3', { hasText: 'Density' }).first().waitFor();
});

// ----------------------------------------------------------------------------- sweeps
await test('a sweep is submitted; curves, the map, the way to a job, the table', async () => {
  const base = { particles: 4, length: 8, time: 1, potential: { type: 'cosine', amplitude: 2 },
                 observables: { msd: { points: 6 }, energy: {} } };
  await visit(tab, `#submit?job=${encodeURIComponent(JSON.stringify(base))}`);
  await tab.locator('#axis-pointer').fill('/diameter');
  for (const [pointer, values] of [['/diameter', '0.2,0.5'], ['/potential/amplitude', '0..6:3'], ['/seed', '1..2']]) {
    await tab.locator('#axis-pointer').fill(pointer);
    await tab.locator('#axis-values').fill(values);
    await tab.getByRole('button', { name: 'Add' }).click();
    await tab.locator('code', { hasText: `${pointer}  ` }).waitFor();
  }
  await tab.locator('#send').click();
  await tab.waitForURL(/#sweep\/s/);
  const sweepId = tab.url().split('/').at(-1);
  await tab.locator('b').getByText('12', { exact: true }).waitFor(); // all done
  await tab.locator('.cell').nth(5).waitFor();
  const figure = tab.locator('.figure').first();
  await figure.locator('h3', { hasText: 'Mean squared displacement by diameter' }).waitFor();
  expect((await figure.locator('.paper .shape').count()) === 2, 'curves');
  expect((await tab.locator('.cell').count()) === 6, 'cells');
  const fills = () => tab.locator('rect.cell').evaluateAll((all) => all.map((cell) => cell.getAttribute('fill')));
  const linear = await fills(), turn = tab.getByRole('button', { name: 'log colours' });
  await turn.click();
  const logarithmic = await fills(), ends = [linear.indexOf('rgb(68,1,84)'), linear.findIndex((f) => f.startsWith('rgb(253'))];
  expect(tab.url().endsWith('scale=log') && (await turn.getAttribute('aria-pressed')) === 'true', tab.url());
  expect(ends.every((i) => i >= 0 && linear[i] === logarithmic[i]) && linear.some((f, i) => f !== logarithmic[i]), linear, logarithmic);
  await tab.locator('.note', { hasText: 'Colours go by the logarithm.' }).waitFor();
  await tab.locator('label', { hasText: 'observable' }).locator('select').selectOption('energy');
  await tab.locator('h3', { hasText: 'energy over diameter and potential.amplitude' }).waitFor();
  const rows = (await ask('GET', `/v1/sweeps/${sweepId}/results/energy`)).json.rows;
  const mine = rows.filter((r) => r['/diameter'] === 0.5 && r['/potential/amplitude'] === 6);
  const cell = tab.locator('a[aria-label^="diameter 0.5, potential.amplitude 6:"]');
  const value = Number((await cell.getAttribute('aria-label')).split(': ')[1].replace('−', '-'));
  expect(mine.length === 2 && Math.abs(value - (mine[0].energy + mine[1].energy) / 2) < 1e-3, value, mine);
  await tab.locator('.note', { hasText: 'cells are not above 0 and dotted' }).waitFor(); // the link has kept it
  expect((await tab.locator('rect.low').count()) > 0 && (await tab.locator('rect.low[fill]').count()) === 0);
  const svg = (await tab.locator('code', { hasText: '.svg?x=/diameter&y=/potential/amplitude&scale=log' }).textContent()).match(/\/v1[^' ]*/)[0];
  expect((await ask('GET', svg)).text.includes('logarithmic colours'), svg);
  expect((await tab.locator('tbody tr').count()) === 12, 'rows of the table');
  await cell.click();
  await tab.waitForURL(/#jobs\?sweep=/);
  await tab.waitForFunction(() => document.querySelectorAll('.jobs tbody tr').length === 2);
  await visit(tab, '#sweeps');
  await tab.locator(`a[href="#sweep/${sweepId}"]`).waitFor();
});

await test('reports: nothing is measured unasked; stability is shown as it is found', async () => {
  await visit(tab, '#reports');
  const begin = tab.getByRole('button', { name: 'Measure it' });
  await begin.nth(1).waitFor();
  for (const name of ['work-precision', 'stability'])
    expect((await ask('GET', `/v1/reports/${name}?begin=false`)).status === 404, name);
  await begin.nth(1).click();
  const first = tab.locator('.signs td button').first();
  await first.waitFor({ timeout: 60000 });
  const said = await first.getAttribute('aria-label');
  expect(/^(\S \S+: )?U0 = 100, \w+: (right|biased|ran|refused)/.test(said), said);
  await first.click();
  expect(said.endsWith(await tab.locator('.says').last().textContent()), said);
  expect((await ask('GET', '/v1/reports/work-precision')).status === 409, 'one at a time');
  await tab.getByRole('button', { name: 'Stop' }).click();
  await begin.nth(1).waitFor({ timeout: 60000 });
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

// ------------------------------------------------------------------------ for everybody
// page_long.mjs looks at every view in both themes.
for (const [theme, some] of [['light', ['#jobs?limit=4', '#submit']], ['dark', [`#job/${id}`]]])
  await test(`axe-core finds nothing serious, ${theme}`, async () => {
    const other = await openTab(browser, { theme });
    const found = {};
    for (const view of some) {
      await visit(other.tab, view);
      await other.tab.locator('.figure, .facts, tbody tr').first().waitFor();
      const bad = await violations(other.tab);
      if (bad.length)
        found[view] = bad;
    }
    await other.context.close();
    expect(Object.keys(found).length === 0, found);
    expect(other.faults.length === 0, other.faults);
  });

await test('nothing is wider than a narrow screen', async () => {
  const other = await openTab(browser, { width: 360 });
  for (const view of ['#jobs', `#job/${id}`, '#submit', '#reports']) {
    await visit(other.tab, view);
    await other.tab.waitForTimeout(200);
    const wide = await other.tab.evaluate(() => document.documentElement.scrollWidth);
    expect(wide <= 360, view, wide);
  }
  await other.context.close();
});

// ------------------------------------------------- a server of its own: tokens, restarts
const directory = mkdtempSync(join(tmpdir(), 'page'));
await test('a server that wants a token is given one, which stays in the tab', async () => {
  const secret = execFileSync(`${process.env.B ?? 'build'}/bcdd`, ['token', 'create', '--data', directory, '--owner', 'anna',
    '--role', 'admin'], { encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] }).match(/bcd_[a-z2-7]{52}/)[0];
  const daemon = await startDaemon(directory);
  const { tab: closed, context } = await openTab(browser, { home: daemon.url });
  await closed.goto(`${daemon.url}/#jobs`);
  await closed.locator('#token-why', { hasText: 'needs a token' }).waitFor();
  await closed.locator('#token-text').fill(`bcd_${'a'.repeat(52)}`);
  await closed.getByRole('button', { name: 'Use it' }).click();
  await closed.locator('#token-why', { hasText: 'not known' }).waitFor();
  await closed.locator('#token-text').fill(secret);
  await closed.getByRole('button', { name: 'Use it' }).click();
  await closed.getByText('anna (admin)').waitFor();
  await closed.getByText('There are no jobs yet.').waitFor();
  const kept = await closed.evaluate(() => [sessionStorage.length, localStorage.length, document.cookie, location.href]);
  expect(kept[0] === 1 && kept[1] === 0 && kept[2] === '' && !kept[3].includes('bcd_'), kept);
  await closed.locator('.source summary').click();
  expect((await closed.locator('.source code').textContent()).includes('-H "Authorization: Bearer $BCD_TOKEN"'));

  // The server goes away and comes back while the page is open.
  const port = Number(new URL(daemon.url).port);
  await daemon.end('SIGKILL');
  await closed.locator('#connection', { hasText: 'No connection' }).waitFor();
  const again = await startDaemon(directory, port);
  await closed.waitForFunction(() => document.getElementById('connection').textContent === '');
  const submitted = await fetch(`${again.url}/v1/jobs`, { method: 'POST', body: JSON.stringify({ ...rods, label: 'after it' }),
    headers: { 'content-type': 'application/json', authorization: `Bearer ${secret}` } });
  expect(submitted.status === 202, submitted.status);
  const row = closed.locator('tr', { hasText: 'after it' });
  await row.getByText('done').waitFor();
  await context.close();
  await again.end('SIGTERM');
});
rmSync(directory, { recursive: true, force: true });

await test('nothing was wrong meanwhile', () => {
  expect(faults.length === 0, faults);
});
await browser.close();
finish();
