// SPDX-License-Identifier: GPL-3.0-or-later
// job.js - one job: how far it is, its plots, with others over them; what was chosen for it and why.
import { ask, curl, get } from './api.js';
import { action, h, replace, shellLine } from './dom.js';
import { live } from './live.js';
import { go, link, note, place, put, value } from './place.js';
import { panels } from './panels.js';
import { deed, jobActions, jobOf, progressBar, stateWord, submitLink } from './parts.js';
import { chosen, errors } from './record.js';
import { ended, nameOf, summary } from './words.js';

export const title = 'Job';
const MOST = 8; // as many as there are colours

export async function show(main, { id, query }, signal) {
  let record = await get(`/v1/jobs/${id}`, signal);
  let others = (value(query, 'with') ?? '').split(',').filter((o) => o && o !== id).slice(0, MOST - 1);
  const head = h('div'), plots = h('div', { class: 'plots' }), told = h('p', { class: 'fault', role: 'alert' });
  const facts = h('div');
  replace(main, head, overlayForm(), told, plots, facts);

  const line = h('p'), buttons = h('p', { class: 'row' }), notices = h('div');
  replace(head, h('div', { class: 'head' }, h('div', null, h('h1', null, nameOf(record)), line), buttons), notices);
  let shown; // what could be done with it then

  function showHead() {
    replace(line, stateWord(record.state), ' ', h('span', { class: 'progress' }, progressBar(record)), ' · ',
            summary(record.job),
            record.tags.map((tag) => h('a', { class: 'tag', href: link('jobs', '', [['tag', tag]]) }, tag)));
    if (shown !== deed(record))
      replace(buttons, jobActions(record, update), record.state === 'done' && action('Run anew', async () => {
        const { json } = await ask('POST', '/v1/jobs?force=true', jobOf(record));
        go('job', json.id);
      }), h('a', { href: submitLink(jobOf(record)) }, 'Change and submit'));
    shown = deed(record);
    replace(notices, record.error && h('p', { class: 'notice' }, record.error),
            Object.entries(record.derived).filter(([name]) => name.endsWith('_warning'))
              .map(([, text]) => h('p', { class: 'notice' }, text)));
  }

  function update(now) {
    const before = record.state;
    record = now;
    showHead();
    if (before !== record.state && ended(record.state))
      load();
  }

  async function load() {
    replace(facts, chosen(record));
    if (record.state !== 'done') {
      replace(plots, h('p', { class: 'wait' }, ended(record.state) ? 'It left no results.'
        : 'The plots come when it is done.'));
      return;
    }
    told.textContent = '';
    const all = [record];
    for (const other of others)
      try {
        all.push(await get(`/v1/jobs/${other}`, signal));
      } catch (error) {
        told.textContent += `${other}: ${error.message} `;
      }
    const tables = await Promise.all(all.map((r) => r.state === 'done' ? tablesOf(r) : {}));
    if (signal.aborted)
      return;
    const drawn = [];
    const last = (name) => name === 'trajectory'; // as wide as the page
    for (const name of Object.keys(record.job.observables).sort((a, b) => last(a) - last(b))) {
      const curves = all.map((r, series) => ({ record: r, name: nameOf(r), table: tables[series][name], series }))
        .filter((c) => c.table);
      drawn.push(...(panels[name] ?? panels.any)(name, curves));
    }
    replace(plots, drawn);
    replace(facts, errors(tables[0]), chosen(record));
    for (const r of all.slice(1).filter((r) => r.state !== 'done'))
      told.textContent += `${nameOf(r)} is ${r.state} and has no results. `;
  }

  async function tablesOf(r) {
    const names = Object.keys(r.job.observables);
    const tables = await Promise.all(names.map((name) => get(`/v1/jobs/${r.id}/results/${name}`, signal)));
    return Object.fromEntries(names.map((name, i) => [name, tables[i]]));
  }

  function overlayForm() {
    const input = h('input', { id: 'overlay', value: others.join(' '), spellcheck: 'false', autocomplete: 'off',
                               placeholder: 'ids of other jobs, to be drawn over this one' });
    return h('form', { class: 'filter', onsubmit: (event) => {
      event.preventDefault();
      others = [...new Set(input.value.split(/[\s,]+/))].filter((o) => o && o !== id).slice(0, MOST - 1);
      note(put(place().query, 'with', others.join(',')));
      load();
    } }, h('label', { for: 'overlay' }, 'Over it'), input, h('button', { type: 'submit' }, 'Draw'));
  }

  live.addEventListener('job', async ({ detail }) => {
    if (detail.id !== id)
      return;
    if (detail.state === 'running') {
      const before = record.state;
      record = { ...record, state: 'running', progress: detail.progress,
                 started_at: record.started_at ?? new Date().toISOString() };
      if (before === 'running')
        replace(head.querySelector('.progress'), progressBar(record));
      else
        showHead();
    } else {
      try {
        update(await get(`/v1/jobs/${id}`, signal));
      } catch { /* the next event, or the next link */ }
    }
  }, { signal });
  live.addEventListener('link', async ({ detail }) => {
    if (detail.up)
      get(`/v1/jobs/${id}`, signal).then(update, () => {});
  }, { signal });

  showHead();
  await load();
  main.append(h('details', { class: 'source' }, h('summary', null, 'The record and all results by curl'),
    shellLine(curl(`/v1/jobs/${id}`)), shellLine(curl(`/v1/jobs/${id}/results`))));
}
