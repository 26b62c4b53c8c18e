// SPDX-License-Identifier: GPL-3.0-or-later
// jobs.mjs - values at random after a JSON Schema, jobs above all, and faults put into them.
import { fc } from './tools.mjs';

// Whole documents or parts of them; `root` is where "#/..." leads.
export function fromSchema(schema, root = schema) {
  if (schema === true || Object.keys(schema).length === 0)
    return fc.jsonValue({ maxDepth: 1 });
  if (schema.$ref)
    return fromSchema(deref(schema.$ref, root), root);
  if ('const' in schema)
    return fc.constant(schema.const);
  if (schema.enum)
    return fc.constantFrom(...schema.enum);
  if (schema.oneOf ?? schema.anyOf)
    return fc.oneof(...(schema.oneOf ?? schema.anyOf).map((s) => fromSchema(s, root)));
  const type = Array.isArray(schema.type) ? schema.type[0] : schema.type;
  switch (type) {
  case 'null': return fc.constant(null);
  case 'boolean': return fc.boolean();
  case 'integer': return number(schema, true);
  case 'number': return number(schema, false);
  case 'string': return string(schema);
  case 'array':
    return fc.array(fromSchema(schema.items ?? true, root),
                    { minLength: schema.minItems ?? 0,
                      maxLength: Math.min(schema.maxItems ?? 6, (schema.minItems ?? 0) + 6) });
  default: return object(schema, root);
  }
}

