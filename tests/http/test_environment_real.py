# SPDX-License-Identifier: MIT
"""An environment map on its way from a file to a picture: each direction shows its own texel."""
import math
import os

import support
from test_service_environments import exr, hdr
from test_service_real import linear_from_srgb
from test_service_renders import read_png

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)

WIDTH, HEIGHT = 64, 32
UNIT = 1 / math.sqrt(3)
DIRECTIONS = [(1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1), (0.6, 0.8, 0), (0, -0.8, 0.6),
              (UNIT, UNIT, UNIT), (-UNIT, -UNIT, UNIT)]


def colour(direction):
    """Another one for each direction, from 0.1 to 0.9."""
    return tuple(0.5 + 0.4 * c for c in direction)


def texel(x, y):
    """Row 0 is +Y, the middle of the map -Z, and +X lies to the right of it."""
    phi, theta = 2 * math.pi * ((x + 0.5) / WIDTH - 0.5), math.pi * (y + 0.5) / HEIGHT
    return colour((math.sin(theta) * math.sin(phi), math.cos(theta),
                   -math.sin(theta) * math.cos(phi)))


def unturned(direction, degrees):
    """The direction of the map that a turned one shows there."""
    turn = math.radians(degrees)
    x, y, z = direction
    return (x * math.cos(turn) - z * math.sin(turn), y, x * math.sin(turn) + z * math.cos(turn))


class Directions(support.ServiceTest):
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL).wait_device()

    def seen(self, environment, direction, shadows):
        camera = {"eye": [50, 50, 50], "target": [50 + c for c in direction], "fov_y_deg": 1}
        reply = self.daemon.render(
            self.scene, width=8, height=8, camera=camera, environment=environment,
            tone_mapping="none", quality={"shadows": shadows, "samples": 1})
        self.assertEqual(200, reply.status, reply.body[:300])
        *_, rows = read_png(reply.body)
        return tuple(linear_from_srgb(c / 255) for c in rows[4][16:19])

    def test_each_direction_shows_its_texel_turned_and_scaled(self):
        self.scene = self.daemon.push(support.triangle())
        for content in (hdr(WIDTH, HEIGHT, texel), exr(WIDTH, HEIGHT, texel)):
            image = self.daemon.request("POST", "/v1/environments", content, {
                "Content-Type": "application/octet-stream"}).json()["id"]
            for degrees, intensity, shadows in ((0, 1, "map"), (90, 0.5, "map"),
                                                (-30, 1, "raytraced")):
                for direction in DIRECTIONS:
                    got = self.seen({"image": image, "rotation_deg": degrees,
                                     "intensity": intensity, "background": True}, direction,
                                    shadows)
                    meant = colour(unturned(direction, degrees))
                    for a, b in zip(got, meant):
                        # a texel spans 0.1 rad, and HDR has eight bits
                        self.assertAlmostEqual(intensity * b, a, delta=0.012,
                                               msg=(degrees, shadows, direction, got, meant))


if __name__ == "__main__":
    support.run_tests()
