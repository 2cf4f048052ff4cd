// A daemon of its own for a file of tests: any free port, a folder that is gone afterwards. Not a client for users.
import { spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

export class Daemon {
  // With `url` it stands for a daemon that runs already.
  constructor(build, url) {
    this.url = url?.replace(/\/$/, "");
    if (url) return;
    this.program = path.join(build, "impactd");
    this.data = fs.mkdtempSync(path.join(os.tmpdir(), "impactd-browser-"));
    this.port = 0;
  }

  // Starts it, the second time on the port that it had.
  async start(...options) {
    if (!this.program) return;
    this.process = spawn(this.program, ["serve", "--listen", `127.0.0.1:${this.port}`, "--data", this.data, ...options]);
    let said = "";
    this.process.stderr.on("data", (bytes) => (said += bytes));
    await new Promise((resolve, reject) => {
      const failed = () => reject(new Error(`impactd does not start: ${said.slice(-2000)}`));
      this.process.once("error", failed);
      this.process.once("exit", failed);
      this.process.stdout.on("data", (bytes) => {
        said += bytes;
        const found = /listens on (http:\/\/[^/\s]+:(\d+))/.exec(said);
        if (!found) return;
        this.url = found[1];
        this.port = Number(found[2]);
        this.process.off("exit", failed);
        resolve();
      });
    });
  }

  async stop() {
    if (!this.process || this.process.exitCode !== null || this.process.signalCode !== null) return;
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.process.kill("SIGTERM");
    await ended;
  }

  async end() {
    await this.stop();
    if (this.data) fs.rmSync(this.data, { recursive: true, force: true });
  }

  async ask(method, target, json, headers = {}) {
    const response = await fetch(new URL(target, this.url), {
      method,
      headers: { ...(json === undefined ? {} : { "Content-Type": "application/json" }), ...headers },
      body: json === undefined ? undefined : JSON.stringify(json),
    });
    const text = await response.text();
    if (!response.ok) throw new Error(`${method} ${target}: ${response.status} ${text.slice(0, 500)}`);
    return JSON.parse(text);
  }

  get(target) {
    return this.ask("GET", target);
  }

  example(name) {
    return this.get(`/v1/examples/${name}`);
  }

  // Runs a scene, or an example by name, with `changes` in its outermost members; the finished job.
  async run(scene, changes = {}) {
    const whole = { ...(typeof scene === "string" ? await this.example(scene) : scene), ...changes };
    let job = await this.ask("POST", "/v1/jobs", whole, { Prefer: "wait=20" });
    while (job.finished === null) job = await this.get(`/v1/jobs/${job.id}?wait=20`);
    if (job.status !== "successful") throw new Error(`job ${job.id}: ${job.status} ${JSON.stringify(job.problem)}`);
    return job;
  }
}
