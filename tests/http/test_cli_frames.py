# SPDX-License-Identifier: MIT
"""`vitrail render --frames`, as a farm calls it: shares of a list, and frames that are there."""
import json
import os
import subprocess

import support
from cli_service import VITRAIL, CliServiceTest
from test_jobs import body_of, moving


class CliFrames(CliServiceTest):
    command = ("render",)
    make_scene = staticmethod(moving)

    def run_cli(self, *arguments, pattern="f.%03d.png", **options):
        os.makedirs(self.path("out"), exist_ok=True)
        return super().run_cli(self.scene, "-o", os.path.join(self.path("out"), pattern), "--size",
                               "32x16", "--camera", "fit:front", "--frame-rate", "1", *arguments,
                               **options)

    def files(self):
        folder = os.path.join(self.folder, "out")
        return sorted(os.listdir(folder))

    def content(self, name):
        with open(os.path.join(self.folder, "out", name), "rb") as file:
            return file.read()

    def test_frames_are_those_of_a_job_and_the_scene_is_sent_once(self):
        printed = self.run_cli("--frames", "1-3,7").splitlines()
        self.assertEqual([f"f.00{n}.png" for n in (1, 2, 3, 7)], self.files())
        self.assertEqual(4, len(printed))
        self.assertEqual(1, len({line.split("scene ")[1].split(" ")[0] for line in printed}))
        scene = printed[0].split("scene ")[1].split(" ")[0]
        view = {"width": 32, "height": 16, "camera": {"fit": "front"}, "exposure_ev": "auto"}
        job = self.daemon.request("POST", "/v1/jobs", {**body_of(scene, "1-3,7"), "view": view})
        path = f"/v1/jobs/{job.json()['id']}"
        support.wait_until(
            lambda: self.daemon.request("GET", path).json()["state"] == "done", "it is done")
        for frame in (1, 7):
            self.assertEqual(self.content(f"f.00{frame}.png"),
                             self.daemon.request("GET", f"{path}/frames/{frame}/color").body)
        self.run_cli("--frames", "1,7", "--still", pattern="still.%d.png")
        self.assertEqual(self.content("still.1.png"), self.content("still.7.png"))

    def test_chunks_are_the_whole_list_together_and_nothing_twice(self):
        seen = []
        for chunk in range(4):
            before = set(self.files()) if os.path.exists(self.folder + "/out") else set()
            self.run_cli("--frames", "10-19", "--chunks", "4", "--chunk", str(chunk))
            seen.append(len(set(self.files()) - before))
        self.assertEqual([2, 3, 2, 3], seen)
        for variables, name in (({"SLURM_ARRAY_TASK_ID": "7", "SLURM_ARRAY_TASK_MIN": "5",
                                  "SLURM_ARRAY_TASK_STEP": "2"}, "s.%d.png"),
                                ({"JOB_COMPLETION_INDEX": "1"}, "s.%d.png")):
            self.run_cli("--frames", "1-4", "--chunks", "2", environment=variables, pattern=name)
            self.assertEqual(["s.3.png", "s.4.png"],
                             [file for file in self.files() if file.startswith("s.")])

    def test_frames_that_are_there_are_left_out_if_they_are_whole_and_the_same(self):
        self.run_cli("--frames", "1-4", "--skip-existing")
        first = {name: self.content(name) for name in self.files()}
        self.assertEqual(8, len(first))
        note = json.loads(first["f.002.png.json"])
        self.assertEqual(support.sha256(first["f.002.png"]), note["sha256"])
        frames = self.daemon.stats()["renders"]["rendered"]
        printed = self.run_cli("--frames", "1-4", "--skip-existing")
        self.assertEqual(4, printed.count("is there"))
        self.assertEqual(frames, self.daemon.stats()["renders"]["rendered"])
        with open(os.path.join(self.folder, "out", "f.003.png"), "r+b") as file:
            file.truncate(20)
        os.unlink(os.path.join(self.folder, "out", "f.001.png.json"))
        printed = self.run_cli("--frames", "1-4", "--skip-existing")
        self.assertEqual(2, printed.count("is there"))
        self.assertEqual(first["f.003.png"], self.content("f.003.png"))
        printed = self.run_cli("--frames", "1-4", "--skip-existing", "--exposure", "1")
        self.assertEqual(0, printed.count("is there"))

    def test_a_frame_that_fails_ends_the_call_and_leaves_no_part_of_it(self):
        with open(self.scene, "wb") as file:
            file.write(moving("fake:crash-at=3"))
        self.assertIn("ended its worker", self.run_cli("--frames", "1-5", code=75))
        self.assertEqual(["f.001.png", "f.002.png"], self.files())

    def test_farms_see_each_frame(self):
        self.run_cli("--frames", "5,6", progress="afanasy")
        lines = self.stderr.splitlines()
        self.assertEqual(["FRAME: 5", "FRAME: 6"], [line for line in lines if "FRAME" in line])
        self.assertGreaterEqual(lines.count("PROGRESS: 100%"), 2)

    def test_calls_that_are_wrong(self):
        self.assertIn("%d", self.run_cli("--frames", "1-2", pattern="f.png", code=2))
        self.assertIn("frames", self.run_cli(code=2))  # --frame-rate alone
        self.assertIn("twice", self.run_cli("--frames", "1,1", code=2))
        self.assertIn("--chunks", self.run_cli("--frames", "1", "--chunk", "0", code=2))
        self.assertIn("from 0 to 1",
                      self.run_cli("--frames", "1", "--chunks", "2", "--chunk", "2", code=2))
        self.assertIn("SLURM_ARRAY_TASK_ID", self.run_cli("--frames", "1", "--chunks", "2", code=2))
        def farm(*arguments):
            done = subprocess.run([VITRAIL, "farm", *arguments], capture_output=True, text=True,
                                  timeout=60, check=False, env={**os.environ, "PATH": "/none"})
            return done.returncode, done.stderr
        whole = ("submit", self.scene, "-o", "f.%d.png", "--frames", "1-3")
        for arguments, code, words in (
                (("sumbit", *whole[1:], "--slurm"), 2, "submit"), (whole, 2, "which engine"),
                ((*whole[:4], "--slurm"), 2, "--frames"),
                ((*whole, "--slurm", "--chunk", "1"), 2, "--chunk"),
                ((*whole, "--slurm", "--chunks", "0"), 2, "--chunks"),
                (("submit", "/none.glb", *whole[2:], "--slurm"), 66, "/none.glb"),
                ((*whole, "--slurm"), 75, "did not take")):
            found = farm(*arguments)
            self.assertEqual(code, found[0], (arguments, found))
            self.assertIn(words, found[1])
        self.assertIn("--stats", self.run_cli("--frames", "1", "--stats", "x.json", code=2))


if __name__ == "__main__":
    support.run_tests()
