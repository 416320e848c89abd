// SPDX-License-Identifier: MIT
// Clip planes: cut along an axis, or through what is selected.
import { button, el } from "./dom.js";
import { empty, group, slider, vectorField } from "./fields.js";
import { refill } from "./docks.js";
import { dot } from "./transforms.js";

const PLANES_MAX = 8; // as the service takes them
const AXES = ["X", "Y", "Z"];

export class SectionPanel {
  #controls = [];

  constructor(panel, model) {
    Object.assign(this, { panel, model });
    model.addEventListener("scene", () => this.fill());
    model.addEventListener("select", () => this.fill());
    model.addEventListener("edit", () => {
      if (this.shape !== this.#shape()) this.fill();
      else for (const update of this.#controls) update();
    });
    this.fill();
  }

  #shape() {
    return JSON.stringify([this.model.scene?.id, this.model.view.clip_planes.map((plane) => this.#axis(plane))]);
  }

  /** 0 to 2 when the plane stands on an axis, else null. */
  #axis(plane) {
    const at = [0, 1, 2].filter((axis) => plane[axis] !== 0);
    return at.length === 1 ? at[0] : null;
  }

  #add(normal, point) {
    this.model.edit("Add clip plane", (view) => {
      view.clip_planes.push([...normal, -dot(normal, point)]);
    });
  }

  #set(index, plane) {
    this.model.edit(`Clip plane ${index + 1}`, (view) => {
      view.clip_planes[index] = plane;
    });
  }

  #axisSlider(index, axis) {
    const bounds = this.model.bounds;
    const read = () => {
      const plane = this.model.view.clip_planes[index];
      return -plane[3] / plane[axis];
    };
    const field = slider({ label: `${AXES[axis]} at`, unit: "m", least: bounds[axis],
      most: bounds[axis + 3], limit: 1e12, value: read(), onchange: (value) => {
        const plane = [...this.model.view.clip_planes[index]];
        plane[3] = -value * plane[axis];
        this.#set(index, plane);
      } });
    this.#controls.push(() => field.set(read()));
    return field.row;
  }

  #freeFields(index) {
    const read = () => this.model.view.clip_planes[index];
    const size = this.model.camera.sceneSize;
    const reach = size + Math.hypot(...this.model.center);
    const normal = vectorField({ label: "Normal", value: read().slice(0, 3), onchange: (values) =>
      this.#set(index, [...values, read()[3]]) });
    const offset = slider({ label: "Offset", unit: "m", least: -reach, most: reach, limit: 1e12,
      value: read()[3], onchange: (value) => this.#set(index, [...read().slice(0, 3), value]) });
    this.#controls.push(() => {
      normal.set(read().slice(0, 3));
      offset.set(read()[3]);
    });
    return [normal.row, offset.row];
  }

  #plane(plane, index) {
    const axis = this.#axis(plane);
    return group(`Plane ${index + 1}`,
      axis === null ? this.#freeFields(index) : this.#axisSlider(index, axis),
      el("div", { class: "row" },
        button({ text: "Flip", icon: "flip", "data-key": `flip-${index}`, onclick: () =>
          this.#set(index, plane.map((_, i) => -this.model.view.clip_planes[index][i])) }),
        button({ text: "Remove", icon: "remove", onclick: () =>
          this.model.edit("Remove clip plane", (view) => view.clip_planes.splice(index, 1)) })));
  }

  fill() {
    this.shape = this.#shape();
    this.#controls = [];
    const { scene, view, selection } = this.model;
    if (!scene) {
      refill(this.panel, empty("section", "Open a scene to cut it."));
      return;
    }
    const isFull = view.clip_planes.length >= PLANES_MAX;
    const center = this.model.center;
    const isHit = selection?.position && selection?.normal;
    refill(this.panel,
      el("div", { class: "row", role: "group", "aria-label": "Add a clip plane" },
        AXES.map((name, axis) => button({ text: `Cut ${name}`, icon: "add", disabled: isFull,
          onclick: () => this.#add([0, 1, 2].map((i) => (i === axis ? -1 : 0)), center) })),
        isHit && button({ text: "At the hit", icon: "target", disabled: isFull, onclick: () =>
          this.#add(selection.normal.map((value) => -value), selection.position) })),
      el("p", { class: "fine" }, view.clip_planes.length
        ? "What is cut away still casts shadows." : "Cuts open the view; up to eight at once."),
      view.clip_planes.map((plane, index) => this.#plane(plane, index)));
  }
}

