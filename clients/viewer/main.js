// SPDX-License-Identifier: MIT
// Puts the viewer together: model, picture, panels, toolbar, and the line to the server.
import { announce, button, byId, el, icon, replace } from "./dom.js";
import { Address } from "./address.js";
import { STANDARD_VIEWS } from "./camera.js";
import { Comparison } from "./comparison.js";
import { Connection } from "./connection.js";
import { Dock } from "./docks.js";
import { EnvironmentMaps } from "./environment.js";
import { makeHandles } from "./handles.js";
import { HeatView, SHOWN } from "./heat.js";
import { listenToKeys } from "./keys.js";
import { Live, refinedQuality, VIEW_OPTIONS } from "./live.js";
import { notice, showProblem } from "./messages.js";
import { Model } from "./model.js";
import { Navigator } from "./navigate.js";
import { Opening } from "./opening.js";
import { Overlay } from "./overlay.js";
import { JobsPanel } from "./panel_jobs.js";
import { LightsPanel } from "./panel_lights.js";
import { PropertiesPanel } from "./panel_properties.js";
import { RenderPanel } from "./panel_render.js";
import { ScenesPanel } from "./panel_scenes.js";
import { SectionPanel } from "./panel_section.js";
import { TreePanel } from "./panel_tree.js";
import { FrameProgress } from "./progress.js";
import { Readout } from "./readout.js";
import { openHelp, openSave, openTradeoff, shareLink } from "./save.js";
import { Stage } from "./stage.js";
import { nextTheme, restoreTheme } from "./theme.js";
import { Timeline } from "./timeline.js";
import { Toolbar } from "./toolbar.js";
import { Vitrail } from "./vitrail.js";

const STREAM = { budget_ms: 120, rest_ms: 200 };
const REST_SAMPLES = 16;
const BAD_EDITS = ["invalid_request", "not_found", "unsupported", "too_large"];
const PART_GONE = /^\/parts(\/[^/]*\/scene)?$/; // of whose picture there is none
const LINES = ["socket", "stream", "stills"];

