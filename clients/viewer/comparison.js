// SPDX-License-Identifier: MIT
// A second picture beside the first one: the same view with another shadow technique.

/** The technique that is most telling beside the one in use. */
function otherTechnique(current, names) {
  const preferred = ["raytraced", "deep", "map", "none"];
  return preferred.find((name) => names.includes(name) && name !== current) ?? names[0] ?? "";
}

export class Comparison {
  technique = ""; // of the second picture; "" for none
  #live = null;

  /**
   * @param {object} asks
   * @param {(canvas: HTMLCanvasElement) => Live} asks.line makes one for the second picture
   * @param {() => string[]} asks.techniques
   * @param {() => Promise<string>} asks.current what casts the shadows of the first picture
   * @param {() => void} asks.changed another technique is compared with, or none
   */
  constructor(stage, model, asks) {
    Object.assign(this, { stage, model, asks });
  }

  /** Shows another shadow technique beside the one in use; "" ends it. */
  show(technique) {
    this.technique = this.model.scene ? technique : "";
    this.#live?.stop();
    this.#live = this.technique ? this.asks.line(this.stage.second) : null;
    const asked = this.model.view.quality.shadows ?? "auto";
    this.stage.compare(this.technique && [asked, this.technique]);
    this.asks.changed();
    if (this.technique && asked === "auto") this.#nameChosen();
  }

  /** The label says what the server chose for the first picture, once that is known. */
  async #nameChosen() {
    const { technique } = this;
    const chosen = await this.asks.current();
    if (technique === this.technique && chosen !== "auto")
      this.stage.compare([`auto: ${chosen}`, technique]);
  }

  async toggle() {
    if (this.technique) this.show("");
    else this.show(otherTechnique(await this.asks.current(), this.asks.techniques()));
  }

  update(wanted) {
    this.#live?.show({ ...wanted, quality: { ...wanted.quality, shadows: this.technique } });
  }

  stop() {
    this.#live?.stop();
  }
}
