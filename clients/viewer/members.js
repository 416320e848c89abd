// SPDX-License-Identifier: MIT
// Members of a view as plain JSON: equal or not, copied, and what makes one of another.

export const copy = (value) => JSON.parse(JSON.stringify(value));
export const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
export const isEqual = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);

/** Whether two objects have equal members. */
export const isSame = (a, b) => Object.keys(a).length === Object.keys(b).length
  && Object.keys(a).every((name) => isEqual(a[name], b[name]));

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
