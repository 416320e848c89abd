# SPDX-License-Identifier: MIT
"""Jobs whose pictures are rendered in tiles: what is joined is the picture, whatever happens."""
import os
import random
import signal

import support
from test_jobs import JobTest, body_of, moving
from test_service_renders import read_png

support.needs(support.FAKE)

SIZE = {"width": 700, "height": 530}  # four columns and four rows of at most 256
TILES = 16


def tiles_of(folder):
    return [name for name in os.listdir(folder) if name.startswith(".tile-")]


class JobTiles(JobTest):
    def tiled(self, scene, frames="1", size=None, tiles=256, **members):
        return self.submit(scene, frames, view=size or SIZE, tiles=tiles, **members)

    def file(self, job, output="color", frame=1):
        return self.daemon.request("GET", f"/v1/jobs/{job}/frames/{frame}/{output}").body

    def test_a_picture_of_tiles_is_the_picture_in_one_piece(self):
        scene = self.daemon.push(moving())
        job = self.tiled(scene, "1-2", outputs=[
            "color", {"name": "still", "format": "jpeg", "quality_percent": 70},
            {"name": "web", "format": "webp", "quality_percent": 80},
            {"name": "ids", "outputs": ["node"], "format": "png"},
            {"name": "data", "outputs": ["color", "depth", "normal"], "format": "exr"}])
        found = self.wait(job)
        self.assertEqual({"columns": 4, "rows": 4, "count": 2 * 5 * TILES, "done": 2 * 5 * TILES},
                         found["tiles"])
        time = {"animation": {"time_s": 2}, **SIZE}
        single = self.daemon.render(scene, format="png", **time)
        self.assertEqual(read_png(single.body), read_png(self.file(job, frame=2)))
        ids = self.daemon.render(scene, format="png", output="node", **time)
        self.assertEqual(read_png(ids.body), read_png(self.file(job, "ids", 2)))
        for whole, name in ((single, "color"), (ids, "ids")):
            self.assertEqual(support.provenance(whole.body),
                             support.provenance(self.file(job, name, 2)))
        for name, members in (("still", {"format": "jpeg", "quality_percent": 70}),
                              ("web", {"format": "webp", "quality_percent": 80}),
                              ("data", {"format": "exr",
                                        "outputs": ["color", "depth", "normal"]})):
            single = self.daemon.render(scene, **members, **time)
            self.assertEqual(single.body, self.file(job, name, 2), name)
        for frame in self.frames(job):
            for file in frame["files"]:
                self.assertEqual(file["sha256"], support.sha256(
                    self.daemon.request("GET", file["href"]).body))
        folder = os.path.join(self.daemon.state_dir, "jobs", job)
        self.assertEqual(10, len(os.listdir(folder)), "no tile and no draft is left")

    def test_a_job_without_provenance_joins_none(self):
        outputs = [{"name": format, "format": format} for format in ("png", "jpeg", "webp", "exr")]
        job = self.tiled(self.daemon.push(moving()), provenance=False, outputs=outputs)
        self.wait(job)
        for output in outputs:
            self.assertIsNone(support.provenance(self.file(job, output["name"])))

    def test_progress_counts_tiles(self):
        job = self.tiled(self.daemon.push(moving("fake:slow=20")))
        seen = set()
        while (found := self.job(job))["state"] in ("queued", "running"):
            seen.add(found["tiles"]["done"])
            self.assertAlmostEqual(found["tiles"]["done"] / TILES, found["progress"], delta=1e-9)
        self.assertGreater(len(seen - {0, TILES}), 2)
        self.assertEqual((1, TILES), (found["progress"], found["tiles"]["done"]))

    def test_a_picture_may_be_larger_than_any_single_render(self):
        scene = self.daemon.push(moving())
        job = self.tiled(scene, size={"width": 40000, "height": 20}, tiles=4096)
        self.assertEqual(16, self.wait(job)["tiles"]["count"])
        self.assertEqual((40000, 20), read_png(self.file(job))[:2])

    def test_a_tile_that_is_damaged_is_rendered_again(self):
        with support.tempfile.TemporaryDirectory() as state:
            with support.Daemon(state_dir=state) as daemon:
                scene = daemon.push(moving("fake:slow=20"))
                job = daemon.request("POST", "/v1/jobs", body_of(
                    scene, "1", view=SIZE, tiles=256)).json()["id"]
                folder = os.path.join(state, "jobs", job)
                support.wait_until(lambda: len(tiles_of(folder)) > 3, "some tiles")
                daemon.stop(signal.SIGKILL)
            damaged = sorted(tiles_of(folder))[0]
            with open(os.path.join(folder, damaged), "r+b") as file:
                file.truncate(100)
            with support.Daemon(state_dir=state) as daemon:
                self.wait(job, daemon=daemon)
                frames = daemon.request("GET", f"/v1/jobs/{job}/frames").json()["frames"]
                self.assertEqual(2, frames[0]["attempts"], "joining cost one")
                whole = daemon.render(scene, format="png", animation={"time_s": 1}, **SIZE)
                made = daemon.request("GET", f"/v1/jobs/{job}/frames/1/color")
                self.assertEqual(read_png(whole.body), read_png(made.body))

    def test_a_server_that_is_killed_goes_on_with_the_tiles_that_are_there(self):
        chance = random.Random(7)
        with support.tempfile.TemporaryDirectory() as state:
            body = None
            survived, names = 0, []
            for kill in range(5):
                with support.Daemon(state_dir=state) as daemon:
                    if kill == 0:
                        scene = daemon.push(moving("fake:slow=15"))
                        body = body_of(scene, "1-3", view=SIZE, tiles=256)
                        job = daemon.request("POST", "/v1/jobs", body).json()["id"]
                        folder = os.path.join(state, "jobs", job)
                    done = daemon.request("GET", f"/v1/jobs/{job}").json()["tiles"]["done"]
                    self.assertGreaterEqual(done, survived, "what was told is kept")
                    if kill == 4:
                        self.wait(job, daemon=daemon)
                        break
                    aim = min(3 * TILES - 2, done + chance.randrange(4, 14))
                    support.wait_until(lambda: daemon.request(
                        "GET", f"/v1/jobs/{job}").json()["tiles"]["done"] >= aim, "some more")
                    survived = daemon.request("GET", f"/v1/jobs/{job}").json()["tiles"]["done"]
                    daemon.stop(signal.SIGKILL)
            with support.Daemon(state_dir=state) as daemon:
                frames = daemon.request("GET", f"/v1/jobs/{job}/frames").json()["frames"]
                names = sorted(os.listdir(folder))
                again = daemon.request("POST", "/v1/jobs", body).json()["id"]
                self.wait(again, daemon=daemon)
                undisturbed = daemon.request("GET", f"/v1/jobs/{again}/frames").json()["frames"]
            self.assertEqual([frame["files"][0]["sha256"] for frame in undisturbed],
                             [frame["files"][0]["sha256"] for frame in frames])
            self.assertEqual([1, 1, 1], [frame["attempts"] for frame in frames])
            self.assertEqual([f"color.{n:04}.png" for n in (1, 2, 3)], names)

    def test_a_tile_has_attempts_and_a_frame_fails_with_it(self):
        scene = self.daemon.push(moving("fake:crash-at=2"))
        found = self.wait(self.tiled(scene, "1-3", attempts=2), "failed")
        self.assertEqual((2, 1), (found["frames"]["done"], found["frames"]["failed"]))
        self.assertEqual((2, 2), (found["failures"][0]["frame"], found["failures"][0]["attempts"]))

    def test_a_job_that_is_cancelled_leaves_no_tiles(self):
        job = self.tiled(self.daemon.push(moving("fake:slow=30")))
        folder = os.path.join(self.daemon.state_dir, "jobs", job)
        support.wait_until(lambda: len(tiles_of(folder)) > 2, "some tiles")
        self.daemon.request("DELETE", f"/v1/jobs/{job}")
        self.wait(job, "cancelled")
        self.assertEqual([], os.listdir(folder))

    def test_bad_tiles_are_refused_by_member(self):
        scene = self.daemon.push(moving())
        def refused(status, pointer, words, **members):
            reply = self.daemon.request("POST", "/v1/jobs", {
                "scene": scene, "view": SIZE, "tiles": 1024, **members})
            self.assertEqual((status, pointer), (reply.status, reply.json()["pointer"]), reply.body)
            self.assertIn(words, reply.json()["detail"])
        refused(400, "/tiles", "from 256 to 16384", tiles=255)
        refused(400, "/tiles", "from 256 to 16384", tiles=16385)
        refused(400, "/tiles", "side of a tile", tiles="2048")
        refused(400, "/tiles/height", "", tiles={"width": 2048})
        refused(413, "/tiles", "limit is 16384", view={"width": 65536, "height": 65536}, tiles=256)
        refused(400, "/view/width", "65536", view={"width": 65537})
        refused(400, "/view/tile", "", view={"tile": {"width": 1, "height": 1}})
        refused(422, "/outputs/0", "png, jpeg, webp or exr", outputs=[{"format": "exr-deep"}],
                view={"quality": {"shadows": "map"}})
        refused(422, "/outputs/0", "webp holds 16383 pixels a side, the picture has 16384 x 9",
                view={"width": 16384, "height": 9}, outputs=[{"format": "webp"}])
        refused(422, "/outputs/0", "65500 pixels a side", view={"width": 65501, "height": 9},
                outputs=[{"format": "jpeg"}])
        whole = self.daemon.request("POST", "/v1/jobs", {"scene": scene, "view": {"width": 20000}})
        self.assertEqual((400, "/view/width"), (whole.status, whole.json()["pointer"]))


if __name__ == "__main__":
    support.run_tests()
