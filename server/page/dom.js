// SPDX-License-Identifier: GPL-3.0-or-later
// dom.js - elements. Text only ever becomes text nodes: what the server says is never markup.
const SVG = 'http://www.w3.org/2000/svg';

// h('button', { class: 'quiet', onclick: go }, 'Go'): attributes that are null or false are left out,
// on... are listeners, value and checked are properties.
export function h(tag, props, ...children) {
  return fill(document.createElement(tag), props, children);
}

// The same for parts of pictures.
export function s(tag, props, ...children) {
  return fill(document.createElementNS(SVG, tag), props, children);
}

function fill(element, props, children) {
  for (const [name, value] of Object.entries(props ?? {})) {
    if (value === null || value === undefined || value === false)
      continue;
    if (name.startsWith('on'))
      element.addEventListener(name.slice(2), value);
    else if (name === 'value' || name === 'checked')
      element[name] = value;
    else
      element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat(2).filter((c) => c !== null && c !== undefined && c !== false));
  return element;
}

export function replace(element, ...children) {
  element.replaceChildren(...children.flat(2).filter((c) => c !== null && c !== undefined && c !== false));
}

// A button that waits for what it began, and shows what went wrong beside itself.
export function action(words, begin, props) {
  const failed = h('span', { class: 'fault', role: 'alert' });
  const button = h('button', { type: 'button', ...props, onclick: async () => {
    button.disabled = true;
    failed.textContent = '';
    try {
      await begin();
    } catch (error) {
      failed.textContent = error.message;
    }
    button.disabled = false;
  } }, words);
  return h('span', { class: 'action' }, button, failed);
}

// A line of shell, to be copied.
export function shellLine(line) {
  const text = h('code', { tabindex: '0' }, line);
  const copy = h('button', { type: 'button', class: 'quiet', onclick: async () => {
    try {
      await navigator.clipboard.writeText(text.textContent);
      copy.textContent = 'Copied';
    } catch { // no right to: selected, for the keyboard
      getSelection().selectAllChildren(text);
      copy.textContent = 'Selected';
    }
    setTimeout(() => { copy.textContent = 'Copy'; }, 1500);
  } }, 'Copy');
  return h('div', { class: 'shell' }, text, copy);
}

// Calls `what` once things have been quiet for `ms`: for what is typed.
export function later(ms, what) {
  let timer;
  return (...args) => {
    clearTimeout(timer);
    timer = setTimeout(() => what(...args), ms);
  };
}

// Calls `what` within pause() ms, one call at a time, and again if it was wanted meanwhile: for what
// happens all the time and is never quiet.
export function paced(pause, what) {
  let wanted = false, going = false;
  return async () => {
    wanted = true;
    if (going)
      return;
    going = true;
    while (wanted) {
      await new Promise((resolve) => setTimeout(resolve, pause()));
      wanted = false;
      await what();
    }
    going = false;
  };
}
