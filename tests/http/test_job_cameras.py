# SPDX-License-Identifier: MIT
"""Cameras that move over the frames of a job, drawn by the real renderer: paths through keys, and
cameras of files that are animated there."""
import json
import os
import struct

import support
from cli_service import CliServiceTest
from test_jobs import PLACES, TIMES, JobTest
from test_service_renders import read_png

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)

SIZE = {"width": 48, "height": 32}
KEYS = [{"frame": 1, "eye": [0.3, 0.3, 3], "target": [0.3, 0.3, 0]},
        {"frame": 3, "eye": [2, 1, 2], "target": [0.3, 0.3, 0], "fov_y_deg": 30},
        {"frame": 4, "eye": [2, 0.5, -1], "target": [0.5, 0.3, 0], "up": [0.2, 1, 0]}]


def filmed():
    """A triangle that stands still, and a camera that moves by a millimetre a second."""
    document = support.triangle_document()
    document["nodes"] += [{"name": "Rig", "translation": [0, 0, 3], "children": [2]},
                          {"name": "Camera", "camera": 0}]
    document["scenes"][0]["nodes"].append(1)
    document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.01}}]
    binary = support.TRIANGLE + TIMES + PLACES
    start = len(support.TRIANGLE)
    document["buffers"][0]["byteLength"] = len(binary)
    document["bufferViews"] += [{"buffer": 0, "byteOffset": start, "byteLength": 8},
                                {"buffer": 0, "byteOffset": start + 8, "byteLength": 24}]
    document["accessors"] += [
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR",
         "min": [0], "max": [1000]},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}]
    document["animations"] = [{
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
        "samplers": [{"input": 1, "output": 2}]}]
    return support.glb(document, binary)


