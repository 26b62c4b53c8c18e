// SPDX-License-Identifier: GPL-3.0-or-later
// panels.js - the plots of each observable. A curve is { record, name, table, series }: the first is the
// job looked at, the others lie over it.
import { curl } from './api.js';
import { h } from './dom.js';
import { localSlope, ratio, rootOfTime, singleFile } from './guides.js';
import { plot } from './plot.js';
import { num, observableNames, withError } from './words.js';
import { valueOf } from './record.js';
import { trajectory } from './trajectory.js';

const lines = (name, curves) => curves.flatMap(({ record }) =>
  [curl(`/v1/jobs/${record.id}/results/${name}.csv`), curl(`/v1/jobs/${record.id}/results/${name}.svg`)]);
const fileOf = (name, curves) => `${name}-${curves.map((c) => c.record.id).join('-')}`.slice(0, 100);
const legendOf = (curves, kind) => curves.map((c) => ({ series: c.series, name: c.name, kind, group: `c${c.series}` }));
const minus = (a, b) => a.map((v, i) => v - b[i]);
const plus = (a, b) => a.map((v, i) => v + b[i]);

// What t^½ is compared with: what is known, or what fits where the curve runs like that.
function half({ record, table }) {
  const known = singleFile(record), fitted = known === null ? rootOfTime(table) : null;
  return known !== null ? { factor: known, name: '2 (1/ρ − σ) √(D t / π), many rods' }
    : fitted && { factor: fitted.factor, name: `${num(fitted.factor, 3)} t^½, fitted to lags ${num(fitted.from, 2)} to ${num(fitted.to, 2)}` };
}

function msd(name, curves) {
  const marks = [], legend = legendOf(curves, 'both');
  for (const { table, series, name: who } of curves) {
    const group = `c${series}`, { lag, msd: y, stderr } = table;
    marks.push({ kind: 'band', x: lag, low: minus(y, stderr), high: plus(y, stderr), series, group },
               { kind: 'line', x: lag, y, series, group, silent: true },
               { kind: 'points', x: lag, y, error: stderr, series, group, name: who });
    if (Array.isArray(table.theory))
      marks.push({ kind: 'line', dash: true, x: lag, y: table.theory, series: 7, group: 'theory',
                   name: `exact theory${curves.length > 1 ? `, ${who}` : ''}` });
  }
  const [{ table, record }] = curves, { lag } = table;
  const free = 2 * record.derived.diffusion;
  if (marks.some((m) => m.group === 'theory'))
    legend.push({ series: 7, name: 'exact theory', kind: 'dash', group: 'theory' });
  marks.push({ kind: 'slope', x: lag, y: lag.map((t) => free * t), group: 't' });
  legend.push({ name: '2 D t, a rod alone', kind: 'guide', group: 't' });
  const guide = half(curves[0]);
  if (guide) {
    marks.push({ kind: 'slope', other: true, x: lag, y: lag.map((t) => guide.factor * Math.sqrt(t)), group: 'half' });
    legend.push({ name: guide.name, kind: 'other guide', group: 'half' });
  }
  const notes = [table.theory === null && `No theory: ${table.theory_reason}.`,
                 !guide && 'The slope is nowhere a half: no t^½ is drawn.'].filter(Boolean);
  const slopes = curves.map((c) => ({ ...localSlope(c.table.lag, c.table.msd, c.table.stderr), series: c.series, name: c.name }));
  const x = { label: 'lag t', name: 'lag', kind: 'log', both: true };
  return [
    plot({ title: observableNames.msd, marks, legend, x, y: { label: 'MSD', name: 'msd', kind: 'log', both: true },
           height: 340, key: 'msd', file: fileOf(name, curves), curl: lines(name, curves), note: notes.join(' ') || null }),
    plot({ title: 'Local slope d log MSD / d log t', x, height: 340, key: 'slope',
           y: { label: 'slope', name: 'slope', kind: 'linear' }, file: fileOf('slope', curves),
           legend: legendOf(curves, 'both'), curl: lines(name, curves),
           note: 'Error bars take the two lags for independent. They are not, and the true error is smaller.',
           marks: [{ kind: 'level', y: 1 }, { kind: 'level', y: 0.5 },
                   ...slopes.flatMap((c) => [
                     { kind: 'line', x: c.x, y: c.y, series: c.series, group: `c${c.series}`, silent: true },
                     { kind: 'points', x: c.x, y: c.y, error: c.error, series: c.series, group: `c${c.series}`, name: c.name }])] }),
    ...compared(name, curves, x), spreading(name, curves),
  ];
}

