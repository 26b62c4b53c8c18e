// SPDX-License-Identifier: GPL-3.0-or-later
// parts.js - what several views are made of: states, bars of progress, what can be done with a job.
import { ask } from './api.js';
import { action, h } from './dom.js';
import { remaining } from './live.js';
import { go, link } from './place.js';
import { duration, ended, states } from './words.js';

export function stateWord(state) {
  return h('span', { class: `state ${state}` }, `${states[state] ?? ''} ${state}`);
}

// The bar and how long it will still take; `text` for lists.
export function progressBar(record) {
  if (record.state !== 'running')
    return h('span');
  const percent = Math.floor(record.progress * 100), left = remaining(record);
  return h('span', null, h('progress', { max: 1, value: record.progress, 'aria-label': 'Progress' }),
           ` ${percent} %`, Number.isFinite(left) ? `, ${duration(left)} left` : '');
}

// The job as it was submitted, to be submitted again.
export function jobOf({ job, label, tags, priority }) {
  return { ...job, ...(label ? { label } : {}), ...(tags?.length ? { tags } : {}),
           ...(priority ? { priority } : {}) };
}

// What can be done with a job, in a word: buttons stay the same as long as this does, for one that is
// made anew while it is pressed is not clicked.
export const deed = ({ state }) => (ended(state) ? (state === 'done' ? '' : 'retry') : 'cancel');

export function jobActions(record, changed) {
  if (deed(record) === 'cancel')
    return action('Cancel', async () =>
      changed((await ask('DELETE', `/v1/jobs/${record.id}`)).json), { 'data-do': 'cancel' });
  if (deed(record) === '')
    return null;
  return action('Retry', async () => {
    const { json } = await ask('POST', '/v1/jobs', jobOf(record));
    go('job', json.id);
  }, { 'data-do': 'retry' });
}

export const submitLink = (job) => link('submit', '', [['job', JSON.stringify(job)]]);