class Viewer {
  client = new Vitrail();
  model = new Model();
  stage = new Stage();
  progress = new FrameProgress();
  address = new Address(this.model);
  opening = new Opening(this.client, this.model, this.address, {
    aspect: () => this.stage.aspect, scenes: () => this.scenes.scenes,
    close: () => {
      this.live.stop();
      this.connection.rest();
      this.stage.clear();
      this.progress.hide();
    },
    added: () => {
      this.isMoving = false;
      this.toggleMoving();
    },
    gone: () => {
      this.scenes.refresh();
      this.docks.left.show("scenes");
    } });
  connection = new Connection({ retry: () => this.live.retry(), back: () => this.scenes.refresh() });
  isOutlined = true; // the selected node is outlined
  restSamples = REST_SAMPLES; // that the picture at rest is refined to; 0: it is not
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
    this.comparison = new Comparison(this.stage, this.model, {
      line: (canvas) => this.#newLive(canvas, false), current: () => this.#shadowsNow(),
      techniques: () => this.render.techniques("shadows").map(({ name }) => name),
      changed: () => {
        this.render.setComparing(this.comparison.technique);
        this.#changed();
      } });
    this.toolbar = new Toolbar(this);
    this.#updateTools();
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
    if (!isFirst) return live;
    live.addEventListener("state", ({ detail }) => {
      this.progress.hide();
      this.connection.show(detail);
    });
    live.addEventListener("progress", ({ detail }) => {
      const isRefining = this.stage.canvas.dataset.exact === "true"; // nobody waits for that
      if (!isRefining) this.progress.show(detail);
    });
    return live;
  }

  #makePanels() {
    const left = new Dock("left");
    const right = new Dock("right");
    this.docks = { left, right };
    this.maps = new EnvironmentMaps(this.client, this.model, () => this.capabilities?.limits ?? {});
    this.scenes = new ScenesPanel(left.add("scenes", "Scenes", "scenes"), this.client, this.model,
      { open: (id) => this.opening.open(id), show: () => left.show("scenes"),
        limits: () => this.capabilities?.limits ?? {}, bringMaps: (files) => this.maps.bring(files) });
    this.tree = new TreePanel(left.add("tree", "Parts", "tree"), this.model, () => this.opening.addPart());
    this.jobs = new JobsPanel(left.add("jobs", "Jobs", "frames"), this.client, {
      isOpen: () => left.isOpen("jobs"), wanted: () => this.model.scene && this.wanted });
    const fitNode = (index) => this.fit(this.model.boundsOf(index));
    this.properties = new PropertiesPanel(right.add("properties", "Properties", "properties"),
      this.model, { fitNode, isMoving: () => this.isMoving, toggleMoving: () => this.toggleMoving() });
    this.lights = new LightsPanel(right.add("lights", "Lights", "light"), this.model, this.maps,
      () => this.#mark());
    this.section = new SectionPanel(right.add("section", "Section", "section"), this.model,
      () => this.#mark());
    this.render = new RenderPanel(right.add("render", "Render", "render"), this.model, {
      compare: (name) => this.comparison.show(name), rescale: (scale) => this.rescale(scale),
      scale: () => this.stage.scale, restSamples: () => this.restSamples,
      refineTo: (samples) => {
        this.restSamples = samples;
        this.#changed();
      }, isOutlined: () => this.isOutlined,
      outline: (isOn) => {
        this.isOutlined = isOn;
        this.#changed();
      },
      exposure: () => this.exposure(),
      measure: () => this.model.scene && openTradeoff(this.client, this.wanted) });
    this.handles = makeHandles(this.stage, this.model, { lights: this.lights, section: this.section }, {
      isLighting: () => right.isOpen("lights"), isCutting: () => right.isOpen("section"), isMoving: () => this.isMoving });
    right.addEventListener("show", () => this.#mark());
    left.addEventListener("show", () => {
      this.#mark();
      if (left.isOpen("jobs")) this.jobs.show();
    });
    left.show("scenes");
    right.show("properties");
  }

  #listen() {
    this.model.addEventListener("scene", () => this.#sceneChanged());
    for (const type of ["edit", "camera", "time"])
      this.model.addEventListener(type, () => this.#changed());
    this.model.addEventListener("select", () => this.#changed());
    this.stage.addEventListener("resize", () => this.#changed());
    addEventListener("hashchange", () => this.opening.openLink());
    addEventListener("pagehide", () => {
      this.live.stop();
      this.heat.stop();
      this.comparison.stop();
    });
    addEventListener("pageshow", (event) => event.persisted && this.#changed());
    listenToKeys(this.stage.surface, this);
    byId("help").addEventListener("close", () => this.stage.surface.focus());
  }

  // ---- scenes ----

  async start() {
    restoreTheme();
    this.#sceneChanged();
    this.client.capabilities().then((capabilities) => {
      this.capabilities = capabilities;
      this.render.setCapabilities(capabilities);
      const { warning, passed_over: passedOver = [] } = capabilities.device ?? {};
      const said = byId("status-device");
      said.hidden = !warning && !passedOver.length;
      said.textContent = warning ? "software rendering" : "another device renders";
      said.title = [warning, ...passedOver].filter(Boolean).join("\n");
    }).catch((problem) => showProblem(problem, "The server does not answer"));
    await this.scenes.refresh();
    if (!(await this.opening.openLink()) && this.scenes.scenes.length) await this.opening.open(this.scenes.scenes[0].id);
  }

  #sceneChanged() {
    const { scene } = this.model;
    this.jobs.fill();
    const name = scene ? scene.name ?? `Scene ${scene.id.slice(0, 8)}` : "";
    byId("scene-name").textContent = name;
    document.title = name ? `${name} – Vitrail` : "Vitrail";
    byId("welcome").hidden = Boolean(scene);
    byId("busy").hidden = !scene;
    if (!scene)
      replace(byId("welcome"), icon("scenes", 40), el("h2", {}, "Light through transparent things"),
        el("p", {}, "Drop a scene here (glTF, OBJ, PLY, STL, FBX, COLLADA, 3MF, 3DS, Open Inventor) with its files. It stays on the server, which draws it."),
        el("p", { class: "welcome-ways" }, button({ text: "Choose files", icon: "upload", class: "primary",
          onclick: () => this.scenes.input.click() }), this.#demoButton()));
    this.toolbar.setCameras(scene?.outline.cameras ?? []);
    if (this.comparison.technique) this.comparison.show("");
    this.show(scene && this.model.shown in SHOWN ? this.model.shown : "color");
    this.#changed();
  }

  /** One click to a picture: the server makes a scene of its own. */
  #demoButton() {
    const made = button({ text: "Open the demo scene", icon: "play", onclick: async () => {
      made.disabled = true;
      made.lastChild.textContent = "Making the demo scene";
      await this.scenes.bringDemo();
      made.disabled = false;
      made.lastChild.textContent = "Open the demo scene";
    } });
    return made;
  }

  // ---- the picture ----

  /** The outline of the selected node, as a member of the view. */
  get #highlight() {
    const node = this.model.selectedNode;
    return this.isOutlined && node !== null ? { nodes: [this.model.keyOf(node)] } : undefined;
  }

  /** All members of the view that should show: the picture itself. */
  get wanted() {
    const { scene, view, camera } = this.model;
    const isClear = view.background[3] < 1;
    const stream = { ...STREAM, format: isClear ? "webp" : "jpeg", // JPEG has no transparency
      ...(this.restSamples > 0 && { rest_samples: this.restSamples }) };
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
        this.progress.hide();
        this.stage.canvas.dataset.exact = this.stage.canvas.dataset.settled = "false";
        this.readout.clear();
      }
      this.heat.update(wanted);
      this.comparison.update(wanted);
      this.#mark();
    });
    this.address.keepSoon();
  }

  /** Of the picture that is shown; 0 where that is not known. */
  async exposure() {
    const report = this.lastFrame && await this.client.frame(this.lastFrame).catch(() => null);
    return report?.exposure_ev ?? 0;
  }

  #frame(frame, canvas, isFirst) {
    this.stage.draw(frame.bitmap, canvas);
    const wasExact = canvas.dataset.exact === "true";
    canvas.dataset.exact = String(frame.isExact);
    const isLast = frame.isRefined || (frame.isExact && !refinedQuality(this.wanted));
    canvas.dataset.settled = String(isLast);
    canvas.dataset.frame = frame.frame ?? "";
    byId("busy").hidden = true;
    if (!isFirst) return;
    this.progress.hide();
    this.overlay.add(frame);
    this.lastFrame = frame.frame;
    this.timeline.frameShown();
    const total = frame.timings?.total;
    byId("status-frame").textContent = [`${frame.width} × ${frame.height}`,
      frame.isRefined ? "refined" : frame.isExact ? "exact" : "moving",
      total !== undefined && `${total.toFixed(0)} ms`]
      .filter(Boolean).join(" · ");
    const name = byId("scene-name").textContent;
    canvas.setAttribute("aria-label", `${name}, ${frame.isExact ? "final picture" : "moving"}`);
    if (!frame.isExact || wasExact) return;
    announce("Picture complete");
    this.readout.refresh();
  }

  #notShown(problem) {
    showProblem(problem, `No map of ${SHOWN[this.heat.shown].text.toLowerCase()}`);
    this.show("color");
  }

  #refused(problem, isFirst) {
    byId("busy").hidden = true;
    if (isFirst) this.progress.hide();
    if (problem.code === "not_found" && problem.pointer === "/scene" && this.model.scene) {
      this.opening.sceneGone();
      return;
    }
    if (problem.code === "not_found" && PART_GONE.test(problem.pointer ?? "") && this.model.scene) {
      if (isFirst) // the second picture follows the first
        this.opening.partsGone().catch(() => false)
          .then((isMended) => isMended || this.#blame(problem, isFirst));
      return;
    }
    if (problem.code === "not_found" && problem.pointer === "/environment/image" && this.model.scene) {
      if (isFirst) this.maps.gone();
      return;
    }
    this.#blame(problem, isFirst);
  }

  /** The last edit of the view, or the technique that is compared with. */
  #blame(problem, isFirst) {
    showProblem(problem, isFirst ? "The server refuses this view" : `No picture with ${this.comparison.technique}`);
    if (!isFirst) this.comparison.show("");
    else if (BAD_EDITS.includes(problem.code)) this.model.refuse();
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
    const view = this.live.view ?? await this.client.createView(this.wanted, VIEW_OPTIONS);
    try {
      return await view.pick(share.x * width, share.y * height);
    } finally {
      if (view !== this.live.view) view.delete().catch(() => {}); // it expires by itself
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
      if (!this.connection.isLost) showProblem(problem, "Nothing could be picked");
    }
  }

  fit(bounds) {
    if (!this.model.scene) return;
    const selected = this.model.selectedNode;
    const own = selected !== null ? this.model.boundsOf(selected) : null;
    this.model.camera.fit(bounds ?? own ?? this.model.bounds, this.stage.aspect);
    this.model.cameraMoved();
  }

  standBy(name) {
    if (!this.model.scene || !name) return;
    const camera = /^camera-(\d+)$/.exec(name);
    if (camera) {
      this.model.standAt(this.model.scene.outline.cameras[camera[1]], this.stage.aspect);
    } else {
      this.model.camera.turnTo(STANDARD_VIEWS[name]);
      this.model.camera.fit(this.model.bounds, this.stage.aspect);
    }
    this.model.cameraMoved();
    announce(`View: ${name}`);
  }

  /** Handles at the selected node, or none. */
  toggleMoving() {
    const selected = this.model.selectedNode;
    this.isMoving = !this.isMoving && selected !== null && this.model.boundsOf(selected) !== null;
    if (this.isMoving) this.docks.right.show("properties");
    this.properties.refresh();
    this.#mark();
    announce(this.isMoving ? "Handles are shown" : "Handles are hidden");
  }

  /** Hides the selected node, or shows it. */
  toggleHidden() {
    const node = this.model.selectedNode;
    if (node !== null) this.model.setVisible(node, !this.model.isVisible(node));
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
    return report?.chosen?.shadows ?? asked;
  }

  /** Another output over the picture, by its name in SHOWN. */
  show(name) {
    this.model.shown = name;
    this.toolbar.shows.value = name;
    this.heat.show(name, this.model.scene && this.wanted);
    this.readout.clear();
    this.#updateTools();
    if (this.model.scene && name !== "color") announce(`Showing ${SHOWN[name].text}`);
    this.address.keepSoon();
  }

  nextMap() {
    const order = ["color", "layers", "lights"];
    this.show(order[(order.indexOf(this.heat.shown) + 1) % order.length]);
  }

  nextTheme() {
    notice(`Colours: ${nextTheme()}`);
  }

  help() {
    openHelp(this.capabilities);
  }

  toggleStats() {
    this.overlay.toggle();
    this.#updateTools();
  }

  step(which) {
    const label = this.model[which]();
    if (label) notice(`${which === "undo" ? "Undone" : "Redone"}: ${label}`);
  }

  save() {
    if (!this.model.scene) return;
    const name = (this.model.scene.name ?? "vitrail").replace(/\.[^.]*$/, "").replace(/[^\w-]+/g, "_");
    openSave(this.client, this.wanted, name);
  }

  share() {
    if (!this.model.scene) return;
    this.address.keep();
    shareLink(location.href);
  }

  #updateTools() {
    this.toolbar.update({ hasScene: Boolean(this.model.scene), canUndo: this.model.canUndo,
      canRedo: this.model.canRedo, pressed: { ortho: this.model.camera.isOrthographic,
        compare: Boolean(this.comparison.technique), stats: this.overlay.isShown } });
  }
}

new Viewer().start();
