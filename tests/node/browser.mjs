// SPDX-License-Identifier: GPL-3.0-or-later
// browser.mjs - headless Chromium with an empty profile, for the tests of the web page.
import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { require, url } from './tools.mjs';

const { chromium } = require('playwright-core');
const axe = readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');
const build = process.env.B ?? 'build';

// Debian's wrapper script is passed over where the program itself is known.
export async function openBrowser() {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', timeout: 120000, args: [
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
}

// A tab in a context of its own. `faults` collects what the page complains of: errors nobody caught,
// what the content security policy refused, requests that went elsewhere. That the server refuses
// something is no fault: Chromium writes a line for each of its 4xx.
export async function openTab(browser, { theme = 'light', width = 1200, home = url } = {}) {
  const context = await browser.newContext({ colorScheme: theme, viewport: { width, height: 900 },
                                             acceptDownloads: true });
  const tab = await context.newPage();
  tab.setDefaultTimeout(60000);
  const faults = [];
  tab.on('pageerror', (error) => faults.push(String(error.stack ?? error)));
  tab.on('console', (line) => {
    if (line.type() === 'error' && !/the server responded with a status of 4(00|01|04|22)/.test(line.text()))
      faults.push(line.text());
  });
  tab.on('request', (request) => {
    if (!request.url().startsWith(home) && !/^(blob|data):/.test(request.url()))
      faults.push(`asks ${request.url()}`);
  });
  return { tab, context, faults };
}

// Goes there and waits until the view says something.
export async function visit(tab, hash, home = url) {
  if (tab.url().startsWith(home))
    await tab.evaluate((h) => { location.hash = h; }, hash);
  else
    await tab.goto(`${home}/${hash}`);
  await tab.locator('main h1').first().waitFor();
}

// A daemon of the test's own, where it must be ended and begun again: { url, end(signal) }.
export function startDaemon(directory, port = 0, options = []) {
  const child = spawn(`${build}/bcdd`, ['--listen', `127.0.0.1:${port}`, '--data', directory, '--workers', '1',
                                        '--nice', '0', ...options], { stdio: ['ignore', 'pipe', 'ignore'] });
  const ended = new Promise((resolve) => child.once('exit', resolve));
  process.once('exit', () => child.kill('SIGKILL'));
  return new Promise((resolve, reject) => {
    let said = '';
    child.stdout.on('data', (part) => {
      said += part;
      const found = /^listening on (http:\S+)$/m.exec(said);
      if (found)
        resolve({ url: found[1], end: (signal) => { child.kill(signal); return ended; } });
    });
    ended.then((code) => reject(new Error(`the daemon ended: ${code} ${said}`)));
  });
}

// What axe-core finds, of the serious kinds; seconds for a view of a thousand elements.
const all = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'];
export async function violations(tab) {
  await tab.evaluate(axe);
  const { violations: found } = await tab.evaluate((runOnly) => globalThis.axe.run(document,
    { runOnly, resultTypes: ['violations'], preload: false }), all);
  return found.filter((v) => ['serious', 'critical'].includes(v.impact))
    .map((v) => [v.id, v.help, v.nodes.slice(0, 3).map((n) => [n.html.slice(0, 150), n.any[0]?.message])]);
}
