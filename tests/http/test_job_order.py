# SPDX-License-Identifier: MIT
"""Jobs that come after others: what they wait for, and what follows where one fails."""
import os
import sqlite3

import support
from test_jobs import JobTest, body_of, moving

support.needs(support.FAKE)


class JobOrder(JobTest):
    def refused(self, scene, status, pointer, words, **members):
        reply = self.daemon.request("POST", "/v1/jobs", body_of(scene, **members))
        self.assertEqual((status, pointer), (reply.status, reply.json().get("pointer")),
                         reply.body)
        self.assertIn(words, reply.json()["detail"])

    def forget(self, job):
        return self.daemon.request("DELETE", f"/v1/jobs/{job}?forget=true")

    def change(self, job, **members):
        self.assertEqual(200, self.daemon.request("PATCH", f"/v1/jobs/{job}", members).status)

    def test_a_job_begins_when_all_that_it_names_are_done(self):
        scene = self.daemon.push(moving())
        first = self.submit(scene, "1-5", paused=True)
        second = self.submit(scene, "1-5", paused=True)
        last = self.submit(scene, "1-2", after=[first, second])
        found = self.job(last)
        self.assertEqual(["waiting", [first, second], None],
                         [found["state"], found["waits_for"], found["problem"]])
        self.assertEqual([first, second], found["request"]["after"])
        self.assertEqual("cancel", found["request"]["after_failure"])
        self.wait(self.submit(scene, "1-9"))  # others go on meanwhile
        self.change(first, paused=False)
        self.wait(first)
        support.wait_until(lambda: self.job(last)["waits_for"] == [second], "one is done")
        self.wait(self.submit(scene, "1-9"))
        self.assertEqual(["waiting", 0],
                         [self.job(last)["state"], self.job(last)["frames"]["done"]])
        metrics = self.daemon.request("GET", "/metrics").body.decode()
        self.assertIn('vitrail_jobs{state="waiting"} 1\n', metrics)
        self.assertEqual(1, self.daemon.request("GET", "/v1/stats").json()["jobs"]["waiting"])
        self.change(second, paused=False)
        found = self.wait(last)
        self.assertEqual([[], None], [found["waits_for"], found["problem"]])
        self.assertGreaterEqual(found["started"], self.job(second)["ended"])

    def test_a_job_whose_others_are_done_begins_at_once(self):
        scene = self.daemon.push(moving())
        first = self.submit(scene, "1")
        self.wait(first)
        last = self.submit(scene, "1", after=[first], paused=True)
        self.assertEqual(["queued", []], [self.job(last)["state"], self.job(last)["waits_for"]])
        self.change(last, paused=False)
        self.wait(last)

    def test_a_failed_job_cancels_those_after_it_lets_them_run_or_keeps_them_waiting(self):
        scene = self.daemon.push(moving())
        gone = moving("goes away")
        failing = self.submit(self.daemon.push(gone), "1-2", paused=True)
        cancelled = self.submit(scene, "1", after=[failing])
        its_own = self.submit(scene, "1", after=[cancelled])
        runs = self.submit(scene, "1", after=[failing], after_failure="run")
        waits = self.submit(scene, "1", after=[failing], after_failure="wait")
        self.daemon.request("DELETE", f"/v1/scenes/{self.job(failing)['scene']}?force=true")
        self.change(failing, paused=False)
        self.wait(failing, "failed")
        for job, other, words in ((cancelled, failing, "failed"),
                                  (its_own, cancelled, "was cancelled")):
            problem = self.wait(job, "cancelled")["problem"]
            self.assertEqual("conflict", problem["code"])
            self.assertIn(f"since job {other}, which is to end before, {words}",
                          problem["detail"])
        self.wait(runs)
        found = self.job(waits)
        self.assertEqual(["waiting", [failing]], [found["state"], found["waits_for"]])
        self.assertIn(f"waits, since job {failing}", found["problem"]["detail"])
        self.daemon.push(gone)
        self.change(failing, retry_failed=True)
        self.wait(failing)
        self.assertIsNone(self.wait(waits)["problem"])
        self.assertEqual("cancelled", self.job(cancelled)["state"], "it stays as it is")

    def test_a_cancelled_job_is_one_that_failed(self):
        scene = self.daemon.push(moving())
        first = self.submit(scene, "1", paused=True)
        after = self.submit(scene, "1", after=[first])
        either = self.submit(scene, "1", after=[first], after_failure="run")
        self.daemon.request("DELETE", f"/v1/jobs/{first}")
        self.assertIn("was cancelled", self.wait(after, "cancelled")["problem"]["detail"])
        self.wait(either)
        for _ in range(5):  # it is cancelled a moment later, and does not tell a watcher to give up
            late = self.daemon.request("POST", "/v1/jobs",
                                       body_of(scene, "1", after=[first])).json()
            found = self.job(late["id"])
            for seen in (late, found):
                self.assertEqual(seen["state"] == "cancelled", seen["problem"] is not None)
            self.wait(late["id"], "cancelled")

    def test_what_is_not_there_or_named_wrongly_is_refused(self):
        scene = self.daemon.push(moving())
        known = self.submit(scene, "1")
        self.wait(known)
        self.refused(scene, 422, "/after/1", "there is no job '0123456789abcdef'",
                     after=[known, "0123456789abcdef"])
        self.refused(scene, 400, "/after/0", "16 hexadecimal digits", after=["shot 7"])
        self.refused(scene, 400, "/after/1", "second time", after=[known, known])
        self.refused(scene, 400, "/after_failure", "cancel", after=[known], after_failure="go")
        self.refused(scene, 400, "/after_failure", "names no job", after_failure="run")
        many = [f"{n:016x}" for n in range(17)]
        self.refused(scene, 413, "/after", "16", after=many)
        self.assertEqual(204, self.forget(known).status)
        self.refused(scene, 422, "/after/0", "forgotten", after=[known])

    def test_a_job_is_kept_until_those_after_it_have_begun(self):
        scene = self.daemon.push(moving())
        first = self.submit(scene, "1")
        self.wait(first)
        last = self.submit(scene, "1", after=[first], paused=True)
        refused = self.forget(first)
        self.assertEqual((409, "conflict"), (refused.status, refused.code))
        self.assertIn(f"before job {last} has begun", refused.json()["detail"])
        self.change(last, paused=False)
        self.wait(last)
        self.assertEqual(204, self.forget(first).status)

    def test_events_of_a_job_that_waits_go_on_until_it_has_ended(self):
        scene = self.daemon.push(moving())
        first = self.submit(scene, "1", paused=True)
        last = self.submit(scene, "1-2", after=[first])
        self.change(first, paused=False)
        text = self.daemon.request("GET", f"/v1/jobs/{last}/events").body.decode()
        self.assertIn('"state":"done"', text.strip().split("\n\n")[-1])


class KeptOrder(JobTest):
    def test_the_order_is_kept_over_restarts(self):
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            with support.Daemon(state_dir=state) as daemon:
                scene = daemon.push(moving())
                def submit(**members):
                    return daemon.request("POST", "/v1/jobs",
                                          body_of(scene, "1-2", **members)).json()["id"]
                first, gone = submit(paused=True), submit(paused=True)
                last, orphan = submit(after=[first]), submit(after=[gone])
                self.assertEqual(0, daemon.stop())
            with sqlite3.connect(os.path.join(state, "jobs", "jobs.db")) as connection:
                connection.execute("DELETE FROM job WHERE id=?", (gone,))
            connection.close()
            with support.Daemon(state_dir=state) as daemon:
                found = daemon.request("GET", f"/v1/jobs/{last}").json()
                self.assertEqual(["waiting", [first]], [found["state"], found["waits_for"]])
                problem = self.wait(orphan, "cancelled", daemon)["problem"]
                self.assertIn("is not there any more", problem["detail"])
                daemon.request("PATCH", f"/v1/jobs/{first}", {"paused": False})
                self.wait(last, daemon=daemon)


if __name__ == "__main__":
    support.run_tests()
