// SPDX-License-Identifier: GPL-3.0-or-later
// plot.js - a plot one can work with: legend, zoom, values under the pointer or by arrow keys, linear
// and logarithmic axes, saved as SVG and CSV, and the command that gets the same data.
//
// spec: { title, x, y, marks, legend, height, file, curl, note }; x and y { label, kind, name, fixed
// (limits) , both (may be linear or log) }; legend [{ series, name, kind, group }]: marks of the same
// `group` are shown and hidden together; by `key` zoom, axes and what is hidden stand in the link.
import { h, replace, s, shellLine } from './dom.js';
import { draw, key } from './plot_draw.js';
import { keep, kept, printRange, readRange } from './plot_state.js';
import { csvOfMarks, download, svgText } from './save.js';
import { num } from './words.js';

// As the link has it, where that can be.
function viewOf(spec) {
  const { x, y, in: zoom = [], off = [] } = spec.key ? kept(spec.key) : {};
  const kind = (axis, words) => (spec[axis].both && ['linear', 'log'].includes(words?.[0]) ? words[0] : spec[axis].kind);
  const view = { x: kind('x', x), y: kind('y', y), zoom: null, hidden: new Set(off), at: null, drawn: null };
  const across = readRange(zoom.slice(0, 2), view.x), up = readRange(zoom.slice(2), view.y);
  if (across && up)
    view.zoom = { x: across, y: up };
  return view;
}
function keepView(spec, { x, y, zoom, hidden }) {
  if (spec.key)
    keep(spec.key, { x: x !== spec.x.kind && [x], y: y !== spec.y.kind && [y],
                     in: zoom && [...printRange(zoom.x), ...printRange(zoom.y)], off: [...hidden] });
}

export function plot(spec) {
  const view = viewOf(spec);
  const paper = h('div', { class: 'paper', tabindex: '0', role: 'group',
                           'aria-label': `${spec.title}. Arrow keys read values, plus and minus zoom.` });
  const says = h('p', { class: 'says', 'aria-live': 'polite' });
  const legend = h('ul', { class: 'legend' });
  const figure = h('figure', { class: 'figure' },
    h('figcaption', null, h('h3', null, spec.title), tools(spec, view, turned)),
    legend, paper, says, spec.note ? h('p', { class: 'note' }, spec.note) : null,
    spec.curl ? h('details', { class: 'source' }, h('summary', null, 'The same data by curl'),
                  ...spec.curl.map((line) => shellLine(line))) : null);

  function render() {
    const width = Math.max(260, Math.floor(paper.clientWidth || 560));
    const shown = { ...spec, x: { ...spec.x, kind: view.x, limits: view.zoom?.x ?? spec.x.fixed },
                    y: { ...spec.y, kind: view.y, limits: view.zoom?.y ?? spec.y.fixed },
                    marks: spec.marks.filter((m) => !view.hidden.has(m.group)) };
    view.shown = shown;
    view.drawn = draw(shown, width, spec.height ?? 300);
    replace(paper, view.drawn.svg);
    view.width = width;
    mark();
  }

  // Drawn anew as the reader wants it.
  function turned() {
    keepView(spec, view);
    render();
  }

  replace(legend, ...(spec.legend ?? []).map((row) => h('li', null, h('label', null,
    h('input', { type: 'checkbox', checked: !view.hidden.has(row.group), onchange: ({ target }) => {
      view.hidden[target.checked ? 'delete' : 'add'](row.group);
      turned();
    } }), key(row.series, row.kind), ' ', row.name))));

  // The point nearest to a place, of all that can be read.
  function nearest(px, py) {
    let best = null;
    for (const m of view.shown.marks)
      if (['points', 'bars', 'steps', 'line'].includes(m.kind) && !m.silent)
        m.x.forEach((v, i) => {
          const dx = view.drawn.x.at(v) - px, dy = view.drawn.y.at(m.y[i]) - py;
          const far = dx * dx * 9 + dy * dy;
          if (Number.isFinite(far) && (!best || far < best.far))
            best = { far, mark: m, i };
        });
    return best;
  }

  function mark() {
    view.drawn.svg.querySelector('.cursor')?.remove();
    if (!view.at || !view.shown.marks.includes(view.at.mark)) {
      says.textContent = '';
      return;
    }
    const { mark: m, i } = view.at;
    const px = view.drawn.x.at(m.x[i]), py = view.drawn.y.at(m.y[i]);
    view.drawn.svg.append(s('g', { class: 'cursor' },
      s('path', { d: `M${px} ${view.drawn.y.from}V${view.drawn.y.to}` }),
      s('circle', { cx: px, cy: py, r: 6 })));
    const error = m.error?.[i] ?? m.errors?.[i];
    says.textContent = `${m.name ? `${m.name}: ` : ''}${spec.x.name ?? spec.x.label} ${num(m.x[i], 5)}, ` +
      `${spec.y.name ?? spec.y.label} ${num(m.y[i], 5)}${error > 0 ? ` ± ${num(error, 2)}` : ''}`;
  }

  pointer(paper, view, { nearest, mark, turned });
  keys(paper, view, { mark, turned });
  new ResizeObserver(() => {
    if (Math.abs(Math.floor(paper.clientWidth) - view.width) > 1)
      render();
  }).observe(paper);
  render();
  return figure;
}

