// SPDX-License-Identifier: GPL-3.0-or-later
// heat.js - a number over two axes: cells that say their value and lead to their jobs.
import { h, replace, s } from './dom.js';
import { scale } from './plot_scale.js';
import { csvText, download, svgText } from './save.js';
import { num } from './words.js';

// From dark blue to yellow by way of green, of even steps in lightness (after viridis).
const STOPS = ['#440154', '#46327e', '#365c8d', '#277f8e', '#1fa187', '#4ac16d', '#a0da39', '#fde725'];
function colour(share) {
  const at = Math.min(0.9999, Math.max(0, share)) * (STOPS.length - 1), i = Math.floor(at);
  const part = (hex, k) => parseInt(hex.slice(1 + 2 * k, 3 + 2 * k), 16);
  const mixed = [0, 1, 2].map((k) => Math.round(part(STOPS[i], k) + (at - i) * (part(STOPS[i + 1], k) - part(STOPS[i], k))));
  const light = mixed.map((c) => c / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  return { fill: `rgb(${mixed.join(',')})`,
           dark: 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2] < 0.18 };
}

// spec: { title, x: { label, values }, y: { label, values }, cell(xi, yi) -> { value, error, href, state }
// or null, file, curl, name, log: whether colours go by the logarithm, kept(log) when that is turned }
export function heat(spec) {
  const cells = spec.y.values.map((_, j) => spec.x.values.map((_, i) => spec.cell(i, j)));
  const numbers = cells.flat().map((c) => c?.value).filter(Number.isFinite);
  const note = h('p', { class: 'note' });
  const paper = h('div', { class: 'paper' }), says = h('p', { class: 'says', 'aria-live': 'polite' });
  const where = (i, j) => `${spec.x.label} ${show(spec.x.values[i])}, ${spec.y.label} ${show(spec.y.values[j])}`;
  let drawn = null, width = 0, log = spec.log;

  // What has no logarithm has no colour then.
  function colours() {
    const some = log ? numbers.filter((v) => v > 0) : numbers, low = Math.min(...some), high = Math.max(...some);
    const shares = scale(log ? 'log' : 'linear', [low, high], [0, 1]);
    note.textContent = !log ? '' : some.length === numbers.length ? 'Colours go by the logarithm.'
      : `Colours go by the logarithm; ${numbers.length - some.length} cells are not above 0 and dotted.`;
    return { low, high, any: some.length > 0, of: (v) => (!Number.isFinite(v) || (log && v <= 0) ? null
      : colour(high > low ? shares.at(v) : 0.5)) };
  }

  function render() {
    const by = colours();
    width = Math.max(300, Math.floor(paper.clientWidth || 560));
    const left = 74, top = 8, size = (width - left - 76) / spec.x.values.length;
    const tall = Math.max(14, Math.min(56, 330 / spec.y.values.length));
    const bottom = top + tall * spec.y.values.length, height = bottom + 44;
    const svg = s('svg', { class: 'plot', viewBox: `0 0 ${width} ${height}`, width, height, role: 'group',
                           'aria-label': spec.title }, s('title', null, spec.title));
    cells.forEach((row, j) => row.forEach((cell, i) => {
      const place = { x: left + i * size, y: bottom - (j + 1) * tall, width: size, height: tall };
      if (!cell)
        return;
      const known = Number.isFinite(cell.value);
      const look = by.of(cell.value);
      const tell = () => { says.textContent = `${where(i, j)}: ${known ? num(cell.value, 5) : cell.state}${
        cell.error > 0 ? ` ± ${num(cell.error, 2)}` : ''}${cell.count > 1 ? `, mean of ${cell.count}` : ''}`; };
      svg.append(s('a', { href: cell.href, 'aria-label': `${where(i, j)}: ${known ? num(cell.value) : cell.state}`,
                          onpointerenter: tell, onfocus: tell },
        s('rect', { class: look ? 'cell' : known ? 'void low' : 'void', ...place, fill: look?.fill }),
        size > 34 && tall >= 14 && s('text', { class: `cell-text ${look?.dark ? 'on-dark' : look ? 'on-light' : ''}`,
          x: place.x + size / 2, y: place.y + tall / 2 + 4 }, known ? num(cell.value, size > 60 ? 4 : 2) : cell.state ?? '–')));
    }));
    const every = (many, room, one) => Math.max(1, Math.ceil(many * one / room));
    const xStep = every(spec.x.values.length, width - left - 70, 48), yStep = every(spec.y.values.length, bottom - top, 15);
    spec.x.values.forEach((v, i) => i % xStep === 0 && svg.append(s('text', { x: left + (i + 0.5) * size, y: bottom + 15,
      'text-anchor': 'middle' }, show(v))));
    spec.y.values.forEach((v, j) => j % yStep === 0 && svg.append(s('text', { x: left - 6, y: bottom - (j + 0.5) * tall + 4,
      'text-anchor': 'end' }, show(v))));
    svg.append(s('text', { class: 'name', x: left + size * spec.x.values.length / 2, y: bottom + 36, 'text-anchor': 'middle' },
                 spec.x.label),
               s('text', { class: 'name', 'text-anchor': 'middle',
                           transform: `translate(12 ${(top + bottom) / 2}) rotate(-90)` }, spec.y.label));
    if (by.any)
      svg.append(bar({ x: width - 62, from: Math.min(bottom, top + 200), to: top, low: by.low, high: by.high, log }));
    drawn = svg;
    replace(paper, svg);
  }
  new ResizeObserver(() => Math.abs(Math.floor(paper.clientWidth) - width) > 1 && render()).observe(paper);
  render();
  const rows = () => cells.flatMap((row, j) => row.flatMap((c, i) => (c ? [[show(spec.x.values[i]), show(spec.y.values[j]),
    c.value, c.error]] : [])));
  const turn = h('button', { type: 'button', class: 'quiet', 'aria-pressed': String(log), title: 'Colours by the logarithm',
    onclick: () => {
      log = !log;
      turn.setAttribute('aria-pressed', String(log));
      spec.kept(log);
      render();
    } }, 'log colours');
  return h('figure', { class: 'figure' }, h('figcaption', null, h('h3', null, spec.title), h('span', { class: 'tools' }, turn,
    h('button', { type: 'button', class: 'quiet', 'data-save': 'svg', onclick: () =>
      download(`${spec.file}.svg`, 'image/svg+xml', svgText(drawn)) }, 'SVG'),
    h('button', { type: 'button', class: 'quiet', 'data-save': 'csv', onclick: () =>
      download(`${spec.file}.csv`, 'text/csv', csvText([spec.x.label, spec.y.label, spec.name, 'stderr'], rows())) }, 'CSV'))),
    paper, says, note, spec.curl);
}

export const show = (v) => (typeof v === 'number' ? num(v, 4) : v === null ? 'none' : typeof v === 'string' ? v
  : v?.type ? `${v.type} ${JSON.stringify({ ...v, type: undefined })}` : JSON.stringify(v));

// Which colour is which value: numbers at the ends, and between them where there is room.
function bar({ x, from, to, low, high, log }) {
  const group = s('g', { class: 'bar' }), step = (from - to) / 40;
  for (let i = 0; i < 40; i++)
    group.append(s('rect', { x, y: from - step * (i + 1), width: 14, height: step + 0.5,
                             fill: colour(high > low ? (i + 0.5) / 40 : 0.5).fill }));
  const axis = scale(log ? 'log' : 'linear', high > low ? [low, high] : [low - 1, low + 1], [from, to]);
  const ends = high > low ? [[low, from], [high, to + 8]] : [[low, (from + to) / 2]];
  const between = high > low ? axis.ticks(4).filter((t) => t.label && !t.minor).map((t) => [t.value, axis.at(t.value) + 4])
    .filter(([, at]) => at < from - 14 && at > to + 22) : [];
  for (const [value, at] of [...ends, ...between])
    group.append(s('text', { x: x + 18, y: at }, num(value, 3)));
  return group;
}
