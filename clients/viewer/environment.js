// SPDX-License-Identifier: MIT
// Light from all around: the environment maps of the server, and the controls of the view's.
import { announce, button, bytes, el } from "./dom.js";
import { checkField, colorField, group, selectField, slider } from "./fields.js";
import { notice, showProblem } from "./messages.js";

const MAP = /\.(hdr|exr)$/i;
const FRESH = { sky: [0.3, 0.35, 0.4], ground: [0.1, 0.1, 0.1] };

/** The maps among files, as they were dropped or chosen. */
export const mapsAmong = (files) => files.filter(({ name }) => MAP.test(name));

/** The members of a view's environment with others; null where neither a map nor a sky is left. */
export function environmentWith(environment, members) {
  const changed = { ...environment, ...members };
  for (const [name, value] of Object.entries(changed)) if (value === null) delete changed[name];
  return changed.image || changed.sky ? changed : null;
}

/** Event: "change", when the server has other maps. */
export class EnvironmentMaps extends EventTarget {
  maps = []; // newest first

  /** @param {Vitrail} client @param {Model} model @param {() => object} limits of the server */
  constructor(client, model, limits) {
    super();
    Object.assign(this, { client, model, limits });
    this.refresh();
  }

  async refresh() {
    try {
      this.maps = (await this.client.environments()).reverse();
      this.dispatchEvent(new Event("change"));
    } catch (problem) {
      showProblem(problem, "The environment maps cannot be listed");
    }
  }

  /** Uploads maps, and lights the view with the last that is taken. */
  async bring(files) {
    let last = null;
    for (const { name, blob } of files) last = (await this.#send(name, blob)) ?? last;
    await this.refresh();
    if (last && this.model.scene) this.choose(last.id);
  }

  async #send(name, blob) {
    const most = this.limits().upload_bytes ?? Infinity;
    try {
      if (blob.size > most)
        throw new Error(`It has ${bytes(blob.size)}; this server takes up to ${bytes(most)}.`);
      announce(`Uploading ${name}`);
      const summary = await this.client.postEnvironment(blob, { name: name.split("/").pop() });
      notice([`Uploaded ${name}`, ...summary.warnings].join(": "));
      return summary;
    } catch (problem) {
      showProblem(problem, `${name} could not be taken`);
      return null;
    }
  }

  /** @param {string|null} image "studio" or an id; null: no map */
  choose(image) {
    this.edit("map", image ? { image } : { image: null, rotation_deg: null, intensity: null, background: null });
  }

  /** The map of the view was removed from the server: goes on without it. */
  gone() {
    this.choose(null);
    this.refresh();
    showProblem(new Error("It was removed from the server. Bring its file again and undo."),
      "The environment map is gone");
  }

  /** @param {string} what changes, for undo */
  edit(what, members) {
    this.model.edit(`Environment ${what}`, (view) => {
      view.environment = environmentWith(view.environment, members);
    });
  }
}

/** The controls; `keep` takes a function that brings one of them up to date. */
export class EnvironmentControls {
  constructor(maps) {
    this.maps = maps;
    this.input = el("input", { type: "file", class: "hidden-text", tabIndex: -1, accept: ".hdr,.exr",
      "aria-label": "File of an environment map", onchange: () => {
        const files = [...this.input.files].map((file) => ({ name: file.name, blob: file }));
        this.input.value = "";
        maps.bring(files);
      } });
  }

  /** Changes when other controls than now are needed. */
  get shape() {
    const { environment } = this.maps.model.view;
    return [Boolean(environment?.sky), environment?.image, this.maps.maps.map(({ id, name }) => [id, name])];
  }

  #read(member, otherwise) {
    return this.maps.model.view.environment?.[member] ?? otherwise;
  }

  #control(keep, make, member, otherwise, more) {
    const field = make({ ...more, value: this.#read(member, otherwise),
      onchange: (value) => this.maps.edit(member.replace(/_deg$/, ""), { [member]: value }) });
    keep(() => field.set(this.#read(member, otherwise)));
    return field.row;
  }

  #choice() {
    const image = this.#read("image", "");
    const known = ["", "studio", ...this.maps.maps.map(({ id }) => id)];
    return selectField({ label: "Map", value: image, onchange: (value) => this.maps.choose(value || null),
      options: [["", "None"], ["studio", "Studio"],
        ...this.maps.maps.map(({ id, name }) => [id, name ?? `Map ${id.slice(0, 8)}`]),
        ...(known.includes(image) ? [] : [[image, `Map ${image.slice(0, 8)}`]])] }).row;
  }

  #studio(keep) {
    const read = () => this.maps.model.view.studio;
    const field = selectField({ label: "Studio lighting", value: read(),
      options: [["auto", "Where nothing else shines"], ["on", "On"], ["off", "Off"]],
      onchange: (value) => this.maps.model.edit("Studio lighting", (view) => { view.studio = value; }) });
    keep(() => field.set(read()));
    return field.row;
  }

  rows(keep) {
    const control = (...rest) => this.#control(keep, ...rest);
    const hasSky = Boolean(this.#read("sky", null));
    const turn = checkField({ label: "Light from everywhere", value: hasSky, onchange: (isOn) =>
      this.maps.edit("sky", isOn ? FRESH : { sky: null, ground: null }) });
    return group("Environment", this.input, this.#studio(keep), this.#choice(),
      button({ text: "Bring a map", icon: "upload", onclick: () => this.input.click() }),
      this.#read("image", null) && [
        control(slider, "rotation_deg", 0, { label: "Map rotation", unit: "°", least: -180, most: 180, limit: 360 }),
        control(slider, "intensity", 1, { label: "Map intensity", least: 0, most: 10, limit: 1e6, curve: 2 }),
        control(checkField, "background", false, { label: "Show it behind the scene" })],
      turn.row,
      hasSky && [control(colorField, "sky", [0, 0, 0], { label: "Sky" }),
        control(colorField, "ground", [0, 0, 0], { label: "Ground" })]);
  }
}
