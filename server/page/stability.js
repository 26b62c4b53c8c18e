// SPDX-License-Identifier: GPL-3.0-or-later
// stability.js - what every method does at the extremes, as `bcd report stability --json FILE` found it.
// It takes minutes and processes of its own, so that the file is made there and opened here.
import { h, replace, shellLine } from './dom.js';
import { num } from './words.js';

// A sign for each verdict, in words below the table.
const SIGNS = { right: '●', biased: '◐', ran: '○', refused: '–' };

export function stability() {
  const place = h('div'), told = h('p', { class: 'fault', role: 'alert' });
  const file = h('input', { type: 'file', id: 'stability-file', accept: '.json,application/json', onchange: async () => {
    try {
      told.textContent = '';
      replace(place, table(JSON.parse(await file.files[0].text())));
    } catch (error) {
      replace(place);
      told.textContent = `This is no stability report: ${error.message}`;
    }
  } });
  return h('section', null, h('h2', null, 'Stability'), h('p', null,
    'Every method at the extremes: right, biased by how much, or refused with a reason. It is measured by the command line:'),
    shellLine('bcd report stability --json stability.json'),
    h('p', { class: 'row' }, h('label', { for: 'stability-file' }, 'Show the file'), file), told, place);
}

function table({ entries, tried, failed, interrupted }) {
  const unique = (key) => [...new Set(entries.map((e) => e[key]))];
  const methods = unique('method'), extremes = unique('extreme'), words = h('p', { class: 'says', 'aria-live': 'polite' });
  const verdicts = unique('verdict'), sign = (v) => SIGNS[v] ?? '✕';
  const cell = (e) => {
    if (!e)
      return h('td');
    const text = `${e.extreme}, ${e.method}: ${e.verdict}${Number.isFinite(e.off) ? `, off by ${num(e.off, 3)} ± ${num(e.stderr, 2)}` : ''}${
      e.reason ? `: ${e.reason}` : ''}`;
    return h('td', null, h('button', { type: 'button', class: `quiet ${SIGNS[e.verdict] ? '' : 'fault'}`, title: text, 'aria-label': text,
      onclick: () => { words.textContent = text; } }, sign(e.verdict), Number.isFinite(e.off) && e.verdict === 'biased'
      ? ` ${num(e.off, 1)}` : ''));
  };
  return h('div', null, h('p', null, `${tried} tried, ${failed} silent failures${interrupted ? '; it was interrupted' : ''}. `,
    verdicts.map((v) => `${sign(v)} ${v}`).join('   ')), words,
    h('div', { class: 'scroll' }, h('table', null, h('thead', null, h('tr', null, h('th', null, 'extreme'),
      methods.map((m) => h('th', null, m)))), h('tbody', null, extremes.map((x) => h('tr', null, h('td', null, x),
      methods.map((m) => cell(entries.find((e) => e.extreme === x && e.method === m)))))))));
}
