// SPDX-License-Identifier: MIT
// What is looked at and how: the scene, the edits of a view as the service words them, selection,
// undo, and all of it as text for a link. Nothing here touches the page or the network.
import { OrbitCamera } from "./camera.js";
import { IDENTITY, cross, inverse, movedBounds, multiply } from "./transforms.js";

/** The members of a view that this page edits, at the values a new one has. */
export const DEFAULTS = Object.freeze({
  scene_lights: true,
  lights: [],
  overrides: { nodes: {}, materials: {} },
  clip_planes: [],
  background: [0.012, 0.013, 0.016, 1],
  environment: null,
  exposure_ev: 0,
  tone_mapping: "neutral",
  quality: {},
  animation: null,
  edges: null,
});

const UNDO_MAX = 100;
const copy = (value) => JSON.parse(JSON.stringify(value));
export const isEqual = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

/** The JSON merge patch (RFC 7396) that makes `to` of `from`; undefined when there is none. */
export function mergePatch(from, to) {
  if (!isObject(from) || !isObject(to)) return isEqual(from, to) ? undefined : to;
  const patch = {};
  for (const name of Object.keys(from)) if (!(name in to)) patch[name] = null;
  for (const [name, value] of Object.entries(to)) {
    const change = name in from ? mergePatch(from[name], value) : value;
    if (change !== undefined) patch[name] = change;
  }
  return Object.keys(patch).length ? patch : undefined;
}

/**
 * Events: "scene" (another one, or none), "edit" (members of the view), "camera", "select", "time".
 */
export class Model extends EventTarget {
  camera = new OrbitCamera();
  scene = null; // summary and, in `outline`, what can be edited
  view = copy(DEFAULTS);
  selection = null; // {node, material, position, normal, depth}: indices, or null each
  aspect = 1.6; // of the picture, for what fits into it
  shown = "color"; // output that the picture shows
  #undo = [];
  #redo = [];
  #lastEdit = { label: "", time: 0 };

