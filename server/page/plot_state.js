// SPDX-License-Identifier: GPL-3.0-or-later
// plot_state.js - what was done to a plot stands in the link, so that who gets it sees the same:
// plot.msd=x:linear,in:0.01:3:0.1:20,off:half
import { note, place, put, value } from './place.js';

// { name: [part, ...] } of the plot that goes by this key.
export function kept(key) {
  const words = (value(place().query, `plot.${key}`) ?? '').split(',').filter(Boolean);
  return Object.fromEntries(words.map((word) => word.split(':')).map(([name, ...parts]) => [name, parts]));
}

// What has no parts is as it is without being told.
export function keep(key, state) {
  const words = Object.entries(state).filter(([, parts]) => parts?.length)
    .map(([name, parts]) => [name, ...parts].join(':'));
  note(put(place().query, `plot.${key}`, words.join(',')));
}

// Of pairs, those that belong to no plot: other plots come.
export const withoutPlots = (pairs) => pairs.filter(([name]) => !name.startsWith('plot.'));

// A range as short numbers that still tell its ends apart, and back; null where it is none.
export function printRange([low, high]) {
  const digits = Math.ceil(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / Math.abs(high - low))) + 4;
  return [low, high].map((v) => String(Number(v.toPrecision(Math.min(17, Math.max(4, digits || 4))))));
}
export function readRange(words, kind = 'linear') {
  const [low, high] = (words ?? []).map(Number);
  return Number.isFinite(low) && low < high && (kind !== 'log' || low > 0) ? [low, high] : null;
}
