// SPDX-License-Identifier: GPL-3.0-or-later
// main.js - the frame: which view is shown, who looks, day or night, whether the server is there.
import { ask, keepToken, token } from './api.js';
import { h, replace } from './dom.js';
import { follow, live } from './live.js';
import { place } from './place.js';

const views = {
  jobs: () => import('./jobs.js'), job: () => import('./job.js'),
  sweeps: () => import('./sweeps.js'), sweep: () => import('./sweep.js'),
  submit: () => import('./submit.js'), reports: () => import('./reports.js'),
};
const main = document.getElementById('main');
let leave = null; // ends what the view shown has begun

// A view is { title, show(main, place, signal) }: it fills `main`, and ends what it began with `signal`.
async function show(moved) {
  leave?.abort();
  const { signal } = leave = new AbortController();
  const where = place();
  const load = views[where.view];
  for (const a of document.querySelectorAll('nav a'))
    a.toggleAttribute('aria-current', a.dataset.view.split(' ').includes(where.view));
  for (const a of document.querySelectorAll('nav a[aria-current]'))
    a.setAttribute('aria-current', 'page');
  try {
    if (!load)
      throw new Error('There is no such view.');
    const view = await load();
    if (signal.aborted)
      return;
    document.title = `${where.id || view.title} - bcdd`;
    await view.show(main, where, signal);
    if (moved && !signal.aborted)
      main.focus({ preventScroll: true });
  } catch (error) {
    if (!signal.aborted)
      replace(main, h('h1', null, where.id || 'bcdd'), failure(error));
  }
}

function failure(error) {
  return h('p', { class: 'fault', role: 'alert' }, error.message, ' ',
           h('button', { type: 'button', onclick: () => show(false) }, 'Try again'));
}

addEventListener('hashchange', () => show(true));

// ------------------------------------------------------------------------ who looks
const dialog = document.getElementById('token'), who = document.getElementById('who');

function askForToken(why) {
  document.getElementById('token-why').textContent = why;
  document.getElementById('token-text').value = '';
  if (!dialog.open)
    dialog.showModal();
}
who.addEventListener('click', () => askForToken(token() ? 'A token is in use in this tab.'
                                                        : 'No token is in use.'));
document.addEventListener('token-wanted', ({ detail }) => askForToken(detail));
dialog.addEventListener('close', () => {
  const { returnValue } = dialog, text = document.getElementById('token-text').value.trim();
  if (returnValue === 'forget' || (returnValue === 'use' && text)) {
    keepToken(returnValue === 'forget' ? '' : text);
    begin();
    show(false);
  }
  dialog.returnValue = '';
});

async function greet() {
  try {
    const { json } = await ask('GET', '/v1/me');
    who.textContent = `${json.owner} (${json.role})`;
  } catch {
    who.textContent = 'token';
  }
}

function begin() {
  follow();
  greet();
}

// -------------------------------------------------------------------- day and night
const theme = document.getElementById('theme'), themes = ['light or dark', 'light', 'dark'];
function dress(name) {
  const known = themes.includes(name) ? name : themes[0];
  if (known === themes[0])
    delete document.documentElement.dataset.theme;
  else
    document.documentElement.dataset.theme = known;
  theme.textContent = known;
  theme.title = known === themes[0] ? 'As the system has it' : `Always ${known}`;
  return known;
}
theme.addEventListener('click', () => {
  const next = themes[(themes.indexOf(theme.textContent) + 1) % themes.length];
  localStorage.setItem('theme', dress(next));
});
dress(localStorage.getItem('theme'));

// -------------------------------------------------------------------- the connection
const connection = document.getElementById('connection');
live.addEventListener('link', ({ detail: { up, why } }) => {
  connection.textContent = up ? '' : why === 'no token' ? 'A token is needed' : 'No connection, trying again';
  connection.classList.toggle('down', !up);
});

begin();
show(false);
