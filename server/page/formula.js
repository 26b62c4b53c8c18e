// SPDX-License-Identifier: GPL-3.0-or-later
// formula.js - potentials as functions, to be drawn. What a formula means the server decides; one that
// cannot be read here is not drawn.

const FUNCTIONS = ['sin', 'cos', 'tan', 'asin', 'acos', 'atan', 'sinh', 'cosh', 'tanh', 'exp', 'log', 'sqrt',
                   'abs', 'min', 'max'];

// The function of x (or r) that a formula tells; throws where it is none.
export function formula(text) {
  const words = text.match(/\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|[a-z]+|[-+*/^(),]|\S/g) ?? [];
  let at = 0;
  const next = () => words[at];
  const take = (word) => {
    if (words[at++] !== word)
      throw new Error(`expected ${word}`);
  };
  function sum() {
    let left = product();
    while (next() === '+' || next() === '-') {
      const a = left, plus = words[at++] === '+', b = product();
      left = plus ? (x) => a(x) + b(x) : (x) => a(x) - b(x);
    }
    return left;
  }
  function product() {
    let left = signed();
    while (next() === '*' || next() === '/') {
      const a = left, times = words[at++] === '*', b = signed();
      left = times ? (x) => a(x) * b(x) : (x) => a(x) / b(x);
    }
    return left;
  }
  function signed() { // -2^2 is -(2^2)
    if (next() !== '-' && next() !== '+')
      return raised();
    const minus = words[at++] === '-', inner = signed();
    return minus ? (x) => -inner(x) : inner;
  }
  function raised() {
    const base = single();
    if (next() !== '^')
      return base;
    at++;
    const power = signed();
    return (x) => base(x) ** power(x);
  }
  function single() {
    const word = words[at++];
    if (word === '(') {
      const inner = sum();
      take(')');
      return inner;
    }
    if (/^[\d.]/.test(word ?? ''))
      return () => Number(word);
    if (word === 'x' || word === 'r')
      return (x) => x;
    if (word === 'pi' || word === 'e')
      return () => (word === 'pi' ? Math.PI : Math.E);
    if (!FUNCTIONS.includes(word))
      throw new Error(`${word} is not known`);
    take('(');
    const args = [sum()];
    while (next() === ',') {
      at++;
      args.push(sum());
    }
    take(')');
    return (x) => Math[word](...args.map((a) => a(x)));
  }
  const whole = sum();
  if (at !== words.length)
    throw new Error(`${words[at]} is too much`);
  return whole;
}

// { energy(x), period } of a job's potential; null where there is none, or none that can be drawn.
export function potentialOf(potential) {
  const wave = (v) => (Number(v) > 0 ? Number(v) : 1), TAU = 2 * Math.PI;
  try {
    switch (potential?.type) {
    case 'cosine': {
      const { amplitude, wavelength, phase = 0 } = potential, period = wave(wavelength);
      return { period, energy: (x) => Number(amplitude) / 2 * Math.cos(TAU * x / period + Number(phase)) };
    }
    case 'fourier': {
      const { wavelength, cosine = [], sine = [] } = potential, period = wave(wavelength);
      return { period, energy: (x) =>
        cosine.reduce((u, a, k) => u + a * Math.cos(TAU * (k + 1) * x / period), 0) +
        sine.reduce((u, b, k) => u + b * Math.sin(TAU * (k + 1) * x / period), 0) };
    }
    case 'table': { // straight between the values: what lies between them is the server's spline
      const { values } = potential, period = wave(potential.period);
      return { period, energy: (x) => {
        const place = (x / period - Math.floor(x / period)) * values.length, i = Math.floor(place);
        return values[i] + (place - i) * (values[(i + 1) % values.length] - values[i]);
      } };
    }
    case 'expression': {
      const energy = formula(potential.energy), period = Number(potential.period) || 0;
      energy(0);
      return { period, energy: period ? (x) => energy(x - period * Math.floor(x / period)) : energy };
    }
    default:
      return null;
    }
  } catch {
    return null;
  }
}