class JobCameras(JobTest, CliServiceTest):
    command = ()

    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL)
        cls.daemon.wait_ready()

    def pictures(self, scene, frames, **members):
        job = self.submit(scene, frames, view=SIZE, **members)
        self.wait(job)
        return {frame["frame"]: self.daemon.request("GET", frame["files"][0]["href"]).body
                for frame in self.frames(job)}

    def single(self, scene, **members):
        reply = self.daemon.render(scene, format="png", **{**SIZE, **members})
        self.assertEqual(200, reply.status, reply.body)
        return reply.body

    def test_frames_of_a_path_have_the_bits_of_renders_with_its_cameras(self):
        scene = self.daemon.push(support.triangle())
        for interpolation in ("smooth", "linear"):
            found = self.pictures(scene, "0-5", camera_path={"keys": KEYS,
                                                             "interpolation": interpolation})
            self.assertEqual(4, len(set(found.values())), "frames 0 and 1, 4 and 5 are alike")
            for key in KEYS:
                camera = {"fov_y_deg": 45, **key}
                del camera["frame"]
                self.assertEqual(self.single(scene, camera=camera), found[key["frame"]], key)
            self.assertEqual([found[1], found[4]], [found[0], found[5]])
        between = {"eye": [1.15, 0.65, 2.5], "target": [0.3, 0.3, 0], "fov_y_deg": 37.5}
        found = self.pictures(scene, "2", provenance=False,
                              camera_path={"keys": KEYS, "interpolation": "linear"})
        self.assertEqual(self.single(scene, camera=between, provenance=False), found[2],
                         "half of the straight way")

    def test_a_closed_path_comes_round(self):
        scene = self.daemon.push(support.triangle())
        found = self.pictures(scene, "1,4,6,9", camera_path={"keys": KEYS, "closed": {"frame": 6}})
        self.assertEqual([found[1], found[4]], [found[6], found[9]])
        self.assertNotEqual(found[1], found[4])

    def test_a_camera_of_the_file_moves_as_it_is_animated_there(self):
        scene = self.daemon.push(filmed())
        job = self.submit(scene, "0,200,400", view={**SIZE, "camera": {"node": "Camera"}})
        self.wait(job)
        found = [self.daemon.request("GET", frame["files"][0]["href"]).body
                 for frame in self.frames(job)]
        self.assertEqual(3, len(set(found)), "the camera moves")
        self.assertEqual(self.single(scene, camera={"node": "Camera"},
                                     animation={"time_s": 200}), found[1])
        eye = [0.2, 0, 3]
        placed = self.single(scene, camera={"eye": eye, "target": [0.2, 0, 0],
                                            "fov_y_deg": 0.8 * 180 / 3.141592653589793})
        off = [abs(a - b) for one, other in zip(read_png(placed)[4], read_png(found[1])[4])
               for a, b in zip(one, other)]
        self.assertLess(sum(off) / len(off), 0.5, "it stands where the animation has it")
        found = self.wait(self.submit(scene, "0-1", view={**SIZE, "camera": {"node": "Nobody"}}),
                          "failed")
        self.assertEqual([(0, 1), (1, 1)], [(one["frame"], one["attempts"])
                                            for one in found["failures"]], "trying again is no use")
        self.assertIn("'Nobody'", found["failures"][0]["problem"]["detail"])

    def test_the_command_line_takes_a_path_for_jobs_and_for_frames(self):
        path = self.path("keys.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"keys": KEYS}, file)
        job = self.run_cli("job", "submit", self.scene, "--size", "48x32", "--frames", "1-4",
                           "--camera-path", path).strip()
        self.run_cli("job", "watch", job)
        self.run_cli("render", self.scene, "-o", self.path("f.%d.png"), "--size", "48x32",
                     "--frames", "1-4", "--camera-path", path, "-q")
        for frame in range(1, 5):
            with open(self.path(f"f.{frame}.png"), "rb") as file:
                self.assertEqual(self.daemon.request(
                    "GET", f"/v1/jobs/{job}/frames/{frame}/color").body, file.read())
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"keys": KEYS[:1]}, file)
        self.assertIn("/keys is an array of 1, must hold at least 2 keys", self.run_cli(
            "render", self.scene, "-o", self.path("f.%d.png"), "--frames", "1", "--camera-path",
            path, code=2))
        self.assertIn("go with --frames", self.run_cli(
            "render", self.scene, "-o", self.path("f.png"), "--camera-path", path, code=2))
        self.assertIn("/camera_path/keys", self.run_cli(
            "job", "submit", self.scene, "--camera-path", path, code=1))

    def test_bad_paths_are_refused_by_place(self):
        scene = self.daemon.push(support.triangle())
        def refused(pointer, words, path, **members):
            reply = self.daemon.request("POST", "/v1/jobs", {
                "scene": scene, "frames": "1-9", "camera_path": path, **members})
            self.assertIn(reply.status, (400, 413), reply.body)
            self.assertEqual("/camera_path" + pointer, reply.json()["pointer"])
            self.assertIn(words, reply.json()["detail"])
        refused("/keys", "", {})
        refused("/keys", "at least 2", {"keys": KEYS[:1]})
        refused("/keys", "10000", {"keys": KEYS * 4000})
        refused("/keys/1/frame", "after that of key 0", {"keys": KEYS[::-1]})
        refused("/keys/1/target", "too near", {"keys": [
            KEYS[0], {"frame": 7, "eye": [1, 2, 3], "target": [1, 2, 3]}]})
        refused("/keys/1/eye/0", "", {"keys": [
            KEYS[0], {"frame": 7, "eye": ["NaN", 2, 3], "target": [1, 2, 3]}]})
        refused("", "at frame 5 the camera's eye meets its target", {"keys": [
            {"frame": 1, "eye": [0, 0, 4], "target": [0, 0, 0]},
            {"frame": 9, "eye": [0, 0, -4], "target": [0, 0, 0]}]})
        refused("", "turntable", {"keys": KEYS}, turntable={})


if __name__ == "__main__":
    support.run_tests()
