// SPDX-License-Identifier: GPL-3.0-or-later
// scene.js - a job's scene to scale: rods at their mean distance in their potential.
import { h, s } from './dom.js';
import { potentialOf } from './formula.js';
import { num } from './words.js';

const HEIGHT = 190, LEFT = 12, RIGHT = 12;

export function scene(job, room) {
  const WIDTH = Math.max(260, Math.floor(room || 640));
  const N = Number(job.particles), L = Number(job.length), sigma = Number(job.diameter ?? 0);
  if (!(N >= 1) || !(L > 0) || !(sigma >= 0))
    return h('p', { class: 'note' }, 'The scene is drawn once there are particles and a length.');
  const spacing = L / N, potential = potentialOf(job.potential), gap = spacing - sigma;
  // All of it, or as much as shows single rods and wells.
  const shown = Math.min(L, Math.max(14 * spacing, potential?.period ? 6 * potential.period : 0));
  const width = Math.min(shown, 40 * Math.max(sigma, spacing / 4, potential?.period ?? 0) || shown);
  const unit = (WIDTH - LEFT - RIGHT) / width, px = (x) => LEFT + x * unit;
  const svg = s('svg', { class: 'plot scene', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: WIDTH, height: HEIGHT, role: 'img',
    'aria-label': `${N} rods of length ${sigma} in ${L}, mean gap ${num(gap)}` });
  const floor = 118;
  if (potential)
    svg.append(curve(potential, width, px, WIDTH - RIGHT));
  const tall = 20;
  for (let i = 0; (i + 0.5) * spacing - sigma / 2 < width && i < 400; i++)
    svg.append(s('rect', { class: 'rod', x: px((i + 0.5) * spacing - sigma / 2), y: floor - tall / 2,
                           width: Math.max(2.5, sigma * unit), height: tall, rx: sigma ? 1.5 : 1 }));
  svg.append(s('path', { class: 'grid', d: `M${LEFT} ${floor + tall / 2 + 1}H${WIDTH - RIGHT}` }));
  if (job.boundary === 'walls')
    svg.append(s('path', { class: 'wall', d: `M${LEFT} 6V${floor + tall}` }),
               width === L && s('path', { class: 'wall', d: `M${WIDTH - RIGHT} 6V${floor + tall}` }));
  const from = px(0.5 * spacing + sigma / 2), to = px(1.5 * spacing - sigma / 2), line = floor + 26;
  if (gap > 0 && N > 1)
    svg.append(s('path', { class: 'measure', d: `M${from} ${line - 6}v12M${from} ${line}H${to}M${to} ${line - 6}v12` }),
               s('text', { x: Math.max(from, LEFT), y: line + 22 }, `mean gap ${num(gap, 3)}`));
  svg.append(s('text', { x: WIDTH - RIGHT, y: line + 22, 'text-anchor': 'end' },
               width < L ? `${num(width, 3)} of ${num(L)} shown` : `all of ${num(L)} shown`));
  const facts = [`density ${num(N / L, 3)}`, `covered ${num(100 * N * sigma / L, 3)} %`,
                 gap < 0 ? 'rods do not fit' : `mean gap ${num(gap, 3)}`];
  if (potential?.period)
    facts.push(`${num(N * potential.period / L, 3)} rods a period`);
  if (job.potential && !potential)
    facts.push('the potential cannot be drawn');
  return h('div', null, svg, h('p', { class: 'note' }, facts.join('  ·  ')));
}

function curve({ energy }, width, px, end) {
  const xs = Array.from({ length: 501 }, (_, i) => i / 500 * width), us = xs.map(energy);
  const finite = us.filter(Number.isFinite), low = Math.min(...finite), high = Math.max(...finite);
  const group = s('g');
  if (!finite.length)
    return group;
  const y = (u) => (high > low ? 92 - (u - low) / (high - low) * 70 : 60); // below the words
  let d = '', pen = 'M';
  xs.forEach((x, i) => {
    if (Number.isFinite(us[i])) {
      d += `${pen}${px(x).toFixed(1)} ${y(us[i]).toFixed(1)}`;
      pen = 'L';
    } else {
      pen = 'M';
    }
  });
  group.append(s('path', { class: 'potential', d }),
               s('text', { x: end, y: 12, 'text-anchor': 'end' }, `U from ${num(low, 3)} to ${num(high, 3)}`));
  return group;
}
