// SPDX-License-Identifier: GPL-3.0-or-later
// form.js - fields for a job, made from its JSON Schema: a parameter that is new there is here, too.
// The job holds only what was set; an empty field means the default, which it shows.
import { h, replace } from './dom.js';

const GROUPS = [
  ['Rods', ['particles', 'length', 'diameter', 'boundary', 'initial']],
  ['Forces', ['potential', 'interaction', 'force', 'temperature', 'mobility']],
  ['Run', ['time', 'equilibration_time', 'realizations', 'seed', 'target']],
  ['Measured', ['observables']],
  ['Method and time step', ['method', 'tolerance', 'time_step', 'sample_every', 'time_step_error', 'stability'], true],
  ['Name', ['label', 'tags', 'priority'], true],
];

const at = (job, path) => path.reduce((value, key) => value?.[key], job);
const pointerOf = (path) => `/${path.join('/')}`;

function put(job, path, value) {
  const last = path.at(-1);
  const holder = path.slice(0, -1).reduce((inner, key) => (inner[key] ??= {}), job);
  if (value === undefined)
    delete holder[last];
  else
    holder[last] = value;
}

// { element, show(errors) }: `job` is changed in place, `changed` called after each change.
export function form(schema, job, changed) {
  const fields = new Map(); // pointer -> { input, fault }
  const named = GROUPS.flatMap(([, names]) => names);
  const others = Object.keys(schema.properties).filter((name) => !named.includes(name) && name !== 'model');
  const groups = others.length ? [...GROUPS, ['Further', others, true]] : GROUPS;
  const context = { job, changed, fields };
  const element = h('div', null, groups.map(([title, names, less]) => {
    const inner = h('div', { class: 'fields' }, names.filter((name) => schema.properties[name])
      .map((name) => field(context, [name], schema.properties[name], schema.required.includes(name))));
    const open = names.some((name) => job[name] !== undefined);
    return less ? h('details', { open }, h('summary', null, title), h('fieldset', null, inner))
                : h('fieldset', null, h('legend', null, title), inner);
  }));
  return { element, show: (errors) => show(fields, errors) };
}

// Puts each fault beside its field; gives back those that have none.
function show(fields, errors) {
  for (const { input, fault } of fields.values()) {
    input.removeAttribute('aria-invalid');
    fault.textContent = '';
  }
  return errors.filter(({ pointer = '', detail }) => {
    const path = pointer.split('/');
    while (path.length > 1 && !fields.has(path.join('/')))
      path.pop();
    const found = fields.get(path.join('/'));
    if (!found || !found.input.isConnected)
      return true;
    found.input.setAttribute('aria-invalid', 'true');
    found.fault.textContent += `${found.fault.textContent ? '; ' : ''}${detail}`;
    found.input.closest('details')?.setAttribute('open', '');
    return false;
  });
}

let fieldCount = 0;
function frame(context, path, schema, needed, input, wide) {
  const id = `field${++fieldCount}`, fault = h('p', { class: 'fault', id: `${id}-fault` });
  const [what, ...more] = (schema.description ?? '').split(/; (?=unit: )|\. (?=[A-Z])/);
  input.id = id;
  input.setAttribute('aria-describedby', `${id}-note ${id}-fault`);
  if (needed)
    input.required = true;
  context.fields.set(pointerOf(path), { input, fault });
  return h('div', { class: `field${wide ? ' wide' : ''}`, 'data-pointer': pointerOf(path) },
    h('label', { for: id }, path.at(-1).replaceAll('_', ' '), needed ? ' *' : ''), input,
    h('p', { class: 'note', id: `${id}-note`, title: more.join('. ') }, what), fault);
}

