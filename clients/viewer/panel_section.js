// SPDX-License-Identifier: MIT
// Clip planes: cut along an axis, or through what is selected; moved by fields and by a handle.
import { button, el } from "./dom.js";
import { checkField, colorField, empty, group, selectField, slider, vectorField } from "./fields.js";
import { refill } from "./docks.js";
import { add, dot, frameOf, turnAbout, turned, unit } from "./transforms.js";

const PLANES_MAX = 8; // as the service takes them
const AXES = ["X", "Y", "Z"];
const FRAME = 0.35; // of the size of the scene, or of the picture: half a side of the frame

/** [a, b, c, d] of an entry of the view, which is that or an object with it. */
const planeOf = (entry) => (Array.isArray(entry) ? entry : entry.plane);
const cutsShadows = (entry) => Array.isArray(entry) || entry.shadows !== false;
/** false, true, or a colour. */
const capOf = (entry) => (Array.isArray(entry) ? false : entry.cap ?? false);
const CAP_COLOR = [0.6, 0.1, 0.05];
const CAPS = [["open", "Open"], ["closed", "Closed, own material"], ["colored", "Closed, coloured"]];
const capName = (cap) => (Array.isArray(cap) ? "colored" : cap ? "closed" : "open");

/** The least that says it: what is not cut out of shadows has no caps. */
const entryOf = (plane, { shadows, cap }) =>
  !shadows ? { plane, shadows: false } : cap ? { plane, cap } : plane;

const planeThrough = (normal, point) => [...normal, Number(-dot(normal, point).toPrecision(12)) || 0];

export class SectionPanel {
  #controls = [];
  #active = 0; // the plane that has the handle
  #changed;

  /** @param {() => void} changed is called when another plane has the handle */
  constructor(panel, model, changed) {
    Object.assign(this, { panel, model });
    this.#changed = changed;
    model.addEventListener("scene", () => this.fill());
    model.addEventListener("select", () => this.fill());
    model.addEventListener("edit", () => {
      if (this.shape !== this.#shape()) this.fill();
      else for (const update of this.#controls) update();
    });
    this.fill();
  }

  get #entries() {
    return this.model.view.clip_planes;
  }

  #shape() {
    return JSON.stringify([this.model.scene?.id, this.#entries.map((entry) =>
      [this.#axis(planeOf(entry)), cutsShadows(entry), capName(capOf(entry))])]);
  }

  /** 0 to 2 when the plane stands on an axis, else null. */
  #axis(plane) {
    const at = [0, 1, 2].filter((axis) => plane[axis] !== 0);
    return at.length === 1 ? at[0] : null;
  }

  #add(normal, point) {
    this.#active = this.#entries.length;
    this.model.edit("Add clip plane", (view) => {
      view.clip_planes.push([...normal, -dot(normal, point)]);
    });
  }

  #set(index, plane) {
    this.model.edit(`Clip plane ${index + 1}`, (view) => {
      const entry = view.clip_planes[index];
      view.clip_planes[index] = entryOf(plane, { shadows: cutsShadows(entry), cap: capOf(entry) });
    });
  }

