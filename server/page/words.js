// SPDX-License-Identifier: GPL-3.0-or-later
// words.js - numbers, times and states as people read them.

export function num(value, digits = 4) {
  if (typeof value !== 'number')
    return value === null || value === undefined ? '–' : String(value);
  if (!Number.isFinite(value))
    return Number.isNaN(value) ? '–' : value > 0 ? '∞' : '−∞';
  if (value === 0 || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e6))
    return String(Number(value.toPrecision(digits))).replace('-', '−');
  const [mantissa, power] = value.toExponential(digits - 1).split('e');
  return `${Number(mantissa)}e${power.replace('+', '')}`.replaceAll('-', '−');
}

// Value and standard error: 1.234 ± 0.005, the error with two figures.
export function withError(value, error) {
  if (!(error > 0) || !Number.isFinite(value))
    return num(value, 6);
  const places = Math.min(12, Math.max(0, 1 - Math.floor(Math.log10(error))));
  if (Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-4))
    return `${num(value)} ± ${num(error, 2)}`;
  return `${value.toFixed(places).replace('-', '−')} ± ${error.toFixed(places)}`;
}

export function duration(seconds) {
  if (!Number.isFinite(seconds))
    return '–';
  if (seconds < 1)
    return seconds < 0.001 ? '< 1 ms' : `${num(seconds * 1000, 2)} ms`;
  const units = [['d', 86400], ['h', 3600], ['min', 60], ['s', 1]];
  const at = units.findIndex(([, size]) => seconds >= size);
  const [unit, size] = units[at], whole = Math.floor(seconds / size);
  const [small, smallSize] = units[at + 1] ?? [];
  const rest = small ? Math.floor((seconds - whole * size) / smallSize) : 0;
  return unit === 's' ? `${seconds < 10 ? num(seconds, 2) : whole} s`
    : `${whole} ${unit}${rest && whole < 10 ? ` ${rest} ${small}` : ''}`;
}

export function bytes(count) {
  const units = ['B', 'kB', 'MB', 'GB', 'TB'];
  const at = Math.min(units.length - 1, count < 1 ? 0 : Math.floor(Math.log10(count) / 3));
  return `${num(count / 1000 ** at, 3)} ${units[at]}`;
}

const two = (n) => String(n).padStart(2, '0');
export function moment(iso) {
  if (!iso)
    return '–';
  const t = new Date(iso);
  const day = `${t.getFullYear()}-${two(t.getMonth() + 1)}-${two(t.getDate())}`;
  const clock = `${two(t.getHours())}:${two(t.getMinutes())}:${two(t.getSeconds())}`;
  return t.toDateString() === new Date().toDateString() ? clock : `${day} ${clock.slice(0, 5)}`;
}

// A sign beside the word, so that nothing is said by colour alone.
export const states = { queued: '○', running: '◐', done: '●', failed: '✕', cancelled: '⊘' };
export const ended = (state) => !['queued', 'running'].includes(state);

export const observableNames = {
  msd: 'Mean squared displacement', density: 'Density', contact_density: 'Contact density',
  pair_distribution: 'Pair distribution', energy: 'Energy', current: 'Current',
  cluster_sizes: 'Cluster sizes', trajectory: 'Space and time', contact_force: 'Contact forces' };

// What a job is about, in one line.
export function summary(job) {
  const words = [`N ${job.particles}`, `L ${num(job.length)}`, `σ ${num(job.diameter)}`];
  if (job.boundary === 'walls')
    words.push('walls');
  const { potential, interaction } = job;
  if (potential)
    words.push(potential.type === 'cosine' ? `U₀ ${num(potential.amplitude)}` : potential.type);
  if (potential?.velocity)
    words.push(`v ${num(potential.velocity)}`);
  if (job.force)
    words.push(`f ${num(job.force)}`);
  if (interaction)
    words.push(interaction.type === 'sticky' ? `γ ${num(interaction.strength)}` : interaction.type);
  return words.join(' · ');
}

export const nameOf = (record) => record.label || record.id;
