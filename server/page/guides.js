// SPDX-License-Identifier: GPL-3.0-or-later
// guides.js - the local slope of a mean squared displacement, and the laws it is compared with.

// d log MSD / d log t between neighbours but one. Its error takes the two for independent; they have
// most of their path in common, and what both have cancels: the true error is smaller.
export function localSlope(lag, msd, stderr) {
  const x = [], y = [], error = [];
  for (let i = 1; i + 1 < lag.length; i++)
    if (msd[i - 1] > 0 && msd[i + 1] > 0) {
      const apart = Math.log(lag[i + 1] / lag[i - 1]);
      x.push(lag[i]);
      y.push(Math.log(msd[i + 1] / msd[i - 1]) / apart);
      error.push(stderr ? Math.hypot(stderr[i - 1] / msd[i - 1], stderr[i + 1] / msd[i + 1]) / apart : NaN);
    }
  return { x, y, error };
}

// Another MSD over the first, at the other's lags within those of the first, which is a line from lag
// to lag in logarithms. Errors take both for independent.
export function ratio(first, other) {
  const out = { x: [], y: [], error: [] };
  other.lag.forEach((t, i) => {
    const j = first.lag.findLastIndex((lag) => lag <= t), k = first.lag[j] === t ? j : j + 1;
    if (j < 0 || k >= first.lag.length || !(first.msd[j] > 0) || !(first.msd[k] > 0))
      return;
    const share = k === j ? 0 : Math.log(t / first.lag[j]) / Math.log(first.lag[k] / first.lag[j]);
    const between = (a, b) => a * (1 - share) + b * share;
    const y = other.msd[i] / Math.exp(between(Math.log(first.msd[j]), Math.log(first.msd[k])));
    out.x.push(t);
    out.y.push(y);
    out.error.push(y * Math.hypot((other.stderr?.[i] ?? NaN) / other.msd[i],
      between(first.stderr?.[j] / first.msd[j], first.stderr?.[k] / first.msd[k])));
  });
  return out;
}

// Of hard rods in no field and endless in number: 2 (1/rho - sigma) sqrt(D t / pi). Null elsewhere.
export function singleFile({ job, derived }) {
  const room = job.length / job.particles - job.diameter;
  return job.potential || job.interaction || job.boundary !== 'periodic' || !(job.particles > 1) || !(room > 0) ? null
    : 2 * room * Math.sqrt(derived.diffusion / Math.PI);
}

// c of c sqrt(t) where the curve runs like that: lags whose slope is within a tenth of a half, weighted
// by their errors (none below a thousandth). { factor, from, to, count }; null where it does nowhere.
export function rootOfTime({ lag, msd, stderr }) {
  const slopes = localSlope(lag, msd, stderr), like = slopes.x.filter((_, i) => Math.abs(slopes.y[i] - 0.5) <= 0.1);
  if (like.length < 2)
    return null;
  let all = 0, sum = 0;
  for (const t of like) {
    const i = lag.indexOf(t), weight = 1 / Math.max(1e-3, (stderr?.[i] ?? 0) / msd[i]) ** 2;
    all += weight;
    sum += weight * Math.log(msd[i] / Math.sqrt(t));
  }
  return { factor: Math.exp(sum / all), from: like[0], to: like.at(-1), count: like.length };
}
