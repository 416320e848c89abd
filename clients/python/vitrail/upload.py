# SPDX-License-Identifier: MIT
"""Scenes on their way to the server: files of a .gltf, ids by content, multipart bodies."""
from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
import urllib.parse
from typing import Dict, Iterator, Mapping, Optional, Set, Tuple, Union

Files = Mapping[str, bytes]
Path = Union[str, "os.PathLike[str]"]


# By suffix: the names of the formats beside glTF.
FORMATS = {".obj": "obj", ".ply": "ply", ".stl": "stl", ".fbx": "fbx", ".dae": "collada",
           ".3mf": "3mf", ".3ds": "3ds", ".iv": "iv",
           ".step": "step", ".stp": "step", ".iges": "iges", ".igs": "iges", ".vdb": "vdb"}
UNITS_M = {"mm": 0.001, "cm": 0.01, "m": 1, "in": 0.0254, "ft": 0.3048}


def scene_id(content: Union[Path, bytes, Files], *, unit: Optional[str] = None,
             up: Optional[str] = None, deflection: Optional[float] = None) -> str:
    """The id that the server will give: the SHA-256 of one file, or of the manifest of several.

    content, unit, up and deflection as those of Client.post_scene: a path, the bytes of a .glb, or
    files by name."""
    if isinstance(content, (str, os.PathLike)):
        return scene_id(files_of(content), unit=unit, up=up, deflection=deflection)
    if isinstance(content, (bytes, bytearray, memoryview)):
        return hashlib.sha256(content).hexdigest()
    own = _id_of_files(content)
    form = _format_of(content)
    if form is None:
        return own
    metres = "-" if unit is None else f"{UNITS_M[unit]:.9g}"
    within = "" if deflection is None else f" {deflection:.9g}"
    line = f"vitrail-scene-as-1\n{own} {form} {metres} {up or '-'}{within}\n"
    return hashlib.sha256(line.encode()).hexdigest()


def _format_of(files: Files) -> Optional[str]:
    """The format of the scene among files; None: glTF."""
    found = None
    for name in files:
        suffix = os.path.splitext(name)[1].lower()
        if suffix in (".gltf", ".glb"):
            return None
        found = found or FORMATS.get(suffix)
    return found


def _id_of_files(content: Files) -> str:
    if len(content) == 1:
        return scene_id(next(iter(content.values())))
    lines = ["vitrail-scene-1\n"]
    for name in sorted(content, key=str.encode):
        digest = hashlib.sha256(content[name]).hexdigest()
        lines.append(f"{digest} {len(content[name])} {name}\n")
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def files_of(path: Path) -> Dict[str, bytes]:
    """A scene with the files that it names, by the names under which it names them."""
    path = os.fspath(path)
    folder, name = os.path.split(path)
    files = {name: _read(path)}
    if name.lower().endswith(".obj"):
        return {**files, **_files_of_obj(folder, files[name])}
    if not name.lower().endswith(".gltf"):
        return files
    document = json.loads(files[name])
    for kind in ("buffers", "images"):
        for entry in document.get(kind, []):
            uri = entry.get("uri", "data:")
            if uri.startswith("data:"):
                continue
            relative = urllib.parse.unquote(uri)
            files[relative] = _read(os.path.join(folder, relative))
    return files


def _files_of_obj(folder: str, text: bytes) -> Dict[str, bytes]:
    """The libraries of materials of an .obj and their textures, as far as they are below it."""
    files: Dict[str, bytes] = {}

    def add(name: str) -> Optional[bytes]:
        name = os.path.normpath(name.replace("\\", "/")).replace(os.sep, "/")
        path = os.path.join(folder, name)
        if os.path.isabs(name) or name.startswith("..") or not os.path.isfile(path):
            return None
        files[name] = _read(path)
        return files[name]

    for library in _values_of(text, {"mtllib"}):
        for texture in _values_of(add(library) or b"", MAPS):
            add(texture)
    return files


MAPS = {"map_kd", "map_ke", "map_ks", "map_ns", "map_d", "map_ka", "norm", "bump", "map_bump"}


def _values_of(text: bytes, words: Set[str]) -> Iterator[str]:
    """What stands behind words at the begin of lines, without options as "-s 1 1 1"."""
    for line in text.decode("utf-8", "replace").splitlines():
        word, _, value = line.strip().partition(" ")
        if word.lower() in words and value.strip():
            yield re.sub(r"^(-\w+\s+((on|off|[-+.\d]\S*|\w)\s+)*)*", "", value.strip())


def _read(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


def multipart(files: Files) -> Tuple[bytes, str]:
    """Body and Content-Type of an upload of files by relative name."""
    boundary = f"vitrail-{secrets.token_hex(16)}"
    pieces = []
    for name, content in files.items():
        if any(character in name for character in '"\\\r\n'):
            raise ValueError(f"a file cannot be uploaded as {name!r}")
        pieces.append(f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"; '
                      f'filename="{name}"\r\n\r\n'.encode())
        pieces += [bytes(content), b"\r\n"]
    pieces.append(f"--{boundary}--\r\n".encode())
    return b"".join(pieces), f"multipart/form-data; boundary={boundary}"
