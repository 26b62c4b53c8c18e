// SPDX-License-Identifier: GPL-3.0-or-later
// family.js - a sweep's plots: a curve for each value of one axis, a number over two axes.
import { curl } from './api.js';
import { h, shellLine } from './dom.js';
import { heat, show as written } from './heat.js';
import { link, note, place, put, value as asked } from './place.js';
import { plot } from './plot.js';
import { STYLES } from './plot_draw.js';
import { axisName, columnsOf, grouped, isCurve, isSeed, mean, meanCurve, same, scalar } from './points.js';
import { observableNames } from './words.js';

// Axes that go side by side with another are told by that one.
const together = (sweep, a, b) => a === b || (sweep.zip ?? []).some((group) => group.includes(a) && group.includes(b));

// Points at the fixed values of all axes but some (and but the seed, over which is averaged).
function those({ sweep, points, fixed }, but) {
  const held = Object.keys(sweep.axes).filter((name) => !isSeed(name) && sweep.axes[name].length > 1 &&
    !but.some((other) => together(sweep, name, other)));
  return points.filter((p) => held.every((name) => same(p.values[name], fixed[name])));
}

export function family(spec) {
  const { sweep, observable, curves, x, which, id, points } = spec;
  const first = points.find((p) => p.table).table, over = isCurve(first);
  const title = `${observableNames[observable] ?? observable}${curves ? ` by ${axisName(curves)}` : ''}`;
  const values = curves ? sweep.axes[curves] : [null];
  const some = values.length > STYLES
    ? Array.from({ length: STYLES }, (_, i) => values[Math.round(i * (values.length - 1) / (STYLES - 1))]) : values;
  const columns = over ? columnsOf(first) : { x: axisName(x ?? ''), y: which };
  const marks = [], legend = [], within = those(spec, over ? [curves] : [curves, x]).filter((p) => p.table);
  const at = curves ? grouped(within, curves) : () => within;
  some.forEach((v, series) => {
    const mine = at(v);
    const curve = !mine.length ? null : over ? meanCurve(mine, columns) : along(sweep, mine, x, which);
    if (!curve || !curve.x.length)
      return;
    const group = `c${series}`, name = curves ? `${axisName(curves)} ${written(v)}` : which;
    if (curve.theory && over)
      marks.push({ kind: 'line', dash: true, x: curve.x, y: curve.theory, series, group: 'theory', silent: true });
    else
      marks.push({ kind: 'line', x: curve.x, y: curve.y, series, group, silent: true });
    marks.push({ kind: 'points', x: curve.x, y: curve.y, error: curve.error, series, group, name });
    legend.push({ series, name, kind: 'both', group });
  });
  if (marks.some((m) => m.group === 'theory'))
    legend.push({ series: 0, name: 'exact theory', kind: 'dash', group: 'theory' });
  if (!marks.length)
    return h('p', { class: 'figure' }, 'No point of these values is done yet.');
  const log = observable === 'msd' && over ? 'log' : 'linear', base = `/v1/sweeps/${id}/results/${observable}`;
  return plot({ title, marks, legend, height: 360, key: 'family', file: `${observable}-${id}`,
    x: { label: columns.x, name: columns.x, kind: log, both: true },
    y: { label: columns.y, name: columns.y, kind: log, both: true },
    note: some.length < values.length ? `${some.length} of ${values.length} values are drawn.` : null,
    curl: [curl(`${base}.csv`), curl(`${base}.svg${curves ? `?curves=${encodeURIComponent(curves)}` : ''}`)] });
}

// Single numbers along an axis, one for each of its values that is a number.
function along(sweep, points, x, which) {
  const out = { x: [], y: [], error: [], theory: null }, at = grouped(points, x);
  for (const v of sweep.axes[x] ?? []) {
    const there = at(v);
    if (typeof v !== 'number' || !there.length)
      continue;
    const { value, error } = mean(there.map((p) => scalar(p.table, which)), errorsOf(there, which));
    out.x.push(v);
    out.y.push(value);
    out.error.push(error);
  }
  return out;
}
// The error bar belongs to the value of a single number, and to no other column.
const errorsOf = (points, which) => (['energy', 'current'].includes(which) ? points.map((p) => p.table?.stderr) : null);

const CELLS = 20000; // more cannot be told apart

export function picture(spec) {
  const { sweep, observable, x, y, which, id } = spec;
  if (sweep.axes[x].length * sweep.axes[y].length > CELLS)
    return h('p', { class: 'figure' }, `A map of more than ${CELLS} cells is not drawn; the table has them.`);
  const at = grouped(those(spec, [x, y]), x);
  const columns = sweep.axes[x].map((v) => grouped(at(v), y));
  const cell = (i, j) => {
    const there = columns[i](sweep.axes[y][j]);
    if (!there.length)
      return null;
    const good = there.filter((p) => p.table);
    const { value, error, count } = good.length ? mean(good.map((p) => scalar(p.table, which)), errorsOf(good, which)) : {};
    const filters = Object.entries(there[0].values).filter(([name]) => !isSeed(name))
      .filter(([, v]) => typeof v === 'number' || typeof v === 'string').map(([name, v]) => [axisName(name), String(v)]);
    return { value, error, count, state: there[0].state,
             href: there.length === 1 ? link('job', there[0].job) : link('jobs', '', [['sweep', id], ...filters]) };
  };
  const base = `/v1/sweeps/${id}/results/${observable}`, log = asked(place().query, 'scale') === 'log';
  const paths = [`${base}.csv`];
  if (servers(spec))
    paths.push(`${base}.svg?x=${x}&y=${y}${log ? '&scale=log' : ''}`);
  return heat({ title: `${which} over ${axisName(x)} and ${axisName(y)}`, name: which, cell, file: `${observable}-map-${id}`,
    x: { label: axisName(x), values: sweep.axes[x] }, y: { label: axisName(y), values: sweep.axes[y] },
    curl: h('details', { class: 'source' }, h('summary', null, 'The same data by curl'), paths.map((path) => shellLine(curl(path)))),
    log, kept: (now) => note(put(place().query, 'scale', now ? 'log' : null)) });
}

// The server draws the number itself, and other axes at their first value.
const servers = ({ sweep, fixed, observable, which, x, y }) => which === observable &&
  Object.entries(fixed).every(([name, v]) => name === x || name === y || same(v, sweep.axes[name][0]));
