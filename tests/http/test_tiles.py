# SPDX-License-Identifier: MIT
"""Tiles of pictures over HTTP and by the command line, drawn by the real renderer: what is cut from
the whole, and what is refused."""
import os

import support
from cli_service import CliServiceTest
from test_service_renders import read_png

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)

SIZE = {"width": 90, "height": 60}
TILES = [(0, 0, 90, 20), (0, 20, 45, 40), (45, 20, 45, 40)]


def pixels_of(png):
    width, height, _, _, rows = read_png(png)
    return width, height, rows


class Tiles(CliServiceTest):
    command = ("render",)

    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL)
        cls.daemon.wait_ready()

    def pixels(self, **members):
        reply = self.daemon.render(self.scene_id, format="png", **members)
        self.assertEqual(200, reply.status, reply.body)
        return pixels_of(reply.body)

    def setUp(self):
        super().setUp()
        self.scene_id = self.daemon.push(support.triangle())

    def test_tiles_together_are_the_picture(self):
        looks = ({}, {"quality": {"shadows": "raytraced"}}, {"output": "normal"},
                 {"camera": {"fit": "iso"}, "exposure_ev": "auto"},
                 {"camera": {"eye": [1, 1, 3], "target": [0.3, 0.3, 0], "ortho_height": 1.5}})
        for look in looks:
            _, _, whole = self.pixels(**SIZE, **look)
            found = [bytearray() for _ in range(SIZE["height"])]
            for x, y, width, height in TILES:
                made = self.pixels(**SIZE, **look, tile={"x": x, "y": y, "width": width,
                                                         "height": height})
                self.assertEqual((width, height), made[:2])
                for row, content in enumerate(made[2]):
                    found[y + row] += content
            self.assertEqual([bytes(row) for row in whole], [bytes(row) for row in found], look)

    def test_a_tile_of_a_picture_that_no_single_render_makes(self):
        huge = {"width": 60000, "height": 40000, "quality": {"shadows": "raytraced", "samples": 1}}
        for tile in ({"x": 30000, "y": 20000, "width": 16, "height": 8},
                     {"x": 59990, "y": 39996, "width": 10, "height": 4}):
            self.assertEqual((tile["width"], tile["height"]), self.pixels(**huge, tile=tile)[:2])
        refused = self.daemon.render(self.scene_id, **huge)
        self.assertEqual((400, "/width"), (refused.status, refused.json()["pointer"]))
        self.assertIn("by tile", refused.json()["detail"])

    def test_a_job_joins_tiles_to_the_picture(self):
        size = {"width": 600, "height": 300}
        for look in ({"quality": {"shadows": "deep"}, "edges": {"width_px": 3}},
                     {"quality": {"shadows": "raytraced"}}):
            job = self.daemon.request("POST", "/v1/jobs", {
                "scene": self.scene_id, "view": {**size, **look}, "tiles": 256}).json()["id"]
            found = self.daemon.request("GET", f"/v1/jobs/{job}",
                                        headers={"Prefer": "wait=60"}).json()
            self.assertEqual(("done", 8), (found["state"], found["tiles"]["count"]))
            made = self.daemon.request("GET", f"/v1/jobs/{job}/frames/1/color").body
            self.assertEqual(self.pixels(**size, **look), pixels_of(made), look)

    def test_the_report_has_the_size_of_the_image(self):
        reply = self.daemon.render(self.scene_id, **SIZE, tile={"width": 7, "height": 5})
        link = reply.header("Link").split(">")[0].lstrip("<")
        report = self.daemon.request("GET", link).json()
        self.assertEqual((7, 5), (report["width"], report["height"]))

    def test_bad_tiles_are_refused_by_member(self):
        def refused(status, pointer, tile, **members):
            reply = self.daemon.render(self.scene_id, **{**SIZE, **members}, tile=tile)
            self.assertEqual((status, pointer), (reply.status, reply.json()["pointer"]))
        refused(400, "/tile/x", {"x": 90, "width": 1, "height": 1})
        refused(400, "/tile/width", {"x": 1, "width": 90, "height": 1})
        refused(400, "/tile/height", {"width": 90})
        view = self.daemon.request("POST", "/v1/views", {"scene": self.scene_id, "tile": {}})
        self.assertEqual((400, "/tile"), (view.status, view.json()["pointer"]))

    def test_the_command_line_takes_a_tile(self):
        whole, part = self.path("whole.png"), self.path("part.png")
        self.run_cli(self.scene, "-o", whole, "--size", "90x60", "-q")
        self.run_cli(self.scene, "-o", part, "--size", "90x60", "--tile", "40,10,30x20", "-q")
        with open(whole, "rb") as one, open(part, "rb") as other:
            rows, cut = pixels_of(one.read())[2], pixels_of(other.read())[2]
        self.assertEqual([bytes(row[4 * 40:4 * 70]) for row in rows[10:30]],
                         [bytes(row) for row in cut])
        self.assertIn("X,Y,WIDTHxHEIGHT", self.run_cli(
            self.scene, "-o", part, "--tile", "1,2,3", code=2))


if __name__ == "__main__":
    support.run_tests()
