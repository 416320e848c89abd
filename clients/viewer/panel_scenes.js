// SPDX-License-Identifier: MIT
// The scenes on the server: choose, bring by file or by drag and drop, forget.
import { announce, button, byId, bytes, count, el, icon } from "./dom.js";
import { refill } from "./docks.js";
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

/** Paths from the folder of the .gltf or .glb, as it refers to its files. */
function relativeNames(files) {
  const root = files.find(({ name }) => /\.(gltf|glb)$/i.test(name));
  if (!root) return null;
  const folder = root.name.slice(0, root.name.lastIndexOf("/") + 1);
  const kept = files.filter(({ name }) => name.startsWith(folder));
  if (/\.glb$/i.test(root.name) && kept.length > 1) return [{ ...root, name: root.name.slice(folder.length) }];
  return [root, ...kept.filter((file) => file !== root)]
    .map(({ name, blob }) => ({ name: name.slice(folder.length), blob }));
}

export class ScenesPanel {
  scenes = [];
  upload = null; // {name, share, abort}

  constructor(panel, client, model, open) {
    Object.assign(this, { panel, client, model, open });
    this.input = el("input", { type: "file", multiple: true, class: "hidden-text", id: "scene-files",
      tabIndex: -1, accept: ".glb,.gltf,.bin,.png,.jpg,.jpeg,.webp,.ktx2,model/gltf-binary",
      "aria-label": "Files of a scene",
      onchange: () => this.bring([...this.input.files].map((file) =>
        ({ name: file.webkitRelativePath || file.name, blob: file }))) });
    model.addEventListener("scene", () => this.fill());
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

  /** Uploads files and opens what they make. */
  async bring(files) {
    const named = relativeNames(files);
    this.input.value = "";
    if (!named) {
      showProblem(new Error("None of these files is a .glb or a .gltf."), "Nothing to upload");
      return;
    }
    const abort = new AbortController();
    this.upload = { name: named[0].name, share: 0, abort };
    this.fill();
    try {
      const summary = await this.client.postScene(named, { signal: abort.signal,
        onProgress: (share) => this.#progress(share) });
      this.upload = null;
      await this.refresh();
      notice(`${named[0].name} is here`);
      this.open(summary.id);
    } catch (problem) {
      this.upload = null;
      this.fill();
      if (problem.name !== "AbortError") showProblem(problem, `${named[0].name} was not taken`);
    }
  }

  #progress(share) {
    this.upload.share = share;
    if (!this.bar?.isConnected) return;
    if (share < 1) this.bar.value = share;
    else this.bar.removeAttribute("value"); // all sent; the server decodes
    this.said.textContent = share < 1 ? `${Math.round(100 * share)} %` : "decoding";
  }

  async #forget(scene) {
    const name = scene.name ?? scene.id.slice(0, 12);
    if (!confirm(`Forget ${name}? It is removed from the server.`)) return;
    try {
      await this.client.deleteScene(scene.id);
      if (this.model.scene?.id === scene.id) this.open(null);
      notice(`${name} is forgotten`);
    } catch (problem) {
      showProblem(problem, `${name} was not forgotten`);
    }
    this.refresh();
  }

  #item(scene) {
    const isOpen = this.model.scene?.id === scene.id;
    return el("li", { class: "scene", "data-open": isOpen ? "" : undefined },
      el("button", { type: "button", class: "scene-open", "data-key": scene.id,
        "aria-current": isOpen ? "true" : undefined, onclick: () => this.open(scene.id) },
      el("strong", {}, scene.name ?? `Scene ${scene.id.slice(0, 8)}`),
      el("span", { class: "fine" }, `${count(scene.triangles)} triangles · ${bytes(scene.bytes.upload)}`)),
      button({ label: `Forget ${scene.name ?? scene.id.slice(0, 8)}`, icon: "remove", class: "plain",
        onclick: () => this.#forget(scene) }));
  }

  #uploading() {
    this.bar = el("progress", { max: 1, value: this.upload.share, "aria-label": "Upload" });
    this.said = el("span", { class: "fine" }, "");
    announce(`Uploading ${this.upload.name}`);
    return el("div", { class: "uploading" }, el("strong", {}, this.upload.name), this.bar, this.said,
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
