// SPDX-License-Identifier: GPL-3.0-or-later
// plot_scale.js - numbers to places along an axis and back, and where its ticks are.

// kind: 'linear' or 'log'; [low, high] goes to [from, to]. at() is NaN where there is no such place.
export function scale(kind, [low, high], [from, to]) {
  const log = kind === 'log';
  const map = log ? (v) => (v > 0 ? Math.log(v) : NaN) : (v) => v;
  const a = map(low), b = map(high);
  return {
    kind, low, high, from, to,
    at: (v) => from + (map(v) - a) / (b - a) * (to - from),
    back: (place) => {
      const v = a + (place - from) / (to - from) * (b - a);
      return log ? Math.exp(v) : v;
    },
    ticks: (many) => (log ? logTicks(low, high, many) : linearTicks(low, high, many)),
  };
}

// The least range that holds all values, with a little room; log scales see positive values only.
export function range(kind, values) {
  let low = Infinity, high = -Infinity;
  for (const v of values)
    if (Number.isFinite(v) && (kind !== 'log' || v > 0)) {
      low = Math.min(low, v);
      high = Math.max(high, v);
    }
  if (low > high)
    return kind === 'log' ? [0.1, 10] : [0, 1];
  if (kind === 'log')
    return low === high ? [low / 2, high * 2] : [low / (high / low) ** 0.03, high * (high / low) ** 0.03];
  const room = low === high ? Math.abs(low) * 0.1 || 1 : (high - low) * 0.04;
  return [low - room, high + room];
}

// At least two, however little room there is.
function linearTicks(low, high, many) {
  const raw = (high - low) / Math.max(1, many), power = 10 ** Math.floor(Math.log10(raw));
  const steps = [0.2, 0.5, 1, 2, 5, 10].map((m) => m * power), within = (s) => Math.floor(high / s + 1e-9) - Math.ceil(low / s - 1e-9);
  const step = steps.find((s) => s >= raw * 0.999 && within(s) > 0) ?? steps.findLast((s) => within(s) > 0) ?? raw;
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++)
    ticks.push({ value: i * step, label: written(i * step, places) });
  return ticks;
}
function written(value, places) {
  const size = Math.abs(value);
  const text = size !== 0 && (size >= 1e6 || places > 5) ? value.toPrecision(3).replace(/\.?0+(e|$)/, '$1')
    : value.toFixed(places);
  return text.replaceAll('-', '−');
}

const raised = (n) => String(n).replace(/[-\d]/g, (c) => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]));
export const power = (n) => (n >= -2 && n <= 3 ? String(Number(`1e${n}`)) : `10${raised(n)}`);

// Decades with their numbers, what lies between as short lines; within little more than one decade the
// 2 and the 5 have numbers, too.
function logTicks(low, high, many) {
  const first = Math.floor(Math.log10(low)), last = Math.ceil(Math.log10(high));
  const decades = Math.log10(high / low);
  if (decades < 0.7)
    return linearTicks(low, high, many);
  const every = Math.max(1, Math.ceil(decades / Math.max(1, many)));
  const ticks = [];
  for (let n = first; n <= last; n++)
    for (let m = 1; m < 10; m++) {
      const value = m * 10 ** n;
      if (value < low * 0.9999 || value > high * 1.0001 || (m > 1 && (decades > 6 || every > 1)))
        continue;
      const named = m === 1 ? n % every === 0 : decades < 1.6 && (m === 2 || m === 5);
      ticks.push({ value, label: !named ? '' : m === 1 ? power(n) : n >= -3 && n <= 3
        ? String(Number(value.toPrecision(1))) : `${m}·10${raised(n)}`, minor: m > 1 });
    }
  return ticks;
}
