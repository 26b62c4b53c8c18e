// SPDX-License-Identifier: GPL-3.0-or-later
// points.js - the points of a sweep: groups that differ in their seed alone are one, with the mean of
// their values; single numbers out of tables.
import { valueOf } from './record.js';

const isPlain = (v) => v === null || typeof v !== 'object';
export const same = (a, b) => a === b || (!isPlain(a) && !isPlain(b) && JSON.stringify(a) === JSON.stringify(b));

// Points by their value of an axis, looked at once: a sweep may have 10^5 of them.
export function grouped(points, pointer) {
  const groups = new Map(), keyOf = (v) => (isPlain(v) ? v : JSON.stringify(v));
  for (const point of points) {
    const key = keyOf(point.values[pointer]);
    if (!groups.has(key))
      groups.set(key, []);
    groups.get(key).push(point);
  }
  return (v) => groups.get(keyOf(v)) ?? [];
}
export const axisName = (pointer) => pointer.slice(1).replaceAll('/', '.');
export const isSeed = (pointer) => pointer === '/seed';
const ALONG = ['lag', 'x', 'r', 'size', 'force'];

export const isCurve = (table) => Object.values(table).some(Array.isArray);
export const columnsOf = (table) => ({ x: ALONG.find((name) => Array.isArray(table[name])), y: valueOf(table) });

// Single numbers that a table has: its numbers, and of lists the last, the largest and the mean.
export function scalarsOf(table) {
  const names = [];
  for (const [name, v] of Object.entries(table)) {
    if (typeof v === 'number')
      names.push(name);
    if (Array.isArray(v) && !ALONG.includes(name) && name !== 'samples')
      names.push(...['last', 'max', 'mean'].map((how) => `${how} ${name}`));
  }
  const first = valueOf(table);
  return names.sort((a, b) => (b.split(' ').at(-1) === first) - (a.split(' ').at(-1) === first));
}
export function scalar(table, name) {
  const [how, column] = name.includes(' ') ? name.split(' ') : ['', name];
  const v = table?.[column];
  if (how === '')
    return typeof v === 'number' ? v : NaN;
  const list = (Array.isArray(v) ? v : []).filter(Number.isFinite);
  if (!list.length)
    return NaN;
  return how === 'last' ? list.at(-1) : how === 'max' ? list.reduce((a, b) => Math.max(a, b))
    : list.reduce((a, b) => a + b, 0) / list.length;
}

// The mean of several points' numbers and the error of it: from their own errors, or else their spread.
export function mean(values, errors) {
  const there = values.map((v, i) => [v, errors?.[i]]).filter(([v]) => Number.isFinite(v)), n = there.length;
  const value = there.reduce((sum, [v]) => sum + v, 0) / n;
  const error = there.every(([, e]) => Number.isFinite(e)) ? Math.hypot(...there.map(([, e]) => e)) / n
    : n > 1 ? Math.sqrt(there.reduce((sum, [v]) => sum + (v - value) ** 2, 0) / (n - 1) / n) : NaN;
  return { value, error, count: n };
}

// The curve of points that differ in their seed: row by row, as far as they have the same rows.
export function meanCurve(points, { x, y }) {
  const tables = points.map((p) => p.table).filter((t) => Array.isArray(t?.[x]));
  const [first] = tables, alike = tables.filter((t) => t[x].length === first[x].length);
  const rows = first[x].map((_, i) => mean(alike.map((t) => t[y][i]), alike.map((t) => t.stderr?.[i])));
  return { x: first[x], y: rows.map((r) => r.value), error: rows.map((r) => r.error),
           theory: Array.isArray(first.theory) ? first.theory : null };
}
