// SPDX-License-Identifier: GPL-3.0-or-later
// trajectory.js - rods in space and time: time to the right, positions upwards, rods as wide as they
// are. Those in a cluster are drawn over in another colour and broader: clusters, and the waves in
// which they are handed on, are seen as they move. Drawn into part of it: that part alone.
import { h, replace, s } from './dom.js';
import { range, scale } from './plot_scale.js';
import { keep, kept, printRange, readRange } from './plot_state.js';
import { csvText, download, svgText } from './save.js';
import { num } from './words.js';

const MOST_POINTS = 120000; // of all paths together; beyond that not every time is drawn

// Columns as arrays of frames: { times, rods, at(rod, frame) }.
export function frames(table) {
  const times = [];
  for (let i = 0; i < table.time.length && table.rod[i] === table.rod[0]; i++)
    times.push(table.time[i]);
  const count = times.length, many = Math.floor(table.x.length / Math.max(1, count));
  return { times, many, at: (rod, frame) => table.x[rod * count + frame] };
}

// For every frame and rod whether a neighbour is closer than `gap` (surface to surface). Neighbours are
// so by number: rods do not pass each other.
export function clustered({ times, many, at }, { diameter, length, particles, boundary }, gap) {
  const flags = new Uint8Array(times.length * many);
  const ring = boundary === 'periodic' && many === particles;
  for (let t = 0; t < times.length; t++)
    for (let rod = 0; rod < many; rod++) {
      const next = rod + 1 < many ? rod + 1 : ring && many > 1 ? 0 : -1;
      if (next < 0)
        continue;
      let apart = at(next, t) - at(rod, t);
      if (boundary === 'periodic')
        apart -= length * Math.floor(apart / length);
      if (apart - diameter <= gap) {
        flags[t * many + rod] = 1;
        flags[t * many + next] = 1;
      }
    }
  return flags;
}

