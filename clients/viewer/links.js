// SPDX-License-Identifier: MIT
// A view as text for the part of an address after "#".

/** "#scene=ID&view=STATE" with the state as base64url of its JSON. */
export function linkFromState(scene, state) {
  const bytes = new TextEncoder().encode(JSON.stringify(state));
  const text = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  const safe = text.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
  return `#scene=${scene}&view=${safe}`;
}

/** {scene, state}, or null for what is no such text. */
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
