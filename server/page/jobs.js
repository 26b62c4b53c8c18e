// SPDX-License-Identifier: GPL-3.0-or-later
// jobs.js - the queue: counts by state, a page of jobs as they go on, filters in the API's own words.
// Only the page shown is held: 10^5 jobs are as fast as ten.
import { curl, get } from './api.js';
import { h, paced, replace, shellLine } from './dom.js';
import { counts, live } from './live.js';
import { go, link, note, parse, place, print, put, show as words, value } from './place.js';
import { deed, jobActions, progressBar, stateWord } from './parts.js';
import { duration, moment, nameOf, states, summary } from './words.js';

export const title = 'Queue';
const STATES = Object.keys(states);
const SORTS = [['', 'newest first'], ['submitted', 'oldest first'], ['-finished', 'ended last first'],
               ['label', 'by label'], ['diameter', 'by diameter'], ['-derived.steps', 'longest first']];

// What is chosen to be compared stands in the link beside the filter, and stays from page to page.
const chosenOf = (query) => (value(query, 'compare') ?? '').split(',').filter(Boolean);

export async function show(main, { query: all }, signal) {
  const query = put(all, 'compare');
  const rows = new Map(); // id -> { record, row }
  const chosen = new Set(chosenOf(all)), here = (pairs) => put(pairs, 'compare', [...chosen].join(','));
  const body = h('tbody'), fault = h('p', { class: 'fault', role: 'alert' });
  const states = h('ul', { class: 'counts', 'aria-label': 'Jobs by state' });
  const compare = h('p', { class: 'row' }), more = h('p', { class: 'row' }), empty = h('p', { class: 'note' });
  const wait = h('p', { class: 'note' });
  replace(main, h('h1', null, 'Queue'), states, wait, filterForm(query, here), fault,
          h('div', { class: 'scroll' }, h('table', { class: 'jobs' }, h('thead', null, h('tr', null,
            h('th', null, h('span', { class: 'note' }, 'compare')), h('th', null, 'state'), h('th', null, 'job'),
            h('th', null, 'progress'), h('th', { class: 'less' }, 'method'),
            h('th', { class: 'less' }, 'owner'), h('th', { class: 'less' }, 'submitted'), h('th', null, 'do'))), body)),
          compare, empty, more,
          h('details', { class: 'source' }, h('summary', null, 'The same list by curl'),
            shellLine(curl(path(query)))));

  function choose() {
    const ids = [...chosen];
    replace(compare, ids.length > 1 && h('a', { class: 'button', href:
      link('job', ids[0], [['with', ids.slice(1).join(',')]]) }, `Compare ${ids.length} jobs in one plot`),
      ids.length > 0 && h('button', { type: 'button', class: 'quiet', onclick: () => {
        chosen.clear();
        body.querySelectorAll('input').forEach((box) => { box.checked = false; });
        choose();
      } }, `Choose none of ${ids.length}`));
    note(put(place().query, 'compare', ids.join(',')));
    turn();
  }

  let next = null;
  function turn() {
    replace(more, value(query, 'cursor') && h('a', { href: link('jobs', '', here(put(query, 'cursor'))) }, 'First page'),
            next && h('a', { rel: 'next', href: link('jobs', '', here(put(query, 'cursor', next))) }, 'Next page'));
  }

  function rowOf(record) {
    const bar = h('td', null, progressBar(record));
    return h('tr', { 'data-id': record.id },
      h('td', null, h('input', { type: 'checkbox', checked: chosen.has(record.id),
        'aria-label': `Compare ${nameOf(record)}`, onchange: ({ target }) => {
          chosen[target.checked ? 'add' : 'delete'](record.id);
          choose();
        } })),
      h('td', null, stateWord(record.state)),
      h('td', { class: 'what' }, h('a', { href: link('job', record.id) }, nameOf(record)),
        record.tags.map((tag) => h('a', { class: 'tag', href: link('jobs', '', [['tag', tag]]) }, tag)),
        h('small', null, summary(record.job), ' · ', Object.keys(record.job.observables).join(', '))),
      bar, h('td', { class: 'less' }, record.derived.method), h('td', { class: 'less' }, record.owner),
      h('td', { class: 'less' }, moment(record.submitted_at)),
      h('td', null, jobActions(record, update)));
  }

  // All of the row but what is pressed.
  function renew(old, record) {
    if (deed(old.record) !== deed(record)) {
      const row = rowOf(record), held = old.row.contains(document.activeElement) &&
        document.activeElement.dataset.do;
      old.row.replaceWith(row);
      if (held)
        row.querySelector('a')?.focus();
      return row;
    }
    [...rowOf(record).cells].slice(1, -1).forEach((cell, i) => old.row.cells[i + 1].replaceWith(cell));
    return old.row;
  }

  function update(record) {
    const old = rows.get(record.id);
    if (old)
      rows.set(record.id, { record, row: renew(old, record) });
  }

  // The page's rows in order; those that are there already stay where they are.
  function showRows(records) {
    const before = new Map(rows);
    let place = body.firstChild;
    rows.clear();
    for (const record of records) {
      const old = before.get(record.id), at = old?.row === place;
      const row = old ? renew(old, record) : rowOf(record);
      if (at)
        place = row.nextSibling;
      else
        body.insertBefore(row, place);
      rows.set(record.id, { record, row });
    }
    while (place) {
      const next = place.nextSibling;
      place.remove();
      place = next;
    }
  }

  async function load() {
    try {
      const page = await get(path(query), signal);
      fault.textContent = '';
      showRows(page.jobs);
      empty.textContent = page.jobs.length ? '' : query.length ? 'No job is like that.'
        : 'There are no jobs yet.';
      next = page.next;
      turn();
    } catch (error) {
      if (!signal.aborted)
        fault.textContent = error.errors?.length
          ? error.errors.map((e) => `${e.parameter}: ${e.detail}`).join('; ') : error.message;
    }
  }
  const reload = paced(() => 400, () => signal.aborted || load());

  // Made once: what is made anew several times a second cannot be clicked.
  const numbers = Object.fromEntries(STATES.map((state) => [state, h('b', null, '–')]));
  const now = value(query, 'state');
  replace(states, STATES.map((state) => h('li', null, h('button', { type: 'button',
    'aria-pressed': String(now === state), 'data-state': state, onclick: () => go('jobs', '',
      here(put(put(query, 'cursor'), 'state', now === state ? null : state))) }, stateWord(state), ' ', numbers[state]))));
  function count() {
    for (const state of counts ? STATES : [])
      numbers[state].textContent = counts[state].toLocaleString('en');
  }

  live.addEventListener('counts', count, { signal });
  live.addEventListener('lost', reload, { signal });
  live.addEventListener('link', ({ detail }) => detail.up && reload(), { signal });
  live.addEventListener('job', ({ detail }) => {
    const known = rows.get(detail.id);
    if (!known)
      return detail.state === 'queued' ? reload() : undefined;
    if (known.record.state !== detail.state && detail.state !== 'running')
      return refresh(detail.id);
    const record = { ...known.record, state: detail.state, progress: detail.progress,
                     started_at: known.record.started_at ?? new Date().toISOString() };
    if (known.record.state !== detail.state)
      return update(record);
    known.record = record;
    replace(known.row.cells[3], progressBar(record));
  }, { signal });
  async function refresh(id) {
    try {
      update(await get(`/v1/jobs/${id}`, signal));
    } catch { /* the list will tell */ }
  }
  async function waiting() {
    try {
      const { core_seconds: mine } = await get('/v1/me', signal);
      wait.textContent = mine.waiting > 0 ? `Yours that have not ended need ${duration(mine.waiting)} of one core.` : '';
    } catch { /* the list tells what is wrong */ }
  }
  live.addEventListener('counts', paced(() => 2000, () => signal.aborted || waiting()), { signal });
  count();
  if (chosen.size)
    choose();
  await Promise.all([load(), waiting()]);
}

function path(query) {
  const text = print(query);
  return `/v1/jobs${text ? `?${text}` : ''}`;
}

// The filter is the API's query string, as it would be typed behind the question mark.
function filterForm(query, here) {
  const sort = value(query, 'sort') ?? '';
  const rest = put(put(query, 'sort'), 'cursor');
  const input = h('input', { id: 'filter', type: 'search', spellcheck: 'false', autocomplete: 'off',
    placeholder: 'diameter=0.3..0.5&potential.amplitude>=6&tag=fig3', value: words(rest) });
  const order = h('select', { 'aria-label': 'Order', onchange: () => send() },
    (SORTS.some(([name]) => name === sort) ? SORTS : [...SORTS, [sort, sort]])
      .map(([name, text]) => h('option', { value: name }, text)));
  order.value = sort;
  const send = () => go('jobs', '', here(put(parse(input.value), 'sort', order.value)));
  return h('form', { class: 'filter', role: 'search', onsubmit: (event) => {
    event.preventDefault();
    send();
  } }, h('label', { for: 'filter' }, 'Filter'), input, order, h('button', { type: 'submit' }, 'Find'));
}
