// SPDX-License-Identifier: MIT
// Puts the viewer together: model, picture, panels, toolbar, and the line to the server.
import { announce, append, button, byId, el, icon, replace } from "./dom.js";
import { STANDARD_VIEWS } from "./camera.js";
import { Dock } from "./docks.js";
import { makeHandles } from "./handles.js";
import { HeatView, SHOWN } from "./heat.js";
import { Live } from "./live.js";
import { clearProblems, clearUnreached, notice, showProblem } from "./messages.js";
import { linkFromState, stateFromLink } from "./links.js";
import { Model } from "./model.js";
import { Navigator } from "./navigate.js";
import { Overlay } from "./overlay.js";
import { LightsPanel } from "./panel_lights.js";
import { PropertiesPanel } from "./panel_properties.js";
import { RenderPanel, otherTechnique } from "./panel_render.js";
import { Readout } from "./readout.js";
import { ScenesPanel } from "./panel_scenes.js";
import { SectionPanel } from "./panel_section.js";
import { TreePanel } from "./panel_tree.js";
import { openAddPart } from "./add_part.js";
import { openHelp, openSave, openTradeoff, shareLink } from "./save.js";
import { Stage } from "./stage.js";
import { Timeline } from "./timeline.js";
import { Vitrail } from "./vitrail.js";

const STREAM = { budget_ms: 120, rest_ms: 200 };
const BAD_EDITS = ["invalid_request", "not_found", "unsupported", "too_large"];
const LINES = ["socket", "stream", "stills"];

function storedTheme() {
  try {
    return localStorage.getItem("vitrail-theme") ?? "auto";
  } catch {
    return "auto"; // a browser that keeps nothing
  }
}

class Viewer {
  client = new Vitrail();
  model = new Model();
  stage = new Stage();
  comparing = ""; // the technique of the second picture
  isOutlined = true; // the selected node is outlined
  isMoving = false; // the selected node has handles
  isPending = false;

