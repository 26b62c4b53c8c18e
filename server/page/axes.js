// SPDX-License-Identifier: GPL-3.0-or-later
// axes.js - a sweep's axes as the command line writes them: 0.1,0.5  0..6:7  0.1..10:7:log  1..4

export function parseAxis(text) {
  const words = text.split(',').map((word) => word.trim()).filter(Boolean);
  const span = words.length === 1 && /^([^:]+?)\.\.([^:]+)(?::(\d+)(?::(log|linear))?)?$/.exec(words[0]);
  if (!words.length)
    throw new Error('needs values: 0.1,0.5  0..6:7  0.1..10:7:log  1..4');
  if (!span)
    return words.map((word) => (word !== '' && Number.isFinite(Number(word)) ? Number(word) : word));
  const [, from, to, points, scale] = span, a = Number(from), b = Number(to);
  if (!Number.isFinite(a) || !Number.isFinite(b))
    throw new Error(`${words[0]} is no range of numbers`);
  if (points)
    return { from: a, to: b, points: Number(points), ...(scale ? { scale } : {}) };
  if (!Number.isInteger(a) || !Number.isInteger(b) || b < a)
    throw new Error(`${words[0]}: whole numbers go 1..4, others need how many: 0..1:5`);
  return { first: a, count: b - a + 1 };
}

// How many values that is.
export const countOf = (axis) => (Array.isArray(axis) ? axis.length : axis.points ?? axis.count);
