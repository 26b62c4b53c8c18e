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
