# SPDX-License-Identifier: MIT
"""How long jobs and their results are kept: by age, by bytes, and whatever the clock shows."""
import os
import sqlite3

import support
from test_jobs import JobTest, body_of, moving

support.needs(support.FAKE)

DAY_MS = 86400000


def let_time_pass(state, days):
    """Between two servers: as if the first one had run so much longer."""
    with sqlite3.connect(os.path.join(state, "jobs", "jobs.db")) as connection:
        connection.execute("UPDATE clock SET ran_ms = ran_ms + ?", (int(days * DAY_MS),))
    connection.close()


class Retention(JobTest):
    def setUp(self):
        folder = support.tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.state = os.path.join(folder.name, "state")
        self.allowed = os.path.join(folder.name, "allowed")
        os.mkdir(self.allowed)

    def run_daemon(self, *flags):
        return support.Daemon("--job-dir", self.allowed, *flags, state_dir=self.state)

    def make(self, daemon, scene, frames="1-2", **members):
        job = daemon.request("POST", "/v1/jobs", body_of(scene, frames, **members)).json()["id"]
        if not members.get("paused") and "after" not in members:
            self.wait(job, daemon=daemon)
        return job

    def kept(self, daemon):
        return [job["id"] for job in reversed(daemon.request("GET", "/v1/jobs").json()["jobs"])]

    def test_jobs_go_by_the_days_that_the_server_ran_since_they_ended(self):
        days = ("--job-retention-days", "10")
        with self.run_daemon(*days) as daemon:
            scene = daemon.push(moving())
            old = self.make(daemon, scene)
            elsewhere = self.make(daemon, scene, directory="shot")
            awaited = self.make(daemon, scene)
            waiting = self.make(daemon, scene, after=[awaited], paused=True)
            open_job = self.make(daemon, scene, paused=True)
            found = daemon.request("GET", f"/v1/jobs/{old}").json()
            self.assertGreater(found["expires"], found["ended"])
            for job in (elsewhere, awaited, waiting, open_job):
                self.assertIsNone(daemon.request("GET", f"/v1/jobs/{job}").json()["expires"])
            self.assertEqual(0, daemon.stop())
        let_time_pass(self.state, 9.5)
        with self.run_daemon(*days) as daemon:
            self.assertEqual(5, len(self.kept(daemon)))
            young = self.make(daemon, scene)
            self.assertEqual(0, daemon.stop())
        let_time_pass(self.state, 1)
        with self.run_daemon(*days) as daemon:
            support.wait_until(lambda: old not in self.kept(daemon), "the old one is forgotten")
            self.assertEqual([elsewhere, awaited, waiting, open_job, young], self.kept(daemon))
            self.assertFalse(os.path.exists(os.path.join(self.state, "jobs", old)))
            self.assertEqual(2, len(os.listdir(os.path.join(self.allowed, "shot"))))
            self.assertIn('vitrail_jobs_forgotten_total{reason="age"} 1\n',
                          daemon.request("GET", "/metrics").body.decode())
            daemon.request("PATCH", f"/v1/jobs/{waiting}", {"paused": False})
            self.wait(waiting, daemon=daemon)
            support.wait_until(lambda: awaited not in self.kept(daemon), "nothing waits for it")

    def test_results_that_take_too_much_room_go_in_the_order_of_their_ends(self):
        with self.run_daemon("--job-results-bytes", "1M") as daemon:
            scene = daemon.push(moving())
            view = {"width": 256, "height": 256}
            outputs = [{"outputs": ["depth"], "format": "exr"}]
            first = self.make(daemon, scene, view=view, outputs=outputs)
            size = daemon.request("GET", "/v1/stats").json()["jobs"]["kept_bytes"] // 2
            second = self.make(daemon, scene, "1", paused=True)
            self.make(daemon, scene, "1-2", view=view, outputs=outputs)
            daemon.request("PATCH", f"/v1/jobs/{second}", {"paused": False})
            self.wait(second, daemon=daemon)
            room = (1 << 20) // size
            self.assertGreater(room, 4)
            large = self.make(daemon, scene, f"1-{room - 2}", view=view, outputs=outputs)
            self.assertNotIn(first, self.kept(daemon), "it ended first")
            self.assertIn(second, self.kept(daemon), "submitted before the third, it ended later")
            self.assertIn(large, self.kept(daemon))
            larger = daemon.request("POST", "/v1/jobs", body_of(
                scene, f"1-{room + 5}", view=view, outputs=outputs)).json()["id"]
            path = f"/v1/jobs/{larger}"
            support.wait_until(lambda: daemon.request("GET", path).json()["paused"], "it pauses")
            found = daemon.request("GET", path).json()
            self.assertIn("--job-results-bytes", found["problem"]["detail"])
            self.assertEqual(0, found["frames"]["failed"])
            self.assertEqual([larger], self.kept(daemon), "all that could go went")
            stats = daemon.request("GET", "/v1/stats").json()["jobs"]
            self.assertLessEqual(stats["kept_bytes"], 1 << 20)
            self.assertEqual(4, stats["forgotten"])
            for frame in daemon.request("GET", path + "/frames").json()["frames"]:
                for file in frame["files"]:
                    self.assertEqual(200, daemon.request("GET", file["href"]).status)
            self.assertEqual(0, daemon.stop())
        with self.run_daemon("--job-results-bytes", "4M") as daemon:
            daemon.request("PATCH", path, {"paused": False})
            self.wait(larger, daemon=daemon)
            self.assertEqual(0, daemon.stop())
        with self.run_daemon("--job-results-bytes", "1M") as daemon:
            support.wait_until(lambda: not self.kept(daemon), "a smaller limit holds at once")

    def test_a_database_of_version_2_is_brought_up_to_date_and_forgets_nothing_at_once(self):
        with self.run_daemon() as daemon:
            scene = daemon.push(moving())
            job = self.make(daemon, scene)
            self.assertEqual(0, daemon.stop())
        connection = sqlite3.connect(os.path.join(self.state, "jobs", "jobs.db"))
        connection.executescript("ALTER TABLE job DROP COLUMN ended_ms; DROP TABLE clock;"
                                 "UPDATE job SET ended_s = 5; PRAGMA user_version=2;")
        connection.close()
        with self.run_daemon("--job-retention-days", "1") as daemon:
            self.assertIn("of version 3", daemon.log())
            self.assertEqual([job], self.kept(daemon))
            self.assertIsNotNone(daemon.request("GET", f"/v1/jobs/{job}").json()["expires"])
            self.assertEqual(0, daemon.stop())
        let_time_pass(self.state, 1)
        with self.run_daemon("--job-retention-days", "1") as daemon:
            support.wait_until(lambda: not self.kept(daemon), "it goes a day after that")


if __name__ == "__main__":
    support.run_tests()
