// SPDX-License-Identifier: MIT
// Density grids of the scene and its parts: the controls of their look.
import { button } from "./dom.js";
import { colorField, group, slider } from "./fields.js";

const MOST_SHOWN = 16; // grids with controls; scenes with more are edited by the API
const THICK = 4; // times the density of the file, at the right end of the slider

/** The controls; `keep` takes a function that brings one of them up to date. */
export class SmokeControls {
  constructor(model) {
    this.model = model;
  }

  get #grids() {
    return this.model.scene?.outline.grids ?? [];
  }

  /** Changes when other controls than now are needed. */
  get shape() {
    return this.#grids.slice(0, MOST_SHOWN).map(({ key }, index) => [key, this.model.isGridEdited(index)]);
  }

  #group(keep, index) {
    const { model } = this;
    const { name, density } = this.#grids[index];
    const control = (make, member, more) => {
      const field = make({ ...more, value: model.grid(index)[member], onchange: (value) =>
        model.editGrid(index, { [member]: value }) });
      keep(() => this.#grids[index] && field.set(model.grid(index)[member]));
      return field.row;
    };
    const most = Math.max(THICK * density, model.grid(index).density) || 1;
    return group(name ? `Smoke: ${name}` : "Smoke",
      control(slider, "density", { label: "Density of the smoke", unit: "1/m", least: 0, most, limit: 1e12, curve: 2 }),
      control(colorField, "color", { label: "Colour of the smoke" }),
      control(slider, "anisotropy", { label: "Smoke scatters onwards or back", least: -0.95, most: 0.95, step: 0.01 }),
      model.isGridEdited(index) && button({ text: "As in the file", icon: "reset",
        onclick: () => model.editGrid(index, null) }));
  }

  rows(keep) {
    return this.#grids.slice(0, MOST_SHOWN).map((_, index) => this.#group(keep, index));
  }
}
