// SPDX-License-Identifier: GPL-3.0-or-later
// stability.js - what every method does at the extremes, shown as it is found.
import { h, replace } from './dom.js';
import { num } from './words.js';

// A sign for each verdict, in words above the table.
const SIGNS = { right: '●', biased: '◐', ran: '○', refused: '–' };
const sign = (verdict) => SIGNS[verdict] ?? '✕';

function words(e) {
  const off = Number.isFinite(e.off) ? `, off by ${num(e.off, 3)} ± ${num(e.stderr, 2)}` : '';
  return `${e.extreme}, ${e.method}: ${e.verdict}${off}${e.reason ? `: ${e.reason}` : ''}`;
}

// Entries come in rows of an extreme each; what is there already stays, so that it can be pressed.
export function stabilityTable(place) {
  const says = h('p', { class: 'says', 'aria-live': 'polite' }), sums = h('p');
  const heads = h('tr'), body = h('tbody'), frame = h('div', { class: 'scroll' },
    h('table', { class: 'signs' }, h('thead', null, heads), body));
  let shown = [];

  function cell(e) {
    const text = words(e), off = Number.isFinite(e.off) && e.verdict !== 'right' && e.verdict !== 'ran';
    const seen = sign(e.verdict) + (off ? ` ${num(e.off, 1)}` : ''); // said first where it is more than a sign
    return h('td', null, h('button', { type: 'button', class: `quiet ${e.failed ? 'fault' : ''}`, title: text,
      'aria-label': off ? `${seen}: ${text}` : text, onclick: () => { says.textContent = text; } }, seen));
  }

  return function show(entries) {
    const same = shown.length > 0 && shown.every((e, i) => words(e) === (entries[i] && words(entries[i])));
    if (!same) {
      shown = [];
      replace(body);
      says.textContent = '';
      replace(place, ...(entries.length ? [sums, says, frame] : []));
    }
    const methods = [...new Set(entries.map((e) => e.method))];
    if (heads.cells.length !== methods.length + 1)
      replace(heads, h('th', null, 'extreme'), methods.map((m) => h('th', null, m)));
    for (const e of entries.slice(shown.length)) {
      if (body.lastChild?.dataset.extreme !== e.extreme)
        body.append(h('tr', { 'data-extreme': e.extreme }, h('th', { scope: 'row' }, e.extreme)));
      body.lastChild.append(cell(e));
    }
    shown = entries;
    const failed = entries.filter((e) => e.failed).length, verdicts = [...new Set(entries.map((e) => e.verdict))];
    sums.textContent = `${entries.length} tried, ${failed} silent failures. ${verdicts.map((v) =>
      `${sign(v)} ${v} ${entries.filter((e) => e.verdict === v).length}`).join('   ')}`;
  };
}
