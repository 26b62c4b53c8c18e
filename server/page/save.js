// SPDX-License-Identifier: GPL-3.0-or-later
// save.js - plots as files: SVG that needs no style sheet, CSV of what is shown.
import { h } from './dom.js';

export function download(name, type, text) {
  const url = URL.createObjectURL(new Blob([text], { type }));
  h('a', { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

const LOOKS = ['fill', 'fill-opacity', 'stroke', 'stroke-width', 'stroke-dasharray', 'stroke-linejoin',
               'stroke-linecap', 'opacity', 'font-size', 'font-family', 'font-weight', 'text-anchor'];

// The picture in light colours with its looks written into it, so that any program shows it the same.
export function svgText(svg) {
  const copy = svg.cloneNode(true);
  copy.querySelectorAll('.cursor').forEach((e) => e.remove());
  const place = h('div', { class: 'saving', 'aria-hidden': 'true' }, copy);
  document.body.append(place);
  for (const element of [copy, ...copy.querySelectorAll('*')]) {
    const looks = getComputedStyle(element);
    for (const name of ['path', 'rect', 'text', 'line', 'circle'].includes(element.tagName) ? LOOKS : [])
      element.setAttribute(name, looks.getPropertyValue(name));
    element.removeAttribute('tabindex');
  }
  for (const element of [copy, ...copy.querySelectorAll('[class]')])
    element.removeAttribute('class');
  const { width, height } = copy.viewBox.baseVal;
  const paper = document.createElementNS(copy.namespaceURI, 'rect');
  paper.setAttribute('width', width);
  paper.setAttribute('height', height);
  paper.setAttribute('fill', '#fff');
  copy.prepend(paper);
  copy.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
  place.remove();
  return new XMLSerializer().serializeToString(copy);
}

const cell = (v) => (typeof v === 'string' ? (/[",\n]/.test(v) ? `"${v.replaceAll('"', '""')}"` : v)
  : Number.isFinite(v) ? String(v) : '');

// columns: names; rows: arrays.
export function csvText(columns, rows) {
  return `${[columns, ...rows].map((row) => row.map(cell).join(',')).join('\n')}\n`;
}

// Every curve and point of a plot, one a line.
export function csvOfMarks(spec) {
  const rows = [];
  for (const { kind, name, x, y, error, silent } of spec.marks)
    if (['line', 'points', 'steps', 'bars'].includes(kind) && !silent)
      x.forEach((v, i) => rows.push([name ?? '', v, y[i], error?.[i]]));
  return csvText(['series', spec.x.name ?? spec.x.label, spec.y.name ?? spec.y.label, 'stderr'], rows);
}
