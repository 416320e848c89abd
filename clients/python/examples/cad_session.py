# SPDX-License-Identifier: MIT
"""A CAD session: one assembly, then a hundred small edits with a lit image after each.

Every edit is a patch of some hundred bytes: a part moved, hidden, shown or recoloured.

usage: cad_session.py ASSEMBLY [EDITS] [URL]
"""
import statistics
import sys
import time

import vitrail


def edits(outline, count):
    """Patches in turn: move a part, tint a material, hide a part, show it again."""
    parts = [i for i, node in enumerate(outline["nodes"]) if node["bounds"]]
    materials = len(outline["materials"])
    for step in range(count):
        part = parts[step // 4 % len(parts)]
        kind = step % 4
        if kind == 0:
            lift = 0.05 * (1 + step % 3)
            matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, lift, 0, 1]
            yield {"overrides": {"nodes": {f"#{part}": {"matrix": matrix}}}}
        elif kind == 1 and materials:
            color = [0.2 + 0.6 * (step % 5) / 4, 0.4, 0.6, 1]
            yield {"overrides": {"materials": {f"#{step % materials}": {"base_color": color}}}}
        elif kind == 2:
            yield {"overrides": {"nodes": {f"#{part}": {"visible": False}}}}
        else:
            yield {"overrides": {"nodes": {f"#{part}": None}}}


def main(path, count="100", url=None):
    with vitrail.Client(url) as client:
        scene = client.post_scene(path)
        outline = client.outline(scene["id"])
        times = []
        with client.create_view(scene["id"], width=480, height=360, camera={"fit": "iso"}) as view:
            view.image()  # the first image loads the scene and compiles its shaders
            for patch in edits(outline, int(count)):
                started = time.monotonic()
                view.patch(patch, revision=view.revision)  # nobody else may edit in between
                image = view.image()
                times.append(1e3 * (time.monotonic() - started))
            print(f"revision {view.revision}, {len(image.data)} bytes in the last image")
        times.sort()
        print(f"{len(times)} edits: median {statistics.median(times):.0f} ms, "
              f"95 % within {times[int(0.95 * (len(times) - 1))]:.0f} ms")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3, 4):
        sys.exit(__doc__)
    main(*sys.argv[1:])
