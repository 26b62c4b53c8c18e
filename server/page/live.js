// SPDX-License-Identifier: GPL-3.0-or-later
// live.js - one stream of what happens to all jobs, for whoever listens: 'job' {id, state, progress},
// 'counts' by state, 'lost', and 'link' {up} when the server comes and goes.
import { events } from './api.js';

export const live = new EventTarget();
export let counts = null;
export let up = null; // null: not known yet
let stop = null;

const tell = (type, detail) => live.dispatchEvent(new CustomEvent(type, { detail }));
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

function link(now, why) {
  if (up === now && !why)
    return;
  up = now;
  tell('link', { up, why });
}

// Begins, or begins anew, as with another token.
export async function follow() {
  stop?.abort();
  const mine = stop = new AbortController();
  const { signal } = mine;
  let last, pause = 500;
  while (!signal.aborted) {
    try {
      for await (const event of events('/v1/events', { signal, last })) {
        if (signal.aborted)
          return;
        link(true);
        pause = 500;
        last = event.id ?? last;
        if (event.type === 'counts')
          counts = event.data;
        tell(event.type, event.data);
      }
    } catch (error) {
      if (signal.aborted)
        return;
      if (error.status === 401 || error.status === 403) {
        link(false, 'no token');
        return;
      }
    }
    link(false, 'reconnecting');
    await sleep(pause);
    pause = Math.min(pause * 2, 5000);
  }
}

// How long a job will still take, from how its progress went while it was watched.
const seen = new Map();
live.addEventListener('job', ({ detail: { id, state, progress } }) => {
  if (state !== 'running') {
    seen.delete(id);
    return;
  }
  const now = performance.now();
  const first = seen.get(id);
  if (!first || progress < first.progress)
    seen.set(id, { progress, since: now, at: now, to: progress });
  else
    Object.assign(first, { at: now, to: progress });
  if (seen.size > 500)
    seen.delete(seen.keys().next().value);
});
export function remaining(record) {
  const watched = seen.get(record.id);
  const { progress } = record;
  if (watched && watched.at - watched.since > 2000 && watched.to > watched.progress)
    return (1 - progress) * (watched.at - watched.since) / 1000 / (watched.to - watched.progress);
  const run = (Date.now() - new Date(record.started_at)) / 1000;
  return record.started_at && progress > 0.01 ? run * (1 - progress) / progress : NaN;
}
