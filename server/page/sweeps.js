// SPDX-License-Identifier: GPL-3.0-or-later
// sweeps.js - all sweeps, newest first, as they go on.
import { curl, get } from './api.js';
import { h, paced, replace, shellLine } from './dom.js';
import { live } from './live.js';
import { link, print, put, value } from './place.js';
import { moment, nameOf, states } from './words.js';

export const title = 'Sweeps';
const LESS = ['owner', 'submitted']; // not on narrow screens

export async function show(main, { query }, signal) {
  const body = h('tbody'), more = h('p', { class: 'row' }), told = h('p', { class: 'fault', role: 'alert' });
  const path = `/v1/sweeps${query.length ? `?${print(query)}` : ''}`;
  replace(main, h('h1', null, 'Sweeps'), told, h('div', { class: 'scroll' }, h('table', { class: 'sweeps' }, h('thead', null, h('tr', null,
    ['sweep', 'points', 'ended', ...Object.keys(states), 'owner', 'submitted'].map((t) =>
      h('th', { class: ['points', ...Object.keys(states)].includes(t) ? 'number' : LESS.includes(t) ? 'less' : null }, t)))), body)), more,
    h('details', { class: 'source' }, h('summary', null, 'The same list by curl'), shellLine(curl(path))));

  async function load() {
    try {
      const page = await get(path, signal);
      told.textContent = '';
      replace(body, page.sweeps.map((sweep) => h('tr', null,
        h('td', null, h('a', { href: link('sweep', sweep.id) }, nameOf(sweep)),
          sweep.tags.map((tag) => h('span', { class: 'tag' }, tag)), sweep.cancelled_at && ' (cancelled)'),
        h('td', { class: 'number' }, sweep.jobs),
        h('td', null, h('progress', { max: 1, value: sweep.progress, 'aria-label': 'Share of points that have ended' }),
          ` ${Math.floor(sweep.progress * 100)} %`),
        Object.keys(states).map((state) => h('td', { class: 'number' }, sweep.states[state] || '')),
        h('td', { class: 'less' }, sweep.owner), h('td', { class: 'less' }, moment(sweep.submitted_at)))));
      if (!page.sweeps.length)
        replace(body, h('tr', null, h('td', { colspan: 10 }, 'There are none yet: ', h('a', { href: '#submit' }, 'Submit'),
                                      ' makes them, and POST /v1/sweeps.')));
      replace(more, value(query, 'cursor') && h('a', { href: link('sweeps', '', put(query, 'cursor')) }, 'First page'),
              page.next && h('a', { href: link('sweeps', '', put(query, 'cursor', page.next)) }, 'Next page'));
    } catch (error) {
      if (!signal.aborted)
        told.textContent = error.message;
    }
  }
  const reload = paced(() => 700, () => signal.aborted || load());
  live.addEventListener('counts', reload, { signal });
  await load();
}
