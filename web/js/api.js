// The service over HTTP: the one place that fetches. Paths of our own are written without a slash ("v1/jobs"), those of
// answers' links as they came.
import { tabStorage } from "./storage.js";
import { createStore } from "./store.js";

// What a problem document says (RFC 9457), or that nobody answered (status 0).
class Refusal extends Error {
  constructor(status, { title, detail = title, errors = [] }) {
    super(detail ?? `the server answered ${status}`);
    Object.assign(this, { status, title, errors }); // errors: [{pointer, value, detail, unit, did_you_mean}]
  }
}

const NO_ANSWER = {
  title: "The server does not answer",
  detail: "Is it running? Nothing is lost here.",
};

// The reason of a failure: a module that could not be fetched means that the server did not answer.
export const reason = (error) =>
  error instanceof TypeError && /module/i.test(error.message) ? new Refusal(0, NO_ANSWER) : error;

const KEY = "impactd.token";
let signIn = null; // () -> a promise of whether there is a token now
export const token = () => tabStorage.get(KEY);
export const setToken = (text) => tabStorage.set(KEY, text);
export const tokenChanges = createStore(0); // counts tokens given by hand: what was refused before is tried again
export function onUnauthorised(asks) {
  signIn = asks;
}

const home = new URL(".", document.baseURI);
export const address = (path) => new URL(path, home).href;

async function send(method, path, { json, body, type, headers, query, signal }) {
  const url = new URL(path, home);
  for (const [name, value] of Object.entries(query ?? {}))
    if ((value ?? "") !== "") url.searchParams.set(name, value);
  const kind = json ? "application/json" : type;
  const sent = {
    ...headers,
    ...(kind && { "Content-Type": kind }),
    ...(token() && { Authorization: `Bearer ${token()}` }),
  };
  try {
    return await fetch(url, {
      method,
      headers: sent,
      body: json ? JSON.stringify(json) : body,
      signal,
    });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Refusal(0, NO_ANSWER);
  }
}

let pageSignal = null; // aborted when the page in view is left
let declined; // the token, or that there is none, about which this page's reader was asked in vain
export function setPageSignal(signal) {
  pageSignal = signal;
  declined = undefined;
}

// One exchange; a Refusal where the answer is none. Options: json (a body), body and type (another one), headers, query
// (null leaves one out), signal: once it is aborted there is no answer, but what writes is sent whole. Without a signal the
// answer is for the page in view; with null it is wanted whatever page follows.
export async function ask(method, path, { signal = pageSignal, ...more } = {}) {
  const options = { ...more, signal: method === "GET" ? signal : null };
  const used = token();
  let response = await send(method, path, options);
  if (response.status === 401 && used !== declined) {
    if (token() !== used || (await signIn?.())) response = await send(method, path, options);
    if (response.status === 401) declined = token();
  }
  signal?.throwIfAborted();
  if (!response.ok) throw new Refusal(response.status, await response.json().catch(() => ({})));
  return response;
}

const json = async (path, query, signal) => (await ask("GET", path, { query, signal })).json();

// What is asked for while the modules of the page that will get() it are on their way.
const prefetched = new Map();
export function prefetch(path) {
  const answer = json(path);
  prefetched.set(path, answer);
  // The page that gets it shows a failure. What was aborted was another page's: the next one asks again.
  answer.catch(
    ({ name }) =>
      name === "AbortError" && prefetched.get(path) === answer && prefetched.delete(path),
  );
}

// The answer's JSON.
export function get(path, query, signal) {
  const answer = query ? null : prefetched.get(path);
  if (answer) prefetched.delete(path);
  return answer ?? json(path, query, signal);
}
export const post = async (path, json, options) =>
  (await ask("POST", path, { ...options, json })).json();
export const remove = async (path) => (await ask("DELETE", path)).json();

export async function wait(ms, signal) {
  await new Promise((resolve) => setTimeout(resolve, ms));
  signal?.throwIfAborted();
}

// Submits a scene; the job as it is at once, done or not.
export const submit = (scene) => post("v1/jobs", scene, { headers: { Prefer: "wait=1" } });

// What the scene would come to, without running it: faults come as a Refusal.
export const check = (scene) => post("v1/jobs?dry_run=1", scene);

// Follows a job to its end, which is returned: `onChange(job)` each second and at its end. While nobody answers (a daemon that
// starts anew takes its jobs up again) the job has `isLost`.
export async function follow(job, onChange, signal = pageSignal) {
  for (;;) {
    try {
      job = await get(`v1/jobs/${job.id}`, { wait: 1 }, signal);
      onChange(job);
      if (job.finished) return job;
    } catch (error) {
      if (!(error.status === 0 || error.status >= 500)) throw error;
      onChange({ ...job, isLost: true });
      await wait(1000, signal);
    }
  }
}

// Runs a scene to its end: the id of its result.
export async function runScene(scene) {
  const job = await submit(scene);
  const end = job.finished ? job : await follow(job, () => {});
  if (end.status !== "successful") throw Object.assign(new Error("The run failed"), end.problem);
  return end.result;
}

// A JSON Schema by name, asked for once.
const schemas = new Map();
export function getSchema(name) {
  if (!schemas.has(name)) schemas.set(name, get(`schemas/${name}`, null, null));
  schemas.get(name).catch(() => schemas.delete(name));
  return schemas.get(name);
}