  #tell(type, detail) {
    const event = new Event(type);
    event.detail = detail;
    this.dispatchEvent(event);
  }

  // ---- scene and camera ----

  /** Another scene, with a fresh view of it, or with that of a link. */
  open(summary, outline, state) {
    this.scene = summary ? { ...summary, outline } : null;
    this.view = copy(DEFAULTS);
    this.shown = typeof state?.show === "string" ? state.show : "color";
    this.selection = null;
    this.#undo = [];
    this.#redo = [];
    if (summary) {
      const [least, most] = [this.bounds.slice(0, 3), this.bounds.slice(3)];
      this.camera = new OrbitCamera();
      this.camera.sceneSize = Math.max(Math.hypot(...most.map((v, i) => v - least[i])), 1e-6);
      if (!this.camera.fromState(state?.camera)) this.#standByDefault();
      if (isObject(state?.view)) Object.assign(this.view, state.view);
    }
    this.#tell("scene");
  }

  #standByDefault() {
    const [camera] = this.scene.outline.cameras;
    if (camera) {
      this.standAt(camera);
      return;
    }
    this.camera.turnTo({ yaw: 35, pitch: 20 });
    this.camera.fit(this.bounds, this.aspect);
  }

  /** Stands where a camera of the scene stands; what is near is told by where the parts are. */
  standAt(camera) {
    const eye = camera.matrix.slice(12, 15);
    const away = this.scene.outline.nodes.filter(({ bounds }) => bounds).map(({ bounds }) =>
      Math.hypot(...eye.map((value, axis) => (bounds[axis] + bounds[axis + 3]) / 2 - value)));
    const median = away.sort((a, b) => a - b)[Math.floor(away.length / 2)] ?? this.camera.sceneSize;
    this.camera.standAt(camera, this.bounds, 0.15 * median);
  }

  /** Of the whole scene: least x y z, greatest x y z. */
  get bounds() {
    const bounds = this.scene?.bounds;
    return bounds ? [...bounds.min, ...bounds.max] : [-1, -1, -1, 1, 1, 1];
  }

  get center() {
    const bounds = this.bounds;
    return [0, 1, 2].map((axis) => (bounds[axis] + bounds[axis + 3]) / 2);
  }

  /** Of a node and all below it; null without geometry. */
  boundsOf(index) {
    const { nodes } = this.scene.outline;
    const isBelow = new Uint8Array(nodes.length); // parents come before their children
    const hasMoved = Object.values(this.view.overrides.nodes).some(({ matrix }) => matrix);
    const isMoved = new Uint8Array(nodes.length);
    let found = null;
    nodes.forEach((node, at) => {
      isBelow[at] = at === index || (node.parent !== null && isBelow[node.parent]);
      isMoved[at] = (hasMoved && this.isMoved(at)) || (node.parent !== null && isMoved[node.parent]);
      if (!node.bounds || !isBelow[at]) return;
      const box = isMoved[at] ? this.#boundsNow(at) : node.bounds;
      found ??= [...box];
      for (let axis = 0; axis < 3; axis++) {
        found[axis] = Math.min(found[axis], box[axis]);
        found[axis + 3] = Math.max(found[axis + 3], box[axis + 3]);
      }
    });
    return found;
  }

  #boundsNow(index) {
    const fromRest = multiply(this.worldOf(index), inverse(this.worldOf(index, true)));
    return movedBounds(fromRest, this.scene.outline.nodes[index].bounds);
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
    const before = copy(this.view);
    change(this.view);
    if (isEqual(before, this.view)) return;
    const now = Date.now();
    if (label !== this.#lastEdit.label || now - this.#lastEdit.time > 1000) {
      this.#undo.push({ label, view: before });
      if (this.#undo.length > UNDO_MAX) this.#undo.shift();
    }
    this.#lastEdit = { label, time: now };
    this.#redo = [];
    this.#tell("edit", label);
  }

  get canUndo() {
    return this.#undo.length > 0;
  }

  get canRedo() {
    return this.#redo.length > 0;
  }

  #step(from, to) {
    const step = from.pop();
    if (!step) return null;
    to.push({ label: step.label, view: this.view });
    this.view = { ...step.view, animation: this.view.animation }; // time is no edit
    this.#lastEdit = { label: "", time: 0 };
    this.#tell("edit", step.label);
    return step.label;
  }

  /** Takes the last edit back; its label, or null. */
  undo() {
    return this.#step(this.#undo, this.#redo);
  }

  redo() {
    return this.#step(this.#redo, this.#undo);
  }

  /** The server refused the last edit: as undo, with nothing to redo. */
  refuse() {
    const label = this.undo();
    this.#redo = [];
    return label;
  }

  /** The time that shows, as the service words it; null is the scene at rest. */
  setAnimation(animation) {
    if (isEqual(animation, this.view.animation)) return;
    this.view.animation = animation;
    this.#tell("time");
  }

  // ---- nodes and materials; the names "#index" are exact where names repeat ----

  isVisible(index) {
    return this.view.overrides.nodes[`#${index}`]?.visible !== false;
  }

  setVisible(index, isVisible) {
    const name = this.scene.outline.nodes[index].name || `#${index}`;
    this.edit(`${isVisible ? "Show" : "Hide"} ${name}`, (view) =>
      overrideNode(view, index, "visible", isVisible ? undefined : false));
  }

  showAll() {
    this.edit("Show all", (view) => {
      for (const key of Object.keys(view.overrides.nodes))
        overrideNode(view, key.slice(1), "visible", undefined);
    });
  }

  isMoved(index) {
    return Boolean(this.view.overrides.nodes[`#${index}`]?.matrix);
  }

  /** Parent from node, as it is now. */
  matrixOf(index) {
    return this.view.overrides.nodes[`#${index}`]?.matrix ?? this.scene.outline.nodes[index].matrix
      ?? IDENTITY;
  }

  /** World from node, as it is now, or as in the file. */
  worldOf(index, isAtRest = false) {
    const { nodes } = this.scene.outline;
    const own = isAtRest ? nodes[index].matrix ?? IDENTITY : this.matrixOf(index);
    const { parent } = nodes[index];
    return parent === null ? [...own] : multiply(this.worldOf(parent, isAtRest), own);
  }

  /** Places a node in its parent; null puts it back as in the file. */
  setMatrix(index, matrix, what = "Move") {
    const name = this.scene.outline.nodes[index].name || `#${index}`;
    this.edit(`${what} ${name}`, (view) => overrideNode(view, index, "matrix", matrix ?? undefined));
  }

  /** As it is now: the file's values with the edits over them. */
  material(index) {
    const own = this.scene.outline.materials[index];
    return { ...own, ...this.view.overrides.materials[`#${index}`] };
  }

  editMaterial(index, members) {
    const name = this.scene.outline.materials[index].name || `#${index}`;
    this.edit(`Material ${name}: ${Object.keys(members).join(", ")}`, (view) => {
      const before = view.overrides.materials[`#${index}`] ?? {};
      view.overrides.materials[`#${index}`] = { ...before, ...members };
    });
  }

  resetMaterial(index) {
    this.edit("Reset material", (view) => {
      delete view.overrides.materials[`#${index}`];
    });
  }

  // ---- lights ----

  /** Edits need the lights as members of the view: those of the scene are copied over once. */
  takeLights(view) {
    if (!view.scene_lights) return;
    const own = this.scene.outline.lights.map((light) => lightMembers(light));
    view.lights = [...own, ...view.lights];
    view.scene_lights = false;
  }

  /** All that shine: those of the scene unless taken over, then those of the view. */
  get lights() {
    const own = this.view.scene_lights ? this.scene.outline.lights : [];
    return [...own.map((light) => lightMembers(light)), ...this.view.lights];
  }

  editLight(index, members) {
    this.edit(`Light ${index + 1}: ${Object.keys(members).join(", ")}`, (view) => {
      this.takeLights(view);
      view.lights[index] = lightMembers({ ...view.lights[index], ...members });
    });
  }

  addLight(type) {
    const height = this.bounds[4];
    const [x, , z] = this.center;
    const size = this.camera.sceneSize;
    const short = (value) => Number(value.toPrecision(3));
    const side = short(0.2 * size);
    const candela = short(3 * size * size);
    const intensity = { directional: 3, rect: short(candela / side ** 2),
      disk: short((4 * candela) / (Math.PI * side ** 2)) }[type] ?? candela;
    this.edit(`Add ${type} light`, (view) => {
      view.lights.push(lightMembers({
        type, intensity, color: [1, 1, 1], width: side, height: side, radius: side / 2,
        position: [x, height + 0.25 * size, z].map(short),
        direction: type === "directional" ? [-0.4, -1, -0.3] : [0, -1, 0],
      }));
    });
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

  select(selection) {
    this.selection = selection;
    this.#tell("select");
  }

  // ---- links ----

  /** What a link carries: the camera, and the members that differ from the defaults. */
  toState() {
    const view = {};
    for (const [name, value] of Object.entries(this.view))
      if (!isEqual(value, DEFAULTS[name])) view[name] = value;
    return { camera: this.camera.toState(), ...(Object.keys(view).length ? { view } : {}),
      ...(this.shown === "color" ? {} : { show: this.shown }) };
  }
}