export function deref(ref, root) {
  return ref.replace(/^#\//, '').split('/')
    .reduce((at, key) => at[key.replace(/~1/g, '/').replace(/~0/g, '~')], root);
}

function inside(schema, v) {
  return !(v < schema.minimum) && !(v <= schema.exclusiveMinimum) && !(v > schema.maximum) &&
         !(v >= schema.exclusiveMaximum);
}

// Numbers as people give them, the ends of the range, and anything in between.
function number(schema, whole) {
  const { minimum, exclusiveMinimum, maximum } = schema;
  const low = minimum ?? exclusiveMinimum ?? -1e9, high = maximum ?? 1e9;
  const usual = whole ? [0, 1, 2, 3, 5, 10, 50] : [0, 1e-3, 0.01, 0.1, 0.5, 1, 2, 5, 10, 100];
  const ends = [low, high, ...(whole ? [low + 1, high - 1] : [low + 1e-9, high * (1 - 1e-9)])];
  const common = usual.filter((v) => inside(schema, v));
  const choices = [
    { weight: 1, arbitrary: fc.constantFrom(...ends.filter((v) => inside(schema, v))) },
    { weight: 1, arbitrary: whole ? fc.maxSafeInteger().filter((v) => inside(schema, v))
                                  : fc.double({ min: low, max: high, noNaN: true })
                                    .filter((v) => inside(schema, v)) },
  ];
  if (whole)
    choices[1].arbitrary = fc.integer({ min: Math.max(low, -(2 ** 31)),
                                        max: Math.min(high, 2 ** 31 - 1) });
  if (common.length)
    choices.push({ weight: 8, arbitrary: fc.constantFrom(...common) });
  if ('default' in schema && typeof schema.default === 'number')
    choices.push({ weight: 3, arbitrary: fc.constant(schema.default) });
  return fc.oneof(...choices);
}

function string(schema) {
  const minLength = schema.minLength ?? 0, maxLength = Math.min(schema.maxLength ?? 20, 40);
  if (schema.pattern === '^[ -~]*$')
    return fc.oneof({ weight: 3, arbitrary: fc.constantFrom('3*cos(2*pi*x)', 'x^2', '1/r', 'exp(-r)') },
                    fc.string({ unit: 'grapheme-ascii', minLength, maxLength }));
  if (schema.pattern)
    return fc.stringMatching(new RegExp(schema.pattern, 'u'))
      .filter((s) => [...s].length >= minLength && [...s].length <= (schema.maxLength ?? 1e9));
  if (schema.format === 'date-time')
    return fc.date({ min: new Date('1990-01-01'), max: new Date('2100-01-01'),
                     noInvalidDate: true }).map((d) => d.toISOString());
  return fc.string({ unit: 'grapheme', minLength, maxLength })
    .filter((s) => [...s].length <= (schema.maxLength ?? 1e9) && !s.includes('\0'));
}

function object(schema, root) {
  const properties = {};
  for (const [name, value] of Object.entries(schema.properties ?? {}))
    properties[name] = fromSchema(value, root);
  if (schema.additionalProperties?.type || schema.additionalProperties?.oneOf) {
    const pointers = fc.constantFrom('/diameter', '/seed', '/potential/amplitude', '/x', '');
    const key = fc.oneof({ weight: 4, arbitrary: pointers }, fc.string({ maxLength: 8 }));
    return fc.dictionary(key, fromSchema(schema.additionalProperties, root), { maxKeys: 3 });
  }
  const known = fc.record(properties, { requiredKeys: (schema.required ?? [])
    .filter((key) => key in properties) });
  return schema.minProperties ? known.filter((o) => Object.keys(o).length >= schema.minProperties)
                              : known;
}

// A target is about something that is measured.
function aimed(job) {
  const [observable] = Object.keys(job.observables);
  return job.target ? { ...job, target: { ...job.target, observable } } : job;
}

// Jobs: anything that the schema allows, and as often a plain one with a few of its keys at random.
export function anyJob(schema) {
  const { properties, required } = schema;
  const names = Object.keys(properties).filter((name) => !required.includes(name));
  const plain = fc.record({
    particles: fc.constantFrom(1, 2, 10), length: fc.constantFrom(10, 20), diameter: fc.constantFrom(0, 0.5),
    time: fc.constantFrom(1, 10),
    observables: fc.constantFrom('energy', 'current', 'msd', 'density', 'cluster_sizes')
      .chain((name) => fc.record({ [name]: fromSchema(properties.observables.properties[name]) })) });
  const few = fc.subarray(names, { maxLength: 3 })
    .chain((some) => fc.record(Object.fromEntries(some.map((n) => [n, fromSchema(properties[n])]))));
  return fc.oneof(fromSchema(schema), fc.tuple(plain, few).map(([a, b]) => ({ ...a, ...b })))
    .map(aimed);
}

// Every place in a document: [path, ...] of keys, the whole one left out.
export function places(value, path = []) {
  if (value === null || typeof value !== 'object')
    return path.length ? [path] : [];
  const inner = Object.keys(value)
    .flatMap((key) => places(value[key], [...path, Array.isArray(value) ? Number(key) : key]));
  return path.length ? [path, ...inner] : inner;
}

export function replaced(value, path, change) {
  const copy = structuredClone(value);
  let at = copy;
  for (const key of path.slice(0, -1))
    at = at[key];
  change(at, path[path.length - 1]);
  return copy;
}

const odd = fc.oneof(
  fc.constantFrom(null, true, false, '', 'auto', [], {}, 0, -1, 1e300, -1e300, 5e-324, 0.5, 2 ** 53,
                  2 ** 53 + 2, 1e19, '\u0000', '1', [1], [null], { type: 'cosine' }, 'Auto', '\u00e9'),
  fc.double({ noNaN: true, noDefaultInfinity: true }), fc.integer(),
  fc.string({ unit: 'grapheme', maxLength: 12 }), fc.jsonValue({ maxDepth: 2 }));

// One change at one place: another value, the key gone, one more key.
export function mutated(value, place, kind, other) {
  const all = places(value);
  if (all.length === 0)
    return { ...value, extra: other };
  const path = all[place % all.length];
  return replaced(value, path, (at, key) => {
    if (kind === 'replace')
      at[key] = other;
    else if (kind === 'remove')
      Array.isArray(at) ? at.splice(key, 1) : delete at[key];
    else if (Array.isArray(at))
      at.push(other);
    else
      at[kind === 'misspell' ? `${key}x` : 'type'] = other;
  });
}

export const mutation = fc.record({
  place: fc.nat(1000), other: odd,
  kind: fc.constantFrom('replace', 'replace', 'replace', 'remove', 'add', 'misspell') });