export function trajectory(record, table, lines) {
  const { job } = record, data = frames(table);
  const fold = job.boundary === 'periodic' ? (x) => x - job.length * Math.floor(x / job.length) : (x) => x;
  const whole = { t: range('linear', data.times), x: [0, job.length] };
  const { in: zoom = [], gap: [kept0] = [] } = kept('trajectory'), usual = 0.02 * (job.diameter || 1);
  const view = { t: readRange(zoom.slice(0, 2)) ?? whole.t, x: readRange(zoom.slice(2)) ?? whole.x,
                 gap: kept0 !== undefined && Number(kept0) >= 0 ? Number(kept0) : usual, drawn: null };
  // Drawn anew as the reader wants it, and the link says how.
  function turned() {
    const all = view.t === whole.t && view.x === whole.x;
    keep('trajectory', { in: !all && [...printRange(view.t), ...printRange(view.x)],
                         gap: view.gap !== usual && [String(view.gap)] });
    render();
  }
  const paper = h('div', { class: 'paper', tabindex: '0', role: 'group',
    'aria-label': 'Rods in space and time. Plus and minus zoom, arrow keys move, 0 shows all.' });
  const says = h('p', { class: 'says', 'aria-live': 'polite' });

  function render() {
    const width = Math.max(300, Math.floor(paper.clientWidth || 900)), height = 460;
    view.width = width;
    const t = scale('linear', view.t, [56, width - 12]), x = scale('linear', view.x, [height - 40, 10]);
    const svg = s('svg', { class: 'plot', viewBox: `0 0 ${width} ${height}`, width, height, role: 'img',
                           'aria-label': 'Rods in space and time' });
    const inner = s('svg', { x: t.from, y: x.to, width: t.to - t.from, height: x.from - x.to,
                             viewBox: `${t.from} ${x.to} ${t.to - t.from} ${x.from - x.to}` });
    inner.append(wells(job, x, t), ...paths(data, view, job, fold, t, x));
    svg.append(s('title', null, 'Rods in space and time'), inner, frame(t, x, height));
    view.drawn = { svg, t, x };
    replace(paper, svg);
  }

  const share = (gap) => clustered(data, job, gap).reduce((sum, v) => sum + v, 0) /
    Math.max(1, data.times.length * data.many);
  const gap = h('input', { id: `gap-${record.id}`, type: 'number', min: 0, step: 'any', value: num(view.gap, 3),
    onchange: ({ target }) => { view.gap = Math.max(0, Number(target.value) || 0); tell(); turned(); } });
  const tell = () => {
    says.textContent = `${num(100 * share(view.gap), 3)} % of all rods and times are in clusters: ` +
      'broad lines of the second colour.';
  };

  drag(paper, view, turned, whole);
  paper.addEventListener('keydown', (event) => {
    const spread = ([a, b], f) => [(a + b) / 2 - (b - a) / 2 * f, (a + b) / 2 + (b - a) / 2 * f];
    const shift = ([a, b], f) => [a + (b - a) * f, b + (b - a) * f];
    const moves = {
      '+': () => Object.assign(view, { t: spread(view.t, 0.5), x: spread(view.x, 0.5) }),
      '-': () => Object.assign(view, { t: spread(view.t, 2), x: spread(view.x, 2) }),
      0: () => Object.assign(view, whole), Escape: () => Object.assign(view, whole),
      ArrowLeft: () => { view.t = shift(view.t, -0.2); }, ArrowRight: () => { view.t = shift(view.t, 0.2); },
      ArrowDown: () => { view.x = shift(view.x, -0.2); }, ArrowUp: () => { view.x = shift(view.x, 0.2); },
    };
    if (!moves[event.key])
      return;
    event.preventDefault();
    moves[event.key]();
    turned();
  });
  new ResizeObserver(() => {
    if (Math.abs(Math.floor(paper.clientWidth) - view.width) > 1)
      render();
  }).observe(paper);
  tell();
  render();
  const csv = () => csvText(['time', 'rod', 'x'], table.time.map((t, i) => [t, table.rod[i], table.x[i]]));
  return h('figure', { class: 'figure wide' }, h('figcaption', null, h('h3', null, 'Space and time'),
    h('span', { class: 'tools' }, h('label', { for: `gap-${record.id}` }, 'in a cluster: gap up to '), gap,
      h('button', { type: 'button', class: 'quiet', onclick: () => { Object.assign(view, whole); turned(); } }, 'whole'),
      h('button', { type: 'button', class: 'quiet', 'data-save': 'svg', onclick: () =>
        download(`trajectory-${record.id}.svg`, 'image/svg+xml', svgText(view.drawn.svg)) }, 'SVG'),
      h('button', { type: 'button', class: 'quiet', 'data-save': 'csv', onclick: () =>
        download(`trajectory-${record.id}.csv`, 'text/csv', csv()) }, 'CSV'))),
    paper, says, h('p', { class: 'note' }, 'Of the first realization. Drag over a part to see it alone.'),
    h('details', { class: 'source' }, h('summary', null, 'The same data by curl'),
      lines.map((line) => h('code', null, line))));
}

// Two paths: all rods, and over them what is in clusters. A ring is cut open at its end.
function paths(data, view, job, fold, t, x) {
  const { times, many, at } = data, flags = clustered(data, job, view.gap);
  const first = Math.max(0, times.findIndex((v) => v >= view.t[0]) - 1);
  const after = times.findIndex((v) => v > view.t[1]);
  const last = after < 0 ? times.length - 1 : after;
  const step = Math.max(1, Math.ceil((last - first + 1) * many / MOST_POINTS));
  const thick = Math.max(0.7, Math.abs(x.at(job.diameter) - x.at(0)));
  let all = '', joined = '';
  const round = (v) => Math.round(v * 10) / 10;
  for (let rod = 0; rod < many; rod++) {
    let before = null;
    for (let i = first; i <= last; i += step) {
      const place = fold(at(rod, i)), here = `${round(t.at(times[i]))} ${round(x.at(place))}`;
      const broken = before === null || Math.abs(place - before.place) > job.length / 2;
      const inside = flags[i * many + rod];
      all += `${broken ? 'M' : 'L'}${here}`;
      if (inside && !broken)
        joined += `${before.inside ? '' : `M${before.here}`}L${here}`;
      else if (inside)
        joined += `M${here}`;
      before = { place, here, inside };
    }
  }
  return [s('path', { class: 'rods', d: all, 'stroke-width': thick.toFixed(2) }),
          s('path', { class: 'clusters', d: joined, 'stroke-width': (thick + 0.6).toFixed(2) })];
}

