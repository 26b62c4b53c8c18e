// SPDX-License-Identifier: GPL-3.0-or-later
// job_schema.mjs - the JSON Schema of a job and the server say the same: what it accepts is never
// refused for one field alone, and what is refused for one field alone it does not accept.
import { readFileSync, readdirSync } from 'node:fs';
import { ask, expect, fc, finish, forAll, readJson, test, validator } from './tools.mjs';
import { anyJob, mutated, mutation } from './jobs.mjs';

const schema = readJson('schema/job.schema.json');
const valid = validator().compile(schema);

// How the server words what one field alone can be refused for (engine/param.c, scene_json.c).
const single = [
  /^must be (an integer|a number) (above|at least) /, /^must be (above|at least) \S+ and at most /,
  /^must be a finite number/, /^must be (an integer|a number|a number or "auto"|a word|a text)(, not|$)/,
  /^must be (an object|an object such as \{\}|a list of numbers|one of .*)(, not|$)/s,
  /^must hold \d+ to \d+ numbers/, /^must be \d+ to \d+ characters long/, /^must be printable ASCII/,
  /^unknown/, /^is required: (?!at least)/, /^is required: at least one observable/,
  /^holds \\u0000/, /is too large$/,
  /^has \d+ characters/, /^a tag is /, /^must be a whole number from/, /^must be a list of at most/,
];
const alone = (fault) => single.some((words) => words.test(fault.detail));

async function verdict(job) {
  const answer = await ask('POST', '/v1/estimate', { body: JSON.stringify(job) });
  expect([200, 422].includes(answer.status), 'status', answer.status, answer.text);
  return { accepted: answer.status === 200, single: (answer.json.errors ?? []).filter(alone), answer };
}

await test('the schema is served', async () => {
  const { status, type, text } = await ask('GET', '/v1/schema/job');
  expect(status === 200 && type === 'application/schema+json', status, type);
  expect(text === readFileSync('schema/job.schema.json', 'utf8'), 'another text');
});

const folders = ['tests/scenes', 'tests/scenes/full'];
const scenes = folders.flatMap((folder) =>
  readdirSync(folder).filter((name) => name.endsWith('.json')).map((name) => `${folder}/${name}`));
await test('every scene of the papers is a job by the schema', () => {
  expect(scenes.length === 60, 'scenes', scenes.length);
  for (const file of scenes)
    expect(valid(readJson(file)), file, valid.errors);
});

await test('what the server completes is a job by the schema, and the same one', async () => {
  for (const file of scenes.slice(0, 8)) {
    const { json } = await ask('POST', '/v1/jobs', { body: JSON.stringify(readJson(file)) });
    expect(valid(json.job), file, valid.errors);
    const again = await ask('POST', '/v1/jobs', { body: JSON.stringify(json.job) });
    expect(again.status === 200 && again.json.id === json.id, file, again.status);
    await ask('DELETE', `/v1/jobs/${json.id}`);
  }
});

let accepted = 0;
await test('a job that the schema accepts is not refused for one field alone', () =>
  forAll(250, anyJob(schema), async (job) => {
    expect(valid(job), 'the generator is wrong', valid.errors);
    const said = await verdict(job);
    accepted += said.accepted;
    expect(said.single.length === 0, said.single);
  }));

await test('a fault of one field is one to both or to neither', () =>
  forAll(500, fc.tuple(anyJob(schema), mutation), async ([job, { place, kind, other }]) => {
    const faulty = mutated(job, place, kind, other);
    const said = await verdict(faulty);
    expect(valid(faulty) === (said.single.length === 0), 'schema:', valid.errors, 'server:',
           said.answer.text);
  }));

await test('both were asked about jobs of either kind', () => expect(accepted > 20, accepted));
finish();