function compared(name, [first, ...others], x) {
  if (!others.length)
    return [];
  const ratios = others.map((c) => ({ ...ratio(first.table, c.table), series: c.series, name: c.name })).filter((c) => c.x.length);
  return [plot({ title: `MSD over that of ${first.name}`, x, height: 300, key: 'ratio', file: fileOf('ratio', [first, ...others]),
    y: { label: 'ratio', name: 'ratio', kind: 'linear', both: true }, legend: legendOf(others, 'both'), curl: lines(name, others),
    note: 'Error bars take jobs for independent; with the same seed much of the noise is common, and the true error is smaller.',
    marks: [{ kind: 'level', y: 1 }, ...ratios.flatMap((c) => [
      { kind: 'line', x: c.x, y: c.y, series: c.series, group: `c${c.series}`, silent: true },
      { kind: 'points', x: c.x, y: c.y, error: c.error, series: c.series, group: `c${c.series}`, name: c.name }])] })];
}

// Half the MSD by time: the diffusion coefficient, where it is the same at long lags.
function spreading(name, curves) {
  const at = ({ lag, msd: y, stderr }, i) => [num(lag.at(i)), withError(y.at(i) / 2 / lag.at(i), stderr?.at(i) / 2 / lag.at(i))];
  return h('section', { class: 'figure' }, h('h3', null, 'Spreading, MSD / 2 t'), h('div', { class: 'scroll' },
    h('table', null, h('thead', null, h('tr', null, ['job', 'shortest lag', 'MSD / 2 t', 'longest lag', 'MSD / 2 t', 'D of a rod alone']
      .map((t, i) => h('th', { class: i ? 'number' : null }, t)))),
    h('tbody', null, curves.map((c) => h('tr', null, h('td', null, c.name),
      [...at(c.table, 0), ...at(c.table, -1), num(c.record.derived.diffusion)].map((v) => h('td', { class: 'number' }, v))))))),
    h('p', { class: 'note' }, 'At long lags a diffusion coefficient, once the local slope is 1; below that it still falls with t.'));
}

// Of more rows than a plot can show every so manieth; a note says so.
const ROWS = 3000;
function thinned(curve) {
  const { table } = curve, rows = Math.max(...Object.values(table).filter(Array.isArray).map((v) => v.length));
  const step = Math.ceil(rows / ROWS);
  return step < 2 ? curve : { ...curve, step, table: Object.fromEntries(Object.entries(table).map(([name, v]) =>
    [name, Array.isArray(v) ? v.filter((_, i) => i % step === 0) : v])) };
}

// Profiles over x or r: error bars, theory, and the distance from it in standard errors.
function profile(name, all) {
  const curves = all.map(thinned), [{ step }] = curves;
  const along = name === 'pair_distribution' ? 'r' : 'x';
  const unit = name === 'pair_distribution' ? 'distance r' : 'x';
  const of = valueOf(curves[0].table), marks = [], residuals = [], legend = legendOf(curves, 'points');
  for (const { table, series, name: who } of curves) {
    const group = `c${series}`;
    if (Array.isArray(table.theory))
      marks.push({ kind: 'line', x: table[along], y: table.theory, dash: curves.length > 1, silent: curves.length > 1,
                   series: curves.length > 1 ? series : 7, group: 'theory', name: 'exact theory' });
    marks.push({ kind: 'points', x: table[along], y: table[of], error: table.stderr, series, group, name: who });
    if (Array.isArray(table.z))
      residuals.push({ kind: 'points', x: table[along], y: table.z, series, group, name: who });
  }
  const bare = curves.filter(({ table }) => !Array.isArray(table.theory));
  if (marks.some((m) => m.group === 'theory'))
    legend.push({ series: curves.length > 1 ? 0 : 7, name: 'exact theory', group: 'theory',
                  kind: curves.length > 1 ? 'dash' : 'line' });
  const [{ table }] = curves;
  const drawn = [plot({ title: observableNames[name], marks, legend, height: 300, key: name, file: fileOf(name, curves),
    x: { label: unit, name: along, kind: 'linear' }, y: { label: observableNames[name].toLowerCase(), name: of, kind: 'linear', both: true },
    curl: lines(name, curves),
    note: step ? `Every ${step}th row is drawn; CSV by curl has all.`
      : bare.length && table.theory_reason ? `No theory: ${table.theory_reason}.` : null })];
  if (residuals.length)
    drawn.push(plot({ title: `${observableNames[name]}: distance from theory in standard errors`, height: 300, key: `${name}-z`,
      marks: [...[-2, 0, 2].map((y) => ({ kind: 'level', y })), ...residuals], legend: legendOf(curves, 'points'),
      x: { label: unit, name: along, kind: 'linear' }, y: { label: 'z', name: 'z', kind: 'linear' },
      file: fileOf(`${name}-z`, curves), curl: lines(name, curves),
      note: Number.isFinite(table.chi_square) ? `χ² ${num(table.chi_square, 4)} of ${table.degrees_of_freedom} rows, ` +
        `p ${num(table.p_value, 2)} (${table.p_value_assumes ?? ''})` : null }));
  return drawn;
}

