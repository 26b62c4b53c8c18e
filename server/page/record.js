// SPDX-License-Identifier: GPL-3.0-or-later
// record.js - what was chosen for a job and why, how large its errors are, its record as a whole.
import { h } from './dom.js';
import { download } from './save.js';
import { moment, num, observableNames } from './words.js';

const why = {
  curvature: 'the curvature of the potential', tolerance: 'the tolerance', msd: 'the shortest lag of msd',
  contact_density: 'the gap of contact_density', contacts: 'rods in contact', free: 'nothing: a sixteenth of the time',
};
const asked = {
  method: (v, job) => (job.method === 'auto' ? `${v} (auto)` : v),
  time_step: (v, job) => (job.time_step === 'auto' ? `${num(v)} (auto)` : num(v)),
  sample_every: (v, job) => (job.sample_every === 'auto' ? `${num(v)} (auto)` : num(v)),
  time_step_limited_by: (v) => why[v] ?? v,
};
const names = { diffusion: 'D', time_step_limited_by: 'the step follows', noise_per_gap: 'noise of a step per mean gap',
                free_length: 'free length' };

function fact(name, value) {
  return h('div', null, h('dt', null, names[name] ?? name.replaceAll('_', ' ')), h('dd', null, value));
}

export function chosen(record) {
  const { derived, job, outcome } = record;
  const text = JSON.stringify(record, null, 2);
  return h('section', null, h('h2', null, 'What was chosen for it, and why'), h('dl', { class: 'facts' },
    Object.entries(derived).filter(([name]) => !name.endsWith('_warning'))
      .map(([name, v]) => fact(name, asked[name]?.(v, job) ?? num(v, 5))),
    fact('submitted', moment(record.submitted_at)), fact('started', moment(record.started_at)),
    fact('finished', moment(record.finished_at)), fact('owner', record.owner),
    outcome && fact('realizations done', num(outcome.realizations, 9)),
    outcome?.reused_realizations ? fact('of these from', h('a', { href: `#job/${outcome.reused_from}` },
      `${outcome.reused_from} (${outcome.reused_realizations})`)) : null,
    outcome?.target && fact('target', outcome.target.reached ? 'reached' : `not reached: ${outcome.target.stopped_by}`),
    outcome?.target && fact('relative error reached', num(outcome.target.relative_error, 3))),
  h('details', null, h('summary', null, 'The record'), h('p', null, h('button', { type: 'button', class: 'quiet',
    onclick: () => download(`${record.id}.json`, 'application/json', text) }, 'Save as JSON')),
    h('pre', { tabindex: '0' }, text)));
}

const square = (values) => values.reduce((sum, v) => sum + (Number.isFinite(v) ? v * v : 0), 0);

// Root of the sum of squares of the errors over that of the values; of values over decades the root
// mean square of the rows' shares.
function relative(table, of, column) {
  const values = [table[of]].flat(), errs = [table[column]].flat();
  if (!errs.some(Number.isFinite))
    return null;
  if (['msd', 'fraction', 'probability_density'].includes(of)) {
    const shares = values.map((v, i) => errs[i] / v).filter(Number.isFinite);
    return shares.length ? Math.sqrt(square(shares) / shares.length) : null;
  }
  return square(values) > 0 ? Math.sqrt(square(errs) / square(values)) : null;
}

const SKIP = ['lag', 'x', 'r', 'size', 'force', 'time', 'rod', 'stderr', 'samples'];
export const valueOf = (table) => Object.keys(table).find((name) => !SKIP.includes(name));

export function errors(tables) {
  const percent = (share) => (share === null ? '–' : `${num(share * 100, 3)} %`);
  const rows = Object.entries(tables).filter(([, table]) => table.stderr !== null).map(([name, table]) => {
    const of = valueOf(table);
    return h('tr', null, h('td', null, observableNames[name] ?? name),
      h('td', { class: 'number' }, percent(relative(table, of, 'stderr'))), h('td', null, table.stderr_from ?? ''),
      h('td', { class: 'number' }, percent(relative(table, of, 'time_step_error'))),
      h('td', null, table.time_step_error_from ?? table.time_step_error_reason ?? ''),
      h('td', { class: 'number' }, table.chi_square === undefined || table.chi_square === null ? '–'
        : `${num(table.chi_square, 4)} / ${table.degrees_of_freedom}`),
      h('td', { class: 'number' }, num(table.p_value, 2)));
  });
  return rows.length ? h('section', null, h('h2', null, 'Errors'), h('div', { class: 'scroll' },
    h('table', null, h('thead', null, h('tr', null, h('th', null, 'observable'),
      h('th', { class: 'number' }, 'statistical'), h('th', null, 'from'), h('th', { class: 'number' }, 'of the time step'),
      h('th', null, 'from'), h('th', { class: 'number' }, 'χ² / rows'), h('th', { class: 'number' }, 'p'))),
    h('tbody', null, rows))), h('p', { class: 'note' },
    'Shares of the values, all rows together; one standard error. χ² against exact theory, where there is one; ',
    'it takes rows for independent.')) : null;
}
