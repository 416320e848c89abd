// SPDX-License-Identifier: MIT
// The jobs on the server: submit the view that shows as one, watch them, pause, cancel, forget.
import { announce, button, count, el } from "./dom.js";
import { refill } from "./docks.js";
import { notice, showProblem } from "./messages.js";

const POLL_MS = 1000;
const REST_MS = 5000; // while no job runs
const SHOWN = /\.(png|jpe?g|webp)$/i; // what a browser can show
const SHOWN_FAILURES = 5;

const KEY_FRAMES = 24; // from one key of a camera path to the next

/** What the camera of the frames does. */
const CAMERAS = { turntable: "Goes round the scene", still: "As in the view", keys: "Goes through keys" };

const isOver = ({ ended }) => ended !== null;

export class JobsPanel {
  jobs = null; // null: not listed yet
  open = new Map(); // by id, what is known of the jobs whose details show: {job, frame}
  asked = { frames: "1-48", camera: "turntable", format: "png" };
  keys = []; // of the camera: {frame, camera}

  /** @param {{isOpen: () => boolean, wanted: () => object|null}} actions wanted: the view that shows */
  constructor(panel, client, actions) {
    Object.assign(this, { panel, client, actions });
    this.form = this.#form(); // stays: people type in it while the list below is filled anew
    this.list = el("div");
    panel.append(this.form, this.list);
    this.fill();
  }

  /** Lists the jobs now, and from then on while the panel shows. */
  async show() {
    clearTimeout(this.timer);
    if (!this.actions.isOpen() || document.hidden) {
      this.timer = setTimeout(() => this.show(), REST_MS);
      return;
    }
    try {
      this.jobs = await this.client.jobs();
      for (const id of this.open.keys()) await this.#look(id);
    } catch (problem) {
      if (!this.hasFailed) showProblem(problem, "The jobs cannot be listed");
      this.hasFailed = true;
    }
    this.fill();
    const isBusy = this.jobs?.some((job) => !isOver(job));
    this.timer = setTimeout(() => this.show(), isBusy ? POLL_MS : REST_MS);
  }

