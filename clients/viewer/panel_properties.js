// SPDX-License-Identifier: MIT
// What is selected: where it was hit, the node, and its materials to edit.
import { cssColor } from "./color.js";
import { button, el, number, place } from "./dom.js";
import { checkField, colorField, empty, facts, group, selectField, slider } from "./fields.js";
import { refill } from "./docks.js";
import { transformGroup } from "./transform.js";

const vector = (values) => values.map((value) => number(value, 4)).join(", ");

const share = { least: 0, most: 1 };
/** Members of overrides of materials; none: what a material without the lobe has. */
const LOBES = {
  specular: { label: "Specular", ...share, none: 1 },
  specular_color: { label: "Specular colour", make: colorField, none: [1, 1, 1] },
  clearcoat: { label: "Clearcoat", ...share, none: 0 },
  clearcoat_roughness: { label: "Clearcoat roughness", ...share, none: 0 },
  sheen_color: { label: "Sheen", make: colorField, none: [0, 0, 0] },
  sheen_roughness: { label: "Sheen roughness", ...share, none: 0 },
  iridescence: { label: "Thin film", ...share, none: 0 },
  iridescence_ior: { label: "Film IOR", least: 1, most: 2.5, limit: 100, none: 1.3 },
  iridescence_thickness_nm: { label: "Film thickness", unit: "nm", least: 0, most: 1200, limit: 1e6, none: 400 },
  anisotropy: { label: "Anisotropy", ...share, none: 0 },
  anisotropy_rotation_deg: { label: "Anisotropy turn", unit: "°", least: -180, most: 180, none: 0 },
  diffuse_transmission: { label: "Light from behind", ...share, none: 0 },
  diffuse_transmission_color: { label: "Its colour", make: colorField, none: [1, 1, 1] },
  dispersion: { label: "Dispersion", least: 0, most: 5, limit: 100, none: 0 },
};

export class PropertiesPanel {
  #controls = []; // setters to call when an undo or another panel changed a value

  constructor(panel, model, actions) {
    Object.assign(this, { panel, model, actions });
    for (const type of ["scene", "select"]) model.addEventListener(type, () => this.fill()); // "parts" too tell "select"
    model.addEventListener("edit", () => this.#update());
    this.fill();
  }

  #update() {
    const key = this.#shape();
    if (key !== this.shape) this.fill();
    else for (const update of this.#controls) update();
  }

  /** Values that come from elsewhere than the model changed. */
  refresh() {
    this.#update();
  }

  /** Changes when other controls than now are needed. */
  #shape() {
    const { selection, scene, view } = this.model;
    const isHidden = selection?.node !== null && selection && !this.model.isVisible(selection.node);
    return JSON.stringify([scene?.id, selection, isHidden, Object.keys(view.overrides.materials)]);
  }

