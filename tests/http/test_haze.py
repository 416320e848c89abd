# SPDX-License-Identifier: MIT
"""Haze over HTTP: it is in the picture and its alpha, is refused where nothing draws it, and goes
through views and jobs as other members do."""
import json

import support
from exr_reader import Exr
from test_service_real import REAL, lit_floor

support.needs(REAL)

LOOK = {"width": 48, "height": 32, "camera": {"eye": [0, 2.5, 2.5], "target": [0, 0.5, 0]},
        "format": "exr"}


class Haze(support.ServiceTest):
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL).wait_device()

    def setUp(self):
        self.scene = self.daemon.push(lit_floor())

    def pixels(self, **members):
        reply = self.daemon.render(self.scene, **{**LOOK, **members})
        self.assertEqual(200, reply.status, reply.body[:300])
        return Exr(reply.body).pixels

    def test_it_scatters_and_hides(self):
        sums = []
        for shadows in ("deep", "raytraced", "raytraced-shadows"):
            quality = {"shadows": shadows}
            clear = self.pixels(quality=quality)
            hazy = self.pixels(quality=quality, atmosphere={"density": 0.2})
            dark = self.pixels(quality=quality, atmosphere={"density": 0.2, "color": [0, 0, 0]})
            none = self.pixels(quality=quality, atmosphere={"density": 0})
            self.assertEqual(clear, none)
            for a, b, c in zip(clear, hazy, dark):
                self.assertGreater(b["A"], a["A"] - 1e-6)
                for channel in "RGB":
                    self.assertLessEqual(c[channel], a[channel] + 1e-6)
                    self.assertGreaterEqual(b[channel], c[channel] - 1e-6)
            sums.append(sum(p["G"] for p in hazy))
            self.assertGreater(sums[-1], 1.02 * sum(p["G"] for p in dark))
        for sum_green in sums[1:]:
            self.assertAlmostEqual(1, sum_green / sums[0], delta=0.03)

    def test_what_draws_none_refuses_it(self):
        reply = self.daemon.render(self.scene, **LOOK, quality={"light_lists": "linked"},
                                   atmosphere={"density": 0.2})
        self.assertEqual((400, "invalid_request"), (reply.status, reply.json()["code"]))
        self.assertIn("light_lists", reply.json()["detail"])

    def test_a_view_keeps_what_its_haze_does_not_change(self):
        look = {key: value for key, value in LOOK.items() if key != "format"}
        body = json.dumps({"scene": self.scene, **look}).encode()
        view = self.daemon.request("POST", "/v1/views", body, {"Content-Type": "application/json"})
        path = view.header("Location")
        first = self.daemon.request("GET", path + "/image")
        self.daemon.request("PATCH", path, b'{"atmosphere": {"density": 0.3}}',
                            {"Content-Type": "application/merge-patch+json"})
        second = self.daemon.request("GET", path + "/image")
        self.assertEqual((200, 200), (first.status, second.status))
        self.assertNotEqual(first.header("ETag"), second.header("ETag"))
        self.assertNotEqual(first.body, second.body)


if __name__ == "__main__":
    support.run_tests()
