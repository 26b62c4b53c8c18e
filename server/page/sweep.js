// SPDX-License-Identifier: GPL-3.0-or-later
// sweep.js - one sweep: how far it is, families of curves, a number over two axes, the table.
import { ask, curl, events, get, rows as stream, save } from './api.js';
import { parseAxis } from './axes.js';
import { action, h, paced, replace, shellLine } from './dom.js';
import { family, picture } from './family.js';
import { show as written } from './heat.js';
import { link, note, place, put, value } from './place.js';
import { stateWord, submitLink } from './parts.js';
import { withoutPlots } from './plot_state.js';
import { axisName, isCurve, isSeed, scalar, scalarsOf } from './points.js';
import { moment, nameOf, num, observableNames, states } from './words.js';

export const title = 'Sweep';
const ROWS = 200; // of the table, at first

export async function show(main, { id, query }, signal) {
  let sweep = await get(`/v1/sweeps/${id}`, signal), points = [], loading = null;
  let shown = Math.max(ROWS, Number(value(query, 'rows')) || 0);
  const observables = Object.keys(sweep.base.observables ?? {}).filter((name) => name !== 'trajectory');
  const head = h('div'), choices = h('div', { class: 'row' }), plots = h('div', { class: 'plots' });
  const table = h('div'), told = h('p', { class: 'note', role: 'status' });
  replace(main, head, choices, told, plots, table);
  const chosen = (name, usual) => value(place().query, name) ?? usual;
  const observable = () => (observables.includes(chosen('of')) ? chosen('of') : observables[0]);

  function set(name, text) {
    note(put(withoutPlots(place().query), name, text)); // zoomed into was what was drawn before
    draw();
  }

  // How far it is is told in place: what is made anew several times a second cannot be clicked.
  const bar = h('progress', { max: 1, 'aria-label': 'Share of points that have ended' }), share = h('span');
  const numbers = Object.fromEntries(Object.keys(states).map((name) => [name, h('b')]));
  let could = '';
  function showHead() {
    bar.value = sweep.progress;
    share.textContent = ` ${Math.floor(sweep.progress * 100)} % of ${sweep.jobs} points have ended. `;
    for (const name of Object.keys(states))
      numbers[name].textContent = sweep.states[name];
    const live = sweep.states.queued + sweep.states.running > 0;
    const can = JSON.stringify([live, sweep.states.failed > 0, sweep.axes]);
    if (can === could)
      return;
    could = can;
    replace(head, h('div', { class: 'head' }, h('div', null, h('h1', null, nameOf(sweep)),
      h('p', null, bar, share, h('a', { href: link('jobs', '', [['sweep', id]]) }, 'Its jobs'), `  ${sweep.owner}, ${moment(sweep.submitted_at)}`),
      h('ul', { class: 'counts' }, Object.keys(states).map((name) => h('li', null, h('a', { href:
        link('jobs', '', [['sweep', id], ['state', name]]) }, stateWord(name), ' ', numbers[name]))))),
      h('p', { class: 'row' }, live && action('Cancel', () => change('DELETE', '')),
        sweep.states.failed > 0 && action('Retry what failed', () => change('POST', '/retry')),
        h('a', { href: submitLink(sweep.base) }, 'Change and submit'))),
      h('p', null, Object.entries(sweep.axes).map(([name, values]) => h('span', { class: 'tag' },
        `${axisName(name)}: ${values.length > 8 ? `${values.slice(0, 4).map(written).join(', ')} .. ${written(values.at(-1))} (${values.length})`
          : values.map(written).join(', ')}`))), extendForm());
  }

  async function change(method, rest, body) {
    sweep = { ...sweep, ...(await ask(method, `/v1/sweeps/${id}${rest}`, body)).json };
    showHead();
    follow();
  }

  function extendForm() {
    const axis = h('select', { id: 'more-axis' }, Object.keys(sweep.axes).map((name) => h('option', { value: name }, axisName(name))));
    const values = h('input', { id: 'more-values', placeholder: '0.1,0.5 or 0..6:7', spellcheck: 'false' });
    return h('details', null, h('summary', null, 'More values'), h('p', { class: 'row' }, h('label', { for: 'more-axis' }, 'of'),
      axis, h('label', { for: 'more-values' }, 'values'), values, action('Extend', () =>
        change('POST', '/extend', { axes: { [axis.value]: parseAxis(values.value) } }))));
  }

  // Rows come one by one and are kept without what is not drawn.
  async function load() {
    loading?.abort();
    const mine = loading = new AbortController();
    signal.addEventListener('abort', () => mine.abort(), { once: true });
    const found = [], began = performance.now();
    try {
      for await (const row of stream(`/v1/sweeps/${id}/results/${observable()}.ndjson`, mine.signal)) {
        const { job, state: at, ...rest } = row;
        const values = Object.fromEntries(Object.keys(sweep.axes).map((name) => [name, rest[name]]));
        for (const name of Object.keys(sweep.axes))
          delete rest[name];
        delete rest.samples;
        found.push({ job, state: at, values, table: at === 'done' ? rest : null });
        if (found.length % 2000 === 0)
          told.textContent = `${found.length} of ${sweep.jobs} points read`;
      }
      points = found;
      took = performance.now() - began;
      told.textContent = '';
      draw();
    } catch (error) {
      if (!mine.signal.aborted)
        told.textContent = error.message;
    }
  }

  function draw() {
    const first = points.find((p) => p.table)?.table;
    const axes = Object.entries(sweep.axes).filter(([name, values]) => !isSeed(name) && values.length > 1);
    const scalars = first ? scalarsOf(first) : [];
    const which = scalars.includes(chosen('value')) ? chosen('value') : scalars[0];
    replace(choices, pick('observable', 'of', observables.map((name) => [name, observableNames[name] ?? name]), observable(), true));
    if (!first) {
      replace(plots, h('p', { class: 'wait' }, 'Plots come with the first point that is done.'));
      replace(table);
      return;
    }
    const names = axes.map(([name]) => [name, axisName(name)]);
    const of = (key, at) => (names.some(([name]) => name === chosen(key)) ? chosen(key) : names[at]?.[0]);
    const curves = of('curves', isCurve(first) ? 0 : 1), x = of('x', 0), y = of('y', 1);
    choices.append(...[names.length > 0 && pick('curves by', 'curves', names, curves),
      names.length > 1 && pick('along', 'x', names, x), names.length > 1 && pick('upwards', 'y', names, y),
      pick('number', 'value', scalars.map((name) => [name, name]), which)].filter(Boolean));
    const free = axes.filter(([name]) => ![curves, x, y].includes(name) || (isCurve(first) && name !== curves));
    const fixed = Object.fromEntries(axes.map(([name, values]) => {
      const index = Number(chosen(`at${name}`, 0));
      return [name, values[Number.isInteger(index) && index < values.length ? index : 0]];
    }));
    for (const [name, values] of free)
      choices.append(pick(`${axisName(name)} at`, `at${name}`, values.map((v, i) => [String(i), written(v)]),
                          String(Math.max(0, values.indexOf(fixed[name])))));
    const spec = { sweep, points, observable: observable(), curves, x, y, which, fixed, id };
    replace(plots, family(spec), names.length > 1 && x !== y && picture(spec));
    replace(table, showTable(scalars.slice(0, 4)));
  }

  function pick(words, name, options, now, anew) {
    const input = h('select', { onchange: () => {
      set(name, input.value);
      if (anew)
        load();
    } }, options.map(([v, text]) => h('option', { value: v }, text)));
    input.value = now ?? '';
    return h('label', { class: 'row' }, words, input);
  }

  function showTable(scalars) {
    const axes = Object.keys(sweep.axes), base = `/v1/sweeps/${id}/results/${observable()}`;
    return h('section', null, h('h2', null, 'Table'), h('p', { class: 'row' }, 'Export ',
      ['csv', 'ndjson', 'npz', 'svg'].map((form) => action(form.toUpperCase(), () =>
        save(`${base}.${form}`, `${observable()}-${id}.${form}`), { class: 'quiet' }))),
      ['csv', 'npz'].map((form) => shellLine(`${curl(`${base}.${form}`)} -o ${observable()}.${form}`)),
      h('div', { class: 'scroll' }, h('table', null, h('thead', null, h('tr', null, h('th', null, 'job'), h('th', null, 'state'),
        axes.map((name) => h('th', { class: 'number' }, axisName(name))), scalars.map((name) => h('th', { class: 'number' }, name)))),
      h('tbody', null, points.slice(0, shown).map((p) => h('tr', null, h('td', null, h('a', { href: link('job', p.job) }, p.job)),
        h('td', null, stateWord(p.state)), axes.map((name) => h('td', { class: 'number' }, written(p.values[name]))),
        scalars.map((name) => h('td', { class: 'number' }, p.table ? num(scalar(p.table, name)) : ''))))))),
      points.length > shown && h('button', { type: 'button', onclick: () => {
        shown += 5 * ROWS;
        note(put(place().query, 'rows', shown));
        draw();
      } }, `More (${points.length - shown})`));
  }

  // Not much of the time goes into reading what changes all the time.
  let took = 0;
  const reload = paced(() => 1500 + 5 * took, () => signal.aborted || load());
  let following = false;
  async function follow() {
    if (following)
      return;
    following = true;
    await counting();
    following = false;
  }
  async function counting() {
    for (let pause = 500; !signal.aborted; pause = Math.min(2 * pause, 5000)) {
      try {
        for await (const event of events(`/v1/events?sweep=${id}`, { signal }))
          if (event.type === 'counts') {
            pause = 500;
            const ended = event.data.done !== sweep.states.done || event.data.failed !== sweep.states.failed;
            const left = event.data.queued + event.data.running;
            sweep = { ...sweep, states: event.data, progress: sweep.jobs ? 1 - left / sweep.jobs : 1 };
            showHead();
            if (ended)
              reload();
            if (left === 0)
              return;
          }
      } catch (error) {
        if (signal.aborted || error.status === 401 || error.status === 403)
          return;
      }
      await new Promise((resolve) => setTimeout(resolve, pause));
    }
  }

  showHead();
  await load();
  if (sweep.states.queued + sweep.states.running > 0)
    follow();
}
