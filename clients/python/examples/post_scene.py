# SPDX-License-Identifier: MIT
"""Posts a scene unless the server has it, says what it holds, and renders it once.

usage: post_scene.py SCENE OUT.png [URL]
"""
import sys

import vitrail


def main(path, out, url=None):
    with vitrail.Client(url) as client:
        scene = client.post_scene(path)
        print(f"{scene['id']}: {scene['triangles']} triangles, {scene['light_count']} lights")
        for warning in scene["warnings"]:
            print(f"warning: {warning}")
        image = client.render(scene["id"], width=640, height=360)
        image.save(out)
        print(f"{out}: {image.timings_ms['total']:.0f} ms")
        for step in client.frame(image.frame)["plan"]:
            print(f"  {step['pass']:<24} {step['ms']:8.1f} ms  {step['because']}")


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    main(*sys.argv[1:])
