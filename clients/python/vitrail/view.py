# SPDX-License-Identifier: MIT
"""Views: mutable state over a scene, edited by patches, looked at as images, streams, events."""
from __future__ import annotations

import http.client
import json
import math
import urllib.parse
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Mapping, Optional, Sequence

from .connection import query_of
from .errors import VitrailError, error_of
from .image import Event, Frame, Image, frame_from, image_from

if TYPE_CHECKING:
    from .client import Client

_BOUNDARY = b"--vitrail-frame"


class View:
    """Deletes itself at the end of a with statement; otherwise it expires when nobody asks."""

    def __init__(self, client: "Client", summary: Mapping[str, Any]) -> None:
        self.client = client
        self.id: str = summary["id"]
        self.scene: str = summary["scene"]
        self.revision: int = summary["revision"]  # as of our last patch
        self._path = f"/v1/views/{urllib.parse.quote(self.id, safe='')}"

    def __enter__(self) -> "View":
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.delete()
        except VitrailError as problem:
            if problem.status not in (0, 404):  # gone is what we want
                raise

    def get(self) -> Dict[str, Any]:
        """The summary, and all members in `view`."""
        return self.client.get(self._path)

    def patch(self, members: Mapping[str, Any], *,
              revision: Optional[int] = None) -> Dict[str, Any]:
        """A JSON merge patch; None takes a member back to its default. Answers the summary.

        With a revision it is refused (412, precondition_failed) when the view is at another one."""
        headers = {"Content-Type": "application/merge-patch+json"}
        if revision is not None:
            headers["If-Match"] = f'"{revision}"'
        summary = self.client.send("PATCH", self._path, members, headers).json()
        self.revision = summary["revision"]
        return summary

    def put_part(self, name: str, scene: str, *, parent: Optional[str] = None,
                 matrix: Optional[Sequence[float]] = None, visible: bool = True) -> None:
        """Hangs a scene of the server on a node, in the place of the part of that name if there is
        one. Without a parent it stands in the world; matrix: 16 numbers, column by column."""
        part = {"scene": scene, "parent": parent, "visible": visible,
                "matrix": list(matrix) if matrix is not None else None}
        self.patch({"parts": {name: part}})

    def remove_part(self, name: str) -> None:
        """With the overrides of what was in it; harmless when there is none."""
        self.patch({"parts": {name: None}})

    def set_time(self, time_s: Optional[float], animation: Optional[str] = None) -> None:
        """Shows that time of all animations, or of the one named; None: the scene at rest."""
        self.patch({"animation": None if time_s is None
                    else {"time_s": time_s, "name": animation}})

    def set_variant(self, name: Optional[str]) -> None:
        """Shows a variant of the scene's materials; None: the materials as the file has them."""
        self.patch({"variant": name})

    def delete(self) -> None:
        self.client.connection.request("DELETE", self._path)

    def image(self, *, aov: Optional[str] = None, format: Optional[str] = None,
              quality_percent: Optional[int] = None, etag: Optional[str] = None) -> Optional[Image]:
        """The exact image of the present revision; None when it is the one with that etag."""
        query = query_of(aov=aov, format=format, quality_percent=quality_percent)
        path = f"{self._path}/image{query}"
        headers = {"If-None-Match": etag} if etag else {}
        reply = self.client.connection.request("GET", path, headers=headers)
        return None if reply.status == 304 else image_from(reply.headers, reply.body)

    # ---- picking ----

    def pick(self, x: float, y: float) -> Optional[Dict[str, Any]]:
        """The nearest surface under a point, in pixels from the upper left; None where none is."""
        return self.client.get(f"{self._path}/pick{query_of(x=x, y=y)}")["hit"]

    def pick_through(self, x: float, y: float) -> List[Dict[str, Any]]:
        """Every layer under that point, nearest first, to the first opaque one."""
        return self.client.get(f"{self._path}/pick{query_of(x=x, y=y, through=1)}")["hits"]

    def pick_rectangle(self, x: int, y: int, width: int, height: int, *,
                       through: bool = False) -> List[Dict[str, Any]]:
        """The nodes that show in a rectangle of pixels, each with how many show it."""
        query = query_of(x=x, y=y, width=width, height=height, through=1 if through else None)
        return self.client.get(f"{self._path}/pick{query}")["nodes"]

    # ---- streams ----

    def stream(self) -> Iterator[Frame]:
        """Frames as the view changes: quick ones while it does, an exact one at rest.

        Raises the problem of a frame that could not be rendered. Close the iterator, or leave its
        loop, to end the stream."""
        with self.client.connection.stream(f"{self._path}/stream",
                                           "multipart/x-mixed-replace") as response:
            while (part := _read_part(response)) is not None:
                headers, content = part
                if headers.get("content-type", "").startswith("application/problem+json"):
                    raise error_of(json.loads(content).get("status", 500), content, None)
                yield frame_from(headers, content)

    def events(self) -> Iterator[Event]:
        """Server-sent events: view, frame with its stats, problem, gone (the last)."""
        name, data = "message", []
        with self.client.connection.stream(f"{self._path}/events", "text/event-stream") as response:
            for raw in response:
                line = raw.decode().rstrip("\r\n")
                if line.startswith("event:"):
                    name = line[6:].strip()
                elif line.startswith("data:"):
                    data.append(line[5:].strip())
                elif not line and data:
                    yield Event(name, json.loads("\n".join(data)))
                    if name == "gone":
                        return
                    name, data = "message", []


def _read_part(response: http.client.HTTPResponse) -> Any:
    """(headers by lowercase names, content) of the next part; None at the end."""
    line = response.readline()
    while line and not line.startswith(_BOUNDARY):
        line = response.readline()
    if not line or line.startswith(_BOUNDARY + b"--"):
        return None
    headers: Dict[str, str] = {}
    while (line := response.readline()) not in (b"\r\n", b"\n", b""):
        name, _, value = line.decode("latin-1").partition(":")
        headers[name.strip().lower()] = value.strip()
    if "content-length" not in headers:
        return None
    length = int(headers["content-length"])
    content = response.read(length)
    return (headers, content) if len(content) == length else None


# ---- cameras ----


def look_at(eye: Sequence[float], target: Sequence[float], *,
            fov_y_deg: float = 45.0) -> Dict[str, Any]:
    """A camera as requests word it."""
    return {"eye": list(eye), "target": list(target), "fov_y_deg": fov_y_deg}


def orbit(bounds: Mapping[str, Sequence[float]], count: int, *, pitch_deg: float = 20.0,
          fov_y_deg: float = 45.0, distance: Optional[float] = None) -> List[Dict[str, Any]]:
    """Cameras around a box ("min", "max", as in summaries of scenes), counter-clockwise from +Z.

    distance: metres from the middle; by default such that the sphere around the box is in view."""
    least, most = bounds["min"], bounds["max"]
    center = [(a + b) / 2 for a, b in zip(least, most)]
    radius = math.dist(least, most) / 2 or 1.0
    away = distance if distance is not None else radius / math.sin(math.radians(fov_y_deg) / 2)
    pitch = math.radians(pitch_deg)
    cameras = []
    for index in range(count):
        yaw = 2 * math.pi * index / count
        eye = [center[0] + away * math.cos(pitch) * math.sin(yaw),
               center[1] + away * math.sin(pitch),
               center[2] + away * math.cos(pitch) * math.cos(yaw)]
        cameras.append(look_at(eye, center, fov_y_deg=fov_y_deg))
    return cameras
