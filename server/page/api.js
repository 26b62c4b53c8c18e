// SPDX-License-Identifier: GPL-3.0-or-later
// api.js - requests to the server that served the page, with the token of this tab.
const KEY = 'bcd-token';

export const token = () => sessionStorage.getItem(KEY) ?? '';
export function keepToken(text) {
  if (text)
    sessionStorage.setItem(KEY, text);
  else
    sessionStorage.removeItem(KEY);
}

// What the server says is wrong (RFC 9457); status 0: it did not answer.
export class Problem extends Error {
  constructor(status, body) {
    super(body?.detail ?? body?.title ?? `status ${status}`);
    this.status = status;
    this.title = body?.title ?? '';
    this.errors = body?.errors ?? [];
    this.estimate = body?.estimate;
  }
}

async function send(method, path, { body, signal, headers } = {}) {
  const all = { ...headers };
  if (token())
    all.Authorization = `Bearer ${token()}`;
  if (body !== undefined)
    all['Content-Type'] = 'application/json';
  let answer;
  try {
    answer = await fetch(path, { method, headers: all, signal, body: body === undefined ? undefined
      : typeof body === 'string' ? body : JSON.stringify(body), cache: 'no-cache' });
  } catch (error) {
    if (signal?.aborted)
      throw error;
    throw new Problem(0, { detail: 'The server does not answer.' });
  }
  if (answer.ok)
    return answer;
  const problem = new Problem(answer.status, await answer.json().catch(() => null));
  if (answer.status === 401)
    document.dispatchEvent(new CustomEvent('token-wanted', { detail: problem.message }));
  throw problem;
}

// The answer's JSON; `ask` tells the status beside it.
export async function get(path, signal) {
  return (await send('GET', path, { signal })).json();
}
export async function ask(method, path, body, signal) {
  const answer = await send(method, path, { body, signal });
  return { status: answer.status, json: await answer.json() };
}
export async function text(path, signal) {
  return (await send('GET', path, { signal })).text();
}

async function* linesOf(answer) {
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  for (;;) {
    const { value, done } = await reader.read();
    const lines = (rest + (value ?? '')).split('\n');
    rest = lines.pop();
    yield* lines;
    if (done)
      return;
  }
}

// JSON line by line, as it comes.
export async function* rows(path, signal) {
  for await (const line of linesOf(await send('GET', path, { signal })))
    yield JSON.parse(line);
}

// Server-Sent Events by fetch, for those of the browser's own kind send no token. Ends with the stream.
export async function* events(path, { signal, last } = {}) {
  const headers = { Accept: 'text/event-stream', ...(last ? { 'Last-Event-ID': last } : {}) };
  let event = {};
  for await (const raw of linesOf(await send('GET', path, { signal, headers }))) {
    const line = raw.replace(/\r$/, '');
    if (line === '' && event.data !== undefined)
      yield { type: event.event ?? 'message', id: event.id, data: JSON.parse(event.data) };
    if (line === '')
      event = {};
    const [, name, value] = /^(\w+): ?(.*)$/.exec(line) ?? [];
    if (name === 'data')
      event.data = (event.data ?? '') + value;
    else if (name)
      event[name] = value;
  }
}

const quote = (word) => `'${word.replaceAll("'", "'\\''")}'`;

// What gets the same from a shell.
export function curl(path, { method, body } = {}) {
  const words = ['curl -s'];
  if (token())
    words.push('-H "Authorization: Bearer $BCD_TOKEN"');
  if (method && (method !== 'POST' || body === undefined))
    words.push(`-X ${method}`);
  words.push(quote(location.origin + path));
  if (body !== undefined)
    words.push(`-d ${quote(JSON.stringify(body))}`);
  return words.join(' ');
}

// An answer as a file of the user's.
export async function save(path, name) {
  const url = URL.createObjectURL(await (await send('GET', path)).blob());
  const a = document.createElement('a');
  a.href = url;
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
