# SPDX-License-Identifier: MIT
"""What comes back: images, frames of a stream, events."""
from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Union

from .provenance import provenance

_FRAME = re.compile(r"/v1/frames/([^>]+)>")


def parse_server_timing(header: Optional[str]) -> Dict[str, float]:
    """ "queue;dur=0.1, total;dur=9" as {"queue": 0.1, "total": 9.0}, in ms."""
    found = {}
    for part in (header or "").split(","):
        name, _, rest = part.strip().partition(";")
        if rest.startswith("dur="):
            found[name] = float(rest[4:].split(";")[0])
    return found


@dataclass(frozen=True)
class Image:
    """Encoded bytes with what the headers of the reply say of them."""

    data: bytes
    media_type: str
    etag: Optional[str] = None  # for asking again without rendering
    frame: Optional[str] = None  # id for Client.frame
    revision: Optional[int] = None  # of the view; None for a one-shot render
    timings_ms: Dict[str, float] = field(default_factory=dict)

    @property
    def provenance(self) -> Optional[Dict[str, Any]]:
        """How it was made, as the file says; None for images of views."""
        return provenance(self.data)

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        with open(path, "wb") as file:
            file.write(self.data)


@dataclass(frozen=True)
class Frame(Image):
    """One image of a stream."""

    exact: bool = False  # False: made small and quickly, because things move
    scale: float = 1.0
    refined: bool = False  # exact, with the samples that `stream` wants at rest


@dataclass(frozen=True)
class Event:
    """A server-sent event of a view: name is view, frame, problem or gone."""

    name: str
    data: Dict[str, Any]


def _integer(text: Optional[str]) -> Optional[int]:
    return int(text) if text and text.isdigit() else None


def image_from(headers: Mapping[str, str], data: bytes) -> Image:
    """headers: by lowercase names."""
    frame = _FRAME.search(headers.get("link", ""))
    return Image(data=data, media_type=headers.get("content-type", "").split(";")[0],
                 etag=headers.get("etag"), frame=frame[1] if frame else None,
                 revision=_integer(headers.get("x-view-revision")),
                 timings_ms=parse_server_timing(headers.get("server-timing")))


def frame_from(headers: Mapping[str, str], data: bytes) -> Frame:
    image = image_from(headers, data)
    return Frame(**vars(image), exact=headers.get("x-view-exact") == "1",
                 scale=float(headers.get("x-view-scale", "1")),
                 refined=headers.get("x-view-refined") == "1")