function clusterSizes(name, curves) {
  const one = curves.length === 1, kind = one ? 'bars' : 'points';
  const there = (c) => c.table.size.map((_, i) => i).filter((i) => c.table.fraction[i] > 0);
  const marks = curves.map((c) => {
    const at = there(c), pick = (column) => at.map((i) => c.table[column][i]);
    return { kind, x: pick('size'), y: pick('fraction'), error: pick('stderr'), series: c.series,
             group: `c${c.series}`, name: c.name };
  });
  const size = { label: 'rods in a cluster', name: 'size', kind: 'linear', both: !one };
  return [plot({ title: observableNames.cluster_sizes, marks, legend: one ? [] : legendOf(curves, kind), x: size,
                 y: { label: 'fraction of clusters', name: 'fraction', kind: 'log', both: true }, height: 300, key: name,
                 file: fileOf(name, curves), curl: lines(name, curves) })];
}

function contactForce(name, curves) {
  const marks = curves.map((c) => ({ kind: 'points', x: c.table.force, y: c.table.probability_density,
    error: c.table.stderr, series: c.series, group: `c${c.series}`, name: c.name }));
  return [plot({ title: observableNames.contact_force, marks, legend: legendOf(curves, 'points'), height: 300, key: name,
                 x: { label: 'force', name: 'force', kind: 'linear', both: true },
                 y: { label: 'probability density', name: 'probability_density', kind: 'log', both: true },
                 file: fileOf(name, curves), curl: lines(name, curves) })];
}

// One number: with error, theory and distance, beside those of the other jobs.
function single(name, curves) {
  return [h('section', { class: 'figure' }, h('h3', null, observableNames[name] ?? name), h('div', { class: 'scroll' },
    h('table', null, h('thead', null, h('tr', null, ['job', 'value', 'theory', 'z', 'of the time step']
      .map((t, i) => h('th', { class: i ? 'number' : null }, t)))),
    h('tbody', null, curves.map(({ name: who, table }) => h('tr', null, h('td', null, who),
      h('td', { class: 'number' }, withError(table[valueOf(table)], table.stderr)),
      [table.theory, table.z, table.time_step_error].map((v) => h('td', { class: 'number' }, num(v)))))))),
    h('details', { class: 'source' }, h('summary', null, 'The same data by curl'), lines(name, curves)
      .map((line) => h('code', null, line))))];
}

// What there is no plot for: every column that is a number.
function any(name, curves) {
  const columns = Object.entries(curves[0].table).filter(([, v]) => Array.isArray(v)).map(([key]) => key);
  if (columns.length < 2)
    return single(name, curves);
  const [x, y] = columns;
  return [plot({ title: observableNames[name] ?? name, height: 300, key: name, legend: legendOf(curves, 'points'),
    marks: curves.map((c) => ({ kind: 'points', x: c.table[x], y: c.table[y], error: c.table.stderr ?? undefined,
      series: c.series, group: `c${c.series}`, name: c.name })),
    x: { label: x, kind: 'linear', both: true }, y: { label: y, kind: 'linear', both: true },
    file: fileOf(name, curves), curl: lines(name, curves) })];
}

export const panels = {
  msd, density: profile, contact_density: profile, pair_distribution: profile, cluster_sizes: clusterSizes,
  contact_force: contactForce, energy: single, current: single, any,
  trajectory: (name, [curve]) => (curve ? [trajectory(curve.record, curve.table, lines(name, [curve]))] : []),
};
