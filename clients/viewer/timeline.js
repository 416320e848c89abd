// SPDX-License-Identifier: MIT
// Plays the animations of a scene: a bar under the picture with play, time, loop and speed. The next
// time is asked for when the picture of the last one came, so that no server is run over.
import { announce, button, byId, el, icon, number, replace } from "./dom.js";

const LATE_MS = 400; // a picture that takes longer is not waited for
const STEP_S = 1 / 30; // of the keys
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

export class Timeline {
  isPlaying = false;
  isLooping = true;
  speed = 1;
  #name = ""; // of the animation; all of them when empty
  #isShown = true; // the picture of the time that was asked for last
  #askedAt = 0;
  #last = 0;

  constructor(model) {
    this.model = model;
    this.root = byId("timeline");
    model.addEventListener("scene", () => this.#open());
    model.addEventListener("time", () => this.#say());
    model.addEventListener("edit", () => this.#say());
    this.#open();
  }

  get animations() {
    const found = this.model.scene?.animations;
    return Array.isArray(found) ? found : [];
  }

  /** Seconds of what plays. */
  get duration() {
    const index = this.#name ? Number(this.#name.slice(1)) : -1;
    const durations = this.animations.map(({ duration_s }) => duration_s);
    return this.#name ? durations[index] ?? 0 : Math.max(0, ...durations);
  }

  get time() {
    return this.model.view.animation?.time_s ?? 0;
  }

  #open() {
    this.pause();
    const isShown = this.animations.some(({ duration_s }) => duration_s > 0);
    this.root.hidden = !isShown;
    byId("stage").toggleAttribute("data-timed", isShown);
    if (!isShown) return;
    this.#name = this.model.view.animation?.name ?? "";
    this.isLooping = true;
    this.playButton = button({ label: "Play", icon: "play", class: "tool", onclick: () => this.toggle() });
    this.stopButton = button({ label: "Stop: as the file has it at rest", icon: "stop", class: "tool",
      onclick: () => this.stop() });
    this.loopButton = button({ label: "Loop", icon: "loop", class: "tool", "aria-pressed": "true",
      onclick: () => {
        this.isLooping = !this.isLooping;
        this.loopButton.setAttribute("aria-pressed", String(this.isLooping));
      } });
    this.slider = el("input", { type: "range", min: 0, max: this.duration, step: "any",
      "aria-label": "Time", oninput: () => {
        this.pause();
        this.#set(this.slider.valueAsNumber);
      } });
    this.said = el("output", { class: "time-said" });
    const names = this.animations.map(({ name }, i) =>
      el("option", { value: `#${i}` }, name || `Animation ${i + 1}`));
    this.names = el("select", { "aria-label": "Animation", onchange: () => this.#choose() },
      el("option", { value: "" }, "All"), names);
    this.names.value = this.#name;
    this.rates = el("select", { "aria-label": "Speed", onchange: () => {
      this.speed = Number(this.rates.value);
    } }, SPEEDS.map((speed) => el("option", { value: String(speed) }, `${speed}×`)));
    this.rates.value = String(this.speed);
    replace(this.root, this.playButton, this.stopButton, this.slider, this.said, this.loopButton,
      names.length > 1 && this.names, this.rates);
    this.#say();
  }

  #choose() {
    this.#name = this.names.value;
    this.slider.max = this.duration;
    this.#set(Math.min(this.time, this.duration));
  }

  #set(time) {
    const kept = Number(Math.min(this.duration, Math.max(0, time)).toFixed(4));
    this.#isShown = false;
    this.#askedAt = performance.now();
    this.model.setAnimation({ time_s: kept, ...(this.#name ? { name: this.#name } : {}) });
  }

  #say() {
    if (this.root.hidden) return;
    this.slider.value = this.time;
    this.slider.setAttribute("aria-valuetext", `${number(this.time, 3)} of ${number(this.duration, 3)} seconds`);
    this.said.textContent = `${this.time.toFixed(2)} / ${this.duration.toFixed(2)} s`;
    this.stopButton.disabled = this.model.view.animation === null;
  }

  /** The picture followed: the next time may be asked for. */
  frameShown() {
    this.#isShown = true;
  }

  toggle() {
    if (this.root.hidden) return;
    if (this.isPlaying) {
      this.pause();
      announce("Paused");
      return;
    }
    this.isPlaying = true;
    this.#showPlaying();
    announce("Playing");
    if (this.time >= this.duration) this.#set(0);
    this.#last = performance.now();
    requestAnimationFrame((now) => this.#tick(now));
  }

  #showPlaying() {
    this.playButton.setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
    this.playButton.title = this.isPlaying ? "Pause (Space)" : "Play (Space)";
    replace(this.playButton, icon(this.isPlaying ? "pause" : "play"));
  }

  #tick(now) {
    if (!this.isPlaying) return;
    requestAnimationFrame((next) => this.#tick(next));
    if (!this.#isShown && now - this.#askedAt < LATE_MS) return;
    const next = this.time + (this.speed * Math.max(0, now - this.#last)) / 1000;
    this.#last = now;
    if (next < this.duration) this.#set(next);
    else if (this.isLooping) this.#set(next % this.duration);
    else {
      this.#set(this.duration);
      this.pause();
    }
  }

  pause() {
    if (!this.isPlaying) return;
    this.isPlaying = false;
    this.#showPlaying();
  }

  stop() {
    this.pause();
    this.model.setAnimation(null);
  }

  /** A short way on or back. */
  step(direction) {
    if (this.root.hidden) return;
    this.pause();
    this.#set(this.time + direction * STEP_S);
  }
}