  #materialIndices() {
    const { node, material } = this.model.selection;
    if (material !== null) return [material];
    return this.model.scene.outline.nodes[node]?.materials ?? [];
  }

  #nodeGroup(index) {
    const node = this.model.scene.outline.nodes[index];
    if (!node) return null;
    const path = [];
    for (let at = node.parent; at !== null; at = this.model.scene.outline.nodes[at].parent)
      path.unshift(this.model.nodeName(at));
    const { position, normal, depth } = this.model.selection;
    const bounds = this.model.boundsOf(index);
    const size = bounds && [0, 1, 2].map((axis) => bounds[axis + 3] - bounds[axis]);
    const isVisible = this.model.isVisible(index);
    return group(this.model.nodeName(index),
      facts([
        path.length > 0 && ["Path", path.join(" › ")],
        ["Index", index],
        size && ["Size", `${vector(size)} m`],
        position && ["Clicked point", `${place(position, this.model.camera.sceneSize)} m`],
        normal && ["Normal", vector(normal.map((value) => Math.round(value * 1e4) / 1e4 || 0))],
        depth !== undefined && depth !== null && ["Depth", `${number(depth)} m`],
      ]),
      el("div", { class: "row" },
        button({ text: isVisible ? "Hide" : "Show", icon: isVisible ? "hidden" : "eye",
          onclick: () => this.model.setVisible(index, !isVisible) }),
        button({ text: "Fit", icon: "fit", onclick: () => this.actions.fitNode(index) }),
        node.isPart && button({ text: "Remove", icon: "remove",
          onclick: () => this.model.removeParts([node.part]) })));
  }

  #control(make, index, member, more) {
    const read = () => this.model.material(index)[member];
    const made = make({ ...more, value: read(),
      onchange: (value) => this.model.editMaterial(index, { [member]: value }) });
    this.#controls.push(() => made.set(read()));
    return made.row;
  }

  #materialGroup(index) {
    const own = this.model.scene.outline.materials[index];
    if (!own) return null;
    const control = (make, member, more) => this.#control(make, index, member, more);
    const color = this.#control((more) => colorField({ ...more,
      onchange: (rgb) => this.model.editMaterial(index,
        { base_color: [...rgb, this.model.material(index).base_color[3]] }) }),
    index, "base_color", { label: "Base colour" });
    const alpha = slider({ label: "Alpha", ...share, value: this.model.material(index).base_color[3],
      onchange: (value) => this.model.editMaterial(index,
        { base_color: [...this.model.material(index).base_color.slice(0, 3), value] }) });
    this.#controls.push(() => alpha.set(this.model.material(index).base_color[3]));
    const isEdited = this.model.isMaterialEdited(index);
    return group(own.name || `Material ${index}`, color, alpha.row,
      control(selectField, "alpha_mode", { label: "Alpha mode", options:
        [["opaque", "Opaque"], ["mask", "Mask"], ["blend", "Blend"]] }),
      control(slider, "transmission", { label: "Transmission", ...share }),
      control(slider, "roughness", { label: "Roughness", ...share }),
      control(slider, "metallic", { label: "Metallic", ...share }),
      control(slider, "ior", { label: "IOR", least: 1, most: 2.5, limit: 100 }),
      control(slider, "thickness", { label: "Thickness", unit: "m", least: 0, curve: 3,
        most: Math.max(0.1, 0.1 * this.model.camera.sceneSize), limit: 1e12 }),
      this.#attenuation(index), this.#emission(index), this.#lobes(index),
      checkField({ label: "Casts a shadow on itself",
        value: this.model.material(index).self_shadow !== false,
        onchange: (value) => this.model.editMaterial(index, { self_shadow: value }) }).row,
      isEdited && button({ text: "Reset", icon: "reset", "data-key": `reset-${index}`,
        onclick: () => this.model.resetMaterial(index) }));
  }

  /** What lies over the base or beside it; open where the material has something of it. */
  #lobes(index) {
    const read = (name) => this.model.material(index)[name] ?? LOBES[name].none;
    const rows = Object.entries(LOBES).map(([name, { make = slider, none: _, ...more }]) => {
      const made = make({ ...more, value: read(name),
        onchange: (value) => this.model.editMaterial(index, { [name]: value }) });
      this.#controls.push(() => made.set(read(name)));
      return made.row;
    });
    const has = Object.keys(LOBES).some((name) => name in this.model.material(index));
    return el("details", { open: has }, el("summary", {}, "Layers and lobes"), rows);
  }

  /** Colour and distance go together, as the service wants them. */
  #attenuation(index) {
    const size = this.model.camera.sceneSize;
    const read = () => {
      const { attenuation_color, attenuation_distance } = this.model.material(index);
      return { attenuation_color, attenuation_distance: attenuation_distance ?? size };
    };
    const write = (member) => (value) =>
      this.model.editMaterial(index, { ...read(), [member]: value });
    const color = colorField({ label: "Attenuation", value: read().attenuation_color,
      onchange: write("attenuation_color") });
    const distance = slider({ label: "Attenuation distance", unit: "m", least: 1e-3 * size, most: size, limit: 1e12,
      curve: 3, value: read().attenuation_distance, onchange: write("attenuation_distance") });
    this.#controls.push(() => {
      color.set(read().attenuation_color);
      distance.set(read().attenuation_distance);
    });
    return [color.row, distance.row];
  }

  /** A colour times a strength. */
  #emission(index) {
    const read = () => {
      const { emissive } = this.model.material(index);
      const strength = Math.max(...emissive);
      return { strength, tint: strength > 0 ? emissive.map((v) => v / strength) : [1, 1, 1] };
    };
    let { tint } = read();
    const write = (strength) =>
      this.model.editMaterial(index, { emissive: tint.map((v) => v * strength) });
    const color = colorField({ label: "Emission", value: tint, onchange: (rgb) => {
      tint = rgb;
      write(read().strength);
    } });
    const power = slider({ label: "Emission strength", unit: "nt", least: 0, most: 100, limit: 1e12, curve: 3,
      value: read().strength, onchange: write });
    this.#controls.push(() => {
      const now = read();
      if (now.strength > 0) tint = now.tint;
      color.set(tint);
      power.set(now.strength);
    });
    return [color.row, power.row];
  }

  fill() {
    this.shape = this.#shape();
    this.#controls = [];
    const { scene, selection } = this.model;
    if (!scene || !selection) {
      const materials = scene?.outline.materials ?? [];
      refill(this.panel, empty("properties", scene
        ? "Click a surface or a node, or choose a material." : "Open a scene first."),
      materials.length > 0 && group("Materials", el("ul", { class: "list" }, materials.map(
        ({ name }, index) => el("li", {}, this.#swatch(index), button({ text: name || `Material ${index}`,
          class: "link", onclick: () => this.model.select({ node: null, material: index, position: null }) }))))));
      return;
    }
    refill(this.panel,
      el("div", { class: "row row-end" }, button({ text: "Clear selection", icon: "close",
        onclick: () => this.model.select(null) })),
      selection.node !== null && this.#nodeGroup(selection.node),
      selection.node !== null && scene.outline.nodes[selection.node]
        && transformGroup(this.model, selection.node, this.#controls, this.actions),
      this.#materialIndices().map((index) => this.#materialGroup(index)));
  }

  #swatch(index) {
    const swatch = el("span", { class: "swatch", "aria-hidden": "true" });
    swatch.style.backgroundColor = cssColor(this.model.material(index).base_color);
    return swatch;
  }
}
