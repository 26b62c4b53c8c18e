// SPDX-License-Identifier: GPL-3.0-or-later
// reports.js - which method reaches which error at what cost on this machine; what the methods do at
// the extremes.
import { ask, curl } from './api.js';
import { action, h, replace, shellLine } from './dom.js';
import { note, place, put, value } from './place.js';
import { withoutPlots } from './plot_state.js';
import { plot } from './plot.js';
import { stability } from './stability.js';
import { num } from './words.js';

export const title = 'Reports';
const WORK = '/v1/reports/work-precision';
const ERRORS = [['density_l1', 'density (L1)'], ['energy_error', 'energy'], ['contact_error', 'contact density'],
                ['drift_error', 'drift velocity']];

export async function show(main, { query }, signal) {
  const work = h('div'), state = h('div');
  let error = ERRORS.some(([name]) => name === value(query, 'error')) ? value(query, 'error') : 'density_l1';
  const pick = h('select', { id: 'error', onchange: () => {
    error = pick.value;
    note(put(withoutPlots(place().query), 'error', error));
    if (report)
      draw();
  } }, ERRORS.map(([name, text]) => h('option', { value: name }, text)));
  pick.value = error;
  let report = null;
  replace(main, h('h1', null, 'Reports'), h('h2', null, 'Work and precision'), h('p', null,
    'Error of the time step against the time of one core, method by method, each at several steps. ',
    'Left and below is better.'), h('p', { class: 'row' }, h('label', { for: 'error' }, 'Error of'), pick), state, work,
    h('details', { class: 'source' }, h('summary', null, 'The same data by curl'), shellLine(curl(`${WORK}?begin=false`)),
      shellLine(curl(`${WORK}.csv?begin=false`)), shellLine(curl(`${WORK}.svg?begin=false`))), stability());

  async function load() {
    let again = true;
    while (again && !signal.aborted) {
      again = false;
      try {
        const { status, json } = await ask('GET', `${WORK}?begin=false`, undefined, signal);
        if (status === 202) {
          replace(state, h('p', null, h('progress', { max: 1, value: json.progress, 'aria-label': 'Measured' }),
            ` being measured, ${Math.floor(json.progress * 100)} % `, action('Stop', () => ask('DELETE', WORK))));
          again = true;
          await new Promise((resolve) => setTimeout(resolve, 1000));
        } else {
          report = json;
          replace(state, measure('Measure anew'));
          draw();
        }
      } catch (fault) {
        if (!signal.aborted)
          replace(state, fault.status === 404 ? h('p', null, 'It has not been measured on this machine. ', measure('Measure it'))
            : h('p', { class: 'fault' }, fault.message));
      }
    }
  }
  const measure = (words) => action(words, async () => {
    await ask('POST', WORK);
    load();
  }, { title: 'About a minute of one core' });

  function draw() {
    const methods = [...new Set(report.scenes.flatMap((s) => s.entries.map((e) => e.method)))];
    replace(work, h('p', { class: 'note' }, Object.entries(report.machine).map(([name, v]) => `${name}: ${v}`).join('  ·  ')),
      h('div', { class: 'plots' }, report.scenes.flatMap((scene) => {
        const marks = [], legend = [];
        methods.forEach((method, i) => {
          const series = i, found = scene.entries.filter((e) => e.method === method && e.cost > 0 &&
            Number.isFinite(e[error]) && e[error] > 0).sort((a, b) => a.cost - b.cost);
          if (!found.length)
            return;
          const x = found.map((e) => e.cost), y = found.map((e) => e[error]);
          marks.push({ kind: 'line', x, y, series, group: method, silent: true },
                     { kind: 'points', x, y, error: found.map((e) => e.stderr?.[error]), series, group: method, name: method });
          legend.push({ series, name: method, kind: 'both', group: method });
        });
        if (!marks.length)
          return [];
        return [h('div', null, plot({ title: scene.name, marks, legend, height: 340, key: scene.name, file: `work-precision-${scene.name}`,
          x: { label: 'cost: ns of one core per rod and unit of time', name: 'cost', kind: 'log', both: true },
          y: { label: ERRORS.find(([name]) => name === error)[1], name: error, kind: 'log', both: true },
          curl: [curl(`${WORK}.csv`)] }), costs(scene))];
      })));
  }

  function costs({ cost_at_tolerance: at }) {
    const rows = Object.entries(at).filter(([, v]) => v > 0).sort(([, a], [, b]) => a - b);
    return rows.length ? h('details', null, h('summary', null, `Cost at ${num(100 * report.tolerance, 3)} % of ${
      report.tolerance_of?.replaceAll('_', ' ') ?? 'the error'}`), h('table', null, h('tbody', null, rows.map(([method, v]) =>
      h('tr', null, h('td', null, method), h('td', { class: 'number' }, `${num(v, 3)} ns`),
        h('td', { class: 'number' }, `${num(v / rows[0][1], 3)} times`)))))) : null;
  }
  await load();
}
