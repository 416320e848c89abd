# SPDX-License-Identifier: MIT
"""How an image was made, as its file says: requests.md, "Provenance"."""
from __future__ import annotations

import json
import struct
from typing import Any, Dict, Optional


def _in_packet(packet: bytes) -> Optional[bytes]:
    _, begin, rest = packet.partition(b"<vitrail:provenance>")
    text, end, _ = rest.partition(b"</vitrail:provenance>")
    return text if begin and end else None


def _in_png(data: bytes) -> Optional[bytes]:
    at = 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + length]
        if kind == b"IDAT" or len(body) < length:
            return None
        if kind == b"tEXt" and body.startswith(b"Vitrail\0"):
            return body[8:]
        at += 12 + length
    return None


def _in_jpeg(data: bytes) -> Optional[bytes]:
    name = b"http://ns.adobe.com/xap/1.0/\0"
    at = 2
    while at + 4 <= len(data) and data[at] == 0xff and data[at + 1] != 0xda:
        (length,) = struct.unpack_from(">H", data, at + 2)
        body = data[at + 4:at + 2 + length]
        if data[at + 1] == 0xe1 and body.startswith(name):
            found = _in_packet(body)
            if found is not None:
                return found
        at += 2 + length
    return None


def _in_webp(data: bytes) -> Optional[bytes]:
    at = 12
    while at + 8 <= len(data):
        (length,) = struct.unpack_from("<I", data, at + 4)
        if data[at:at + 4] == b"XMP ":
            return _in_packet(data[at + 8:at + 8 + length])
        at += 8 + length + length % 2
    return None


def _in_exr(data: bytes) -> Optional[bytes]:
    at = 8
    while True:
        name, _, rest = data[at:at + 256].partition(b"\0")
        kind, _, rest = rest.partition(b"\0")
        at += len(name) + len(kind) + 2
        if not name or at + 4 > len(data):
            return None
        (length,) = struct.unpack_from("<i", data, at)
        if length < 0:
            return None
        if name == b"vitrail" and kind == b"string":
            return data[at + 4:at + 4 + length]
        at += 4 + length


def provenance(data: bytes) -> Optional[Dict[str, Any]]:
    """What an image file (PNG, JPEG, WebP or EXR) says of its making; None: it says nothing."""
    text = None
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        text = _in_png(data)
    elif data.startswith(b"\xff\xd8"):
        text = _in_jpeg(data)
    elif data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        text = _in_webp(data)
    elif data.startswith(b"\x76\x2f\x31\x01"):
        text = _in_exr(data)
    try:
        found = json.loads(text) if text is not None else None
    except ValueError:
        return None
    return found if isinstance(found, dict) else None