// Where the potential is least, as far as that is plain to see.
function wells(job, x, t) {
  const group = s('g', { class: 'wells' }), { potential } = job;
  if (potential?.type !== 'cosine' || potential.velocity || !potential.amplitude)
    return group;
  const { wavelength, phase, amplitude } = potential;
  const least = ((amplitude > 0 ? 0.5 : 0) - phase / (2 * Math.PI)) * wavelength;
  if (Math.abs(x.at(wavelength) - x.at(0)) >= 6)
    for (let at = least - wavelength * Math.floor(least / wavelength); at <= job.length; at += wavelength)
      group.append(s('path', { d: `M${t.from} ${x.at(at).toFixed(1)}H${t.to}` }));
  return group;
}

function frame(t, x, height) {
  const group = s('g', { class: 'axes' }, s('path', { class: 'frame', d: `M${t.from} ${x.to}V${x.from}H${t.to}` }));
  for (const { value, label } of t.ticks(Math.floor((t.to - t.from) / 90)))
    group.append(s('path', { class: 'tick', d: `M${t.at(value)} ${x.from}v4` }),
                 s('text', { x: t.at(value), y: x.from + 17, 'text-anchor': 'middle' }, label));
  for (const { value, label } of x.ticks(8))
    group.append(s('path', { class: 'tick', d: `M${t.from} ${x.at(value)}h-4` }),
                 s('text', { x: t.from - 7, y: x.at(value) + 4, 'text-anchor': 'end' }, label));
  group.append(s('text', { class: 'name', x: (t.from + t.to) / 2, y: height - 6, 'text-anchor': 'middle' }, 'time'),
               s('text', { class: 'name', 'text-anchor': 'middle',
                           transform: `translate(13 ${(x.from + x.to) / 2}) rotate(-90)` }, 'position x'));
  return group;
}

function drag(paper, view, turned, whole) {
  let start = null, box = null;
  const place = (event) => {
    const { left, top } = paper.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  paper.addEventListener('pointerdown', (event) => {
    if (event.button === 0 && event.pointerType !== 'touch')
      start = place(event);
  });
  paper.addEventListener('pointermove', (event) => {
    if (!start)
      return;
    const [px, py] = place(event);
    if (!box)
      view.drawn.svg.append(box = s('rect', { class: 'zoom cursor' }));
    for (const [name, v] of Object.entries({ x: Math.min(px, start[0]), y: Math.min(py, start[1]),
      width: Math.abs(px - start[0]), height: Math.abs(py - start[1]) }))
      box.setAttribute(name, v);
  });
  const end = (event) => {
    if (start && box && event.type === 'pointerup') {
      const [px, py] = place(event), { t, x } = view.drawn;
      if (Math.abs(px - start[0]) > 5 && Math.abs(py - start[1]) > 5) {
        view.t = [t.back(Math.min(px, start[0])), t.back(Math.max(px, start[0]))];
        view.x = [x.back(Math.max(py, start[1])), x.back(Math.min(py, start[1]))];
        turned();
      }
    }
    box?.remove();
    start = box = null;
  };
  paper.addEventListener('pointerup', end);
  paper.addEventListener('pointerleave', end);
  paper.addEventListener('dblclick', () => { Object.assign(view, whole); turned(); });
}
