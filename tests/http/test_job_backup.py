# SPDX-License-Identifier: MIT
"""vitraild --backup: a copy of the jobs beside a running daemon, from which another goes on."""
import os
import shutil
import sqlite3
import subprocess

import support
from test_jobs import JobTest, body_of, moving

support.needs(support.FAKE)


class Backup(JobTest):
    def setUp(self):
        folder = support.tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.state, self.file = self.path("state"), self.path("jobs.bak")

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def back_up(self, code=0, state=None, file=None):
        done = subprocess.run(
            [support.FAKE, "--state-dir", state or self.state, "--backup", file or self.file],
            capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(code, done.returncode, done.stderr)
        return done.stdout if code == 0 else done.stderr

    def assert_sound(self, file, jobs):
        with sqlite3.connect(f"file:{file}?mode=ro", uri=True) as connection:
            self.assertEqual([("ok",)], connection.execute("PRAGMA integrity_check").fetchall())
            self.assertEqual([(jobs,)], connection.execute("SELECT count(*) FROM job").fetchall())
        connection.close()

    def shas(self, daemon, job):
        frames = daemon.request("GET", f"/v1/jobs/{job}/frames?count=1000").json()["frames"]
        return [frame["files"][0]["sha256"] for frame in frames]

    def test_a_daemon_goes_on_from_what_was_copied_with_a_job_in_flight(self):
        with support.Daemon(state_dir=self.state) as daemon:
            scene = daemon.push(moving("fake:slow=10"))
            job = daemon.request("POST", "/v1/jobs", body_of(scene, "1-60")).json()["id"]
            path = f"/v1/jobs/{job}"
            for done in (3, 10, 20):
                support.wait_until(
                    lambda done=done: daemon.request("GET", path).json()["frames"]["done"] >= done,
                    "some frames are done")
                self.assertIn(": 1 jobs, ", self.back_up())
                self.assert_sound(self.file, 1)
            self.assertEqual(0o600, os.stat(self.file).st_mode & 0o777)
            self.assertEqual(["jobs.bak"], [name for name in os.listdir(self.folder)
                                            if name.startswith("jobs.bak")], "it is one file")
            saved = self.path("saved")
            # a frame that is being written has a name that is gone a moment later
            shutil.copytree(self.state, saved,
                            ignore=shutil.ignore_patterns("jobs.db*", "lock", "tmp", ".*.tmp"))
            self.wait(job, daemon=daemon)
            expected = self.shas(daemon, job)
        shutil.copy(self.file, os.path.join(saved, "jobs", "jobs.db"))
        with support.Daemon(state_dir=saved) as daemon:
            before = daemon.request("GET", path).json()["frames"]["done"]
            self.assertGreaterEqual(before, 20)
            self.wait(job, daemon=daemon)
            self.assertEqual(expected, self.shas(daemon, job))
            with open(os.path.join(saved, "jobs", job, "color.0060.png"), "rb") as file:
                self.assertEqual(expected[-1], support.sha256(file.read()))

    def test_it_needs_no_daemon_and_takes_what_is_in_the_log(self):
        with support.Daemon(state_dir=self.state) as daemon:
            scene = daemon.push(moving())
            for _ in range(3):
                daemon.request("POST", "/v1/jobs", body_of(scene, paused=True))
            daemon.stop(support.signal.SIGKILL)
        self.assertGreater(os.path.getsize(os.path.join(self.state, "jobs", "jobs.db-wal")), 0)
        self.back_up()
        self.assert_sound(self.file, 3)
        with support.Daemon(state_dir=self.state) as daemon:
            self.assertEqual(3, len(daemon.request("GET", "/v1/jobs").json()["jobs"]))

    def test_a_backup_that_fails_says_why_and_leaves_the_file_as_it_was(self):
        self.assertIn("there is no database of jobs", self.back_up(1))
        with support.Daemon(state_dir=self.state) as daemon:
            daemon.push(moving())
            self.assertIn("No such file", self.back_up(1, file=self.path("no", "where.db")))
            database = os.path.join(self.state, "jobs", "jobs.db")
            self.assertIn("itself", self.back_up(1, file=database))
            self.back_up()
        with open(self.file, "rb") as file:
            good = file.read()
        with open(database, "wb") as file:
            file.write(b"no database at all" * 1000)
        self.assertIn("not a database", self.back_up(1))
        with open(self.file, "rb") as file:
            self.assertEqual(good, file.read())
        self.assertFalse(os.path.exists(self.file + ".part"))
        for arguments in (["--backup"], ["--backup="]):
            done = subprocess.run([support.FAKE, *arguments], capture_output=True, text=True,
                                  check=False)
            self.assertEqual(2, done.returncode, done.stderr)


if __name__ == "__main__":
    support.run_tests()
