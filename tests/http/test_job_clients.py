# SPDX-License-Identifier: MIT
"""`vitrail job` and the Python client's jobs, against a daemon on the test double."""
import json
import os
import sys

import support
from cli_service import CliServiceTest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                "../../clients/python"))
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now


class JobClients(CliServiceTest):
    command = ("job",)

    def submit(self, *arguments, code=0):
        return self.run_cli("submit", self.scene, "--size", "32x16", *arguments, code=code)

    def test_a_job_is_submitted_watched_and_fetched(self):
        job = self.submit("--frames", "1-3", "--name", "Shot", "--turntable", "--file",
                          "turn.%d.jpg", "--file", "data.%03d.exr=depth,normal",
                          "--priority", "70").strip()
        self.run_cli("watch", job)
        shown = json.loads(self.run_cli("show", job, "--json"))
        self.assertEqual(["done", 70, "Shot"],
                         [shown["state"], shown["priority"], shown["name"]])
        self.assertEqual(["turn", "data"], [output["name"] for output in shown["outputs"]])
        folder = self.path("out")
        self.assertEqual("6 files fetched, 0 were there\n",
                         self.run_cli("fetch", job, "-o", folder))
        names = sorted(f"turn.{n}.jpg" for n in (1, 2, 3)) + [f"data.00{n}.exr" for n in (1, 2, 3)]
        self.assertEqual(sorted(names), sorted(os.listdir(folder)))
        with open(os.path.join(folder, "turn.2.jpg"), "ab") as file:
            file.write(b"damaged")
        self.assertEqual("1 files fetched, 5 were there\n",
                         self.run_cli("fetch", job, "-o", folder))
        self.assertIn("Shot", self.run_cli("list"))
        self.run_cli("forget", job)
        self.assertNotIn(job, self.run_cli("list"))

    def test_tiles_are_submitted_and_fetched(self):
        job = self.submit("--size", "600x300", "--tiles", "256x512").strip()
        self.run_cli("watch", job)
        shown = json.loads(self.run_cli("show", job, "--json"))
        self.assertEqual([4, 1, 4], [shown["tiles"][key] for key in ("columns", "rows", "done")])
        self.assertEqual("1 files fetched, 0 were there\n",
                         self.run_cli("fetch", job, "-o", self.path("tiled")))
        self.assertIn("is not N or", self.submit("--tiles", "2048x", code=2))

    def test_keys_pauses_and_ends(self):
        first = self.submit("--key", "k", "--paused", "--frames", "1-9").strip()
        self.assertEqual(first, self.submit("--key", "k", "--paused", "--frames", "1-9").strip())
        self.assertIn("422", self.submit("--key", "k", "--json", code=1))
        self.assertIn("paused", self.run_cli("list"))
        self.assertIn("40", self.run_cli("priority", first, "--priority", "40", "--json"))
        self.run_cli("resume", first)
        self.run_cli("watch", first)
        other = self.submit("--paused").strip()
        self.assertIn("cancelled", self.run_cli("cancel", other))
        self.assertIn("was cancelled", self.run_cli("watch", other, code=1))
        self.assertIn("no failed frames", self.run_cli("retry", first, code=1))

    def test_a_job_comes_after_another(self):
        first = self.submit("--paused").strip()
        after = self.submit("--after", first, "--after-failure", "wait").strip()
        row = next(row for row in self.run_cli("list").splitlines() if row.startswith(after))
        self.assertIn("waiting", row)
        self.assertIn(f"after {first}", row)
        self.run_cli("cancel", first)
        self.assertIn("has not begun: waits, since", self.run_cli("watch", after, code=75))
        other = self.submit("--after", first, "--watch", code=1)
        self.assertIn("was cancelled: cancelled, since job", other)
        self.run_cli("cancel", after)
        self.assertIn("not a job id", self.submit("--after", "shot", code=2))
        self.assertIn("--after JOB", self.submit("--after-failure", "run", code=2))
        with vitrail.Client(self.url) as client:
            scene = client.post_scene(self.scene)["id"]
            view = {"width": 32, "height": 16}
            first = client.create_job(scene, view=view, paused=True)
            last = client.create_job(scene, view=view, after=[first])
            self.assertEqual(["waiting", [first.id]], [last.state, last.waits_for])
            self.assertFalse(last.has_ended)
            first.resume()
            self.assertEqual("done", last.wait().state)

    def test_calls_that_are_wrong_are_refused_before_the_server(self):
        self.assertIn("none of submit", self.run_cli("sumbit", code=2))
        self.assertIn("not a job id", self.run_cli("show", "xyz", code=2))
        self.assertIn("-o FOLDER", self.run_cli("fetch", "0" * 16, code=2))
        self.assertIn("there is no job", self.run_cli("show", "0" * 16, code=1))
        self.assertIn("--priority", self.run_cli("priority", "0" * 16, code=2))
        self.assertIn("/frames", self.submit("--frames", "9-1", "--json", code=1))

    def test_python(self):
        with vitrail.Client(self.url) as client:
            scene = client.post_scene(self.scene)["id"]
            job = client.create_job(scene, key="py", frames="1-3", paused=True,
                                    view={"width": 32, "height": 16})
            self.assertEqual(job.id, client.create_job(scene, key="py", frames="1-3", paused=True,
                                                       view={"width": 32, "height": 16}).id)
            self.assertFalse(job.has_ended)
            self.assertEqual("done", job.set_priority(60).resume().wait().state)
            self.assertEqual([1, 2, 3], [frame["frame"] for frame in job.frames()])
            paths = job.fetch(self.path("py"))
            self.assertEqual(3, len(paths))
            with open(paths[1], "rb") as file:
                self.assertEqual(job.file(2), file.read())
            self.assertIn(job.id, [found.id for found in client.jobs()])
            with self.assertRaises(vitrail.VitrailError) as raised:
                job.retry_failed()
            self.assertEqual("conflict", raised.exception.code)
            job.forget()
            with self.assertRaises(vitrail.VitrailError):
                client.job(job.id)


class DeletingScenes(CliServiceTest):
    command = ("delete",)

    def test_a_scene_that_a_job_needs_is_deleted_by_force_only(self):
        with vitrail.Client(self.url) as client:
            scene = client.post_demo(name="needed")["id"]
            job = client.create_job(scene, view={"width": 32, "height": 16}, paused=True)
            with self.assertRaises(vitrail.VitrailError) as raised:
                client.delete_scene(scene)
            self.assertEqual("conflict", raised.exception.code)
            self.assertIn(job.id, self.run_cli(scene, code=1))
            self.run_cli(scene, "--force")
            job.cancel()
            client.post_demo()
            job = client.create_job(scene, view={"width": 32, "height": 16}, paused=True)
            client.delete_scene(scene, force=True)
            job.cancel()


if __name__ == "__main__":
    support.run_tests()