  constructor() {
    const asked = LINES.indexOf(new URLSearchParams(location.search).get("line"));
    this.firstLine = Math.max(0, asked);
    this.live = this.#newLive(this.stage.canvas, true);
    this.overlay = new Overlay(this.client);
    this.timeline = new Timeline(this.model);
    this.heat = new HeatView(this.client, this.stage, {
      refused: (problem) => this.#notShown(problem), ready: () => this.readout.refresh() });
    this.#makePanels();
    this.#makeToolbar();
    this.navigator = new Navigator(this.model, this.stage, {
      pick: (share) => this.pick(share), aim: (share) => this.pick(share, true) });
    this.readout = new Readout(this.stage, {
      pick: (share) => this.#hit(share), also: (share) => this.heat.at(share),
      isResting: () => Boolean(this.model.scene) && this.stage.canvas.dataset.exact === "true",
      size: () => this.model.camera.sceneSize,
      nameOf: ({ node, material }) => [node.name, material?.name].filter(Boolean).join(" · ") });
    this.#listen();
  }

  #newLive(canvas, isFirst) {
    const live = new Live(this.client, this.firstLine);
    live.addEventListener("frame", ({ detail }) => this.#frame(detail, canvas, isFirst));
    live.addEventListener("problem", ({ detail }) => this.#refused(detail, isFirst));
    if (isFirst) live.addEventListener("state", ({ detail }) => this.#linkState(detail));
    return live;
  }

  #makePanels() {
    const left = new Dock("left");
    const right = new Dock("right");
    this.docks = { left, right };
    this.scenes = new ScenesPanel(left.add("scenes", "Scenes", "scenes"), this.client, this.model,
      { open: (id) => this.open(id), limits: () => this.capabilities?.limits ?? {} });
    this.tree = new TreePanel(left.add("tree", "Parts", "tree"), this.model, () => this.addPart());
    const fitNode = (index) => this.fit(this.model.boundsOf(index));
    this.properties = new PropertiesPanel(right.add("properties", "Properties", "properties"),
      this.model, { fitNode, isMoving: () => this.isMoving, toggleMoving: () => this.toggleMoving() });
    this.lights = new LightsPanel(right.add("lights", "Lights", "light"), this.model, () => this.#mark());
    this.section = new SectionPanel(right.add("section", "Section", "section"), this.model,
      () => this.#mark());
    this.render = new RenderPanel(right.add("render", "Render", "render"), this.model, {
      compare: (name) => this.compare(name), rescale: (scale) => this.rescale(scale),
      scale: () => this.stage.scale, isOutlined: () => this.isOutlined,
      outline: (isOn) => {
        this.isOutlined = isOn;
        this.#changed();
      },
      measure: () => this.model.scene && openTradeoff(this.client, this.wanted) });
    this.handles = makeHandles(this.stage, this.model, { lights: this.lights, section: this.section }, {
      isLighting: () => right.isOpen("lights"), isCutting: () => right.isOpen("section"), isMoving: () => this.isMoving });
    right.addEventListener("show", () => this.#mark());
    left.addEventListener("show", () => this.#mark());
    left.show("scenes");
    right.show("properties");
  }

  #makeToolbar() {
    const views = el("select", { "aria-label": "Standard views", title: "Standard views",
      onchange: () => {
        this.standBy(views.value);
        views.value = "";
      } });
    this.views = views;
    this.shows = el("select", { "aria-label": "What the picture shows", title: "Picture or map (M)",
      onchange: () => this.show(this.shows.value) }, Object.entries(SHOWN).map(([name, { text }]) =>
      el("option", { value: name }, text)));
    const tool = (name, label, iconName, action) => {
      this.tools[name] = button({ label, icon: iconName, class: "tool", onclick: action });
      return this.tools[name];
    };
    this.tools = {};
    append(byId("toolbar"), [
      el("span", { class: "tool-group" },
        tool("undo", "Undo", "undo", () => this.step("undo")),
        tool("redo", "Redo", "redo", () => this.step("redo"))),
      el("span", { class: "tool-group" },
        tool("fit", "Fit (F)", "fit", () => this.fit()),
        el("span", { class: "tool-select" }, icon("cube"), views),
        tool("ortho", "Orthographic (O)", "ortho", () => this.toggleOrtho())),
      el("span", { class: "tool-group" }, el("span", { class: "tool-select tool-shows" }, icon("map"), this.shows)),
      el("span", { class: "tool-group" },
        tool("compare", "Compare two techniques (C)", "compare", () => this.toggleCompare()),
        tool("stats", "Statistics (I)", "stats", () => this.toggleStats())),
      el("span", { class: "tool-group" },
        tool("save", "Save the picture", "save", () => this.save()),
        tool("share", "Copy a link to this view", "share", () => this.share()),
        tool("theme", "Light, dark, or as the system", "theme", () => this.nextTheme()),
        tool("help", "Keys and gestures (?)", "help", () => openHelp(this.capabilities))),
    ]);
    this.#updateTools();
  }

  #listen() {
    this.model.addEventListener("scene", () => this.#sceneChanged());
    for (const type of ["edit", "camera", "time"])
      this.model.addEventListener(type, () => this.#changed());
    this.model.addEventListener("select", () => this.#changed());
    this.stage.addEventListener("resize", () => this.#changed());
    addEventListener("hashchange", () => this.openLink());
    addEventListener("keydown", (event) => this.#globalKey(event));
    addEventListener("pagehide", () => {
      this.live.stop();
      this.heat.stop();
      this.second?.stop();
    });
    addEventListener("pageshow", (event) => event.persisted && this.#changed());
    this.stage.surface.addEventListener("keydown", (event) => this.#key(event));
    byId("help").addEventListener("close", () => this.stage.surface.focus());
  }

  // ---- scenes ----

  async start() {
    this.setTheme(storedTheme());
    this.#sceneChanged();
    this.client.capabilities().then((capabilities) => {
      this.capabilities = capabilities;
      this.render.setCapabilities(capabilities);
    }).catch((problem) => showProblem(problem, "The server does not answer"));
    await this.scenes.refresh();
    if (!(await this.openLink()) && this.scenes.scenes.length) await this.open(this.scenes.scenes[0].id);
  }

  /** The scene and view that the address names; false when it names none. */
  async openLink() {
    const link = stateFromLink(location.hash);
    if (!link || location.hash === this.ownHash) return false;
    await this.open(link.scene, link.state);
    return true;
  }

  /** A scene, with the state of a link if there is one; without an id, none. */
  async open(id, state, isLeft = false) {
    if (!isLeft) clearProblems();
    if (!id) {
      this.live.stop();
      this.isLost = false;
      byId("lost").hidden = true;
      this.stage.clear();
      this.model.open(null);
      history.replaceState(null, "", location.pathname + location.search);
      return;
    }
    if (!state && this.gone?.id === id) ({ state } = this.gone);
    try {
      const [{ summary, outline }, parts] = await Promise.all([this.#described(id), this.#partsOf(state)]);
      this.model.aspect = this.stage.aspect;
      this.model.open(summary, outline, state, parts);
    } catch (problem) {
      showProblem(problem, "The scene cannot be opened");
    }
  }

  async #described(id) {
    const [summary, outline] = await Promise.all([this.client.scene(id), this.client.outline(id)]);
    return { summary, outline };
  }

  /** The scenes of the parts that a link names, by id. */
  async #partsOf(state) {
    const ids = new Set(Object.values(state?.view?.parts ?? {}).map(({ scene }) => scene));
    return new Map(await Promise.all([...ids].map(async (id) => [id, await this.#described(id)])));
  }

  addPart() {
    const selected = this.model.selection?.node ?? null;
    openAddPart(this.scenes.scenes, selected === null ? "" : this.model.nodeName(selected),
      async ({ id, name, isBelow }) => {
        try {
          const { summary, outline } = await this.#described(id);
          const added = this.model.addPart(name, summary, outline, isBelow ? selected : null);
          this.isMoving = false;
          this.toggleMoving();
          notice(`${added} is added`);
        } catch (problem) {
          showProblem(problem, "The part was not added");
        }
      });
  }

  #sceneChanged() {
    const { scene } = this.model;
    const name = scene ? scene.name ?? `Scene ${scene.id.slice(0, 8)}` : "";
    byId("scene-name").textContent = name;
    document.title = name ? `${name} – Vitrail` : "Vitrail";
    byId("welcome").hidden = Boolean(scene);
    byId("busy").hidden = !scene;
    if (!scene)
      replace(byId("welcome"), icon("scenes", 40), el("h2", {}, "Light through transparent things"),
        el("p", {}, "Drop a .glb here, or a .gltf with its files. It stays on the server, which draws it."),
        button({ text: "Choose files", icon: "upload", class: "primary",
          onclick: () => this.scenes.input.click() }));
    const cameras = scene?.outline.cameras ?? [];
    replace(this.views, el("option", { value: "" }, "View"),
      Object.keys(STANDARD_VIEWS).map((view) =>
        el("option", { value: view }, view[0].toUpperCase() + view.slice(1))),
      cameras.map(({ name: camera }, index) =>
        el("option", { value: `camera-${index}` }, camera || `Camera ${index + 1}`)));
    if (this.comparing) this.compare("");
    this.show(scene && this.model.shown in SHOWN ? this.model.shown : "color");
    this.#changed();
  }

  // ---- the picture ----

  /** The outline of the selected node, as a member of the view. */
  get #highlight() {
    const node = this.model.selection?.node ?? null;
    return this.isOutlined && node !== null ? { nodes: [this.model.keyOf(node)] } : undefined;
  }

  /** All members of the view that should show: the picture itself. */
  get wanted() {
    const { scene, view, camera } = this.model;
    const isClear = view.background[3] < 1;
    const stream = { ...STREAM, format: isClear ? "webp" : "jpeg" }; // JPEG has no transparency
    return { scene: scene.id, ...this.stage.size, ...view, stream, camera: camera.toRequest() };
  }

  /** Many changes before the next frame of the screen are one. */
  #changed() {
    this.#updateTools();
    if (!this.model.scene || this.isPending) return;
    this.isPending = true;
    requestAnimationFrame(() => {
      this.isPending = false;
      if (!this.model.scene) return;
      const highlight = this.#highlight;
      const wanted = { ...this.wanted, ...(highlight && { highlight }) };
      if (this.live.show(wanted)) {
        this.stage.canvas.dataset.exact = "false";
        this.readout.clear();
      }
      this.heat.update(wanted);
      this.second?.show({ ...wanted, quality: { ...wanted.quality, shadows: this.comparing } });
      this.#mark();
    });
    clearTimeout(this.linkTimer);
    this.linkTimer = setTimeout(() => this.#keepLink(), 400);
  }

  #frame(frame, canvas, isFirst) {
    this.stage.draw(frame.bitmap, canvas);
    canvas.dataset.exact = String(frame.isExact);
    byId("busy").hidden = true;
    if (!isFirst) return;
    this.overlay.add(frame);
    this.lastFrame = frame.frame;
    this.timeline.frameShown();
    const total = frame.timings?.total;
    byId("status-frame").textContent = [`${frame.width} × ${frame.height}`,
      frame.isExact ? "exact" : "moving", total !== undefined && `${total.toFixed(0)} ms`]
      .filter(Boolean).join(" · ");
    const name = byId("scene-name").textContent;
    canvas.setAttribute("aria-label", `${name}, ${frame.isExact ? "final picture" : "moving"}`);
    if (!frame.isExact) return;
    announce("Picture complete");
    this.readout.refresh();
  }

  #notShown(problem) {
    showProblem(problem, `No map of ${SHOWN[this.heat.shown].text.toLowerCase()}`);
    this.show("color");
  }

  #refused(problem, isFirst) {
    byId("busy").hidden = true;
    if (problem.code === "not_found" && problem.pointer === "/scene" && this.model.scene) {
      this.#sceneGone();
      return;
    }
    showProblem(problem, isFirst ? "The server refuses this view" : `No picture with ${this.comparing}`);
    if (!isFirst) this.compare("");
    else if (BAD_EDITS.includes(problem.code)) this.model.refuse();
  }

  #linkState({ state, label, isLost }) {
    const link = byId("status-link");
    link.dataset.state = state;
    link.textContent = label;
    if (isLost && !this.isLost) {
      this.isLost = true;
      replace(byId("lost"), el("p", {}, "The server cannot be reached. This is the last picture."),
        button({ text: "Try now", onclick: () => this.live.retry() }));
    }
    if (state === "on" && this.isLost) {
      this.isLost = false;
      clearUnreached();
      this.scenes.refresh();
      announce("The server is back");
    }
    byId("lost").hidden = !this.isLost;
    if (this.isLost) byId("busy").hidden = true;
  }

  /** Somebody forgot the scene that shows. What was made of it is kept, should it come back. */
  #sceneGone() {
    const { id, name } = this.model.scene;
    this.gone = { id, state: this.model.toState() };
    showProblem(new Error("It was removed from the server. Bring its files again to go on where you were."),
      `${name ?? "The scene"} is gone`);
    this.open(null, undefined, true);
    this.scenes.refresh();
    this.docks.left.show("scenes");
  }

  #mark() {
    this.stage.markAt(this.model.selection?.position ?? null, this.model.camera);
    this.handles.update();
  }

  rescale(scale) {
    this.stage.scale = scale;
    this.#changed();
  }

  // ---- commands ----

  /** What is at a point of the picture. Still images have no view to ask: one is made for it. */
  async #hit(share) {
    const { width, height } = this.stage.size;
    const view = this.live.view ?? await this.client.createView(this.wanted);
    try {
      return await view.pick(share.x * width, share.y * height);
    } finally {
      if (view !== this.live.view) view.delete().catch(() => {}); // it would expire by itself
    }
  }

  async pick(share, isAim = false) {
    if (!this.model.scene) return;
    try {
      const hit = await this.#hit(share);
      if (isAim && hit) {
        this.model.camera.target = hit.position;
        this.model.cameraMoved();
      }
      const { nodeAt, materialAt } = this.model.scene.outline;
      this.model.select(hit && { node: nodeAt(hit.node.index),
        material: hit.material ? materialAt(hit.material.index) : null,
        position: hit.position, normal: hit.normal, depth: hit.depth });
      if (hit) this.docks.right.show("properties");
      announce(hit ? `Selected ${hit.node.name}` : "Nothing there");
    } catch (problem) {
      if (!this.isLost) showProblem(problem, "Nothing could be picked");
    }
  }

  fit(bounds) {
    if (!this.model.scene) return;
    const selected = this.model.selection?.node;
    const own = selected !== null && selected !== undefined ? this.model.boundsOf(selected) : null;
    this.model.camera.fit(bounds ?? own ?? this.model.bounds, this.stage.aspect);
    this.model.cameraMoved();
  }

  standBy(name) {
    if (!this.model.scene || !name) return;
    const camera = /^camera-(\d+)$/.exec(name);
    if (camera) this.model.standAt(this.model.scene.outline.cameras[camera[1]]);
    else {
      this.model.camera.turnTo(STANDARD_VIEWS[name]);
      this.model.camera.fit(this.model.bounds, this.stage.aspect);
    }
    this.model.cameraMoved();
    announce(`View: ${name}`);
  }

  /** Handles at the selected node, or none. */
  toggleMoving() {
    const selected = this.model.selection?.node ?? null;
    this.isMoving = !this.isMoving && selected !== null && this.model.boundsOf(selected) !== null;
    if (this.isMoving) this.docks.right.show("properties");
    this.properties.refresh();
    this.#mark();
    announce(this.isMoving ? "Handles are shown" : "Handles are hidden");
  }

  toggleOrtho() {
    this.model.camera.isOrthographic = !this.model.camera.isOrthographic;
    this.model.cameraMoved();
    announce(this.model.camera.isOrthographic ? "Orthographic" : "Perspective");
  }

  /** What casts the shadows of the picture that shows, also where the server chose it. */
  async #shadowsNow() {
    const asked = this.model.view.quality.shadows ?? "auto";
    if (asked !== "auto" || !this.lastFrame) return asked;
    const report = await this.client.frame(this.lastFrame).catch(() => null);
    const used = report?.plan.map(({ technique }) => technique) ?? [];
    return ["raytraced", "deep", "map"].find((name) => used.includes(name)) ?? asked;
  }

  async toggleCompare() {
    const names = this.render.techniques("shadows").map(({ name }) => name);
    const current = this.comparing ? "" : await this.#shadowsNow();
    this.compare(this.comparing ? "" : otherTechnique(current, names));
    this.render.setComparing(this.comparing);
  }

  /** Shows another shadow technique beside the one in use; "" ends it. */
  compare(technique) {
    this.comparing = this.model.scene ? technique : "";
    this.second?.stop();
    this.second = this.comparing ? this.#newLive(this.stage.second, false) : null;
    this.stage.compare(this.comparing && [this.model.view.quality.shadows ?? "auto", this.comparing]);
    if (!this.comparing && this.render.comparing) this.render.setComparing("");
    this.#changed();
  }

  /** Another output over the picture, by its name in SHOWN. */
  show(name) {
    this.model.shown = name;
    this.shows.value = name;
    this.heat.show(name, this.model.scene && this.wanted);
    this.readout.clear();
    this.#updateTools();
    if (this.model.scene && name !== "color") announce(`Showing ${SHOWN[name].text}`);
    clearTimeout(this.linkTimer);
    this.linkTimer = setTimeout(() => this.#keepLink(), 400);
  }

  nextMap() {
    const order = ["color", "layers", "lights"];
    this.show(order[(order.indexOf(this.heat.shown) + 1) % order.length]);
  }

  toggleStats() {
    this.overlay.toggle();
    this.#updateTools();
  }

  step(which) {
    const label = this.model[which]();
    if (label) notice(`${which === "undo" ? "Undone" : "Done again"}: ${label}`);
  }

  save() {
    if (!this.model.scene) return;
    const name = (this.model.scene.name ?? "vitrail").replace(/\.[^.]*$/, "").replace(/[^\w-]+/g, "_");
    openSave(this.client, this.wanted, name);
  }

  share() {
    if (!this.model.scene) return;
    this.#keepLink();
    shareLink(location.href);
  }

  /** The address always names what shows, so that reloading and bookmarks keep it. */
  #keepLink() {
    if (!this.model.scene) return;
    this.ownHash = linkFromState(this.model.scene.id, this.model.toState());
    history.replaceState(null, "", location.pathname + location.search + this.ownHash);
  }

  nextTheme() {
    const order = ["auto", "light", "dark"];
    const theme = order[(order.indexOf(document.documentElement.dataset.theme) + 1) % order.length];
    this.setTheme(theme);
    notice(`Colours: ${theme === "auto" ? "as the system" : theme}`);
  }

  setTheme(theme) {
    document.documentElement.dataset.theme = theme;
    try {
      localStorage.setItem("vitrail-theme", theme);
    } catch {
      // a browser that keeps nothing: the choice lasts as long as the page
    }
  }

  #updateTools() {
    const hasScene = Boolean(this.model.scene);
    for (const name of ["fit", "ortho", "compare", "save", "share"]) this.tools[name].disabled = !hasScene;
    this.views.disabled = this.shows.disabled = !hasScene;
    this.tools.undo.disabled = !this.model.canUndo;
    this.tools.redo.disabled = !this.model.canRedo;
    const pressed = { ortho: this.model.camera.isOrthographic, compare: Boolean(this.comparing),
      stats: this.overlay.isShown };
    for (const [name, isOn] of Object.entries(pressed))
      this.tools[name].setAttribute("aria-pressed", String(isOn));
  }

  // ---- keys ----

  #globalKey(event) {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    if (event.target.matches?.("input:not([type=range], [type=checkbox], [type=color])")) return;
    event.preventDefault();
    this.step(event.shiftKey ? "redo" : "undo");
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const selected = this.model.selection?.node;
    const actions = {
      f: () => this.fit(), o: () => this.toggleOrtho(), c: () => this.toggleCompare(),
      i: () => this.toggleStats(), g: () => this.toggleMoving(), m: () => this.nextMap(),
      " ": () => this.timeline.toggle(), ",": () => this.timeline.step(-1),
      ".": () => this.timeline.step(1), "?": () => openHelp(this.capabilities),
      1: () => this.standBy("front"), 2: () => this.standBy("right"), 3: () => this.standBy("top"),
      4: () => this.standBy("iso"), Escape: () => this.model.select(null),
      h: () => selected !== null && selected !== undefined
        && this.model.setVisible(selected, !this.model.isVisible(selected)),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || (!this.model.scene && event.key !== "?")) return;
    event.preventDefault();
    action();
  }
}

new Viewer().start();
