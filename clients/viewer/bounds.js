// SPDX-License-Identifier: MIT
// Boxes around what a model shows, where it stands now: least x y z, greatest x y z.
import { movedBounds } from "./transforms.js";

/** A box around both; null is no box. */
function joined(a, b) {
  if (!a || !b) return a ?? b;
  return a.map((value, at) => (at < 3 ? Math.min : Math.max)(value, b[at]));
}

/** Of a node and all below it; null without geometry. */
export function boundsBelow(model, index) {
  const { nodes } = model.scene.outline;
  const isBelow = new Uint8Array(nodes.length); // parents come before their children
  const hasMoved = Object.values(model.view.overrides.nodes).some(({ matrix }) => matrix);
  const ways = []; // of each node: where it is now from where it is at rest; undefined: the same
  let found = null;
  nodes.forEach((node, at) => {
    isBelow[at] = at === index || (node.parent !== null && isBelow[node.parent]);
    ways[at] = node.isPart || (hasMoved && model.isMoved(at)) ? model.fromRest(at) : ways[node.parent];
    if (!node.bounds || !isBelow[at]) return;
    found = joined(found, ways[at] ? movedBounds(ways[at], node.bounds) : node.bounds);
  });
  return found;
}

/** Of the scene as its file has it, and of the parts where they are. */
export function boundsOfAll(model) {
  const own = model.scene?.bounds;
  let found = own ? [...own.min, ...own.max] : null;
  model.scene?.outline.nodes.forEach(({ isPart }, index) => {
    if (isPart) found = joined(found, model.boundsOf(index));
  });
  return found ?? [-1, -1, -1, 1, 1, 1];
}
