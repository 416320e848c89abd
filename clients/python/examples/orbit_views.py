# SPDX-License-Identifier: MIT
"""Turns around a scene: 24 images from one load, through one view.

usage: orbit_views.py SCENE OUT-PREFIX [COUNT] [URL]
"""
import sys
import time

import vitrail


def main(path, prefix, count="24", url=None):
    with vitrail.Client(url) as client:
        scene = client.post_scene(path)
        started = time.monotonic()
        with client.create_view(scene["id"], width=480, height=360) as view:
            for index, camera in enumerate(vitrail.orbit(scene["bounds"], int(count))):
                view.patch({"camera": camera})
                view.image().save(f"{prefix}{index:02d}.png")
        print(f"{count} images in {time.monotonic() - started:.1f} s")


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4, 5):
        sys.exit(__doc__)
    main(*sys.argv[1:])
