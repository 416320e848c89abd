// SPDX-License-Identifier: MIT
// What is looked at and how: the scene, the edits of a view as the service words them, selection,
// undo, and all of it as text for a link. Nothing here touches the page or the network.
import { assemble, placedLight, worldOf } from "./assembly.js";
import { boundsBelow, boundsOfAll } from "./bounds.js";
import { OrbitCamera, STANDARD_VIEWS } from "./camera.js";
import { History } from "./history.js";
import { lightMembers, newLight } from "./lights.js";
import { copy, isEqual, isObject, isSame, partSceneIds } from "./members.js";
import { IDENTITY, add, inverse, middleOf, multiply } from "./transforms.js";

/** The members of a view that this page edits, at the values a new one has; the exposure of a scene
 * without lights is automatic. */
export const DEFAULTS = Object.freeze({
  scene_lights: true,
  studio: "auto",
  lights: [],
  overrides: { nodes: {}, materials: {}, grids: {} },
  parts: {},
  clip_planes: [],
  background: [0.012, 0.013, 0.016, 1],
  environment: null,
  exposure_ev: 0,
  tone_mapping: "neutral",
  quality: {},
  animation: null,
  variant: null,
  edges: null,
  ground_plane: null,
  atmosphere: null,
});

/**
 * Events: "scene" (another one, or none), "edit" (members of the view), "camera", "select", "time",
 * "parts" (the outline has other nodes; "edit" follows).
 */
export class Model extends EventTarget {
  camera = new OrbitCamera();
  scene = null; // summary and, in `outline`, what can be edited
  #defaults = DEFAULTS; // of the scene
  view = copy(DEFAULTS); // never changed, but replaced: members that are equal are the same
  selection = null; // {node, material, position, normal, depth}: indices, or null each
  #base = null; // of the scene alone: {summary, outline}
  #partScenes = new Map(); // by id, as #base
  #assembled = "[]"; // the parts that the outline has
  #boxes = new Map(); // by node, or "all"; until something moves
  #lights = null; // as they stand now, once asked for
  aspect = 1.6; // of the picture, for what fits into it
  shown = "color"; // output that the picture shows
  #history = new History();

