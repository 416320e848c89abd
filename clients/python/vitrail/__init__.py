# SPDX-License-Identifier: MIT
"""Client of Vitrail, a render server for light through transparent things.

    client = Client("http://127.0.0.1:8090")
    scene = client.post_scene("chapel.glb")
    client.render(scene["id"], width=640, height=360).save("chapel.png")

Members of requests and replies are plain dicts, as docs/reference/requests.md and views.md of the
project describe them; failures are VitrailError.
"""
from .client import Client
from .errors import VitrailError
from .grid import density_grid
from .image import Event, Frame, Image
from .job import Job
from .provenance import provenance
from .upload import scene_id
from .view import View, look_at, orbit

__all__ = ["Client", "Event", "Frame", "Image", "Job", "View", "VitrailError",
           "density_grid", "look_at", "orbit", "provenance", "scene_id"]
__version__ = "0.1.0"
