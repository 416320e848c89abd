// SPDX-License-Identifier: MIT
// Haze in the space around the scene: the controls of the view's.
import { checkField, colorField, group, numberField, slider } from "./fields.js";

const FRESH_DEPTH = 0.5; // optical depth across the scene of haze that is switched on
const HAZY_DEPTH = 8; // at the right end of the slider: nothing of the far side is left

/** The controls; `keep` takes a function that brings one of them up to date. */
export class HazeControls {
  constructor(model) {
    this.model = model;
  }

  get #haze() {
    return this.model.view.atmosphere;
  }

  /** Changes when other controls than now are needed. */
  get shape() {
    return [Boolean(this.#haze), Boolean(this.#haze?.falloff_m)];
  }

  /** The density, to two digits, that has this optical depth across the scene. */
  #densityOf(depth) {
    const box = this.model.bounds;
    const across = Math.hypot(box[3] - box[0], box[4] - box[1], box[5] - box[2]) || 1;
    return Math.min(1e6, Number((depth / across).toPrecision(2)));
  }

  #edit(what, members) {
    this.model.edit(what, (view) => {
      view.atmosphere = members && { ...view.atmosphere, ...members };
    });
  }

  #control(keep, make, member, otherwise, more) {
    const read = () => this.#haze?.[member] ?? otherwise;
    const field = make({ ...more, value: read(), onchange: (value) =>
      this.#edit(more.label, { [member]: value ?? otherwise }) });
    keep(() => field.set(read()));
    return field.row;
  }

  rows(keep) {
    const control = (...rest) => this.#control(keep, ...rest);
    const turn = checkField({ label: "Fill space with haze", value: Boolean(this.#haze), onchange: (isOn) =>
      this.#edit("Haze", isOn ? { density: this.#densityOf(FRESH_DEPTH) } : null) });
    if (!this.#haze) return group("Haze", turn.row);
    const most = Math.max(this.#densityOf(HAZY_DEPTH), this.#haze.density);
    const height = (label, member, more) => control(numberField, member, 0, { label, unit: "m", ...more });
    return group("Haze", turn.row,
      control(slider, "density", 0, { label: "Density", unit: "1/m", least: 0, most, limit: 1e6, curve: 2 }),
      control(colorField, "color", [1, 1, 1], { label: "Colour of the haze" }),
      control(slider, "anisotropy", 0, { label: "Onwards or back", least: -0.95, most: 0.95, step: 0.01 }),
      height("Thins out within", "falloff_m", { least: 0, most: 1e9, hint: "0 is even at any height" }),
      this.#haze.falloff_m > 0 && height("Above height", "base_m", { least: -1e12, most: 1e12 }));
  }
}
