// SPDX-License-Identifier: GPL-3.0-or-later
// tools.mjs - what the tests in this folder share. Their packages are in $B/node (make node-modules):
// nothing is installed into the source tree.
//
//   BCD_URL    the daemon that is asked       BCD_SEED    first seed of the random requests
//   BCD_RUNS   multiplies how many there are (1)
import http from 'node:http';
import { createRequire } from 'node:module';
import { resolve } from 'node:path';
import { readFileSync } from 'node:fs';

const build = process.env.B ?? 'build';
export const require = createRequire(resolve(build, 'node', 'package.json'));
const formats = require('ajv-formats').default;
const { default: Ajv2020 } = require('ajv/dist/2020.js');
export const fc = require('fast-check');
export const modules = resolve(build, 'node', 'node_modules');

export const url = process.env.BCD_URL;
const runs = Number(process.env.BCD_RUNS ?? 1);
export const long = runs > 1;
const seed = Number(process.env.BCD_SEED ?? 1);

export function validator(options) {
  const ajv = new Ajv2020({ allErrors: true, strict: true, strictTypes: false, strictRequired: false,
                            ...options });
  formats(ajv);
  return ajv;
}

export function readJson(file) {
  return JSON.parse(readFileSync(file, 'utf8'));
}

// ---------------------------------------------------------------- TAP
let count = 0, failed = 0;

export async function test(name, body) {
  count++;
  try {
    await body();
    console.log(`ok ${count} - ${name}`);
  } catch (error) {
    failed++;
    console.log(`not ok ${count} - ${name}`);
    console.log(String(error?.stack ?? error).slice(0, 8000).replace(/^/gm, '# '));
  }
}

export function finish() {
  agent.destroy();
  console.log(`1..${count}`);
  process.exitCode = failed ? 1 : 0;
}

export function expect(condition, ...words) {
  if (!condition)
    throw new Error(words.map((w) => (typeof w === 'string' ? w : JSON.stringify(w))).join(' '));
}

// Random inputs, the same ones every time unless BCD_SEED says otherwise.
export function forAll(many, arbitrary, body) {
  return fc.assert(fc.asyncProperty(arbitrary, body),
                   { seed, numRuns: Math.ceil(many * runs), endOnFailure: false, includeErrorInReport: true,
                     interruptAfterTimeLimit: 240000 * Math.max(1, runs),
                     markInterruptAsFailure: true });
}

// ---------------------------------------------------------------- HTTP
const agent = new http.Agent({ keepAlive: true, maxSockets: 8 });

// What came back: { status, type (without parameters), headers, text, json }. An event stream is
// listened to for a moment.
export function ask(method, path, { body, headers = {} } = {}) {
  const bytes = body === undefined ? undefined : Buffer.from(body);
  const given = Object.keys(headers).some((name) => name.toLowerCase() === 'content-type');
  if (bytes !== undefined)
    headers = { ...(given ? {} : { 'content-type': 'application/json' }), ...headers,
                'content-length': bytes.length };
  return new Promise((resolve, reject) => {
    const { hostname, port } = new URL(url);
    const request = http.request({ hostname, port, method, path, headers, agent }, (answer) => {
      const parts = [];
      const type = (answer.headers['content-type'] ?? '').split(';')[0];
      const done = () => {
        const all = Buffer.concat(parts), text = all.toString();
        let json;
        try {
          if (/[/+]json$/.test(type) && text)
            json = JSON.parse(text);
        } catch (error) {
          reject(error);
        }
        resolve({ status: answer.statusCode, type, headers: answer.headers, bytes: all, text, json });
      };
      answer.on('data', (part) => parts.push(part));
      answer.on('end', done);
      answer.on('error', reject);
      if (type === 'text/event-stream')
        setTimeout(() => { done(); request.destroy(); }, 100);
    });
    request.on('error', reject);
    request.setTimeout(long ? 120000 : 70000, () => request.destroy(new Error(`no answer: ${method} ${path}`)));
    request.end(bytes);
  });
}

export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
