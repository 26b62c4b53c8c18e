// SPDX-License-Identifier: GPL-3.0-or-later
// plot_draw.js - one picture of axes and marks as SVG; its looks are in plot.css.
//
// marks: { kind, series, ... } in the order of drawing:
//   line    x, y [, dash]             band   x, low, high
//   points  x, y [, error]            steps  x, y (bins around x)      bars  x, y [, error]
//   level   y                         slope  x, y [, other] (dotted, or short strokes)
// `series` is a number: colour, shape and dash go by it; from STYLES on shapes are hollow.
import { s } from './dom.js';
import { range, scale } from './plot_scale.js';

export const STYLES = 8;
let pictures = 0;

const isLog = (axis) => axis.kind === 'log';
const finite = (values) => values.filter(Number.isFinite);

export function limits(spec) {
  const xs = [], ys = [];
  const add = (list, values) => values.forEach((v) => list.push(v)); // there may be very many
  for (const mark of spec.marks) {
    if (mark.kind === 'level') {
      ys.push(mark.y);
      continue;
    }
    if (mark.kind === 'slope')
      continue;
    const half = ['steps', 'bars'].includes(mark.kind) ? halfStep(mark.x) : 0;
    add(xs, [mark.x[0] - half, mark.x.at(-1) + half]);
    add(xs, mark.x);
    if (mark.kind === 'bars')
      ys.push(isLog(spec.y) ? NaN : 0);
    if (mark.low)
      [mark.low, mark.high].forEach((values) => add(ys, finite(values)));
    else
      mark.y.forEach((y, i) => {
        const error = mark.error?.[i] ?? 0;
        ys.push(y, y + error);
        if (!isLog(spec.y) || y - error > 0.2 * y)
          ys.push(y - error);
      });
  }
  return { x: spec.x.limits ?? range(spec.x.kind, xs), y: spec.y.limits ?? range(spec.y.kind, ys) };
}
const halfStep = (x) => (x.length > 1 ? (x[1] - x[0]) / 2 : 0.5);

// { svg, x, y }: the picture and its scales.
export function draw(spec, width, height) {
  const bounds = limits(spec);
  const many = Math.max(2, Math.floor(width / 90));
  const top = 10, bottom = height - (spec.x.label ? 40 : 24);
  const y = scale(spec.y.kind, bounds.y, [bottom, top]);
  const yTicks = y.ticks(Math.max(2, Math.floor(height / 50)));
  const widest = Math.max(...yTicks.map((t) => t.label.length), 2);
  const left = Math.min(110, 20 + 7 * widest + (spec.y.label ? 18 : 0));
  const x = scale(spec.x.kind, bounds.x, [left, width - 12]);
  const clip = `clip${++pictures}`;
  const svg = s('svg', { class: 'plot', viewBox: `0 0 ${width} ${height}`, width, height, role: 'img',
                         'aria-label': spec.title });
  svg.append(s('title', null, spec.title),
             s('defs', null, s('clipPath', { id: clip }, s('rect', {
               x: left, y: top, width: Math.max(1, width - 12 - left), height: Math.max(1, bottom - top) }))),
             axes(spec, x, y, x.ticks(many), yTicks, height));
  const body = s('g', { 'clip-path': `url(#${clip})` });
  for (const mark of spec.marks)
    body.append(kinds[mark.kind](mark, x, y));
  svg.append(body);
  return { svg, x, y };
}

function axes(spec, x, y, xTicks, yTicks, height) {
  const group = s('g', { class: 'axes' });
  for (const { value, label, minor } of xTicks) {
    const at = round(x.at(value));
    group.append(s('path', { class: minor ? 'tick' : 'grid',
                             d: minor ? `M${at} ${y.from}v-4` : `M${at} ${y.from}V${y.to}` }));
    if (label)
      group.append(s('text', { x: at, y: y.from + 15, 'text-anchor': 'middle' }, label));
  }
  for (const { value, label, minor } of yTicks) {
    const at = round(y.at(value));
    group.append(s('path', { class: minor ? 'tick' : 'grid',
                             d: minor ? `M${x.from} ${at}h4` : `M${x.from} ${at}H${x.to}` }));
    if (label)
      group.append(s('text', { x: x.from - 6, y: at + 4, 'text-anchor': 'end' }, label));
  }
  group.append(s('path', { class: 'frame', d: `M${x.from} ${y.to}V${y.from}H${x.to}` }));
  const long = spec.x.label?.length * 6.5 > x.to - x.from; // goes on to the left then
  if (spec.x.label)
    group.append(s('text', { class: 'name', x: long ? x.to + 12 : (x.from + x.to) / 2, y: height - 6,
                             'text-anchor': long ? 'end' : 'middle' }, spec.x.label));
  if (spec.y.label)
    group.append(s('text', { class: 'name', 'text-anchor': 'middle',
                             transform: `translate(12 ${(y.from + y.to) / 2}) rotate(-90)` }, spec.y.label));
  return group;
}

const round = (v) => Math.round(v * 100) / 100;
const style = (mark, more = '') => `s${(mark.series ?? 0) % STYLES} ${more}`.trim();