  #tell(type, detail) {
    const event = new Event(type);
    event.detail = detail;
    this.dispatchEvent(event);
  }

  // ---- scene and camera ----

  /**
   * Another scene, with a fresh view of it, or with that of a link.
   * @param {Map<string, {summary, outline}>} [partScenes] of the parts that the state names
   */
  open(summary, outline, state, partScenes = new Map()) {
    this.#base = summary ? { summary, outline } : null;
    this.#partScenes = new Map(partScenes);
    this.#defaults = { ...DEFAULTS, exposure_ev: outline?.lights.length === 0 ? "auto" : 0 };
    this.view = copy(this.#defaults);
    this.shown = typeof state?.show === "string" ? state.show : "color";
    this.selection = null;
    this.#history.clear();
    if (isObject(state?.view)) Object.assign(this.view, state.view);
    this.#assemble();
    if (summary) {
      const [least, most] = [this.bounds.slice(0, 3), this.bounds.slice(3)];
      this.camera = new OrbitCamera();
      this.camera.sceneSize = Math.max(Math.hypot(...most.map((v, i) => v - least[i])), 1e-6);
      if (!this.camera.fromState(state?.camera)) this.#standByDefault();
    }
    this.#tell("scene");
  }

  #assemble() {
    const base = this.#base;
    this.scene = base && { ...base.summary, outline: assemble(base, this.view.parts, this.#partScenes) };
    this.#assembled = this.#partsKey;
    this.#forget();
  }

  /** What followed from the view before. */
  #forget() {
    this.#boxes.clear();
    this.#lights = null;
  }

  /** Changes when the outline has to. */
  get #partsKey() {
    return JSON.stringify(Object.entries(this.view.parts)
      .map(([name, { scene, parent }]) => [name, scene, parent]));
  }

  /** Scenes of parts that came with an undo or a link, and are not known here. */
  get unknownScenes() {
    const ids = [...partSceneIds(this.view.parts)];
    return new Set(ids.filter((id) => !this.#partScenes.has(id)));
  }

  /** What they hold, by id. */
  learnScenes(scenes) {
    for (const [id, described] of scenes) this.#partScenes.set(id, described);
    this.#assembled = "";
    this.#followParts();
  }

  /** After any change of the view: other parts are other nodes. */
  #followParts() {
    if (this.#assembled === this.#partsKey) return;
    const key = this.scene.outline.nodes[this.selection?.node]?.key;
    this.#assemble();
    const node = this.scene.outline.nodes.findIndex((one) => one.key === key);
    this.selection = this.selection && node >= 0 ? { ...this.selection, node } : null;
    this.#tell("parts");
    this.#tell("select");
  }

  #standByDefault() {
    const [camera] = this.scene.outline.cameras;
    if (camera) {
      this.standAt(camera, this.aspect);
      return;
    }
    this.camera.turnTo(STANDARD_VIEWS["three-quarter"]);
    this.camera.fit(this.bounds, this.aspect);
  }

  /** Stands where a camera of the scene stands, for a picture of that aspect; where the parts
   * are says what is near. */
  standAt(camera, aspect) {
    const eye = camera.matrix.slice(12, 15);
    const away = this.scene.outline.nodes.filter(({ bounds }) => bounds).map(({ bounds }) =>
      Math.hypot(...add(middleOf(bounds), eye, -1)));
    const median = away.sort((a, b) => a - b)[Math.floor(away.length / 2)] ?? this.camera.sceneSize;
    this.camera.standAt(camera, this.bounds, 0.15 * median, aspect);
  }

  /** Of the whole scene: least x y z, greatest x y z; not to be changed. */
  get bounds() {
    return this.#keptBox("all", () => boundsOfAll(this));
  }

  #keptBox(name, find) {
    if (!this.#boxes.has(name)) this.#boxes.set(name, find());
    return this.#boxes.get(name);
  }

  get center() {
    return middleOf(this.bounds);
  }

  /** Of a node and all below it, not to be changed; null without geometry. */
  boundsOf(index) {
    return this.#keptBox(index, () => boundsBelow(this, index));
  }

  /** World as it is now from world as in the file, for what a node holds. */
  fromRest(index) {
    return multiply(this.worldOf(index), inverse(this.worldOf(index, true)));
  }

  /** Call after having moved `camera`. */
  cameraMoved() {
    this.#tell("camera");
  }

  // ---- edits ----

  /**
   * Changes the view. Edits under one label in quick succession are one step of undo.
   * @param {string} label names the edit for people
   * @param {(view: object) => void} change edits the object it is given
   */
  edit(label, change) {
    const before = this.view;
    const after = copy(before);
    change(after);
    for (const name of Object.keys(after)) // what stays is the same object
      if (isEqual(before[name], after[name])) after[name] = before[name];
    if (isSame(before, after)) return;
    this.view = after;
    this.#forget();
    this.#history.record(label, before);
    this.#followParts();
    this.#tell("edit", label);
  }

  /** While something is dragged, all edits under one label are one step of undo. */
  hold(isHeld) {
    this.#history.hold(isHeld);
  }

  get canUndo() {
    return this.#history.canUndo;
  }

  get canRedo() {
    return this.#history.canRedo;
  }

  #restore(step) {
    if (!step) return null;
    this.view = { ...step.view, animation: this.view.animation }; // time is no edit
    this.#forget();
    this.#followParts();
    this.#tell("edit", step.label);
    return step.label;
  }

  /** Takes the last edit back; its label, or null. */
  undo() {
    return this.#restore(this.#history.undo(this.view));
  }

  redo() {
    return this.#restore(this.#history.redo(this.view));
  }

  /** The server refused the last edit: as undo, with nothing to redo. */
  refuse() {
    const label = this.undo();
    this.#history.forgetRedo();
    return label;
  }

  /** The time that shows, as the service words it; null is the scene at rest. */
  setAnimation(animation) {
    if (isEqual(animation, this.view.animation)) return;
    this.view = { ...this.view, animation };
    this.#tell("time");
  }

  // ---- nodes and materials; keys such as "#index" are exact where names repeat ----

  /** What overrides call a node. */
  keyOf(index) {
    return this.scene.outline.nodes[index].key;
  }

  nodeName(index) {
    return this.scene.outline.nodes[index].name || `Node ${index}`;
  }

  /** What the view says of a node: its override, or, of a part's own node, the part. */
  #said(index, view = this.view) {
    const { key, isPart } = this.scene.outline.nodes[index];
    return (isPart ? view.parts : view.overrides.nodes)[key];
  }

  /** Says it, or takes it back; an override without members is none. */
  #say(view, index, member, value) {
    const { key, isPart } = this.scene.outline.nodes[index];
    const place = isPart ? view.parts : view.overrides.nodes;
    const { [member]: _, ...rest } = place[key] ?? {};
    if (value !== undefined) rest[member] = value;
    if (isPart || Object.keys(rest).length) place[key] = rest;
    else delete place[key];
  }

  isVisible(index) {
    return this.#said(index)?.visible ?? this.#isVisibleAtRest(index);
  }

  #isVisibleAtRest(index) {
    return this.scene.outline.nodes[index].visible !== false;
  }

  setVisible(index, isVisible) {
    this.edit(`${isVisible ? "Show" : "Hide"} ${this.nodeName(index)}`, (view) =>
      this.#say(view, index, "visible", isVisible === this.#isVisibleAtRest(index) ? undefined : isVisible));
  }

  showAll() {
    this.edit("Show all", (view) => this.scene.outline.nodes.forEach((_, index) =>
      !(this.#said(index, view)?.visible ?? this.#isVisibleAtRest(index))
        && this.#say(view, index, "visible", this.#isVisibleAtRest(index) ? undefined : true)));
  }

  isMoved(index) {
    return Boolean(this.#said(index)?.matrix);
  }

  /** Parent from node, as it is now. */
  matrixOf(index) {
    return this.#said(index)?.matrix ?? this.scene.outline.nodes[index].matrix ?? IDENTITY;
  }

  /** World from node, as it is now, or as in its file, which of a part knows nothing of the others. */
  worldOf(index, isAtRest = false) {
    const { nodes } = this.scene.outline;
    return worldOf(nodes, index, isAtRest ? (at) => (nodes[at].isPart ? IDENTITY
      : nodes[at].matrix ?? IDENTITY) : (at) => this.matrixOf(at));
  }

  /** Places a node in its parent; null puts it back as in the file. */
  setMatrix(index, matrix, what = "Move") {
    this.edit(`${what} ${this.nodeName(index)}`, (view) =>
      this.#say(view, index, "matrix", matrix ?? undefined));
  }

  /** As it is now: the file's values with the edits over them. */
  material(index) {
    const { key, ...own } = this.scene.outline.materials[index];
    return { ...own, ...this.view.overrides.materials[key] };
  }

  isMaterialEdited(index) {
    return this.scene.outline.materials[index].key in this.view.overrides.materials;
  }

  editMaterial(index, members) {
    const { key, name } = this.scene.outline.materials[index];
    this.edit(`Material ${name || key}: ${Object.keys(members).join(", ")}`, (view) => {
      view.overrides.materials[key] = { ...view.overrides.materials[key], ...members };
    });
  }

  resetMaterial(index) {
    this.edit("Reset material", (view) => {
      delete view.overrides.materials[this.scene.outline.materials[index].key];
    });
  }

  /** A density grid as it is now. */
  grid(index) {
    const { key, ...own } = this.scene.outline.grids[index];
    return { ...own, ...this.view.overrides.grids?.[key] };
  }

  isGridEdited(index) {
    return this.scene.outline.grids[index].key in (this.view.overrides.grids ?? {});
  }

  /** Edits members of a density grid; null puts all of them back as in the file. */
  editGrid(index, members) {
    const { key, name } = this.scene.outline.grids[index];
    this.edit(members ? `Smoke ${name || key}: ${Object.keys(members).join(", ")}` : "Reset smoke", (view) => {
      const { [key]: old, ...others } = view.overrides.grids ?? {};
      view.overrides.grids = members ? { ...others, [key]: { ...old, ...members } } : others;
    });
  }

  // ---- parts: other scenes in this one ----

  /** Adds a scene below a node, or at the top; its own node is selected. */
  addPart(wanted, summary, outline, parent = null) {
    this.#partScenes.set(summary.id, { summary, outline });
    const plain = wanted.replaceAll("/", "-").slice(0, 60) || "Part";
    const taken = (name) => name in this.view.parts
      || this.scene.outline.nodes.some((node) => node.name === name);
    let name = plain;
    for (let n = 2; taken(name); n++) name = `${plain} ${n}`;
    this.edit(`Add ${name}`, (view) => {
      view.parts[name] = { scene: summary.id, parent: parent === null ? null : this.keyOf(parent) };
    });
    const node = this.scene.outline.nodes.findIndex(({ key }) => key === name);
    this.select({ node, material: null, position: null });
    return name;
  }

  /** Takes parts out, with what hangs on them and the edits of what is in them. */
  removeParts(names) {
    this.edit(`Remove ${names.join(", ")}`, (view) => {
      const gone = [...names];
      for (const part of gone) {
        for (const [other, { parent }] of Object.entries(view.parts))
          if (parent === part || parent?.startsWith(`${part}/`)) gone.push(other);
        delete view.parts[part];
        for (const overrides of Object.values(view.overrides))
          for (const key of Object.keys(overrides)) if (key.startsWith(`${part}/`)) delete overrides[key];
      }
    });
  }

  // ---- lights ----

  /** Where its node stands now, which of a light may be one that the outline has no room for. */
  #standing(light) {
    const { nodes } = this.scene.outline;
    let at = nodes[light.node] ? light.node : null;
    while (at !== null && !nodes[at].isPart && !this.isMoved(at)) at = nodes[at].parent;
    return at === null ? light : placedLight(light, this.fromRest(light.node));
  }

  get #sceneLights() {
    return this.scene.outline.lights.map((light) => lightMembers(this.#standing(light)));
  }

  /** Edits need the lights as members of the view: those of the scene are copied over once. */
  takeLights(view) {
    if (!view.scene_lights) return;
    view.lights = [...this.#sceneLights, ...view.lights];
    view.scene_lights = false;
  }

  /** All that shine: those of the scene unless taken over, then those of the view. */
  get lights() {
    this.#lights ??= [...(this.view.scene_lights ? this.#sceneLights : []), ...this.view.lights];
    return this.#lights;
  }

  editLight(index, members) {
    this.edit(`Light ${index + 1}: ${Object.keys(members).join(", ")}`, (view) => {
      this.takeLights(view);
      view.lights[index] = lightMembers({ ...view.lights[index], ...members });
    });
  }

  addLight(type) {
    this.edit(`Add ${type} light`, (view) =>
      view.lights.push(newLight(type, this.camera)));
  }

  removeLight(index) {
    this.edit(`Remove light ${index + 1}`, (view) => {
      this.takeLights(view);
      view.lights.splice(index, 1);
    });
  }

  resetLights() {
    this.edit("Lights of the scene", (view) => {
      view.lights = [];
      view.scene_lights = true;
    });
  }

  // ---- selection ----

  /** The node that is selected, or null. */
  get selectedNode() {
    return this.selection?.node ?? null;
  }

  select(selection) {
    this.selection = selection;
    this.#tell("select");
  }

  // ---- links ----

  /** What a link carries: the camera, and the members that differ from the defaults. */
  toState() {
    const view = {};
    for (const [name, value] of Object.entries(this.view))
      if (!isEqual(value, this.#defaults[name])) view[name] = value;
    return { camera: this.camera.toState(), ...(Object.keys(view).length ? { view } : {}),
      ...(this.shown === "color" ? {} : { show: this.shown }) };
  }
}
