// SPDX-License-Identifier: GPL-3.0-or-later
// place.js - where the page is: #view/id?query. The query is the view's state, so that a link holds it.

export function place() {
  const [path, query = ''] = split(location.hash.slice(1), '?');
  const [view, id = ''] = split(path, '/');
  return { view: view || 'jobs', id, query: parse(query) };
}

function split(text, at) {
  const index = text.indexOf(at);
  return index < 0 ? [text] : [text.slice(0, index), text.slice(index + 1)];
}

// A query as pairs, in order. Names may end in > or <, as the API's filters do; what is typed by hand
// need not be escaped.
export function parse(query) {
  return query.replace(/^\?/, '').split('&').filter((pair) => pair.trim()).map((pair) => {
    const [name, value = ''] = split(pair, '=');
    return [decode(name.trim()), decode(value.trim())];
  });
}
function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

export function print(pairs) {
  const escape = (text) => encodeURIComponent(text).replace(/%(?:2C|2F|3A)/g, decodeURIComponent); // , / :
  return pairs.map(([name, value]) => `${escape(name)}=${escape(value)}`).join('&');
}
// For people: escaped as little as can be read back.
export function show(pairs) {
  return pairs.map(([name, value]) => `${name}=${value.replace(/[%&]/g, encodeURIComponent)}`).join('&');
}

export const value = (pairs, name) => pairs.find(([n]) => n === name)?.[1];
export function put(pairs, name, text) {
  const rest = pairs.filter(([n]) => n !== name);
  return text === undefined || text === null || text === '' ? rest : [...rest, [name, String(text)]];
}

export function link(view, id, pairs = []) {
  const query = print(pairs);
  return `#${view}${id ? `/${id}` : ''}${query ? `?${query}` : ''}`;
}
export function go(view, id, pairs) {
  location.hash = link(view, id, pairs);
}
// The same view in another state: no new entry in the history, and the view is not begun anew.
export function note(pairs) {
  const { view, id } = place();
  history.replaceState(null, '', link(view, id, pairs));
}
