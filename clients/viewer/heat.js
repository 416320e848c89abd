// SPDX-License-Identifier: MIT
// What the picture can show besides colours: heat maps of the lengths of lists, with a legend and
// their numbers, and the other outputs of the renderer. A second picture over the first.
import { append, byId, count, el, replace } from "./dom.js";
import { checkField } from "./fields.js";
import { Live, STILLS } from "./live.js";

/** Outputs by name: text for people, and the unit of those that count. */
export const SHOWN = {
  color: { text: "Picture" },
  layers: { text: "Layers", title: "Transparent layers", unit: ["layer", "layers"],
    about: "Length of each pixel's list of transparent surfaces" },
  lights: { text: "Lights", title: "Lights that are looked at", unit: ["light", "lights"],
    about: "Length of the light list at each nearest surface" },
  depth: { text: "Depth", about: "Nearest is white; twice as far is half as bright" },
  normal: { text: "Normals", about: "World x, y, z from −1 to 1 as red, green, blue" },
  albedo: { text: "Base colour", about: "Of the nearest surface, without light" },
  transmittance: { text: "Transmittance", about: "What transparent layers let through to the camera" },
  optical_depth: { text: "Optical depth", about: "What haze, smoke and bodies take away: clear is black" },
};

const RAMP = [[0, 0, 0], [28, 40, 150], [0, 140, 200], [20, 170, 70], [245, 215, 40], [220, 40, 30],
  [255, 255, 255]]; // as the service draws counts: 0, then each four times the one before, from 1
const COUNT_MAX = 4 ** (RAMP.length - 2);
const STRENGTH = 0.85; // at first: the shapes below can still be seen
const FEW = 16; // counts that the scale shows one by one

/** The colour at a place of the ramp. */
function colorAt(at) {
  const below = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[below].map((from, i) =>
    Math.round(from + (at - below) * (RAMP[below + 1][i] - from)));
}

/** The colour of a whole count. */
export const colorOf = (value) =>
  colorAt(value > 0 ? Math.min(1 + Math.log2(value) / 2, RAMP.length - 1) : 0);

/** The colour at a share of a scale from blue to red. */
const fittedColor = (share) => colorAt(1 + share * (RAMP.length - 3));

const keyOf = (r, g, b) => (r << 16) | (g << 8) | b;

/** Counts by their colours, exact as far as colours differ. */
function makeCounts() {
  const counts = new Map();
  for (let value = COUNT_MAX; value >= 0; value--) counts.set(keyOf(...colorOf(value)), value);
  return counts;
}

export class HeatView {
  #counts = makeCounts();
  #live = null;
  #pixels = null; // of the last exact heat map: {width, height, values}
  shown = "color";

  #most = 0; // of the last exact heat map
  isFitted = true; // the scale ends at the greatest count of the picture

  /** @param {{refused: (problem: Error) => void, ready: () => void}} tells */
  constructor(client, stage, tells) {
    Object.assign(this, { client, stage, tells });
    this.canvas = byId("picture-heat");
    this.canvas.dataset.isRead = "true"; // its colours become numbers
    this.legend = byId("legend");
    this.strength = el("input", { type: "range", min: 0, max: 1, step: 0.01, value: STRENGTH,
      "aria-label": "Strength of the map over the picture",
      oninput: () => (this.canvas.style.opacity = this.strength.value) });
    this.fit = checkField({ label: "Scale fitted to the picture", value: true, onchange: (isFitted) => {
      this.isFitted = isFitted;
      this.#paint();
    } });
    this.said = el("p", { class: "fine legend-said", role: "status" });
  }

  get isCounting() {
    return Boolean(SHOWN[this.shown].unit);
  }

  /** Another output from now on; "color" is the picture alone. */
  show(name, wanted) {
    this.#live?.stop();
    this.#live = null;
    this.#pixels = null;
    this.shown = name;
    this.canvas.hidden = true;
    this.canvas.dataset.exact = "false";
    this.legend.hidden = name === "color";
    this.stage.surface.toggleAttribute("data-mapped", this.isCounting);
    if (name === "color") return;
    this.#fillLegend();
    this.#live = new Live(this.client, STILLS);
    this.#live.addEventListener("frame", ({ detail }) => this.#draw(detail));
    this.#live.addEventListener("problem", ({ detail }) => this.tells.refused(detail));
    if (wanted) this.update(wanted);
  }

  /** The view changed. */
  update(wanted) {
    // those of the colours
    const { background: _, highlight: __, edges: ___, ground_plane: ____, atmosphere, ...rest } = wanted;
    const isThick = this.shown === "optical_depth" && atmosphere;
    this.#live?.show({ ...rest, ...(isThick && { atmosphere }), output: this.shown });
  }

  stop() {
    this.#live?.stop();
  }

