// SPDX-License-Identifier: GPL-3.0-or-later
// submit.js - a job, or a sweep of it: fields by the schema, the scene as it is typed, what it will
// take, the line that submits it from a shell. The link holds the job.
import { ask, curl, get } from './api.js';
import { countOf, parseAxis } from './axes.js';
import { action, h, later, replace, shellLine } from './dom.js';
import { form } from './form.js';
import { go, note, value } from './place.js';
import { scene } from './scene.js';
import { bytes, duration, moment, num, observableNames } from './words.js';

export const title = 'Submit';
const FIRST = { particles: 40, length: 50, diameter: 0.5, potential: { type: 'cosine', amplitude: 4 },
                initial: 'equilibrium', time: 20, realizations: 8,
                observables: { msd: { first: 0.001, last: 2, points: 30 }, density: { bins: 50 } } };

export async function show(main, { query }, signal) {
  const [schema, { scenes }] = await Promise.all([get('/v1/schema/job', signal), get('/v1/scenes', signal)]);
  let job = read(value(query, 'job')) ?? structuredClone(FIRST);
  let axes = Object.entries(read(value(query, 'axes')) ?? {});
  let fields = null, asked = null;
  const place = h('div'), picture = h('div'), cost = h('div', { 'aria-live': 'polite' });
  const foretold = h('div', { 'aria-live': 'polite' });
  const line = h('div'), rest = h('div', { role: 'alert' }), axesPlace = h('div');
  const text = h('textarea', { id: 'job-json', rows: 14, spellcheck: 'false', onchange: () => {
    try {
      job = JSON.parse(text.value);
      build();
      changed();
    } catch (error) {
      replace(rest, h('p', { class: 'fault' }, `This is no JSON: ${error.message}`));
    }
  } });

  function build() {
    fields = form(schema, job, changed);
    replace(place, fields.element);
  }

  function changed() {
    replace(picture, scene(job, picture.clientWidth));
    text.value = JSON.stringify(job, null, 2);
    settled();
  }
  const settled = later(250, () => {
    if (signal.aborted)
      return;
    note([['job', JSON.stringify(job)], ...(axes.length ? [['axes', JSON.stringify(Object.fromEntries(axes))]] : [])]);
    replace(line, shellLine(axes.length ? curl('/v1/sweeps', { body: sweepOf() }) : curl('/v1/jobs', { body: job })));
    estimate();
  });

  async function estimate() {
    asked?.abort();
    const mine = asked = new AbortController();
    signal.addEventListener('abort', () => mine.abort(), { once: true });
    try {
      const { json } = await ask('POST', '/v1/estimate', job, mine.signal);
      fields.show([]);
      replace(rest);
      replace(cost, told(json));
      replace(foretold, h('p', { class: 'note' }, 'Statistical errors: a sample is being run.'));
      forecast(mine.signal);
    } catch (error) {
      if (!mine.signal.aborted)
        wrong(error);
    }
  }

  // Once nothing was typed for a while: a sample of the job takes a fraction of a second.
  const forecast = later(700, async (mine) => {
    if (mine.aborted)
      return;
    try {
      const { json } = await ask('POST', '/v1/forecast', job, mine);
      replace(foretold, errorsOf(json));
    } catch (error) {
      if (!mine.aborted)
        replace(foretold, h('p', { class: 'note' }, `No forecast of statistical errors: ${error.message}`));
    }
  });

  function wrong(error) {
    replace(foretold);
    const left = fields.show(error.errors ?? []);
    replace(cost, error.estimate ? told(error.estimate) : h('p', { class: 'note' }, 'No estimate while something is wrong.'));
    replace(rest, error.errors?.length
      ? left.map((e) => h('p', { class: 'fault' }, `${e.pointer ?? ''} ${e.detail}`))
      : h('p', { class: 'fault' }, error.message));
  }

  function told(e) {
    const { derived } = e, times = axes.reduce((n, [, a]) => n * (countOf(a) || 1), 1);
    const rows = [['computing', `${duration(e.core_seconds)} of one core${times > 1 ? `, times ${times}` : ''}`],
      ['done', e.finishes_at ? `${duration(e.finishes_in_seconds)} from now, ${moment(e.finishes_at)}` : null],
      ['before it', e.queue && e.queue.jobs_before ? `${e.queue.jobs_before} job${e.queue.jobs_before > 1 ? 's' : ''}, ${duration(e.queue.core_seconds_before)}` : null],
      ['memory', bytes(e.memory_bytes)], ['results', bytes(e.result_bytes)], ['steps', num(e.steps, 3)],
      ['method', derived?.method], ['time step', derived && num(derived.time_step)],
      ['step by', derived?.time_step_limited_by?.replaceAll('_', ' ')],
      ['error of the step', derived ? `aimed at ${num(100 * (Number(job.tolerance) || 0.005), 2)} % of the density` : null]];
    return h('div', null, h('dl', { class: 'facts' }, rows.filter(([, v]) => v).map(([name, v]) =>
      h('div', null, h('dt', null, name), h('dd', null, v)))),
      Object.entries(derived ?? {}).filter(([name]) => name.endsWith('_warning'))
        .map(([, words]) => h('p', { class: 'notice' }, words)));
  }

  function sweepOf() {
    const { label, tags, priority, ...base } = job;
    return { base, axes: Object.fromEntries(axes), ...(label ? { label } : {}), ...(tags ? { tags } : {}),
             ...(priority ? { priority } : {}) };
  }

  function showAxes() {
    const pointer = h('input', { id: 'axis-pointer', placeholder: '/diameter', list: 'pointers', spellcheck: 'false' });
    const values = h('input', { id: 'axis-values', placeholder: '0.1..0.9:5', spellcheck: 'false' });
    replace(axesPlace, axes.map(([name, axis], i) => h('p', null, h('code', null, `${name}  ${JSON.stringify(axis)}`), ' ',
      h('button', { type: 'button', class: 'quiet', onclick: () => {
        axes.splice(i, 1);
        showAxes();
        changed();
      } }, 'Remove'))),
      h('p', { class: 'row' }, h('label', { for: 'axis-pointer' }, 'Vary'), pointer, h('label', { for: 'axis-values' }, 'over'),
        values, action('Add', async () => {
          const name = pointer.value.trim();
          if (!name.startsWith('/'))
            throw new Error('A pointer into the job begins with /');
          axes = [...axes.filter(([n]) => n !== name), [name, parseAxis(values.value)]];
          showAxes();
          changed();
        })),
      h('datalist', { id: 'pointers' }, [...document.querySelectorAll('[data-pointer]')]
        .map((e) => h('option', { value: e.dataset.pointer }))));
  }

  const presets = h('select', { id: 'preset', onchange: () => {
    const found = scenes.find((s) => s.name === presets.value);
    if (!found)
      return;
    job = { ...structuredClone(found.job), label: found.name, tags: [found.name.split('-').slice(0, 2).join('-')] };
    replace(source, `${found.source}, doi ${found.doi}`);
    build();
    changed();
  } }, h('option', { value: '' }, 'choose a scene'), scenes.map((s) => h('option', { value: s.name }, s.name)));
  const source = h('span', { class: 'note' });

  const send = action('Submit', async () => {
    try {
      const { json } = axes.length ? await ask('POST', '/v1/sweeps', sweepOf()) : await ask('POST', '/v1/jobs', job);
      go(axes.length ? 'sweep' : 'job', json.id);
    } catch (error) {
      wrong(error);
      throw error;
    }
  }, { class: 'main', id: 'send' });

  replace(main, h('h1', null, 'Submit'), h('p', { class: 'row' }, h('label', { for: 'preset' }, 'Scenes of the papers'),
    presets, source), h('div', { class: 'two' }, h('div', null, place,
      h('fieldset', null, h('legend', null, 'A sweep'), h('p', { class: 'note' },
        'All combinations of values at these places of the job. 0.1,0.5 or 0..6:7 or 0.1..10:7:log or 1..4'), axesPlace)),
    h('div', { class: 'stick' }, h('fieldset', null, h('legend', null, 'The scene'), picture),
      h('fieldset', null, h('legend', null, 'What it will take'), cost, foretold, rest, h('p', null, send)),
      h('fieldset', null, h('legend', null, 'The same from a shell'), line),
      h('details', null, h('summary', null, h('label', { for: 'job-json' }, 'The job as JSON')), h('div', { class: 'field' }, text)))));
  build();
  showAxes();
  changed();
  let wide = picture.clientWidth;
  new ResizeObserver(() => {
    if (picture.clientWidth === wide)
      return;
    wide = picture.clientWidth;
    replace(picture, scene(job, wide));
  }).observe(picture);
}

// What the statistical errors will be, as far as a sample tells.
function errorsOf({ observables, sample }) {
  return h('div', null, h('p', { class: 'note' }, sample ? `Statistical errors, from a sample of ${sample.realizations} realizations of time ${num(sample.time, 2)}:`
    : 'Statistical errors are not known before it runs:'), h('dl', { class: 'facts' },
  Object.entries(observables).map(([name, { relative_error: error, reason }]) => h('div', null,
    h('dt', null, (observableNames[name] ?? name).toLowerCase()), h('dd', { title: reason ?? '' }, error === null ? 'not known'
      : `${num(100 * error, 2)} %`)))), Object.entries(observables).filter(([, { reason }]) => reason && sample).map(([name, { reason }]) =>
    h('p', { class: 'note' }, `${observableNames[name] ?? name}: ${reason}.`)));
}

function read(text) {
  try {
    return text ? JSON.parse(text) : null;
  } catch {
    return null;
  }
}
