// SPDX-License-Identifier: GPL-3.0-or-later
// reports.js - which method reaches which error at what cost on this machine; what the methods do at
// the extremes.
import { ask, curl, get } from './api.js';
import { action, h, replace, shellLine } from './dom.js';
import { live } from './live.js';
import { note, place, put, value } from './place.js';
import { withoutPlots } from './plot_state.js';
import { plot } from './plot.js';
import { stabilityTable } from './stability.js';
import { moment, num } from './words.js';

export const title = 'Reports';
const WORK = '/v1/reports/work-precision', STABILITY = '/v1/reports/stability';
const ERRORS = [['density_l1', 'density (L1)'], ['energy_error', 'energy'], ['contact_error', 'contact density'],
                ['drift_error', 'drift velocity']];

const source = (path) => h('details', { class: 'source' }, h('summary', null, 'The same data by curl'),
  ['', '.csv', '.svg'].map((form) => shellLine(curl(`${path}${form}?begin=false`))));
const pass404 = (fault) => {
  if (fault.status !== 404)
    throw fault;
  return {};
};

export async function show(main, { query }, signal) {
  const work = h('div'), signs = h('div'), showSigns = stabilityTable(signs);
  let error = ERRORS.some(([name]) => name === value(query, 'error')) ? value(query, 'error') : 'density_l1';
  const pick = h('select', { id: 'error', onchange: () => {
    error = pick.value;
    note(put(withoutPlots(place().query), 'error', error));
    if (report)
      draw();
  } }, ERRORS.map(([name, text]) => h('option', { value: name }, text)));
  pick.value = error;
  let report = null;
  const measured = [
    { path: WORK, state: h('div'), time: 'about a minute', show: (json) => { report = json; draw(); } },
    { path: STABILITY, state: h('div'), time: 'about two minutes', show: (json) => showSigns(json.entries) },
  ];
  replace(main, h('h1', null, 'Reports'), h('h2', null, 'Work and precision'), h('p', null,
    'Error of the time step against the time of one core, method by method, each at several steps. ',
    'Left and below is better; an error bar that reaches the bottom is noise.'),
    h('p', { class: 'row' }, h('label', { for: 'error' }, 'Error of'), pick), measured[0].state, work, source(WORK),
    h('h2', null, 'Stability'), h('p', null, 'Every method at the extremes: right within 3 standard errors, biased by how much, ',
      'refused with a reason, or it ran and there is no telling. Anything else is a silent failure.'),
    measured[1].state, signs, source(STABILITY));

  // Asks once, and again as long as something is being measured.
  async function follow(one) {
    const { path, state } = one;
    let tells = null; // the bar, made once: what is made anew cannot be pressed
    one.following?.abort();
    const mine = one.following = new AbortController();
    signal.addEventListener('abort', () => mine.abort(), { once: true });
    const over = () => mine.signal.aborted;
    try {
      for (;;) {
        const { reports } = await get('/v1/reports', mine.signal);
        const { state: now, progress, measured_at: when } = reports.find((r) => path.endsWith(r.name));
        if (when !== one.when || (now === 'measuring' && !when)) {
          const { json } = await ask('GET', `${path}?begin=false`, undefined, mine.signal).catch(pass404);
          if (json && (json.state === undefined || json.entries))
            one.show(json);
          one.when = when;
        }
        if (now !== 'measuring') {
          const begin = action(when ? 'Measure anew' : 'Measure it', () => ask('POST', path).then(() => { follow(one); }),
                               { title: `Takes ${one.time} of one core` });
          replace(state, h('p', null, when ? `Measured ${moment(when)} on this machine. ` : 'It has not been measured on this machine. ', begin));
          return;
        }
        if (!tells) {
          tells = { bar: h('progress', { max: 1, 'aria-label': 'Measured' }), share: h('span') };
          replace(state, h('p', null, tells.bar, tells.share, ' ', action('Stop', () => ask('DELETE', path))));
        }
        tells.bar.value = progress;
        tells.share.textContent = ` being measured, ${Math.floor(progress * 100)} %`;
        await new Promise((resolve) => setTimeout(resolve, 1000));
      }
    } catch (fault) {
      if (!over())
        replace(state, h('p', { class: 'fault' }, fault.message));
    }
  }

  function draw() {
    const methods = [...new Set(report.scenes.flatMap((s) => s.entries.map((e) => e.method)))];
    replace(work, h('p', { class: 'note' }, Object.entries(report.machine).map(([name, v]) => `${name}: ${v}`).join('  ·  ')),
      h('div', { class: 'plots' }, report.scenes.flatMap((scene) => {
        const marks = [], legend = [];
        methods.forEach((method, i) => {
          const series = i, found = scene.entries.filter((e) => e.method === method && e.cost > 0 &&
            Number.isFinite(e[error]) && e[error] !== 0).sort((a, b) => a.cost - b.cost);
          if (!found.length)
            return;
          const x = found.map((e) => e.cost), y = found.map((e) => Math.abs(e[error]));
          marks.push({ kind: 'line', x, y, series, group: method, silent: true },
                     { kind: 'points', x, y, error: found.map((e) => e.stderr?.[error]), series, group: method, name: method });
          legend.push({ series, name: method, kind: 'both', group: method });
        });
        if (!marks.length)
          return [];
        return [h('div', null, plot({ title: scene.name, marks, legend, height: 340, key: scene.name, file: `work-precision-${scene.name}`,
          x: { label: 'core time, ns per rod and unit of time', name: 'cost', kind: 'log', both: true },
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
  live.addEventListener('link', ({ detail }) => detail.up && measured.forEach(follow), { signal });
  await Promise.all(measured.map(follow));
}