  #draw({ bitmap, isExact }) {
    this.stage.draw(bitmap, this.canvas);
    this.canvas.hidden = false;
    this.canvas.dataset.exact = String(isExact);
    if (this.isCounting) this.#read(isExact);
    if (isExact) this.tells.ready();
  }

  /** Numbers from colours. */
  #read(isExact) {
    const { width, height } = this.canvas;
    const { data } = this.canvas.getContext("2d").getImageData(0, 0, width, height);
    const values = new Uint16Array(width * height);
    let [most, sum, covered] = [0, 0, 0];
    for (let i = 0; i < values.length; i++) {
      const value = this.#counts.get(keyOf(data[4 * i], data[4 * i + 1], data[4 * i + 2])) ?? 0;
      values[i] = value;
      if (value > 0) covered++;
      sum += value;
      most = Math.max(most, value);
    }
    this.#pixels = { width, height, values, isExact };
    if (isExact) this.#most = most;
    this.#paint();
    if (!isExact) return;
    const share = (100 * covered) / Math.max(1, values.length);
    const mean = covered ? sum / covered : 0;
    this.said.textContent = covered === 0 ? "None in this picture"
      : `Most ${count(most)}${most === COUNT_MAX ? " or more" : ""}, mean ${mean.toFixed(1)} where there`
        + ` are any: ${share.toFixed(share < 10 ? 1 : 0)} % of the picture`;
  }

  /** Greatest count of the scale that is in use. */
  get #end() {
    return this.isFitted ? Math.max(this.#most, 2) : COUNT_MAX;
  }

  #colorOf(value) {
    if (!this.isFitted) return colorOf(value);
    return fittedColor(Math.min(1, (value - 1) / (this.#end - 1)));
  }

  /** Colours from numbers; none lets the picture through. */
  #paint() {
    if (!this.#pixels) return;
    const { width, height, values } = this.#pixels;
    const words = new Uint32Array(COUNT_MAX + 1); // little-endian RGBA, as browsers run on
    for (let value = 1; value <= COUNT_MAX; value++) {
      const [r, g, b] = this.#colorOf(value);
      words[value] = ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;
    }
    const image = new ImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    values.forEach((value, i) => (pixels[i] = words[value]));
    this.canvas.getContext("2d").putImageData(image, 0, 0);
    this.#drawScale();
  }

  /** "3 layers" at shares of the picture; "" where nothing is known. */
  at({ x, y }) {
    const known = this.#pixels;
    if (!known?.isExact) return "";
    const [column, row] = [Math.floor(x * known.width), Math.floor(y * known.height)];
    const value = known.values[row * known.width + column];
    const [one, many] = SHOWN[this.shown].unit;
    return value === undefined ? "" : `${count(value)}${value === COUNT_MAX ? "+" : ""} ${value === 1 ? one : many}`;
  }

  #fillLegend() {
    const { text, title, about } = SHOWN[this.shown];
    this.strength.value = this.isCounting ? STRENGTH : 1;
    this.canvas.style.opacity = this.strength.value;
    this.said.textContent = "";
    this.#most = 0;
    this.scale = el("canvas", { class: "legend-scale", width: 240, height: 1, role: "img" });
    this.ticks = el("ol", { class: "legend-ticks", "aria-hidden": "true" });
    replace(this.legend, el("h3", {}, title ?? text), el("p", { class: "fine" }, about),
      this.isCounting && [this.scale, this.ticks, this.said, this.fit.row]);
    append(this.legend, [el("label", { class: "legend-strength" }, el("span", {}, "Strength"), this.strength)]);
  }

  /** Colours from 1 to the end of the scale: in even steps when fitted, else each tick four times the
   * one before. */
  #drawScale() {
    const context = this.scale.getContext("2d");
    const { width } = this.scale;
    const end = this.#end;
    const isFew = this.isFitted && end <= FEW;
    for (let x = 0; x < width; x++) {
      const share = isFew ? Math.floor((x * end) / width) / (end - 1) : x / (width - 1);
      const color = this.isFitted ? fittedColor(share) : colorAt(1 + share * (RAMP.length - 2));
      context.fillStyle = `rgb(${color.join(" ")})`;
      context.fillRect(x, 0, 1, 1);
    }
    const even = (n) => Math.round(1 + (n * (end - 1)) / 5);
    const ticks = !this.isFitted ? ["1", "4", "16", "64", "256", "1024+"]
      : Array.from({ length: isFew ? end : 6 }, (_, n) => count(isFew ? n + 1 : even(n)));
    this.ticks.toggleAttribute("data-few", isFew);
    replace(this.ticks, ticks.map((tick) => el("li", {}, tick)));
    this.scale.setAttribute("aria-label", `Scale from blue, 1, to ${this.isFitted ? "red" : "white"}, ${count(end)}`);
  }
}
