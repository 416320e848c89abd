// SPDX-License-Identifier: MIT
// Members of a view as plain JSON: equal or not, copied, and what makes one of another.

export const copy = (value) => JSON.parse(JSON.stringify(value));
export const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
export const isEqual = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);

/** Whether two objects have equal members. */
export const isSame = (a, b) => Object.keys(a).length === Object.keys(b).length
  && Object.keys(a).every((name) => isEqual(a[name], b[name]));

/** The scenes that the parts of a view are of. */
export const partSceneIds = (parts) => new Set(Object.values(parts).map(({ scene }) => scene));

/** The JSON merge patch (RFC 7396) that makes `to` of `from`; undefined when there is none. */
export function mergePatch(from, to) {
  if (from === to) return undefined;
  if (!isObject(from) || !isObject(to)) return isEqual(from, to) ? undefined : to;
  const patch = {};
  for (const name of Object.keys(from)) if (!(name in to)) patch[name] = null;
  for (const [name, value] of Object.entries(to)) {
    const change = name in from ? mergePatch(from[name], value) : value;
    if (change !== undefined) patch[name] = change;
  }
  return Object.keys(patch).length ? patch : undefined;
}

/** The patch by index that makes one list of lights of another (docs/reference/views.md), where what
 * goes is one piece; else the whole list. */
function lightsPatch(from, to) {
  const gone = from.length - to.length;
  let start = 0;
  while (start < Math.min(from.length, to.length) && isEqual(from[start], to[start])) start++;
  if (gone > 0)
    return isEqual(from.slice(start + gone), to.slice(start))
      ? Object.fromEntries(from.slice(0, gone).map((_, i) => [start + i, null])) : to;
  const patch = {};
  for (let i = start; i < to.length; i++) {
    const change = from[i]?.type === to[i].type ? mergePatch(from[i], to[i]) : to[i];
    if (change) patch[i] = change;
  }
  return patch;
}

/** As mergePatch, of members of a view: of its lights, only those that changed. */
export function viewPatch(from, to) {
  const patch = mergePatch(from, to);
  if (patch?.lights && from.lights?.length) patch.lights = lightsPatch(from.lights, to.lights);
  return patch;
}