function field(context, path, schema, needed) {
  if (path[0] === 'observables' && path.length === 1)
    return observables(context, path, schema);
  const kinds = schema.oneOf ?? [schema];
  if (kinds.some((k) => k.type === 'object'))
    return choice(context, path, schema, kinds);
  if (schema.enum)
    return frame(context, path, schema, needed, select(context, path, schema));
  const list = kinds.find((k) => [k.type].flat().includes('array'));
  const number = kinds.some((k) => ['number', 'integer'].includes([k.type].flat()[0]));
  return frame(context, path, schema, needed,
               list ? typed(context, path, schema, (text) => text.split(/[\s,]+/).filter(Boolean)
                 .map((word) => (list.items.type === 'number' ? read(word) : word)), (v) => v.join(', '))
                    : typed(context, path, schema, number ? read : (text) => text, String), list !== undefined);
}

// What is no number is left as it is: the server says what is wrong with it.
const read = (text) => (/^\s*[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?\s*$/i.test(text) ? Number(text) : text.trim());

function typed({ job, changed }, path, schema, parse, print) {
  const value = at(job, path), usual = schema.default;
  return h('input', { type: 'text', autocomplete: 'off', spellcheck: 'false',
    placeholder: usual === undefined || usual === null ? '' : Array.isArray(usual) ? usual.join(', ') : String(usual),
    value: value === undefined || value === null ? '' : print(value), oninput: ({ target }) => {
      put(job, path, target.value.trim() === '' ? undefined : parse(target.value));
      changed();
    } });
}

function select({ job, changed }, path, schema) {
  const input = h('select', { onchange: () => {
    put(job, path, input.value === String(schema.default) ? undefined : input.value);
    changed();
  } }, schema.enum.map((word) => h('option', { value: word }, word)));
  input.value = at(job, path) ?? schema.default ?? schema.enum[0];
  return input;
}

// One of several kinds of object, or none: potentials, interactions, a target.
function choice(context, path, schema, kinds) {
  const { job, changed } = context;
  const objects = kinds.filter((k) => k.type === 'object');
  const nameOf = (kind) => kind.properties.type?.const ?? 'given';
  const input = h('select', { onchange: () => {
    const kind = objects.find((k) => nameOf(k) === input.value);
    put(job, path, kind && (kind.properties.type ? { type: input.value } : {}));
    fill();
    changed();
  } }, h('option', { value: '' }, 'none'), objects.map((k) => h('option', { value: nameOf(k) }, nameOf(k))));
  const now = at(job, path);
  input.value = now ? now.type ?? 'given' : '';
  const inner = h('div', { class: 'fields' }), doc = h('p', { class: 'note' });
  function fill() {
    const kind = objects.find((k) => nameOf(k) === input.value);
    for (const pointer of [...context.fields.keys()])
      if (pointer.startsWith(`${pointerOf(path)}/`))
        context.fields.delete(pointer);
    doc.textContent = kind?.description ?? '';
    replace(inner, kind && Object.entries(kind.properties).filter(([name]) => name !== 'type')
      .map(([name, s]) => field(context, [...path, name], s, kind.required?.includes(name))));
  }
  fill();
  return h('div', { class: 'field wide' }, frame(context, path, schema, false, input), doc, inner);
}

function observables(context, path, schema) {
  const { job, changed } = context;
  const fault = h('p', { class: 'fault' }), first = h('span');
  const rows = Object.entries(schema.properties).map(([name, kind]) => {
    const inner = h('div', { class: 'fields' });
    const fill = () => replace(inner, at(job, [...path, name]) && Object.entries(kind.properties)
      .map(([key, s]) => field(context, [...path, name, key], s, kind.required.includes(key))));
    const box = h('input', { type: 'checkbox', checked: at(job, [...path, name]) !== undefined, onchange: () => {
      put(job, [...path, name], box.checked ? {} : undefined);
      fill();
      changed();
    } });
    context.fields.set(pointerOf([...path, name]), { input: box, fault });
    fill();
    return h('div', { class: 'observable' }, h('label', null, box, ` ${name.replaceAll('_', ' ')} `,
      h('span', { class: 'note' }, kind.description)), inner);
  });
  context.fields.set(pointerOf(path), { input: first, fault });
  return h('div', { class: 'field wide' }, first, fault, rows);
}