/** Sets a member of a node's override, or takes it back; one without members is none. */
function overrideNode(view, index, member, value) {
  const { [member]: _, ...rest } = view.overrides.nodes[`#${index}`] ?? {};
  if (value !== undefined) rest[member] = value;
  if (Object.keys(rest).length) view.overrides.nodes[`#${index}`] = rest;
  else delete view.overrides.nodes[`#${index}`];
}

const MEMBERS_OF_TYPE = {
  point: ["position", "range"],
  spot: ["position", "direction", "range", "inner_cone_deg", "outer_cone_deg", "up"],
  directional: ["direction", "up"],
  rect: ["position", "direction", "width", "height", "up"],
  disk: ["position", "direction", "radius"],
};
const DEFAULT_MEMBERS = {
  position: [0, 0, 0], direction: [0, -1, 0], width: 1, height: 1, radius: 0.5,
};
const ALWAYS_SAID = ["position", "direction", "width", "height", "radius"]; // the service needs them

/** Only the members that a light of its type has: others would be refused. */
export function lightMembers(light) {
  const kept = { type: light.type };
  for (const name of ["color", "intensity", "shadow", ...MEMBERS_OF_TYPE[light.type]]) {
    if (light[name] !== undefined) kept[name] = light[name];
    else if (ALWAYS_SAID.includes(name)) kept[name] = DEFAULT_MEMBERS[name];
  }
  if (kept.up && Math.hypot(...cross(kept.up, kept.direction)) < 1e-6) delete kept.up; // says nothing
  return kept;
}

/** Text for the part of an address after "#", and back. */
export function linkFromState(scene, state) {
  const bytes = new TextEncoder().encode(JSON.stringify(state));
  const text = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  const safe = text.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
  return `#scene=${scene}&view=${safe}`;
}

export function stateFromLink(hash) {
  const members = new URLSearchParams(hash.replace(/^#/, ""));
  const scene = members.get("scene");
  if (!/^[0-9a-f]{64}$/.test(scene ?? "")) return null;
  try {
    const text = atob((members.get("view") ?? "").replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(text, (character) => character.charCodeAt(0));
    return { scene, state: JSON.parse(new TextDecoder().decode(bytes)) };
  } catch {
    return { scene, state: null }; // a damaged link still names its scene
  }
}
