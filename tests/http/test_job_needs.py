# SPDX-License-Identifier: MIT
"""Scenes and environment maps that jobs need are kept until these have ended."""
import os
import shutil
import threading

import support
from test_jobs import JobTest, body_of, moving
from test_service_environments import hdr

support.needs(support.FAKE)


class Needs(JobTest):
    def delete(self, kind, thing, query=""):
        return self.daemon.request("DELETE", f"/v1/{kind}/{thing}{query}")

    def assert_kept(self, kind, thing, job):
        refused = self.delete(kind, thing)
        self.assertEqual((409, "conflict"), (refused.status, refused.code), refused.body)
        self.assertIn(f"needed by job {job}", refused.json()["detail"])

    def test_scenes_parts_and_maps_are_kept_until_their_jobs_have_ended(self):
        scene, part = self.daemon.push(moving("one")), self.daemon.push(moving("part"))
        image = self.daemon.request("POST", "/v1/environments", hdr(4, 2, lambda x, y: [1, 1, 1]),
                                    {"Content-Type": "application/octet-stream"}).json()["id"]
        view = {"width": 32, "height": 16, "environment": {"image": image},
                "parts": {"here": {"scene": part}}}
        job = self.submit(scene, "1", view=view, paused=True)
        other = self.submit(scene, "1", after=[job])
        for kind, thing in (("scenes", scene), ("scenes", part), ("environments", image)):
            self.assert_kept(kind, thing, job)
        self.assertIn("and 1 more, which have not ended",
                      self.delete("scenes", scene).json()["detail"])
        self.daemon.request("PATCH", f"/v1/jobs/{job}", {"paused": False})
        self.wait(job)
        self.wait(other)
        for kind, thing in (("scenes", scene), ("scenes", part), ("environments", image)):
            self.assertEqual(204, self.delete(kind, thing).status)

    def test_cancelling_lets_a_scene_go_and_force_does_at_once(self):
        for how in ("cancel", "force"):
            scene = self.daemon.push(moving(how))
            job = self.submit(scene, "1", paused=True)
            self.assert_kept("scenes", scene, job)
            if how == "cancel":
                self.daemon.request("DELETE", f"/v1/jobs/{job}")
            query = "?force=true" if how == "force" else ""
            self.assertEqual(204, self.delete("scenes", scene, query).status)

    def test_of_a_job_and_a_removal_at_once_one_is_refused(self):
        for attempt in range(20):
            scene = self.daemon.push(moving(f"at once {attempt}"))
            replies = {}
            def submit(scene=scene, replies=replies):
                replies["job"] = self.daemon.request("POST", "/v1/jobs",
                                                     body_of(scene, "1", paused=True))
            def remove(scene=scene, replies=replies):
                replies["removal"] = self.delete("scenes", scene)
            threads = [threading.Thread(target=act) for act in (submit, remove)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertIn((replies["job"].status, replies["removal"].status),
                          ((202, 409), (404, 204)))


class LostNeeds(JobTest):
    def test_a_job_whose_scene_is_gone_at_the_start_pauses_and_goes_on_with_it(self):
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            with support.Daemon(state_dir=state) as daemon:
                scene = daemon.push(moving())
                job = daemon.request("POST", "/v1/jobs",
                                     body_of(scene, "1-2", paused=True)).json()["id"]
                self.assertEqual(0, daemon.stop())
            shutil.rmtree(os.path.join(state, "scenes", scene))
            with support.Daemon(state_dir=state) as daemon:
                path = f"/v1/jobs/{job}"
                found = daemon.request("GET", path).json()
                self.assertTrue(found["paused"])
                self.assertIn(f"there is no scene '{scene}': bring it again",
                              found["problem"]["detail"])
                self.assertIn("bring it again", daemon.log())
                self.assertEqual(scene, daemon.push(moving()))
                daemon.request("PATCH", path, {"paused": False})
                self.assertIsNone(self.wait(job, daemon=daemon)["problem"])


if __name__ == "__main__":
    support.run_tests()