// A path through what can be placed, broken where something cannot.
function through(xs, ys, x, y) {
  let d = '', pen = false;
  for (let i = 0; i < xs.length; i++) {
    const px = x.at(xs[i]), py = y.at(ys[i]);
    const there = Number.isFinite(px) && Number.isFinite(py);
    if (there)
      d += `${pen ? 'L' : 'M'}${round(px)} ${round(py)}`;
    pen = there;
  }
  return d;
}

const kinds = {
  line: (mark, x, y) => s('path', { class: style(mark, `line ${mark.dash ? 'dash' : ''}`),
                                    d: through(mark.x, mark.y, x, y) }),
  slope: (mark, x, y) => s('path', { class: mark.other ? 'guide other' : 'guide', d: through(mark.x, mark.y, x, y) }),
  level: (mark, x, y) => s('path', { class: 'guide', d: `M${x.from} ${round(y.at(mark.y))}H${x.to}` }),
  band: (mark, x, y) => {
    const floor = isLog(y) ? y.low : -Infinity;
    const low = mark.low.map((v) => Math.max(v, floor));
    const there = mark.x.map((_, i) => i).filter((i) => Number.isFinite(mark.high[i]) &&
                                                        Number.isFinite(x.at(mark.x[i])));
    const up = there.map((i) => `${round(x.at(mark.x[i]))} ${round(y.at(mark.high[i]))}`);
    const back = there.reverse().map((i) => `${round(x.at(mark.x[i]))} ${round(y.at(low[i]))}`);
    return s('path', { class: style(mark, 'band'), d: up.length ? `M${up.join('L')}L${back.join('L')}Z` : '' });
  },
  points: (mark, x, y) => {
    const group = s('g', { class: style(mark, `points ${mark.series >= STYLES ? 'hollow' : ''}`) });
    if (mark.error)
      group.append(errorBars(mark, x, y));
    let d = '';
    mark.x.forEach((v, i) => {
      const px = x.at(v), py = y.at(mark.y[i]);
      if (Number.isFinite(px) && Number.isFinite(py))
        d += shapes[(mark.series ?? 0) % shapes.length](round(px), round(py));
    });
    group.append(s('path', { class: 'shape', d }));
    return group;
  },
  steps: (mark, x, y) => {
    const half = halfStep(mark.x);
    const xs = mark.x.flatMap((v) => [v - half, v + half]), ys = mark.y.flatMap((v) => [v, v]);
    return s('path', { class: style(mark, 'line'), d: through(xs, ys, x, y) });
  },
  bars: (mark, x, y) => {
    const half = halfStep(mark.x) * 0.7, group = s('g', { class: style(mark, 'bars') });
    const base = isLog(y) ? y.from : y.at(0);
    mark.x.forEach((v, i) => {
      const top = y.at(mark.y[i]), left = x.at(v - half), right = x.at(v + half);
      if ([top, left, right].every(Number.isFinite))
        group.append(s('rect', { x: round(left), y: round(Math.min(top, base)), width: round(right - left),
                                 height: round(Math.abs(base - top)) }));
    });
    if (mark.error)
      group.append(errorBars(mark, x, y));
    return group;
  },
};

function errorBars(mark, x, y) {
  let d = '';
  mark.x.forEach((v, i) => {
    const error = mark.error[i], at = round(x.at(v)), high = y.at(mark.y[i] + error);
    const low = y.at(Math.max(mark.y[i] - error, isLog(y) ? y.low : -Infinity));
    if (error > 0 && Number.isFinite(at) && Number.isFinite(high))
      d += `M${at} ${round(high)}V${round(Number.isFinite(low) ? low : y.from)}`;
  });
  return s('path', { class: 'error', d });
}

const shapes = [
  (x, y) => `M${x - 3} ${y}a3 3 0 1 0 6 0a3 3 0 1 0-6 0`,
  (x, y) => `M${x - 3} ${y - 3}h6v6h-6z`,
  (x, y) => `M${x} ${y - 4}l4 7h-8z`,
  (x, y) => `M${x} ${y - 4}l4 4l-4 4l-4-4z`,
  (x, y) => `M${x} ${y + 4}l4-7h-8z`,
  (x, y) => `M${x - 3} ${y - 1}h2v-2h2v2h2v2h-2v2h-2v-2h-2z`,
  (x, y) => `M${x - 4} ${y - 2}h8v4h-8z`,
  (x, y) => `M${x - 2} ${y - 4}h4v8h-4z`,
];

// What stands for a series in a legend.
export function key(series, kind) {
  const svg = s('svg', { class: 'plot key', width: 30, height: 12, viewBox: '0 0 30 12', 'aria-hidden': 'true' });
  const plain = { at: (v) => v, from: 12, to: 0, low: 0 };
  if (kind === 'guide' || kind === 'other guide')
    svg.append(s('path', { class: kind === 'guide' ? 'guide' : 'guide other', d: 'M1 6H29' }));
  if (kind === 'line' || kind === 'both' || kind === 'dash')
    svg.append(s('path', { class: style({ series }, kind === 'dash' ? 'line dash' : 'line'), d: 'M1 6H29' }));
  if (kind === 'points' || kind === 'both')
    svg.append(kinds.points({ series, x: [15], y: [6] }, plain, plain));
  if (kind === 'bars')
    svg.append(s('g', { class: style({ series }, 'bars') }, s('rect', { x: 8, y: 1, width: 14, height: 10 })));
  return svg;
}
