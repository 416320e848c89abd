# SPDX-License-Identifier: MIT
"""Events of jobs: what a client that was cut off is told of, whatever happened meanwhile."""
import json
import os
import signal
import sqlite3

import support
from test_jobs import JobTest, body_of, moving

support.needs(support.FAKE)


def events(daemon, job, last=None):
    """Pairs of the kind and the data of each event, until the job has ended; and the last id."""
    headers = {"Last-Event-ID": str(last)} if last is not None else {}
    text = daemon.request("GET", f"/v1/jobs/{job}/events", headers=headers).body.decode()
    found, identity = [], None
    for block in text.strip().split("\n\n"):
        event = dict(line.split(": ", 1) for line in block.split("\n"))
        identity = int(event.get("id", identity or 0))
        found.append((event["event"], json.loads(event["data"])))
    return found, identity


def told(found, state):
    return sorted(data["frame"] for kind, data in found
                  if kind == "frame" and data["state"] == state)


class Events(JobTest):
    def change(self, job, status=200, **members):
        reply = self.daemon.request("PATCH", f"/v1/jobs/{job}", members)
        self.assertEqual(status, reply.status, reply.body)

    def test_a_frame_that_changed_twice_is_told_in_its_newest_state(self):
        gone = moving("goes away")
        scene = self.daemon.push(gone)
        job = self.submit(scene, "1-3", paused=True)
        before = self.job(job)["sequence"]
        self.daemon.request("DELETE", f"/v1/scenes/{scene}?force=true")
        self.change(job, paused=False)
        self.wait(job, "failed")
        found, middle = events(self.daemon, job, before)
        self.assertEqual([1, 2, 3], told(found, "failed"))
        self.daemon.push(gone)
        self.change(job, retry_failed=True)
        self.wait(job)
        for last in (before, middle, None):
            found, end = events(self.daemon, job, last)
            self.assertEqual([[1, 2, 3], []], [told(found, "done"), told(found, "failed")])
            self.assertEqual(("job", "done"), (found[-1][0], found[-1][1]["state"]))
            self.assertEqual(self.job(job)["sequence"], end)
        found, again = events(self.daemon, job, end)
        self.assertEqual([("job", end)], [(kind, again) for kind, _ in found])

    def test_an_id_that_is_none_of_the_job_brings_everything(self):
        job = self.submit(self.daemon.push(moving()), "1-4")
        self.wait(job)
        for last in (self.job(job)["sequence"] + 1, 4294967295, "x", -1):
            self.assertEqual([1, 2, 3, 4], told(events(self.daemon, job, last)[0], "done"), last)

    def test_more_changes_than_are_told_at_once_are_all_told(self):
        scene = self.daemon.push(moving("goes away"))
        job = self.submit(scene, "1-2500", paused=True, attempts=1)
        self.daemon.request("DELETE", f"/v1/scenes/{scene}?force=true")
        self.change(job, paused=False)
        for _ in range(4):
            found = self.daemon.request("GET", f"/v1/jobs/{job}",
                                        headers={"Prefer": "wait=30"}).json()
            if found["ended"]:
                break
        self.assertEqual("failed", found["state"])
        self.change(job, retry_failed=True, paused=True)
        self.daemon.request("DELETE", f"/v1/jobs/{job}")
        told_frames = told(events(self.daemon, job, found["sequence"])[0], "queued")
        self.assertEqual(list(range(1, 2501)), told_frames)

    def test_what_is_refused_is_no_change(self):
        job = self.submit(self.daemon.push(moving()), "1")
        self.wait(job)
        before = self.job(job)["sequence"]
        self.change(job, 409, retry_failed=True)
        self.change(job, 409, paused=False)
        self.assertEqual(before, self.job(job)["sequence"])


class KilledEvents(JobTest):
    def test_no_final_state_is_lost_where_a_killed_server_had_told_what_it_had_not_saved(self):
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            with support.Daemon(state_dir=state) as daemon:
                scene = daemon.push(moving("fake:slow=20"))
                job = daemon.request("POST", "/v1/jobs", body_of(scene, "1-12")).json()["id"]
                path = f"/v1/jobs/{job}"
                support.wait_until(lambda: daemon.request("GET", path).json()["frames"]["done"]
                                   >= 6, "some frames are done")
                seen = daemon.request("GET", path).json()["sequence"]
                daemon.stop(signal.SIGKILL)
            with sqlite3.connect(os.path.join(state, "jobs", "jobs.db")) as connection:
                # As if the last three commits had not been made when their events were sent.
                saved, = connection.execute("SELECT sequence FROM job").fetchone()
                connection.execute("DELETE FROM frame WHERE sequence > ?", (saved - 3,))
                connection.execute("DELETE FROM file WHERE NOT EXISTS (SELECT * FROM frame"
                                   " WHERE frame.position = file.position)")
                connection.execute("UPDATE job SET sequence = ?", (saved - 3,))
                kept, = connection.execute("SELECT count(*) FROM frame").fetchone()
            connection.close()
            with support.Daemon(state_dir=state) as daemon:
                self.wait(job, daemon=daemon)
                found, _ = events(daemon, job, seen)
                self.assertEqual(12 - kept, len(told(found, "done")), "each that was made anew")
                self.assertEqual("done", found[-1][1]["state"])


if __name__ == "__main__":
    support.run_tests()
