// SPDX-License-Identifier: MIT
// The statistics over the picture: what the last frame cost, pass by pass, and why.
import { byId, bytes, count, el, number, replace } from "./dom.js";
import { facts } from "./fields.js";

const HISTORY = 60; // frames of the small chart

const ms = (value) => `${value < 10 ? value.toFixed(2) : value.toFixed(0)} ms`;

/** Of a pass, whose time some devices do not tell. */
const time = (value) => (value === null ? "–" : ms(value));

export class Overlay {
  #times = [];
  #frame = null;
  #report = null;

  constructor(client) {
    this.client = client;
    this.root = byId("overlay");
    this.chart = el("canvas", { class: "chart", width: 240, height: 36, role: "img",
      "aria-label": "Time of the last frames" });
    this.body = el("div");
    replace(this.root, this.chart, this.body);
  }

  get isShown() {
    return !this.root.hidden;
  }

  toggle(isShown = !this.isShown) {
    this.root.hidden = !isShown;
    if (isShown) this.#refresh();
  }

  add(frame) {
    this.#frame = frame;
    this.#times.push(frame.timings?.total ?? 0);
    if (this.#times.length > HISTORY) this.#times.shift();
    if (frame.isExact) this.#report = null;
    if (this.isShown) this.#refresh();
  }

  /** Only frames at rest have their report read: moving ones come too fast to be read by people. */
  async #refresh() {
    this.#draw();
    if (!this.#frame) return;
    const frame = this.#frame;
    this.#fill();
    if (!frame.isExact || !frame.frame || this.#report?.id === frame.frame) return;
    const report = await this.client.frame(frame.frame).catch(() => null);
    if (report && this.#frame === frame) {
      this.#report = report;
      this.#fill();
    }
  }

  #fill() {
    const { timings, width, height, scale, isExact } = this.#frame;
    const report = this.#report;
    const size = this.#frame.bytes;
    replace(this.body,
      facts([
        ["Frame", `${width} × ${height}${isExact ? ", exact" : `, ${Math.round(100 * scale)} %`}`],
        timings?.total !== undefined && ["Total", ms(timings.total)],
        size && ["Transfer", bytes(size)],
      ]),
      report ? this.#passes(report) : this.#timings(timings ?? {}));
  }

  #timings(timings) {
    return facts(Object.entries(timings).filter(([name]) => name !== "total")
      .map(([name, value]) => [name, time(value)]));
  }

  #passes(report) {
    const most = Math.max(...report.plan.map(({ ms: taken }) => taken ?? 0), 1e-9);
    const rows = report.plan.map(({ pass, technique, because, ms: taken }) => {
      const bar = el("span", { class: "time-bar" });
      bar.style.width = taken === null ? "0" : `${Math.max(1, (100 * taken) / most)}%`;
      return el("tr", { title: because }, el("th", { scope: "row" }, pass, technique
        && el("small", {}, ` ${technique}`)), el("td", { class: "time" }, bar, time(taken)));
    });
    const { counts, error, warnings, reused } = report;
    return [
      el("table", { class: "passes" }, el("caption", { class: "hidden-text" }, "Passes of the frame"),
        el("tbody", {}, rows)),
      facts([
        counts.triangles > 0 && ["Triangles", count(counts.triangles)], // drawn; rays draw none
        ["Lights", counts.shadow_rays > 0 ? count(counts.lights)
          : `${count(counts.lights)}, ${count(counts.shadowed_lights)} with shadow`],
        counts.shadow_rays > 0 && ["Shadow rays", count(counts.shadow_rays)],
        counts.events > 0 && ["Shadow events", `${count(counts.events)}, longest ${counts.longest_list}`],
        counts.transparent_fragments > 0 && ["Layers",
          `${count(counts.transparent_fragments)}, deepest ${counts.longest_pixel_list}`],
        reused.length > 0 && ["Reused", reused.length === 1 ? reused[0] : `${reused.length} structures`],
        error && ["Error", error.source === "exact" ? "exact"
          : `${number(error.value, 3)} ${error.metric} (${error.source})`],
        ["Device", report.device],
      ]),
      warnings.map((warning) => el("p", { class: "warning" }, warning)),
    ];
  }

  #draw() {
    const context = this.chart.getContext("2d");
    const { width, height } = this.chart;
    const most = Math.max(...this.#times, 1);
    context.clearRect(0, 0, width, height);
    context.fillStyle = getComputedStyle(this.root).getPropertyValue("--accent").trim() || "gray";
    this.#times.forEach((time, i) => {
      const bar = Math.max(1, (time / most) * (height - 2));
      context.fillRect((i * width) / HISTORY, height - bar, width / HISTORY - 1, bar);
    });
  }
}
