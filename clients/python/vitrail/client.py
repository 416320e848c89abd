# SPDX-License-Identifier: MIT
"""A server: its scenes, renders, views, and what it says about itself."""
from __future__ import annotations

import json
import os
import time
import urllib.parse
from typing import Any, Dict, List, Mapping, Optional, Union

from .connection import Connection, Reply, query_of
from .errors import VitrailError
from .image import Image, image_from
from .job import Job
from .upload import Files, Path, files_of, multipart
from .view import View

MEDIA_TYPES = {"png": "image/png", "jpeg": "image/jpeg", "webp": "image/webp", "exr": "image/x-exr",
               "exr-deep": "image/x-exr"}


class Client:
    """One server. All methods raise VitrailError when it says no or does not answer.

    Thread: any; each thread keeps a connection of its own.
    """

    def __init__(self, url: Optional[str] = None, *, timeout_s: float = 300.0,
                 retries: int = 2) -> None:
        """url: by default that of the environment variable VITRAIL_URL, or of a local server.
        retries: how often to try again when the server is busy (503)."""
        self.url = url or os.environ.get("VITRAIL_URL") or "http://127.0.0.1:8090"
        self.connection = Connection(self.url, timeout_s, retries)

    def close(self) -> None:
        self.connection.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, method: str, path: str, members: Mapping[str, Any],
             headers: Optional[Mapping[str, str]] = None) -> Reply:
        """A request with a JSON body."""
        return self.connection.request(method, path, json.dumps(members).encode(),
                                       {"Content-Type": "application/json", **(headers or {})})

    def get(self, path: str) -> Any:
        """A JSON reply, parsed."""
        return self.connection.request("GET", path).json()

    # ---- what there is ----

    def capabilities(self) -> Dict[str, Any]:
        return self.get("/v1/capabilities")

    def stats(self) -> Dict[str, Any]:
        return self.get("/v1/stats")

    def is_ready(self) -> bool:
        """Whether a render would be served now."""
        try:
            return self.get("/readyz")["status"] == "ready"
        except VitrailError:
            return False

    def frame(self, frame: str) -> Dict[str, Any]:
        """The report of a frame: passes and why, counts, bytes, warnings."""
        return self.get(f"/v1/frames/{urllib.parse.quote(frame, safe='')}")

    # ---- scenes ----

    def scenes(self) -> List[Dict[str, Any]]:
        """Oldest first."""
        return self.get("/v1/scenes")["scenes"]

    def scene(self, scene: str) -> Dict[str, Any]:
        return self.get(f"/v1/scenes/{scene}")

    def outline(self, scene: str) -> Dict[str, Any]:
        """Nodes, materials, lights and cameras with their values."""
        return self.get(f"/v1/scenes/{scene}/outline")

    def has_scene(self, scene: str) -> bool:
        """Whether the server has it: with scene_id, whether there is anything to upload."""
        try:
            return self.connection.request("HEAD", f"/v1/scenes/{scene}").status == 200
        except VitrailError as problem:
            if problem.status == 404:
                return False
            raise

    def post_scene(self, content: Union[Path, bytes, Files],
                   name: Optional[str] = None,
                   scene: Optional[str] = None, *, unit: Optional[str] = None,
                   up: Optional[str] = None, deflection: Optional[float] = None,
                   request_id: Optional[str] = None) -> Dict[str, Any]:
        """Brings a scene and answers its summary; harmless when it is there already.

        name: what it is called; None takes the name of the file.
        scene: which scene of the file, by its name or "#1", its index, and which grid of one of
        OpenVDB; None leaves it to the file.

        unit: what one unit of a file that is not glTF is: mm, cm, m, in, ft; up: its axis that
        points up: y, z. None leaves them to the file. deflection: how far the triangles of STEP
        and IGES may be off their surfaces, in units of the file; None: a thousandth of each part.

        request_id: 1 to 64 of A-Z a-z 0-9 . _ -, by which upload_status tells how far its reading
        is.

        content: the path of a .glb, of a .gltf or .obj whose files lie where it says, or of a file
        of another format; the bytes of a .glb; or files by relative name, one of them the scene."""
        route = "/v1/scenes" + query_of(name=name or None, scene=scene or None, unit=unit, up=up,
                                       deflection=deflection)
        headers = {"X-Request-Id": request_id} if request_id else {}
        if isinstance(content, (bytes, bytearray, memoryview)):
            headers["Content-Type"] = "model/gltf-binary"
            return self.connection.request("POST", route, bytes(content), headers).json()
        files = content if isinstance(content, Mapping) else files_of(content)
        body, headers["Content-Type"] = multipart(files)
        return self.connection.request("POST", route, body, headers).json()

    def upload_status(self, request_id: str) -> Dict[str, Any]:
        """How far the reading of an upload is: state, elapsed_s, progress (stage and share).

        To be asked from another thread, with a client of its own; 404 once it ended."""
        return self.get(f"/v1/uploads/{urllib.parse.quote(request_id, safe='')}")

    def post_demo(self, name: Optional[str] = None) -> Dict[str, Any]:
        """Has the server make its demo scene and answers its summary.

        name: what it is called; None takes "demo" for one that is new."""
        route = "/v1/scenes/demo" + query_of(name=name or None)
        return self.connection.request("POST", route, b"").json()

    def rename_scene(self, scene: str, name: Optional[str]) -> Dict[str, Any]:
        """Gives a scene a name, or takes it away with None; answers the summary."""
        return self.send("PATCH", f"/v1/scenes/{scene}", {"name": name}).json()

    def delete_scene(self, scene: str, *, force: bool = False) -> None:
        """force: also one that a job needs which has not ended; its frames fail."""
        self.connection.request("DELETE",
                                f"/v1/scenes/{scene}{query_of(force='true' if force else None)}")

    # ---- environment maps: light from all around ----

    def environments(self) -> List[Dict[str, Any]]:
        """Oldest first."""
        return self.get("/v1/environments")["environments"]

    def environment(self, environment: str) -> Dict[str, Any]:
        return self.get(f"/v1/environments/{environment}")

    def post_environment(self, content: Union[Path, bytes],
                         name: Optional[str] = None) -> Dict[str, Any]:
        """Brings a map, Radiance HDR or OpenEXR, and answers its summary, whose id goes into
        environment={"image": ...} of renders and views. Harmless when it is there already.

        content: the path of the file, or its bytes.
        name: what it is called; None takes the name of the file."""
        if not isinstance(content, (bytes, bytearray, memoryview)):
            name = name or os.path.basename(os.fspath(content))
            with open(content, "rb") as file:
                content = file.read()
        route = "/v1/environments" + query_of(name=name or None)
        return self.connection.request("POST", route, bytes(content),
                                       {"Content-Type": "application/octet-stream"}).json()

    def rename_environment(self, environment: str, name: Optional[str]) -> Dict[str, Any]:
        """Gives a map a name, or takes it away with None; answers the summary."""
        return self.send("PATCH", f"/v1/environments/{environment}", {"name": name}).json()

    def delete_environment(self, environment: str, *, force: bool = False) -> None:
        """force: as of delete_scene."""
        query = query_of(force="true" if force else None)
        self.connection.request("DELETE", f"/v1/environments/{environment}{query}")

    # ---- images ----

    def render(self, scene: str, *, format: str = "png", etag: Optional[str] = None,
               request_id: Optional[str] = None, **members: Any) -> Optional[Image]:
        """One image of a scene; members as in docs/reference/requests.md.

        With the etag of an earlier image: None when it would be the same, without rendering.
        request_id: 1 to 64 of A-Z a-z 0-9 . _ -, by which render_status tells how far it is."""
        headers = {"Accept": MEDIA_TYPES.get(format, "*/*")}
        if etag:
            headers["If-None-Match"] = etag
        if request_id:
            headers["X-Request-Id"] = request_id
        body = {"scene": scene, "format": format, **members}
        reply = self.send("POST", "/v1/renders", body, headers)
        return None if reply.status == 304 else image_from(reply.headers, reply.body)

    def render_status(self, request_id: str) -> Dict[str, Any]:
        """How far a render in work is: state, elapsed_s and, of a long one, progress.

        To be asked from another thread, with a client of its own; 404 once the render has ended."""
        return self.get(f"/v1/renders/{urllib.parse.quote(request_id, safe='')}")

    # ---- trade-offs: time against error, measured ----

    def create_tradeoff(self, scene: str, *, tradeoff: Optional[Mapping[str, Any]] = None,
                        **members: Any) -> Dict[str, Any]:
        """Has a view measured with every technique (docs/reference/tradeoffs.md): minutes.

        Later renders of the scene can then ask by quality={"max_error": ...} or "budget_ms"."""
        body = {"scene": scene, "tradeoff": dict(tradeoff or {}), **members}
        return self.send("POST", "/v1/tradeoffs", body).json()

    def tradeoff(self, tradeoff: str) -> Dict[str, Any]:
        """State, progress and results so far."""
        return self.get(f"/v1/tradeoffs/{tradeoff}")

    def tradeoff_as(self, tradeoff: str, format: str) -> bytes:
        """The results as "csv", "svg", "html" or "json"."""
        path = f"/v1/tradeoffs/{tradeoff}?format={format}"
        return self.connection.request("GET", path).body

    def wait_tradeoff(self, tradeoff: str, *, poll_s: float = 1.0) -> Dict[str, Any]:
        """The results, once nothing more is measured."""
        while (found := self.tradeoff(tradeoff))["state"] in ("queued", "running"):
            time.sleep(poll_s)
        return found

    def cancel_tradeoff(self, tradeoff: str) -> None:
        """What is measured stays."""
        self.connection.request("DELETE", f"/v1/tradeoffs/{tradeoff}")

    # ---- jobs: lists of frames ----

    def jobs(self) -> List[Job]:
        """Newest first; their summaries lack outputs, failures and request."""
        return [Job(self, found) for found in self.get("/v1/jobs")["jobs"]]

    def create_job(self, scene: str, *, key: Optional[str] = None, **members: Any) -> Job:
        """Has frames rendered, whatever ends meanwhile; members as in docs/reference/jobs.md.

        key: what this request is called (Idempotency-Key): sent again, it is the same job.
        after: jobs, or their ids, that are to be done before it begins."""
        headers = {"Idempotency-Key": key} if key else {}
        if "after" in members:
            members["after"] = [getattr(job, "id", job) for job in members["after"]]
        return Job(self, self.send("POST", "/v1/jobs", {"scene": scene, **members},
                                   headers).json())

    def job(self, job: str) -> Job:
        """One that exists already."""
        return Job(self, self.get(f"/v1/jobs/{urllib.parse.quote(job, safe='')}"))

    # ---- views ----

    def views(self) -> List[Dict[str, Any]]:
        """Oldest first."""
        return self.get("/v1/views")["views"]

    def create_view(self, scene: str, *, expires_s: Optional[int] = None, **members: Any) -> View:
        """A view to edit and look at; members as in docs/reference/views.md. The server forgets the
        view when nobody asks for or watches it for expires_s."""
        path = "/v1/views" + query_of(expires_s=expires_s)
        return View(self, self.send("POST", path, {"scene": scene, **members}).json())

    def view(self, view: str) -> View:
        """One that exists already."""
        return View(self, self.get(f"/v1/views/{urllib.parse.quote(view, safe='')}"))
