// SPDX-License-Identifier: MIT
// How pictures are made: technique, accuracy and time, what to compare with, camera lens, look.
import { button, el } from "./dom.js";
import { checkField, colorField, group, numberField, selectField, slider } from "./fields.js";
import { refill } from "./docks.js";
import { drawnOverGroup } from "./drawn_over.js";

const TITLES = {
  shadows: "Shadows", transparency: "Transparency", light_lists: "Light lists", blend_filter: "Glass filter",
  volume_map: "Half floats", silhouette_form: "Silhouettes by", refraction: "Refraction",
  environment_visibility: "Shadows of the map",
};

export class RenderPanel {
  #controls = [];

  /** @param {{compare: (technique: string) => void, rescale: (scale: number) => void,
   * scale: () => number, restSamples: () => number, refineTo: (samples: number) => void,
   * measure: () => void, isOutlined: () => boolean,
   * outline: (isOn: boolean) => void, exposure: () => Promise<number>}} actions */
  constructor(panel, model, actions) {
    Object.assign(this, { panel, model, actions });
    this.capabilities = null;
    this.comparing = "";
    model.addEventListener("scene", () => this.#update());
    model.addEventListener("edit", () => this.#update());
    model.addEventListener("camera", () => this.#update());
    this.fill();
  }

  #update() {
    for (const update of this.#controls) update();
  }

  setCapabilities(capabilities) {
    this.capabilities = capabilities;
    this.fill();
  }

  /** Names of a kind of technique, with what each does. */
  techniques(kind) {
    const found = this.capabilities?.techniques?.[kind];
    return Array.isArray(found) ? found : [];
  }

  #quality(make, member, otherwise, more) {
    const read = () => this.model.view.quality[member] ?? otherwise;
    const made = make({ ...more, value: read(), onchange: (value) =>
      this.model.edit(`Quality: ${member}`, (view) => {
        if (value === null || value === otherwise) delete view.quality[member];
        else view.quality[member] = value;
      }) });
    this.#controls.push(() => made.set(read()));
    return made.row;
  }

  #member(make, member, more) {
    const made = make({ ...more, value: this.model.view[member], onchange: (value) =>
      this.model.edit(more.label, (view) => {
        view[member] = value;
      }) });
    this.#controls.push(() => made.set(this.model.view[member]));
    return made.row;
  }

  #techniqueFields() {
    return Object.entries(TITLES).map(([kind, label]) => {
      const names = this.techniques(kind).map(({ name }) => name);
      const first = names[0] ?? "auto";
      const said = el("p", { class: "fine" });
      const say = () => {
        const name = this.model.view.quality[kind] ?? first;
        said.textContent = this.techniques(kind).find((one) => one.name === name)?.does ?? "";
      };
      say();
      this.#controls.push(say);
      return names.length > 1 && [this.#quality(selectField, kind, first, { label, options: names }), said];
    });
  }

  #numbers() {
    const parameters = this.capabilities?.techniques?.parameters ?? {};
    const allowed = (member) => (parameters[member]?.allowed ?? []).map(String);
    const integer = (make) => ({ onchange, value, ...more }) => {
      const made = make({ ...more, value: String(value), onchange: (text) => onchange(Number(text) || null) });
      return { row: made.row, set: (v) => made.set(String(v)) };
    };
    const chooser = integer(selectField);
    return [
      this.#quality(chooser, "shadow_resolution", 1024,
        { label: "Shadow size", options: [256, 512, 1024, 2048, 4096].map((n) => [String(n), `${n} px`]) }),
      allowed("shadow_taps").length > 1 && this.#quality(chooser, "shadow_taps",
        0, { label: "Shadow taps", options: [["0", "automatic"], ...allowed("shadow_taps")] }),
      allowed("samples").length > 1 && this.#quality(chooser, "samples", parameters.samples.default ?? 0,
        { label: "Samples", options: [["0", "automatic"], ...allowed("samples")] }),
      this.#quality(checkField, "reference", false, { label: "Reference, the ground truth" }),
    ];
  }

  #lens() {
    const { camera } = this.model;
    const lens = slider({ label: "Field of view", unit: "°", least: 10, most: 120, limit: 178,
      value: camera.fov, onchange: (value) => {
        const height = this.model.camera.height;
        this.model.camera.fov = value;
        this.model.camera.distance *= height / this.model.camera.height; // the subject keeps its size
        this.model.cameraMoved();
      } });
    const flat = checkField({ label: "Orthographic", value: camera.isOrthographic, onchange: (value) => {
      this.model.camera.isOrthographic = value;
      this.model.cameraMoved();
    } });
    this.#controls.push(() => {
      lens.set(this.model.camera.fov);
      flat.set(this.model.camera.isOrthographic);
    });
    return group("Camera", lens.row, flat.row);
  }

  /** A number, or "auto", which becomes that of the picture when it is taken away. */
  #exposure() {
    const read = () => this.model.view.exposure_ev;
    const edit = (value) => this.model.edit("Exposure", (view) => {
      view.exposure_ev = value;
    });
    const number = () => (read() === "auto" ? 0 : read());
    const stops = slider({ label: "Exposure", unit: "EV", least: -6, most: 6, limit: 64, step: 0.05,
      value: number(), onchange: edit });
    const auto = checkField({ label: "Automatic exposure", value: read() === "auto",
      onchange: async (isAuto) => edit(isAuto ? "auto" : await this.actions.exposure()) });
    this.#controls.push(() => {
      stops.set(number());
      auto.set(read() === "auto");
    });
    return [auto.row, stops.row];
  }

  /** A plane that catches shadows; below the scene unless it says how high. */
  #ground() {
    const read = () => this.model.view.ground_plane;
    const edit = (plane) => this.model.edit("Shadows on the ground", (view) => {
      view.ground_plane = plane;
    });
    const shown = checkField({ label: "Shadows on the ground", value: read() !== null,
      onchange: (isOn) => edit(isOn ? {} : null) });
    const height = numberField({ label: "Height of the ground", unit: "m", least: -1e12, most: 1e12,
      value: read()?.height, placeholder: "below the scene", isOptional: true,
      onchange: (value) => edit(value === null ? {} : { height: value }) });
    const say = () => {
      shown.set(read() !== null);
      height.set(read()?.height);
      height.row.hidden = read() === null;
    };
    say();
    this.#controls.push(say);
    return [shown.row, height.row];
  }

  #look() {
    const background = () => this.model.view.background;
    const color = colorField({ label: "Background", value: background(), onchange: (rgb) =>
      this.model.edit("Background", (view) => {
        view.background = [...rgb, view.background[3]];
      }) });
    const clear = checkField({ label: "Transparent background", value: background()[3] === 0,
      onchange: (isClear) => this.model.edit("Background", (view) => {
        view.background = [...view.background.slice(0, 3), isClear ? 0 : 1];
      }) });
    this.#controls.push(() => {
      color.set(background());
      clear.set(background()[3] === 0);
    });
    return group("Look",
      this.#exposure(),
      this.#member(selectField, "tone_mapping",
        { label: "Tone mapping", options: [["neutral", "Khronos neutral"], ["agx", "AgX"], ["aces", "ACES"],
          ["none", "None"]] }),
      color.row, clear.row, this.#ground());
  }

  fill() {
    this.#controls = [];
    const shadows = this.techniques("shadows").map(({ name }) => name);
    const compare = selectField({ label: "Compare with", value: this.comparing,
      options: [["", "nothing"], ...shadows], onchange: (name) => {
        this.comparing = name;
        this.actions.compare(name);
      } });
    refill(this.panel,
      group("Techniques", this.#techniqueFields(), compare.row),
      group("Accuracy and time",
        this.#quality(numberField, "max_error", null, { label: "Max error", least: 1e-9, most: 1e6,
          placeholder: "none", isOptional: true }),
        this.#quality(numberField, "budget_ms", null, { label: "Budget", unit: "ms", least: 0.001,
          most: 86400000, placeholder: "none", isOptional: true }),
        el("div", { class: "row" }, button({ text: "Measure trade-offs", icon: "stats",
          onclick: () => this.actions.measure() })),
        this.#numbers(),
        selectField({ label: "Samples at rest", value: String(this.actions.restSamples()), options:
          [["0", "as above"], "8", "16"],
        onchange: (value) => this.actions.refineTo(Number(value)) }).row,
        selectField({ label: "Picture size", value: String(this.actions.scale()), options:
          [["0.25", "25 %"], ["0.5", "50 %"], ["0.75", "75 %"], ["1", "100 %"]],
        onchange: (value) => this.actions.rescale(Number(value)) }).row),
      this.#lens(), this.#look(), drawnOverGroup(this.model, this.#controls, this.actions),
      button({ text: "Reset render settings", icon: "reset", onclick: () =>
        this.model.edit("Reset quality", (view) => {
          view.quality = {};
        }) }));
  }

  /** Compared with another technique, or none (""), by whatever hand. */
  setComparing(name) {
    if (name === this.comparing) return;
    this.comparing = name;
    this.fill();
  }
}