function tools(spec, view, turned) {
  const turn = (axis) => spec[axis].both && h('button', { type: 'button', class: 'quiet', 'aria-pressed':
    String(view[axis] === 'log'), onclick: ({ currentTarget }) => {
    view[axis] = view[axis] === 'log' ? 'linear' : 'log';
    view.zoom = null;
    currentTarget.setAttribute('aria-pressed', String(view[axis] === 'log'));
    turned();
  } }, `log ${axis}`);
  const file = spec.file ?? 'plot';
  return h('span', { class: 'tools' }, turn('x'), turn('y'),
    h('button', { type: 'button', class: 'quiet', onclick: () => { view.zoom = null; turned(); } }, 'whole'),
    h('button', { type: 'button', class: 'quiet', 'data-save': 'svg', onclick: () =>
      download(`${file}.svg`, 'image/svg+xml', svgText(view.drawn.svg)) }, 'SVG'),
    h('button', { type: 'button', class: 'quiet', 'data-save': 'csv', onclick: () =>
      download(`${file}.csv`, 'text/csv', (spec.csv ?? csvOfMarks)(view.shown)) }, 'CSV'));
}

// Dragging over a part shows that part alone; a double click the whole again.
function pointer(paper, view, { nearest, mark, turned }) {
  let start = null, box = null;
  const place = (event) => {
    const frame = paper.getBoundingClientRect();
    const { x, y } = view.drawn, inside = (v, a, b) => Math.min(Math.max(v, Math.min(a, b)), Math.max(a, b));
    return [inside(event.clientX - frame.left, x.from, x.to), inside(event.clientY - frame.top, y.from, y.to)];
  };
  paper.addEventListener('pointerdown', (event) => {
    if (event.button === 0 && event.pointerType !== 'touch')
      start = place(event);
  });
  paper.addEventListener('pointermove', (event) => {
    const [px, py] = place(event);
    if (start && Math.hypot(px - start[0], py - start[1]) > 5) {
      if (!box)
        view.drawn.svg.append(box = s('rect', { class: 'zoom cursor' }));
      for (const [name, v] of Object.entries({ x: Math.min(px, start[0]), y: Math.min(py, start[1]),
        width: Math.abs(px - start[0]), height: Math.abs(py - start[1]) }))
        box.setAttribute(name, v);
    } else if (!start) {
      view.at = nearest(px, py);
      mark();
    }
  });
  paper.addEventListener('pointerup', (event) => {
    const [px, py] = place(event), { x, y } = view.drawn;
    if (start && box && Math.abs(px - start[0]) > 5 && Math.abs(py - start[1]) > 5) {
      view.zoom = { x: [x.back(Math.min(px, start[0])), x.back(Math.max(px, start[0]))],
                    y: [y.back(Math.max(py, start[1])), y.back(Math.min(py, start[1]))] };
      turned();
    }
    box?.remove();
    start = box = null;
  });
  paper.addEventListener('pointerleave', () => {
    box?.remove();
    start = box = null;
    if (document.activeElement !== paper) {
      view.at = null;
      mark();
    }
  });
  paper.addEventListener('dblclick', () => { view.zoom = null; turned(); });
}

// Left and right read the points of a curve, up and down go from curve to curve.
function keys(paper, view, { mark, turned }) {
  const readable = () => view.shown.marks.filter((m) =>
    ['points', 'bars', 'steps', 'line'].includes(m.kind) && !m.silent && m.x.length);
  paper.addEventListener('keydown', (event) => {
    const marks = readable(), now = view.at && marks.includes(view.at.mark) ? view.at : null;
    const along = { ArrowRight: 1, ArrowLeft: -1 }[event.key], other = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (along && marks.length) {
      const m = now?.mark ?? marks[0];
      view.at = { mark: m, i: Math.min(m.x.length - 1, Math.max(0, (now ? now.i + along : 0))) };
      mark();
    } else if (other && marks.length) {
      const next = marks[((now ? marks.indexOf(now.mark) : -1) + other + marks.length) % marks.length];
      view.at = { mark: next, i: Math.min(now?.i ?? 0, next.x.length - 1) };
      mark();
    } else if (event.key === '+' || event.key === '-') {
      const { x, y } = view.drawn, share = event.key === '+' ? 0.25 : -0.5;
      const cut = (a) => [a.back(a.from + (a.to - a.from) * share), a.back(a.to - (a.to - a.from) * share)];
      view.zoom = { x: cut(x), y: cut(y) };
      turned();
    } else if (event.key === '0' || event.key === 'Escape') {
      view.zoom = view.at = null;
      turned();
    } else {
      return;
    }
    event.preventDefault();
  });
}
