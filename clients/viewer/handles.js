// SPDX-License-Identifier: MIT
// What the handles over the picture hold: the light that is open in its panel, or the selected node
// while it is being moved.
import { cssColor } from "./color.js";
import { Gizmo } from "./gizmo.js";
import { lightOutlines, turnedLight } from "./lights.js";
import { add, inverse, middleOf, multiply, scaleAbout, turnAbout, turned, withTranslation } from "./transforms.js";

const DOTS_MAX = 256; // lights that are marked; more would hide the picture

const short = (values) => values.map((value) => Number(value.toPrecision(12)));

/** A node, held by the middle of all it has; the world's way becomes one in its parent. */
function nodeTarget(model, index) {
  const bounds = model.boundsOf(index);
  if (!bounds) return null;
  const position = middleOf(bounds);
  const { parent } = model.scene.outline.nodes[index];
  const outer = parent === null ? null : model.worldOf(parent);
  const before = model.matrixOf(index);
  /** @param {number[]} way what happens to all of it, in the world */
  const apply = (way, what) => model.setMatrix(index, !outer ? multiply(way, before)
    : multiply(inverse(outer), multiply(way, multiply(outer, before))), what);
  return { position,
    move(to) {
      const way = add(to, position, -1);
      const local = outer ? turned(inverse(outer), way) : way;
      model.setMatrix(index, withTranslation(before, add(before.slice(12, 15), local)));
    },
    turn: (axis, degrees) => apply(turnAbout(axis, degrees, position), "Turn"),
    scale: (factor) => apply(scaleAbout(factor, position), "Scale") };
}

/** A light; one without a place is held by the middle of the scene. */
function lightTarget(model, index) {
  const light = model.lights[index];
  if (!light) return null;
  return {
    position: light.position ?? model.center,
    direction: light.direction,
    outlines: (distance) => lightOutlines(light, distance),
    move: light.position && ((position) => model.editLight(index, { position: short(position) })),
    aim: (direction) => model.editLight(index, { direction }),
    turn: light.direction && ((axis, degrees) =>
      model.editLight(index, turnedLight(light, axis, degrees))),
    canRoll: light.type === "rect" || Boolean(light.up),
  };
}

/**
 * @param {{lights: object, section: object}} panels of lights and of clip planes
 * @param {{isLighting: () => boolean, isCutting: () => boolean, isMoving: () => boolean}} shown what
 * is at hand now
 */
export function makeHandles(stage, model, { lights, section }, { isLighting, isCutting, isMoving }) {
  const dots = () => {
    if (!isLighting()) return [];
    return model.lights.slice(0, DOTS_MAX).map((light, index) => ({ position: light.position,
      color: cssColor(light.color ?? [1, 1, 1]), name: lights.nameOf(index, light),
      choose: () => lights.activate(index), index }))
      .filter(({ position, index }) => position && index !== lights.active);
  };
  const target = () => {
    if (isLighting()) return lightTarget(model, lights.active);
    if (isCutting()) return section.target();
    const selected = model.selectedNode;
    return isMoving() && selected !== null ? nodeTarget(model, selected) : null;
  };
  return new Gizmo(stage, model, { target, dots });
}