  /** Brings what shows of a job up to date: its newest picture, its failures. */
  async #look(id) {
    const known = this.jobs.find((job) => job.id === id);
    if (!known) {
      this.open.delete(id);
      return;
    }
    const old = this.open.get(id);
    if (old?.job?.sequence === known.sequence) return;
    const job = await this.client.job(id);
    const first = Math.max(0, job.frames.done + job.frames.failed - 4);
    const { frames } = await this.client.jobFrames(id, { first, count: 8 });
    const shown = frames.filter(({ files }) => files.some(({ file }) => SHOWN.test(file))).at(-1);
    this.open.set(id, { job, frame: shown ?? old?.frame ?? null });
  }

  async #do(what, act) {
    try {
      await act();
    } catch (problem) {
      showProblem(problem, what);
    }
    await this.show();
  }

  async #submit() {
    const wanted = this.actions.wanted();
    if (!wanted) return;
    const { scene, stream: _, ...view } = wanted;
    await this.#do("The job was not taken", async () => {
      const job = await this.client.createJob({ scene, view, frames: this.asked.frames,
        ...(this.asked.camera === "turntable" && { turntable: {} }),
        ...(this.asked.camera === "keys" && { camera_path: { keys: this.#keysInOrder() } }),
        outputs: [{ name: "color", format: this.asked.format }] });
      this.open.set(job.id, {});
      notice(`Job ${job.id.slice(0, 8)} is submitted`);
      announce(`A job of ${count(job.request.frames ? job.frames.count : 1)} frames is submitted`);
    });
  }

  #form() {
    const { asked } = this;
    return el("form", { class: "job-form", onsubmit: (event) => {
      event.preventDefault();
      this.#submit();
    } },
    el("label", {}, el("span", { class: "fine" }, "Frames"),
      el("input", { type: "text", value: asked.frames, required: true,
        "aria-label": "Frames of the job", title: "Numbers and ranges, such as 1-100,120-140x2",
        onchange: (event) => { asked.frames = event.target.value; } })),
    el("label", {}, el("span", { class: "fine" }, "Format"),
      el("select", { "aria-label": "Format of the frames",
        onchange: (event) => { asked.format = event.target.value; } },
      ["png", "jpeg", "webp", "exr"].map((name) =>
        el("option", { value: name, selected: name === asked.format }, name.toUpperCase())))),
    el("label", {}, el("span", { class: "fine" }, "Camera"),
      el("select", { "aria-label": "Camera of the frames", onchange: (event) => {
        asked.camera = event.target.value;
        this.#fillKeys();
      } },
      Object.entries(CAMERAS).map(([name, text]) =>
        el("option", { value: name, selected: name === asked.camera }, text)))),
    this.keyList = el("div"),
    this.submitter = button({ text: "Render this view as a job", icon: "render", class: "primary",
      type: "submit" }));
  }

  /** Keys as a job takes them. */
  #keysInOrder() {
    return this.keys.map(({ frame, camera }) => ({ frame, ...camera }))
      .sort((a, b) => a.frame - b.frame);
  }

  #addKey() {
    const { camera } = this.actions.wanted() ?? {};
    if (!camera) return;
    const last = Math.max(...this.keys.map(({ frame }) => frame));
    const first = Number.parseInt(this.asked.frames, 10) || 0;
    this.keys.push({ frame: this.keys.length > 0 ? last + KEY_FRAMES : first, camera });
    announce(`${count(this.keys.length)} keys of the camera`);
    this.#fillKeys();
  }

  /** The keys, where the camera goes through them. */
  #fillKeys() {
    this.keyList.replaceChildren();
    if (this.asked.camera !== "keys") return;
    const rows = this.keys.map((key, index) => el("div", { class: "job-key" },
      el("label", {}, el("span", { class: "fine" }, `Key ${index + 1}`),
        el("input", { type: "number", value: key.frame, step: "any", required: true,
          "aria-label": `Frame of key ${index + 1}`, title: "The frame at which the camera is there",
          onchange: (event) => { key.frame = event.target.valueAsNumber; } })),
      button({ label: `Remove key ${index + 1}`, icon: "remove", class: "plain",
        onclick: () => {
          this.keys.splice(index, 1);
          this.#fillKeys();
        } })));
    const advice = rows.length < 2
      && el("p", { class: "fine" }, "Move the view and add what it shows, twice or more.");
    this.keyList.append(...rows, ...(advice ? [advice] : []),
      button({ text: "Add this view as a key", icon: "camera", onclick: () => this.#addKey() }));
  }

  #buttons(job) {
    const name = job.name ?? job.id.slice(0, 8);
    const change = (label, iconName, act) => button({ label: `${label} ${name}`, icon: iconName,
      class: "plain", onclick: () => this.#do(`${label}: not done`, act) });
    if (!isOver(job))
      return [job.paused
        ? change("Resume", "play", () => this.client.changeJob(job.id, { paused: false }))
        : change("Pause", "pause", () => this.client.changeJob(job.id, { paused: true })),
      change("Cancel", "stop", () => this.client.cancelJob(job.id))];
    return [job.frames.failed > 0
      && change("Try failed frames again:", "reset", () => this.client.changeJob(job.id, { retry_failed: true })),
    button({ label: `Forget ${name}`, icon: "remove", class: "plain", onclick: () => {
      if (confirm(`Forget ${name}? The results that the server keeps are removed.`))
        this.#do("It was not forgotten", () => this.client.forgetJob(job.id));
    } })];
  }

  #nameOf(id) {
    return this.jobs.find((job) => job.id === id)?.name ?? id.slice(0, 8);
  }

  #said(job) {
    const { done, failed, count: all } = job.frames;
    const state = job.paused && !isOver(job) ? "paused" : job.state;
    const left = job.remaining_s !== null && job.state === "running" && !job.paused
      ? `, ${count(Math.ceil(job.remaining_s))} s left` : "";
    const after = job.waits_for.length > 0 ? ` for ${job.waits_for.map((id) => this.#nameOf(id)).join(", ")}` : "";
    return `${state}${after}: ${count(done)} of ${count(all)} frames${failed ? `, ${count(failed)} failed` : ""}${left}`;
  }

  /** The newest picture, the reasons, and where the files are. */
  #details({ job, frame }) {
    if (!job) return el("p", { class: "fine job-details" }, "…");
    const file = frame?.files.find((one) => SHOWN.test(one.file));
    return el("div", { class: "job-details" },
      file && el("img", { src: file.href, alt: `Frame ${frame.frame}`, loading: "lazy" }),
      job.problem && el("p", { class: "job-problem" }, job.problem.detail),
      job.expires && el("p", { class: "fine" }, `Kept until ${new Date(job.expires).toLocaleDateString()}`),
      job.failures.slice(0, SHOWN_FAILURES).map(({ frame: number, attempts, problem }) =>
        el("p", { class: "job-problem" }, `Frame ${number}, ${attempts} attempts: ${problem.detail}`)),
      job.frames.done > 0 && el("a", { href: `/v1/jobs/${job.id}/results.tar`, download: "" },
        "All files, as an archive"));
  }

  #item(job) {
    const name = job.name ?? `Job ${job.id.slice(0, 8)}`;
    const details = this.open.get(job.id);
    const toggle = () => {
      if (!this.open.delete(job.id)) this.open.set(job.id, {});
      this.show();
    };
    return el("li", { class: "scene job", "data-open": details ? "" : undefined },
      el("button", { type: "button", class: "scene-open", "data-key": job.id,
        "aria-expanded": String(Boolean(details)), onclick: toggle },
      el("strong", {}, name), el("span", { class: "fine" }, this.#said(job)),
      el("progress", { max: 1, value: job.progress, "aria-label": `Progress of ${name}` })),
      this.#buttons(job), details && this.#details(details));
  }

  fill() {
    this.submitter.disabled = !this.actions.wanted();
    refill(this.list,
      el("ul", { class: "scenes", "aria-label": "Jobs on the server" },
        (this.jobs ?? []).map((job) => this.#item(job))),
      this.jobs?.length === 0 && el("p", { class: "fine" }, "There is no job on this server yet."));
  }
}
