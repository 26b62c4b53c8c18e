// SPDX-License-Identifier: GPL-3.0-or-later
// browser.mjs - headless Chromium with an empty profile, for the tests of the web page.
import { require, url } from './tools.mjs';

const { chromium } = require('playwright-core');

// Debian's wrapper script is passed over where the program itself is known.
export async function openBrowser() {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: [
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
}

// A tab in a context of its own. `faults` collects what the page complains of: errors nobody caught,
// what the content security policy refused, requests that went elsewhere.
export async function openTab(browser, { theme = 'light', width = 1200, token } = {}) {
  const context = await browser.newContext({ colorScheme: theme, viewport: { width, height: 900 },
                                             acceptDownloads: true });
  const tab = await context.newPage();
  tab.setDefaultTimeout(10000);
  const faults = [];
  let expected = () => false; // of the lines that Chromium writes for every 4xx, say
  tab.on('pageerror', (error) => faults.push(String(error.stack ?? error)));
  tab.on('console', (line) => {
    if (line.type() === 'error' && !expected(line.text()))
      faults.push(line.text());
  });
  tab.on('request', (request) => {
    if (!request.url().startsWith(url) && !/^(blob|data):/.test(request.url()))
      faults.push(`asks ${request.url()}`);
  });
  if (token)
    await context.addInitScript((t) => sessionStorage.setItem('bcd-token', t), token);
  return { tab, context, faults, allow: (test) => { expected = test; } };
}

// Goes there and waits until the view says something.
export async function visit(tab, hash) {
  if (tab.url().startsWith(url))
    await tab.evaluate((h) => { location.hash = h; }, hash);
  else
    await tab.goto(`${url}/${hash}`);
  await tab.locator('main h1').first().waitFor();
}
