# SPDX-License-Identifier: MIT
"""Scenes on their way to the server: files of a .gltf, ids by content, multipart bodies."""
from __future__ import annotations

import hashlib
import json
import os
import secrets
import urllib.parse
from typing import Dict, Mapping, Tuple, Union

Files = Mapping[str, bytes]
Path = Union[str, "os.PathLike[str]"]


def scene_id(content: Union[Path, bytes, Files]) -> str:
    """The id that the server will give: the SHA-256 of one file, or of the manifest of several.

    content as that of Client.post_scene: a path, the bytes of a .glb, or files by name."""
    if isinstance(content, (str, os.PathLike)):
        return scene_id(files_of(content))
    if isinstance(content, (bytes, bytearray, memoryview)):
        return hashlib.sha256(content).hexdigest()
    if len(content) == 1:
        return scene_id(next(iter(content.values())))
    lines = ["vitrail-scene-1\n"]
    for name in sorted(content, key=str.encode):
        digest = hashlib.sha256(content[name]).hexdigest()
        lines.append(f"{digest} {len(content[name])} {name}\n")
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def files_of(path: Path) -> Dict[str, bytes]:
    """A .glb, or a .gltf with the files that it names, by the names under which it names them."""
    path = os.fspath(path)
    folder, name = os.path.split(path)
    files = {name: _read(path)}
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
