// SPDX-License-Identifier: MIT
// A scene with parts of other scenes in it, as one outline: what the base has keeps its indices,
// parts follow. Each part begins with a node of its own, below which its scene hangs.
import { moved, multiply, turned } from "./transforms.js";

/** Parts in the order in which the service joins them: level by level, by name within each. */
function inOrder(parts) {
  const left = Object.keys(parts).sort();
  const done = [];
  const partOf = (parent) => parent?.split("/")[0];
  while (left.length) {
    const ready = left.filter((name) => !left.includes(partOf(parts[name].parent)));
    if (!ready.length) break; // a circle, which the service refuses
    done.push(...ready);
    for (const name of ready) left.splice(left.indexOf(name), 1);
  }
  return done;
}

const plain = (key) => (item, index) => ({ ...item, key: key(index) });

/**
 * @param {{summary: object, outline: object}} base
 * @param {object} parts as the view has them: name to {scene, parent, matrix, visible}
 * @param {Map<string, {summary: object, outline: object}>} scenes by id, those of the parts
 * @returns the outline, whose nodes, materials and grids have `key`, their name in overrides, and whose
 * `at` maps indices of the service to ours; nodes of parts have `part`, a part's own node `isPart`
 */
export function assemble(base, parts, scenes) {
  const nodes = base.outline.nodes.map(plain((index) => `#${index}`));
  const materials = base.outline.materials.map(plain((index) => `#${index}`));
  const grids = (base.outline.grids ?? []).map(plain((index) => `#${index}`));
  const lights = [...base.outline.lights];
  const starts = { nodes: [[0, 0]], materials: [[0, 0]] }; // [of the service, of ours]
  let [nodeEnd, materialEnd] = [base.summary.nodes, base.summary.material_count + 1];
  const places = new Map(nodes.map(({ key }, index) => [key, index]));
  for (const name of inOrder(parts)) {
    const own = scenes.get(parts[name].scene);
    if (!own) continue; // not known yet
    starts.nodes.push([nodeEnd, nodes.length]);
    starts.materials.push([materialEnd, materials.length]);
    const root = nodes.length;
    nodes.push({ name, key: name, part: name, isPart: true, materials: [], bounds: null,
      parent: places.get(parts[name].parent) ?? null });
    places.set(name, root);
    own.outline.nodes.forEach((node, index) => {
      places.set(`${name}/#${index}`, nodes.length);
      nodes.push({ ...node, key: `${name}/#${index}`, part: name,
        parent: root + (node.parent === null ? 0 : node.parent + 1),
        materials: node.materials.map((material) => materials.length + material) });
    });
    own.outline.lights.forEach((light) => lights.push({ ...light, node: root + 1 + light.node }));
    materials.push(...own.outline.materials.map((material, index) =>
      ({ ...material, name: material.name && `${name}: ${material.name}`, key: `${name}/#${index}` })));
    grids.push(...(own.outline.grids ?? []).map((grid, index) =>
      ({ ...grid, name: grid.name && `${name}: ${grid.name}`, key: `${name}/#${index}` })));
    nodeEnd += 1 + own.summary.nodes;
    materialEnd += own.summary.material_count + 1;
  }
  const at = (kind) => (index) => {
    const [from, to] = starts[kind].findLast(([start]) => start <= index);
    return to + index - from;
  };
  return { ...base.outline, nodes, materials, grids, lights,
    nodeAt: at("nodes"), materialAt: at("materials") };
}

/** A light where its node has been moved to. */
export function placedLight(light, way) {
  return { ...light, ...(light.position && { position: moved(way, light.position) }),
    ...(light.direction && { direction: turned(way, light.direction) }),
    ...(light.up && { up: turned(way, light.up) }) };
}

/** World from node; `own(index)` answers parent from node. */
export function worldOf(nodes, index, own) {
  const { parent } = nodes[index];
  return parent === null ? [...own(index)] : multiply(worldOf(nodes, parent, own), own(index));
}