  /** @param {{shadows?: boolean, cap?: boolean|number[]}} change */
  #setEffect(index, what, change) {
    this.model.edit(`Clip plane ${index + 1}: ${what}`, (view) => {
      const entry = view.clip_planes[index];
      view.clip_planes[index] =
        entryOf(planeOf(entry), { shadows: cutsShadows(entry), cap: capOf(entry), ...change });
    });
  }

  /** Light and caps: caps are asked for only where the plane lets light in. */
  #effects(index) {
    const entry = () => this.#entries[index];
    const shadows = checkField({ label: "Removed part casts no shadow", value: cutsShadows(entry()), onchange: (isCutting) =>
      this.#setEffect(index, "shadows", { shadows: isCutting }) });
    this.#controls.push(() => shadows.set(cutsShadows(entry())));
    if (!cutsShadows(entry())) return [shadows.row];
    const cap = selectField({ label: "Cut bodies", options: CAPS, value: capName(capOf(entry())),
      hint: "Closed meshes only: sheets have no inside", onchange: (name) => this.#setEffect(index, "caps",
        { cap: name === "colored" ? CAP_COLOR : name === "closed" }) });
    this.#controls.push(() => cap.set(capName(capOf(entry()))));
    if (!Array.isArray(capOf(entry()))) return [shadows.row, cap.row];
    const color = colorField({ label: "Colour of the cut", value: capOf(entry()), onchange: (rgb) =>
      this.#setEffect(index, "colour", { cap: rgb }) });
    this.#controls.push(() => color.set(capOf(entry())));
    return [shadows.row, cap.row, color.row];
  }

  /** The point of a plane that is nearest to what is looked at, so that its handle is in sight. */
  #pointOf(plane) {
    const { target } = this.model.camera;
    const off = (dot(plane, target) + plane[3]) / Math.hypot(...plane.slice(0, 3));
    return add(target, unit(plane.slice(0, 3)), -off);
  }

  /** What the handle in the picture holds: a Target of Gizmo, or null. */
  target() {
    const index = Math.min(this.#active, this.#entries.length - 1);
    if (index < 0) return null;
    const plane = planeOf(this.#entries[index]);
    const normal = unit(plane.slice(0, 3));
    const position = this.#pointOf(plane);
    const through = (way, point) => this.#set(index, planeThrough(way, point));
    const { sceneSize, height } = this.model.camera;
    const half = FRAME * Math.min(sceneSize, height);
    const [u, v] = frameOf(normal);
    return { position, along: normal, direction: normal,
      outlines: () => [[[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].map(([a, b]) =>
        add(add(position, u, a * half), v, b * half))],
      move: (to) => through(plane.slice(0, 3), to), aim: (way) => through(way, position),
      turn: (axis, degrees) => through(turned(turnAbout(axis, degrees), normal)
        .map((value) => Number(value.toFixed(12)) || 0), position) };
  }

  #axisSlider(index, axis) {
    const bounds = this.model.bounds;
    const read = () => {
      const plane = planeOf(this.#entries[index]);
      return -plane[3] / plane[axis];
    };
    const field = slider({ label: `${AXES[axis]} at`, unit: "m", least: bounds[axis],
      most: bounds[axis + 3], limit: 1e12, value: read(), onchange: (value) => {
        const plane = [...planeOf(this.#entries[index])];
        plane[3] = -value * plane[axis];
        this.#set(index, plane);
      } });
    this.#controls.push(() => field.set(read()));
    return [field.row, this.#normalField(index)];
  }

  /** Tilts the plane about its point in the middle of the picture, as the handles do. */
  #normalField(index) {
    const read = () => planeOf(this.#entries[index]).slice(0, 3);
    const field = vectorField({ label: "Normal", value: read(), onchange: (values) => {
      if (values.some((value) => value !== 0))
        this.#set(index, planeThrough(values, this.#pointOf(planeOf(this.#entries[index]))));
    } });
    this.#controls.push(() => field.set(read()));
    return field.row;
  }

  #freeFields(index) {
    const read = () => planeOf(this.#entries[index]);
    const size = this.model.camera.sceneSize;
    const reach = size + Math.hypot(...this.model.center);
    const offset = slider({ label: "Offset", unit: "m", least: -reach, most: reach, limit: 1e12,
      value: read()[3], onchange: (value) => this.#set(index, [...read().slice(0, 3), value]) });
    this.#controls.push(() => offset.set(read()[3]));
    return [this.#normalField(index), offset.row];
  }

  #plane(entry, index) {
    const axis = this.#axis(planeOf(entry));
    const part = group(`Plane ${index + 1}`,
      axis === null ? this.#freeFields(index) : this.#axisSlider(index, axis), this.#effects(index),
      el("div", { class: "row" },
        button({ text: "Flip", icon: "flip", "data-key": `flip-${index}`, onclick: () =>
          this.#set(index, planeOf(this.#entries[index]).map((value) => -value)) }),
        button({ text: "Remove", icon: "remove", onclick: () =>
          this.model.edit("Remove clip plane", (view) => view.clip_planes.splice(index, 1)) })));
    for (const type of ["focusin", "pointerdown"])
      part.addEventListener(type, () => {
        if (this.#active === index) return;
        this.#active = index;
        this.#changed();
      });
    return part;
  }

  fill() {
    this.shape = this.#shape();
    this.#controls = [];
    const { scene, selection } = this.model;
    if (!scene) {
      refill(this.panel, empty("section", "Open a scene to cut it."));
      return;
    }
    const isFull = this.#entries.length >= PLANES_MAX;
    const center = this.model.center;
    const isHit = selection?.position && selection?.normal;
    refill(this.panel,
      el("div", { class: "row", role: "group", "aria-label": "Add a clip plane" },
        AXES.map((name, axis) => button({ text: `Cut ${name}`, icon: "add", disabled: isFull,
          onclick: () => this.#add([0, 1, 2].map((i) => (i === axis ? -1 : 0)), center) })),
        isHit && button({ text: "At the hit", icon: "target", disabled: isFull, onclick: () =>
          this.#add(selection.normal.map((value) => -value), selection.position) })),
      el("p", { class: "fine" }, this.#entries.length
        ? "Drag the arrow in the picture to move a cut, its ball or rings to tilt it."
        : "Cuts open the view; up to eight at once."),
      this.#entries.map((entry, index) => this.#plane(entry, index)));
  }
}
