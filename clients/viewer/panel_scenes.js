// SPDX-License-Identifier: MIT
// The scenes on the server: choose, bring by file or by drag and drop, delete. The row of a
// scene says what of its file the pictures leave out.
import { announce, button, byId, bytes, count, el, icon } from "./dom.js";
import { refill } from "./docks.js";
import { mapsAmong } from "./environment.js";
import { notice, showProblem } from "./messages.js";

/** Files of a drop, folders opened, each with its path. */
async function filesOfDrop(items) {
  const files = [];
  const visit = async (entry, path) => {
    if (entry.isFile) {
      const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
      files.push({ name: path + file.name, blob: file });
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (!some.length) return;
      for (const one of some) await visit(one, `${path}${entry.name}/`);
    }
  };
  const entries = [...items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  for (const entry of entries) await visit(entry, "");
  return files;
}

const endsWith = (suffixes) => new RegExp(`\\.(${suffixes.join("|")})$`, "i");
const WITHOUT_OTHERS = ["glb", "ply", "stl", "3mf", "iv", "step", "stp", "iges", "igs",
  "vdb"];
const SCENES = [...WITHOUT_OTHERS, "gltf", "obj", "fbx", "dae", "3ds"];
const BESIDE = ["mtl", "hdr", "exr", "bin", "png", "jpg", "jpeg", "webp", "ktx2"];
const SCENE = endsWith(SCENES);
const ALONE = endsWith(WITHOUT_OTHERS);
const UNITS = { mm: "millimetres", cm: "centimetres", m: "metres", in: "inches", ft: "feet" };
const DEFLECTED = ["step", "iges"]; // formats whose surfaces become triangles
const UPS = { y: "+Y up", z: "+Z up" };
const BY = { request: "chosen", file: "as the file has it", default: "assumed" };

/**
 * The scenes among files, each as a list of {name, blob} that begins with the scene: a .glb alone, a
 * .gltf with all that lies in its folder, by their paths from there.
 */
function scenesAmong(files) {
  return files.filter(({ name }) => SCENE.test(name)).map((root) => {
    const folder = root.name.slice(0, root.name.lastIndexOf("/") + 1);
    const others = ALONE.test(root.name) ? [] : files.filter((file) =>
      file !== root && file.name.startsWith(folder) && !SCENE.test(file.name));
    return [root, ...others].map(({ name, blob }) => ({ name: name.slice(folder.length), blob }));
  });
}

export class ScenesPanel {
  scenes = [];
  upload = null; // {name, which, share, abort}
  files = new Map(); // by id, what was sent for it: another scene of the same file is posted from them

  /** @param {{open: (id: string|null) => void, show: () => void, limits: () => object,
   * bringMaps: (files: {name, blob}[]) => void}} actions */
  constructor(panel, client, model, actions) {
    Object.assign(this, { panel, client, model, actions });
    this.input = el("input", { type: "file", multiple: true, class: "hidden-text", id: "scene-files",
      tabIndex: -1, accept: [...[...SCENES, ...BESIDE].map((suffix) => `.${suffix}`), "model/gltf-binary"].join(),
      "aria-label": "Files of a scene",
      onchange: () => this.bring([...this.input.files].map((file) =>
        ({ name: file.webkitRelativePath || file.name, blob: file }))) });
    model.addEventListener("scene", () => {
      this.#warn();
      this.fill();
    });
    this.#takeDrops();
    this.fill();
  }

  #takeDrops() {
    const cover = byId("drop");
    let depth = 0;
    const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
    const end = () => {
      depth = 0;
      cover.hidden = true;
    };
    addEventListener("dragenter", (event) => {
      if (!hasFiles(event)) return;
      depth++;
      cover.hidden = false;
    });
    addEventListener("dragleave", () => {
      if (--depth <= 0) end();
    });
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", async (event) => {
      event.preventDefault();
      end();
      if (hasFiles(event)) this.bring(await filesOfDrop(event.dataTransfer.items));
    });
  }

  async refresh() {
    try {
      this.scenes = (await this.client.scenes()).reverse();
    } catch (problem) {
      showProblem(problem, "The scenes cannot be listed");
    }
    this.fill();
  }

  #isBusy() {
    if (this.upload)
      showProblem(new Error("Another one is on its way: wait for it, or cancel it."), "One at a time");
    return Boolean(this.upload);
  }

  /** Has the server make its demo scene, and opens it. */
  async bringDemo() {
    if (this.#isBusy()) return;
    const summary = await this.#take("demo", "", (options) => this.client.postDemo(options));
    if (summary) this.actions.open(summary.id);
  }

  /** Uploads the scenes among files, one after the other, and opens the last that is taken. */
  async bring(files) {
    this.input.value = "";
    if (this.#isBusy()) return;
    const scenes = scenesAmong(files), maps = mapsAmong(files);
    if (!scenes.length && maps.length) {
      await this.actions.bringMaps(maps);
      return;
    }
    if (!scenes.length)
      showProblem(new Error("None of these files is a scene: .glb, .gltf, .obj, .ply, .stl, .fbx, "
        + ".dae, .3mf, .3ds, .iv, .step, .iges or .vdb, or an environment map: .hdr or .exr."),
      "Nothing to upload");
    let last = null;
    for (const [at, named] of scenes.entries()) {
      const which = scenes.length > 1 ? `${at + 1} of ${scenes.length}` : "";
      const summary = await this.#send(named, which);
      if (summary === undefined) break;
      last = summary ?? last;
    }
    if (last) this.actions.open(last.id);
  }

  /** Why the server would not take them, before they are sent; "" when it may. */
  #tooMuch(named) {
    const { upload_bytes: most = Infinity, upload_files: mostFiles = Infinity } = this.actions.limits();
    const size = named.reduce((sum, { blob }) => sum + blob.size, 0);
    if (size > most) return `It has ${bytes(size)}; this server takes up to ${bytes(most)}.`;
    return named.length > mostFiles ? `These are ${count(named.length)} files; this server takes up to `
      + `${count(mostFiles)}.` : "";
  }

  /**
   * how: {scene, unit, up, deflection}: which scene of the file, and how another format than glTF is read. The
   * summary; null when the server refused the files, undefined when people did.
   */
  async #send(named, which, how = {}) {
    const [{ name }] = named;
    const tooMuch = this.#tooMuch(named);
    if (tooMuch) {
      showProblem(new Error(tooMuch), `${name} was not sent`);
      return null;
    }
    announce(`Uploading ${name}`);
    const summary = await this.#take(name, which, (options) => this.client.postScene(named,
      { ...options, ...how, onProgress: (share) => this.#progress(share),
        onReading: (progress) => this.#reading(progress) }));
    if (summary) this.files.set(summary.id, named);
    return summary;
  }

  /** Opens the file of the open scene again: another scene of it, or in another unit or way up. */
  async #openAgain(how) {
    if (this.#isBusy()) return;
    const summary = await this.#send(this.files.get(this.model.scene.id), "", how);
    if (summary) this.actions.open(summary.id);
    else this.fill();
  }

  /** Shows what is on its way, and that it can be cancelled; answers as #send. */
  async #take(name, which, post) {
    const abort = new AbortController();
    this.upload = { name, which, share: 0, abort };
    this.fill();
    let summary = null;
    try {
      summary = await post({ signal: abort.signal });
      notice(`Opened ${name}`);
    } catch (problem) {
      if (problem.name === "AbortError") summary = undefined;
      else showProblem(problem, `${name} could not be opened`);
    }
    this.upload = null;
    await this.refresh();
    return summary;
  }

  #progress(share) {
    this.upload.share = share;
    if (!this.bar?.isConnected) return;
    if (share < 1) this.bar.value = share;
    else this.bar.removeAttribute("value"); // all sent; the server decodes
    this.said.textContent = share < 1 ? `${Math.round(100 * share)} %` : "decoding";
  }

  /** Stages whose share nobody knows tell 0. */
  #reading({ stage, share }) {
    if (!this.bar?.isConnected) return;
    this.said.textContent = `decoding: ${stage}${share > 0 ? `, ${Math.floor(100 * share)} %` : ""}`;
    if (share > 0) this.bar.value = share;
    else this.bar.removeAttribute("value");
  }

  async #delete(scene) {
    const name = scene.name ?? scene.id.slice(0, 12);
    if (!confirm(`Delete ${name}? It is removed from the server.`)) return;
    try {
      await this.#deleteUnlessNeeded(scene.id);
      if (this.model.scene?.id === scene.id) this.actions.open(null);
      notice(`Deleted ${name}`);
    } catch (problem) {
      showProblem(problem, `${name} could not be deleted`);
    }
    this.refresh();
  }

  /** Asks again where a job needs it, whose name the problem tells. */
  async #deleteUnlessNeeded(id) {
    try {
      await this.client.deleteScene(id);
    } catch (problem) {
      if (problem.code !== "conflict" || !confirm(`${problem.message}\n\nDelete it all the same? Frames of the job fail.`))
        throw problem;
      await this.client.deleteScene(id, { force: true });
    }
  }

  #item(scene) {
    const isOpen = this.model.scene?.id === scene.id;
    return el("li", { class: "scene", "data-open": isOpen ? "" : undefined },
      el("button", { type: "button", class: "scene-open", "data-key": scene.id,
        "aria-current": isOpen ? "true" : undefined, onclick: () => this.actions.open(scene.id) },
      el("strong", {}, scene.name ?? `Scene ${scene.id.slice(0, 8)}`),
      el("span", { class: "fine" }, `${count(scene.triangles)} triangles · ${bytes(scene.bytes.upload)}`)),
      button({ label: `Delete ${scene.name ?? scene.id.slice(0, 8)}`, icon: "remove", class: "plain",
        onclick: () => this.#delete(scene) }),
      isOpen && this.#fileScenes(this.model.scene),
      isOpen && this.#fileUnits(this.model.scene),
      isOpen && this.model.scene.warnings.length > 0 && el("ul", { class: "scene-warnings",
        "aria-label": "What pictures leave out" },
      this.model.scene.warnings.map((warning) => el("li", {}, warning))));
  }

  /** Which scene of its file is shown, where the file has several, and the choice among them. */
  #fileScenes(summary) {
    const { id, file_scenes: names = [], file_scene: shown } = summary;
    if (names.length < 2) return null;
    return this.#fileChoice(id, { label: "Scene of the file", what: "another of its scenes",
      onchange: (at) => this.#openAgain({ ...this.#askedOf(summary), scene: `#${at}` }) },
    names.map((name, at) => el("option", { value: at, selected: at === shown }, name || `Scene ${at + 1}`)));
  }

  /** Of how a file is opened: to be made where the file is at hand. what: is chosen. */
  #fileChoice(id, { label, what, onchange }, options) {
    const isHere = this.files.has(id);
    return el("label", { class: "file-scenes" }, el("span", { class: "fine" }, label),
      el("select", { "aria-label": label, disabled: !isHere,
        title: isHere ? "" : `Bring the file again to choose ${what}`,
        onchange: (event) => onchange(event.target.value) }, options));
  }

  /** How the open file was asked to be read. */
  #askedOf({ source, file_scenes: names = [], file_scene: shown }) {
    const asked = (by, name) => (by === "request" ? name : undefined);
    return { scene: names.length > 1 ? `#${shown}` : undefined, unit: asked(source?.unit_by, source?.unit),
      up: asked(source?.up_by, source?.up), deflection: source?.deflection };
  }

  /** How long one unit of a file of another format is, and which of its axes is up; either can be chosen. */
  #fileUnits(summary) {
    const { id, source } = summary;
    if (!source?.converter) return null;
    const now = this.#askedOf(summary);
    const choice = (name, what, names, unnamed) => {
      const by = BY[source[`${name}_by`]];
      return this.#fileChoice(id, { label: `${what} of the file`, what: `its ${what.toLowerCase()}`,
        onchange: (value) => this.#openAgain({ ...now, [name]: value }) },
      [...Object.entries(names).map(([value, said]) => el("option", { value, selected: value === source[name] },
        value === source[name] ? `${said}, ${by}` : said)),
      !(source[name] in names) && el("option", { value: source[name], selected: true, disabled: true },
        `${unnamed}, ${by}`)]);
    };
    return [choice("unit", "Unit", UNITS, `${source.unit_m} m`),
      choice("up", "Axis", UPS, `+${source.up.toUpperCase()} up`),
      DEFLECTED.includes(source.format) && this.#fileDeflection(id, now)];
  }

  /** How far the triangles of a file may be off its surfaces, in its unit; empty: in proportion to its parts. */
  #fileDeflection(id, now) {
    const isHere = this.files.has(id);
    return el("label", { class: "file-scenes" }, el("span", { class: "fine" }, "Deflection of the file"),
      el("input", { type: "number", min: 1e-9, step: "any", value: now.deflection ?? "", disabled: !isHere,
        "aria-label": "Deflection of the file", placeholder: "0.1 % of each part",
        title: isHere ? "How far triangles may be off the surfaces, in the unit of the file"
          : "Bring the file again to choose its deflection",
        onchange: (event) => event.target.reportValidity()
          && this.#openAgain({ ...now, deflection: event.target.value || undefined }) }));
  }

  /** Below the picture: how many parts of the open file it leaves out; the row of the scene tells which. */
  #warn() {
    const warnings = this.model.scene?.warnings ?? [];
    const said = byId("status-warnings");
    said.hidden = !warnings.length;
    said.textContent = warnings.length === 1 ? "1 warning" : `${warnings.length} warnings`;
    said.title = warnings.join("\n");
    said.onclick = () => this.actions.show();
  }

  #uploading() {
    this.bar = el("progress", { max: 1, value: this.upload.share, "aria-label": "Upload" });
    this.said = el("span", { class: "fine" }, "");
    return el("div", { class: "uploading" }, el("strong", {}, this.upload.name),
      this.upload.which && el("span", { class: "fine" }, this.upload.which), this.bar, this.said,
      button({ text: "Cancel", onclick: () => this.upload.abort.abort() }));
  }

  fill() {
    refill(this.panel, this.input,
      this.upload ? this.#uploading() : el("label", { class: "upload", for: "scene-files" },
        icon("upload", 18), el("span", {}, "Drop files here, or "),
        button({ text: "choose", class: "link", onclick: () => this.input.click() })),
      el("ul", { class: "scenes", "aria-label": "Scenes on the server" },
        this.scenes.map((scene) => this.#item(scene))),
      !this.scenes.length && el("p", { class: "fine" }, "There is no scene on this server yet."));
  }
}
