// SPDX-License-Identifier: MIT
// The lights: those of the scene, taken over at the first edit, and new ones, of which there may be
// thousands; light from all around, and the haze and smoke that all of it crosses.
import { cssColor } from "./color.js";
import { button, count, el, icon, number } from "./dom.js";
import { EnvironmentControls } from "./environment.js";
import { checkField, colorField, empty, numberField, slider, vectorField } from "./fields.js";
import { refill } from "./docks.js";
import { HazeControls } from "./haze.js";
import { TYPES, rollOf, rolled } from "./lights.js";
import { Rows } from "./rows.js";
import { SmokeControls } from "./smoke.js";

const ICONS = { point: "point", spot: "spot", directional: "sun", rect: "front", disk: "disk" };
const MANY = 20; // lights, from which on their number is said
const UNITS = { point: "cd", spot: "cd", directional: "lx", rect: "nt", disk: "nt" };

export class LightsPanel {
  #open = 0; // index of the light whose fields show; -1: none
  #active = 0; // the one that Tab reaches
  #controls = [];
  #openRow = null; // its element, which stays while it is open
  #changed;

  /** @param {() => void} changed is called when another light is open */
  constructor(panel, model, maps, changed) {
    Object.assign(this, { panel, model, environment: new EnvironmentControls(maps),
      haze: new HazeControls(model), smoke: new SmokeControls(model) });
    this.#changed = changed;
    this.rows = el("ul", { class: "lights", "aria-label": "Lights",
      onkeydown: (event) => this.#key(event) });
    this.list = new Rows(panel, this.rows, { count: () => (model.scene ? model.lights.length : 0),
      row: (at) => this.#row(at), kept: () => [this.#active], tall: () => this.#open });
    model.addEventListener("scene", () => {
      this.#open = this.#active = 0;
      this.panel.scrollTop = 0;
      this.fill();
    });
    model.addEventListener("edit", () => this.#update());
    maps.addEventListener("change", () => this.#update());
    this.fill();
  }

  /** Changes when other controls than now are needed. */
  #shape() {
    const { scene, view } = this.model;
    const open = scene && this.model.lights[this.#open];
    return JSON.stringify([scene?.id, view.scene_lights, this.environment.shape, this.haze.shape, this.smoke.shape,
      this.#open, open?.type, scene ? this.model.lights.length : 0]);
  }

  #update() {
    if (this.#shape() !== this.shape) {
      this.fill();
      return;
    }
    for (const update of this.#controls) update();
    this.list.draw(true);
  }

  /** Index of the light whose fields show; -1: none. */
  get active() {
    return this.#open;
  }

  activate(index) {
    this.#open = index;
    if (index >= 0) this.#active = index;
    this.fill();
    if (index >= 0) this.list.scrollTo(index);
    this.#changed();
  }

  nameOf(index, { type }) {
    const own = this.model.scene.outline.lights;
    const name = own[index]?.type === type ? own[index].name : "";
    return name || `${type[0].toUpperCase()}${type.slice(1)} light ${index + 1}`;
  }

  #control(make, index, member, otherwise, more) {
    const read = () => this.model.lights[index]?.[member] ?? otherwise;
    const made = make({ ...more, value: read(),
      onchange: (value) => this.model.editLight(index, { [member]: value }) });
    this.#controls.push(() => made.set(read()));
    return made.row;
  }

  #fields(index, light) {
    const control = (make, member, otherwise, more) => this.#control(make, index, member, otherwise, more);
    const most = Math.max(10, 4 * light.intensity);
    return el("div", { class: "light-fields" },
      control(colorField, "color", [1, 1, 1], { label: "Colour" }),
      control(slider, "intensity", 1, { label: "Intensity", unit: UNITS[light.type], least: 0, most,
        limit: 1e12, curve: 2 }),
      light.position && control(vectorField, "position", [0, 0, 0], { label: "Position", unit: "m" }),
      light.direction && control(vectorField, "direction", [0, -1, 0], { label: "Direction" }),
      light.type === "rect" && this.#roll(index),
      light.type === "spot" && this.#cones(index),
      ["width", "height", "radius"].filter((member) => member in light).map((member) =>
        control(numberField, member, 1, { label: member[0].toUpperCase() + member.slice(1), unit: "m",
          least: 1e-9, most: 1e9 })),
      ["point", "spot"].includes(light.type) && control(numberField, "range", 0,
        { label: "Range", unit: "m", least: 0, most: 1e12, hint: "0 has no end" }),
      control(checkField, "shadow", true, { label: "Casts shadows" }),
      button({ text: "Remove", icon: "remove", onclick: () => this.model.removeLight(index) }));
  }

  /** How a rectangle is turned about its direction. */
  #roll(index) {
    const read = () => rollOf(this.model.lights[index]);
    const field = numberField({ label: "Roll", unit: "°", least: -360, most: 360, value: read(),
      hint: "Turned about its direction", onchange: (degrees) =>
        this.model.editLight(index, rolled(this.model.lights[index], degrees)) });
    this.#controls.push(() => this.model.lights[index]?.type === "rect" && field.set(read()));
    return field.row;
  }

  /** The inner cone is never wider than the outer. */
  #cones(index) {
    const read = () => ({ inner_cone_deg: 0, outer_cone_deg: 45, ...this.model.lights[index] });
    const inner = slider({ label: "Inner cone", unit: "°", least: 0, most: 90,
      value: read().inner_cone_deg, onchange: (value) => this.model.editLight(index,
        { inner_cone_deg: value, outer_cone_deg: Math.max(value, read().outer_cone_deg, 0.001) }) });
    const outer = slider({ label: "Outer cone", unit: "°", least: 0.1, most: 90,
      value: read().outer_cone_deg, onchange: (value) => this.model.editLight(index,
        { outer_cone_deg: value, inner_cone_deg: Math.min(value, read().inner_cone_deg) }) });
    this.#controls.push(() => {
      if (this.model.lights[index]?.type !== "spot") return;
      inner.set(read().inner_cone_deg);
      outer.set(read().outer_cone_deg);
    });
    return [inner.row, outer.row];
  }

  /** A row of the list; the one that is open keeps its element, and with it what is being typed. */
  #row(index) {
    if (index !== this.#open) return this.#item(index, false);
    this.#openRow ??= this.#item(index, true);
    return this.#openRow;
  }

  #item(index, isOpen) {
    const light = this.model.lights[index];
    const swatch = el("span", { class: "swatch", "aria-hidden": "true" });
    const power = el("span", { class: "fine" });
    const head = el("button", { type: "button", class: "light-head", "aria-expanded": String(isOpen),
      "data-key": `light-${index}`, onclick: () => this.activate(isOpen ? -1 : index) },
    icon(ICONS[light.type]), el("span", { class: "grow" }, this.nameOf(index, light)), power, swatch);
    const say = () => {
      const { color = [1, 1, 1], intensity = 1 } = this.model.lights[index] ?? {};
      swatch.style.backgroundColor = cssColor(color);
      power.textContent = `${number(intensity, 3)} ${UNITS[light.type]}`;
      head.tabIndex = index === this.#active ? 0 : -1;
    };
    say();
    if (isOpen) this.#controls.push(say);
    return el("li", { class: "light", "data-open": isOpen ? "" : undefined,
      "aria-posinset": index + 1, "aria-setsize": this.model.lights.length },
    head, isOpen && this.#fields(index, light));
  }

  /** Keys on the heads of the rows. */
  #key(event) {
    if (!event.target.classList.contains("light-head")) return;
    const to = this.list.rowOfKey(event.key, this.#active);
    if (to === null) return;
    event.preventDefault();
    this.#active = to;
    this.list.draw(true);
    this.list.scrollTo(to);
    this.rows.querySelector(`[data-key="light-${to}"]`)?.focus({ preventScroll: true });
  }

  fill() {
    this.shape = this.#shape();
    this.#controls = [];
    this.#openRow = null;
    if (!this.model.scene) {
      refill(this.panel, empty("light", "Open a scene to see its lights."));
      return;
    }
    const { view, lights } = this.model;
    const isOwn = !view.scene_lights || view.lights.length > 0;
    refill(this.panel,
      el("div", { class: "row", role: "group", "aria-label": "Add a light" }, TYPES.map((type) =>
        button({ text: type[0].toUpperCase() + type.slice(1), icon: ICONS[type],
          "aria-label": `Add a ${type} light`, onclick: () => {
            this.#open = this.#active = lights.length;
            this.model.addLight(type);
            this.list.scrollTo(this.#open);
          } }))),
      lights.length > MANY && el("p", { class: "fine" }, `${count(lights.length)} lights`),
      lights.length === 0 && el("p", { class: "fine" }, view.scene_lights
        ? "This scene has no lights." : "All lights are removed."),
      lights.length > 0 && this.rows,
      isOwn && button({ text: "Lights as in the file", icon: "reset",
        onclick: () => this.model.resetLights() }),
      [this.environment, this.haze, this.smoke].map((one) => one.rows((update) => this.#controls.push(update))));
    this.#active = Math.min(this.#active, Math.max(0, lights.length - 1));
    this.list.draw(true);
  }
}
