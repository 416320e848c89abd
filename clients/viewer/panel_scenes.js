// SPDX-License-Identifier: MIT
// The scenes on the server: choose, bring by file or by drag and drop, delete. What of a file its
// pictures leave out is told in its row.
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

const SCENE = /\.(gltf|glb|obj|ply|stl|fbx|dae|3mf|3ds|iv)$/i;
const ALONE = /\.(glb|ply|stl|3mf|iv)$/i; // needs no other file

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
      tabIndex: -1, accept: ".glb,.gltf,.obj,.mtl,.ply,.stl,.fbx,.dae,.3mf,.3ds,.iv,.hdr,.exr,.bin,.png,.jpg,.jpeg,.webp,.ktx2,model/gltf-binary",
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
        + ".dae, .3mf, .3ds or .iv, or an environment map: .hdr or .exr."), "Nothing to upload");
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

  /** scene: which of the file. The summary; null when the server refused them, undefined when people did. */
  async #send(named, which, scene) {
    const [{ name }] = named;
    const tooMuch = this.#tooMuch(named);
    if (tooMuch) {
      showProblem(new Error(tooMuch), `${name} was not sent`);
      return null;
    }
    announce(`Uploading ${name}`);
    const summary = await this.#take(name, which, (options) => this.client.postScene(named,
      { ...options, scene, onProgress: (share) => this.#progress(share) }));
    if (summary) this.files.set(summary.id, named);
    return summary;
  }

  /** Opens another scene of the file of the open one. */
  async #openOther(scene) {
    if (this.#isBusy()) return;
    const summary = await this.#send(this.files.get(this.model.scene.id), "", scene);
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

  async #delete(scene) {
    const name = scene.name ?? scene.id.slice(0, 12);
    if (!confirm(`Delete ${name}? It is removed from the server.`)) return;
    try {
      await this.client.deleteScene(scene.id);
      if (this.model.scene?.id === scene.id) this.actions.open(null);
      notice(`Deleted ${name}`);
    } catch (problem) {
      showProblem(problem, `${name} could not be deleted`);
    }
    this.refresh();
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
      isOpen && this.model.scene.warnings.length > 0 && el("ul", { class: "scene-warnings",
        "aria-label": "What pictures leave out" },
      this.model.scene.warnings.map((warning) => el("li", {}, warning))));
  }

  /** Which scene of its file is shown, where the file has several, and the choice among them. */
  #fileScenes({ id, file_scenes: names = [], file_scene: shown }) {
    if (names.length < 2) return null;
    const isHere = this.files.has(id);
    return el("label", { class: "file-scenes" }, el("span", { class: "fine" }, "Scene of the file"),
      el("select", { "aria-label": "Scene of the file", disabled: !isHere,
        title: isHere ? "" : "Bring the file again to choose another of its scenes",
        onchange: (event) => this.#openOther(`#${event.target.value}`) },
      names.map((name, at) => el("option", { value: at, selected: at === shown }, name || `Scene ${at + 1}`))));
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
