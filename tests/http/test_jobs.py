# SPDX-License-Identifier: MIT
"""Jobs: submitted once, rendered whatever ends meanwhile, read by file, archive and events."""
import io
import json
import os
import random
import signal
import sqlite3
import struct
import tarfile
import threading
import time

import support

support.needs(support.FAKE)

TIMES = struct.pack("<2f", 0, 1000)
PLACES = struct.pack("<6f", 0, 0, 0, 1, 0, 0)


def moving(node="Triangle"):
    """A triangle whose node moves for a thousand seconds."""
    document = support.triangle_document(node)
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
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": 1, "output": 2}]}]
    return support.glb(document, binary)


def body_of(scene, frames="1-3", **members):
    return {"scene": scene, "view": {"width": 32, "height": 16}, "frames": frames,
            "frame_rate": 1, **members}


class JobTest(support.ServiceTest):
    def submit(self, *arguments, headers=None, **members):
        reply = self.daemon.request("POST", "/v1/jobs", body_of(*arguments, **members), headers)
        self.assertEqual(202, reply.status, reply.body)
        self.assertEqual(f"/v1/jobs/{reply.json()['id']}", reply.header("Location"))
        return reply.json()["id"]

    def job(self, job):
        return self.daemon.request("GET", f"/v1/jobs/{job}").json()

    def wait(self, job, state="done", daemon=None):
        daemon = daemon or self.daemon
        for _ in range(4):
            found = daemon.request("GET", f"/v1/jobs/{job}",
                                   headers={"Prefer": "wait=30"}).json()
            if found["state"] not in ("queued", "running"):
                break
        self.assertEqual(state, found["state"], found)
        return found

    def frames(self, job, **query):
        text = "&".join(f"{key}={value}" for key, value in query.items())
        return self.daemon.request("GET", f"/v1/jobs/{job}/frames?{text}").json()["frames"]


class Jobs(JobTest):
    def test_a_job_makes_every_output_of_every_frame(self):
        scene = self.daemon.push(moving())
        job = self.submit(scene, "1-3,10-20x5", name="Shot 7", outputs=[
            "color", {"name": "data", "outputs": ["depth", "normal"], "file": "data-%d.exr"}])
        found = self.wait(job)
        self.assertEqual("Shot 7", found["name"])
        self.assertEqual(6, found["frames"]["count"])
        self.assertEqual((6, 0), (found["frames"]["done"], found["frames"]["failed"]))
        self.assertEqual([1.0, None], [found["progress"], found["remaining_s"]])
        frames = self.frames(job)
        self.assertEqual([1, 2, 3, 10, 15, 20], [frame["frame"] for frame in frames])
        self.assertEqual(["color.0001.png", "data-1.exr"],
                         [file["file"] for file in frames[0]["files"]])
        for frame in frames:
            for file in frame["files"]:
                reply = self.daemon.request("GET", file["href"])
                self.assertEqual(file["sha256"], support.sha256(reply.body))
                self.assertEqual(f"\"{file['sha256']}\"", reply.header("ETag"))
                self.assertEqual(file["bytes"], len(reply.body))
        colours = {frame["files"][0]["sha256"] for frame in frames}
        self.assertEqual(6, len(colours), "the scene moves from frame to frame")
        single = self.daemon.render(scene, format="png", animation={"time_s": 15})
        self.assertEqual(support.sha256(single.body), frames[4]["files"][0]["sha256"])

    def test_frames_that_are_not_listed_are_one_picture_at_the_views_time(self):
        scene = self.daemon.push(moving())
        body = {"scene": scene, "view": {"width": 32, "height": 16, "animation": {"time_s": 7}}}
        job = self.daemon.request("POST", "/v1/jobs", body).json()["id"]
        self.wait(job)
        single = self.daemon.render(scene, format="png", animation={"time_s": 7})
        self.assertEqual(single.body,
                         self.daemon.request("GET", f"/v1/jobs/{job}/frames/1/color").body)

    def test_a_turntable_goes_round_and_returns(self):
        scene = self.daemon.push(support.triangle())
        job = self.submit(scene, "0-3", turntable={"elevation_deg": 10})
        self.assertEqual(10, self.job(job)["request"]["turntable"]["elevation_deg"])
        self.assertEqual(4, self.wait(job)["frames"]["done"])

    def test_ranges_of_a_file(self):
        job = self.submit(self.daemon.push(moving()), "1")
        self.wait(job)
        path = f"/v1/jobs/{job}/frames/1/color"
        whole = self.daemon.request("GET", path)
        for value, expected in (("bytes=0-3", whole.body[:4]), ("bytes=4-", whole.body[4:]),
                                ("bytes=-5", whole.body[-5:]),
                                ("bytes=10-99999999", whole.body[10:])):
            part = self.daemon.request("GET", path, headers={"Range": value})
            self.assertEqual((206, expected), (part.status, part.body), value)
            self.assertTrue(part.header("Content-Range").endswith(f"/{len(whole.body)}"))
        for value in (f"bytes={len(whole.body)}-", "bytes=-0"):
            outside = self.daemon.request("GET", path, headers={"Range": value})
            self.assertEqual((416, "range_not_satisfiable"), (outside.status, outside.code))
            self.assertEqual(f"bytes */{len(whole.body)}", outside.header("Content-Range"))
        for headers in ({"Range": "bytes=2-1"}, {"Range": "lines=1-2"},
                        {"Range": "bytes=0-1,3-4"},
                        {"Range": "bytes=0-3", "If-Range": '"another"'}):
            self.assertEqual(whole.body, self.daemon.request("GET", path, headers=headers).body)
        tag = whole.header("ETag")
        self.assertEqual(304, self.daemon.request("GET", path,
                                                  headers={"If-None-Match": tag}).status)
        self.assertEqual(206, self.daemon.request(
            "GET", path, headers={"Range": "bytes=0-3", "If-Range": tag}).status)

    def test_the_archive_holds_every_file(self):
        job = self.submit(self.daemon.push(moving()), "1-4")
        self.wait(job)
        archive = self.daemon.request("GET", f"/v1/jobs/{job}/results.tar")
        files = {file["file"]: file for frame in self.frames(job) for file in frame["files"]}
        with tarfile.open(fileobj=io.BytesIO(archive.body)) as tar:
            self.assertEqual(sorted(files), sorted(tar.getnames()))
            for member in tar:
                content = tar.extractfile(member).read()
                self.assertEqual(files[member.name]["sha256"], support.sha256(content))

    def test_a_key_makes_a_job_once(self):
        scene = self.daemon.push(moving())
        headers = {"Idempotency-Key": "shot-12"}
        first = self.submit(scene, "1-2", headers=headers)
        again = self.daemon.request("POST", "/v1/jobs", body_of(scene, "1-2"), headers)
        self.assertEqual((202, first, "true"), (again.status, again.json()["id"],
                                                again.header("Idempotency-Replayed")))
        other = self.daemon.request("POST", "/v1/jobs", body_of(scene, "1-3"), headers)
        self.assertEqual((422, "unsupported"), (other.status, other.code))
        self.assertIn(first, other.json()["detail"])
        replies = []
        threads = [threading.Thread(target=lambda: replies.append(self.submit(
            scene, "5", headers={"Idempotency-Key": "at once"}))) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(1, len(set(replies)))
        for key in ("", "x" * 256):
            self.assertEqual(400, self.daemon.request(
                "POST", "/v1/jobs", body_of(scene), {"Idempotency-Key": key}).status)

    def test_waiting_for_a_change_and_for_the_end(self):
        job = self.submit(self.daemon.push(moving("fake:slow=50")), "1-6")
        reply = self.daemon.request("GET", f"/v1/jobs/{job}")
        seen = 0
        while reply.json()["state"] in ("queued", "running"):
            before = reply.json()["sequence"]
            reply = self.daemon.request("GET", f"/v1/jobs/{job}", headers={
                "Prefer": "wait=20", "If-None-Match": reply.header("ETag")})
            self.assertEqual((200, "wait=20"),
                             (reply.status, reply.header("Preference-Applied")))
            self.assertGreater(reply.json()["sequence"], before)
            seen += 1
        self.assertGreater(seen, 1)
        tag = self.daemon.request("GET", f"/v1/jobs/{job}").header("ETag")
        self.assertEqual(304, self.daemon.request(
            "GET", f"/v1/jobs/{job}", headers={"If-None-Match": tag}).status)

    def test_events_tell_every_frame_once_and_can_be_resumed(self):
        job = self.submit(self.daemon.push(moving("fake:slow=20")), "1-8")
        def events(headers=None):
            text = self.daemon.request("GET", f"/v1/jobs/{job}/events",
                                       headers=headers).body.decode()
            for block in text.strip().split("\n\n"):
                yield dict(line.split(": ", 1) for line in block.split("\n"))
        found = list(events())
        done = [json.loads(event["data"])["frame"] for event in found
                if event["event"] == "frame" and json.loads(event["data"])["state"] == "done"]
        self.assertEqual(list(range(1, 9)), sorted(done))
        last = found[-1]
        self.assertEqual(["job", "done"], [last["event"], json.loads(last["data"])["state"]])
        numbers = [int(event["id"]) for event in found if "id" in event]
        self.assertEqual(sorted(set(numbers)), numbers)
        again = list(events({"Last-Event-ID": str(numbers[-2])}))
        self.assertTrue(all(event["event"] == "job" or json.loads(event["data"])["frame"] in done
                            for event in again))
        self.assertLess(len(again), len(found))
        self.assertEqual(last["id"], again[-1]["id"])

    def test_pause_resume_cancel_and_forget(self):
        scene = self.daemon.push(moving("fake:slow=30"))
        job = self.submit(scene, "1-100", paused=True)
        time.sleep(0.3)
        self.assertEqual(["queued", 0],
                         [self.job(job)["state"], self.job(job)["frames"]["done"]])
        self.change(job, paused=False)
        support.wait_until(lambda: self.job(job)["frames"]["done"] > 1, "frames are done")
        self.change(job, paused=True)
        support.wait_until(lambda: self.job(job)["frames"]["running"] == 0, "it pauses")
        done = self.job(job)["frames"]["done"]
        time.sleep(0.3)
        self.assertEqual(done, self.job(job)["frames"]["done"])
        refused = self.daemon.request("DELETE", f"/v1/jobs/{job}?forget=true")
        self.assertEqual((409, "conflict"), (refused.status, refused.code))
        self.assertEqual("cancelled",
                         self.daemon.request("DELETE", f"/v1/jobs/{job}").json()["state"])
        self.assertEqual(409, self.change(job, 409, paused=False))
        self.assertEqual(200, self.daemon.request("GET", f"/v1/jobs/{job}/frames/1/color").status)
        self.assertEqual(204,
                         self.daemon.request("DELETE", f"/v1/jobs/{job}?forget=true").status)
        self.assertEqual(404, self.daemon.request("GET", f"/v1/jobs/{job}").status)
        self.assertFalse(os.path.exists(os.path.join(self.daemon.state_dir, "jobs", job)))

    def change(self, job, status=200, **members):
        reply = self.daemon.request("PATCH", f"/v1/jobs/{job}", members)
        self.assertEqual(status, reply.status, reply.body)
        return reply.status

    def test_a_frame_that_ends_its_worker_fails_alone(self):
        scene = self.daemon.push(moving("fake:crash-at=3"))
        job = self.submit(scene, "1-6", attempts=2)
        found = self.wait(job, "failed")
        self.assertEqual((5, 1), (found["frames"]["done"], found["frames"]["failed"]))
        failure = found["failures"][0]
        self.assertEqual((3, 2), (failure["frame"], failure["attempts"]))
        self.assertIn("ended its worker", failure["problem"]["detail"])
        missing = self.daemon.request("GET", f"/v1/jobs/{job}/frames/3/color")
        self.assertEqual(404, missing.status)
        self.assertIn("failed", missing.json()["detail"])
        self.assertEqual(200, self.daemon.render(scene, animation={"time_s": 1}).status,
                         "the scene is not in quarantine")
        self.change(job, retry_failed=True)
        again = self.wait(job, "failed")
        self.assertEqual(2, again["failures"][0]["attempts"])

    def test_jobs_share_and_interactive_pictures_go_first(self):
        scene = self.daemon.push(moving("fake:slow=20"))
        slow = self.submit(scene, "1-60", priority=50)
        fast = self.submit(scene, "1-60", priority=80)
        self.wait(fast)
        left = self.job(slow)["frames"]
        self.assertGreater(left["queued"], 20, "eight times the weight")
        self.assertGreater(left["done"], 1, "but nobody starves")
        before = self.job(slow)["frames"]["done"]
        self.assertEqual(200, self.daemon.render(scene, {"Priority": "u=0"}).status)
        self.assertLess(self.job(slow)["frames"]["done"] - before, 5)
        self.daemon.request("DELETE", f"/v1/jobs/{slow}")

    def test_a_picture_waits_for_two_pieces_of_jobs_at_most_and_an_urgent_one_for_none(self):
        """By counts, the least of several: frames that end meanwhile may have been counted late."""
        scene, light = self.daemon.push(moving("fake:slow=150")), self.daemon.push(moving())
        job = self.submit(scene, "1-1000")
        def frames_while(headers):
            support.wait_until(lambda: self.job(job)["frames"]["running"] == 2, "it runs")
            before = self.job(job)["frames"]["done"]
            self.assertEqual(200, self.daemon.render(light, headers).status)
            return self.job(job)["frames"]["done"] - before
        self.assertEqual(0, min(frames_while({"Priority": "u=0"}) for _ in range(6)))
        self.assertLessEqual(min(frames_while({}) for _ in range(6)), 2)
        self.daemon.request("DELETE", f"/v1/jobs/{job}")

    def test_frames_of_all_jobs_have_a_bound(self):
        with support.Daemon() as daemon:
            scene = daemon.push(moving())
            def submit(frames):
                return daemon.request("POST", "/v1/jobs", body_of(scene, frames, paused=True))
            first = [submit("1-100000") for _ in range(10)][0].json()["id"]
            reply = submit("1")
            self.assertEqual([429, "too_many_requests", "30"],
                             [reply.status, reply.json()["code"], reply.header("Retry-After")])
            self.assertIn("1000000 frames", reply.json()["detail"])
            daemon.request("DELETE", f"/v1/jobs/{first}")
            forgotten = daemon.request("DELETE", f"/v1/jobs/{first}?forget=true")
            self.assertEqual([204, 202], [forgotten.status, submit("1").status])

    def test_bad_jobs_are_refused_by_member(self):
        scene = self.daemon.push(moving())
        def refused(status, pointer, words, **members):
            reply = self.daemon.request("POST", "/v1/jobs", body_of(scene, **members))
            self.assertEqual(status, reply.status, reply.body)
            self.assertEqual(pointer, reply.json().get("pointer", ""))
            self.assertIn(words, reply.json()["detail"])
        refused(413, "/frames", "more than 100000", frames="1-99999999")
        refused(400, "/frames", "no frame", frames="1-1000000000")
        refused(400, "/frames", "ends before", frames="10-1")
        refused(400, "/frames", "twice", frames="1-10,5")
        refused(400, "/frames", "no frame", frames="1-10x0")
        refused(400, "/frames", "no frame", frames="1,,2")
        refused(400, "/frames", "", frames=[1])
        for name in ("../a.%04d.png", "/tmp/a.%04d.png", ".a.%04d.png", "a/b.%04d.png"):
            refused(400, "/outputs/0/file", "folder", outputs=[{"file": name}])
        for name in ("a.png", "a.%d.%d.png", "a.%s.png", "a.%20d.png", "a.%04d%.png"):
            refused(400, "/outputs/0/file", "number", outputs=[{"file": name}])
        refused(400, "/outputs/0/file", ".exr", outputs=[{"file": "a.%04d.tiff"}])
        refused(400, "/outputs/1", "file", outputs=[{"file": "a.%04d.png"},
                                                    {"name": "b", "file": "a.%d.png"}])
        refused(400, "/outputs/1", "name", outputs=["color", "color"])
        refused(422, "/outputs/0", "exr", outputs=[{"outputs": ["color", "depth"],
                                                    "format": "png"}])
        refused(400, "/view/width", "", view={"width": 0})
        refused(400, "/view/camera", "", view={"camera": 3})
        refused(400, "/view/format", "", view={"format": "png"})
        refused(400, "/attempts", "", attempts=0)
        refused(400, "/priority", "", priority=101)
        refused(422, "/directory", "--job-dir", directory="shots")
        refused(400, "/colour", "", colour=1)
        missing = self.daemon.request("POST", "/v1/jobs", body_of("0" * 64))
        self.assertEqual((404, "/scene"), (missing.status, missing.json()["pointer"]))
        for path in ("/v1/jobs/0123456789abcdef", "/v1/jobs/x/frames", "/v1/jobs/x/events",
                     "/v1/jobs/x/results.tar", "/v1/jobs/x/frames/1/color"):
            self.assertEqual(404, self.daemon.request("GET", path).status, path)
        job = self.submit(scene, "1")
        self.wait(job)
        for path in ("2/color", "x/color", "1/depth", "-1/color", "99999999999999999999/color"):
            self.assertEqual(404, self.daemon.request(
                "GET", f"/v1/jobs/{job}/frames/{path}").status, path)
        self.change(job, 400, paused="yes")
        self.change(job, 400, priority=-1)
        self.change(job, 409, retry_failed=True)
        for query in ("first=-1", "count=0", "count=1001", "first=x"):
            self.assertEqual(400, self.daemon.request(
                "GET", f"/v1/jobs/{job}/frames?{query}").status)

    def test_the_first_frame_chooses_for_all(self):
        scene = self.daemon.push(moving("fake:tradeoff"))
        tradeoff = self.daemon.request("POST", "/v1/tradeoffs", {
            "scene": scene, "width": 32, "height": 16, "tradeoff": {"repeats": 1}}).json()["id"]
        support.wait_until(lambda: self.daemon.request(
            "GET", f"/v1/tradeoffs/{tradeoff}").json()["state"] == "done", "it is measured", 60)
        view = {"width": 32, "height": 16, "quality": {"max_error": 0.05}}
        job = self.submit(scene, "1-5", view=view)
        found = self.wait(job)
        says = [support.provenance(self.daemon.request(
            "GET", f"/v1/jobs/{job}/frames/{frame}/color").body) for frame in range(1, 6)]
        self.assertEqual([found["error"]] * 5, [one["error"] for one in says])
        self.assertEqual([says[0]["request"]["quality"]] * 5,
                         [one["request"]["quality"] for one in says])
        job = self.submit(scene, "1-5", view=view, provenance=False)  # which tells the error, too
        found = self.wait(job)
        self.assertTrue(found["chosen"]["because"])
        self.assertLessEqual(found["error"]["value"], 0.05)
        chosen = {key: found["chosen"][key] for key in ("shadows", "samples", "shadow_resolution",
                                                        "shadow_taps")}
        single = self.daemon.render(scene, format="png", provenance=False,
                                    animation={"time_s": 4}, quality={
            key: value for key, value in chosen.items() if value is not None})
        self.assertEqual(single.body,
                         self.daemon.request("GET", f"/v1/jobs/{job}/frames/4/color").body)
        plain = self.submit(scene, "1", view={"width": 32, "height": 16,
                                              "quality": {"shadows": "map"}})
        self.assertIsNone(self.wait(plain)["chosen"])

    def test_the_first_frame_chooses_the_samples_of_haze_for_all(self):
        scene = self.daemon.push(moving("fake:tradeoff"))
        view = {"width": 32, "height": 16, "atmosphere": {"density": 0.1},
                "quality": {"shadows": "deep"}}
        tradeoff = self.daemon.request("POST", "/v1/tradeoffs", {
            "scene": scene, **view, "tradeoff": {"repeats": 1}}).json()["id"]
        support.wait_until(lambda: self.daemon.request(
            "GET", f"/v1/tradeoffs/{tradeoff}").json()["state"] == "done", "it is measured", 60)
        view["quality"]["max_error"] = 0.2
        job = self.submit(scene, "1-3", view=view)
        self.assertEqual(16, self.wait(job)["chosen"]["atmosphere_samples"])
        for frame in range(1, 4):
            picture = self.daemon.request("GET", f"/v1/jobs/{job}/frames/{frame}/color").body
            quality = support.provenance(picture)["request"]["quality"]
            self.assertEqual(16, quality["atmosphere_samples"])

    def test_a_scene_that_is_deleted_ends_its_job_by_name(self):
        scene = self.daemon.push(moving("fake:slow=21"))
        job = self.submit(scene, "1-50")
        support.wait_until(lambda: self.job(job)["frames"]["done"] > 0, "frames are done")
        refused = self.daemon.request("DELETE", f"/v1/scenes/{scene}")
        self.assertEqual((409, "conflict"), (refused.status, refused.code))
        self.assertIn(f"needed by job {job}, which has not ended", refused.json()["detail"])
        self.assertEqual(400, self.daemon.request(
            "DELETE", f"/v1/scenes/{scene}?force=yes").status)
        self.assertEqual(204, self.daemon.request(
            "DELETE", f"/v1/scenes/{scene}?force=true").status)
        found = self.wait(job, "failed")
        self.assertIn("no scene", found["failures"][0]["problem"]["detail"])
        self.assertEqual(1, found["failures"][0]["attempts"])


class JobDirectory(support.ServiceTest):
    def test_results_go_to_an_allowed_directory_and_a_lost_one_pauses(self):
        with support.tempfile.TemporaryDirectory() as folder:
            allowed = os.path.join(folder, "out")
            os.mkdir(allowed)
            with support.Daemon("--job-dir", allowed) as daemon:
                scene = daemon.push(moving("fake:slow=30"))
                def submit(**members):
                    reply = daemon.request("POST", "/v1/jobs", body_of(scene, **members))
                    return reply.json().get("id"), reply
                def state(job):
                    return daemon.request("GET", f"/v1/jobs/{job}").json()
                job, _ = submit(frames="1-3", directory="shots/a")
                support.wait_until(lambda: state(job)["state"] == "done", "it is done")
                self.assertEqual([f"color.000{n}.png" for n in (1, 2, 3)],
                                 sorted(os.listdir(os.path.join(allowed, "shots", "a"))))
                self.assertEqual(200, daemon.request(
                    "GET", f"/v1/jobs/{job}/frames/2/color").status)
                for directory in ("../b", "/etc", "a/../../b", ".b", "a//b"):
                    self.assertEqual(400, submit(directory=directory)[1].status, directory)
                os.symlink(folder, os.path.join(allowed, "link"))
                self.assertEqual(500, submit(directory="link")[1].status)
                job, _ = submit(frames="1-30", directory="shots/b")
                support.wait_until(lambda: state(job)["frames"]["done"] > 1, "frames are done")
                os.rename(allowed, allowed + "-gone")
                support.wait_until(lambda: state(job)["paused"], "it pauses")
                self.assertIn("cannot be written", state(job)["problem"]["detail"])
                self.assertEqual(0, state(job)["frames"]["failed"])
                os.rename(allowed + "-gone", allowed)
                daemon.request("PATCH", f"/v1/jobs/{job}", {"paused": False})
                support.wait_until(lambda: state(job)["state"] == "done", "it goes on")
                self.assertEqual(30, len(os.listdir(os.path.join(allowed, "shots", "b"))))
                shots = os.path.join(allowed, "shots")
                self.check_that_its_own_folder_may_go(daemon, submit, shots)

    def check_that_its_own_folder_may_go(self, daemon, submit, shots):
        """As where a disk is not mounted any more: no second one is begun in its place, unless
        somebody resumes the job."""
        def state(job):
            return daemon.request("GET", f"/v1/jobs/{job}").json()
        folder = os.path.join(shots, "c")
        job, _ = submit(frames="1-30", directory="shots/c")
        support.wait_until(lambda: state(job)["frames"]["done"] > 1, "frames are done")
        os.rename(folder, folder + "-gone")
        support.wait_until(lambda: state(job)["paused"], "it pauses")
        self.assertIn("cannot be written", state(job)["problem"]["detail"])
        self.assertFalse(os.path.exists(folder))
        daemon.request("PATCH", f"/v1/jobs/{job}", {"paused": False})
        support.wait_until(lambda: state(job)["state"] == "done", "it goes on")
        self.assertEqual(30, len(os.listdir(folder)) + len(os.listdir(folder + "-gone")))

    def test_a_full_disk_pauses_and_room_resumes(self):
        with support.tempfile.TemporaryDirectory() as parent:
            folder = os.path.join(parent, "disk")
            os.mkdir(folder)
            mounted = support.subprocess.run(
                ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", folder],
                capture_output=True, check=False)
            if mounted.returncode != 0:
                self.skipTest("needs to mount a small disk")
            try:
                self.fill_and_make_room(folder)
            finally:
                support.subprocess.run(["umount", folder], check=True)

    def fill_and_make_room(self, folder):
        with support.Daemon("--job-dir", folder) as daemon:
            body = body_of(daemon.push(moving()), "1-30", directory="full")
            path = f"/v1/jobs/{daemon.request('POST', '/v1/jobs', body).json()['id']}"
            def state():
                return daemon.request("GET", path).json()
            support.wait_until(lambda: state()["paused"], "it pauses")
            self.assertIn("No space left", state()["problem"]["detail"])
            self.assertEqual(0, state()["frames"]["failed"])
            names = os.listdir(os.path.join(folder, "full"))
            self.assertEqual(state()["frames"]["done"], len(names), "no part of a file stays")
            support.subprocess.run(["mount", "-o", "remount,size=1m", folder], check=True)
            daemon.request("PATCH", path, {"paused": False})
            support.wait_until(lambda: state()["state"] == "done", "it goes on")
            self.assertEqual(30, len(os.listdir(os.path.join(folder, "full"))))


class Durability(JobTest):
    """What a daemon that is killed leaves."""
    KILLS = int(os.environ.get("VITRAIL_JOB_KILLS", "12"))

    def test_every_frame_is_there_once_whenever_the_daemon_is_killed(self):
        chance = random.Random(20261125)
        scene = self.daemon.push(moving("fake:slow=4"))
        undisturbed = self.submit(scene, "1-200")
        self.wait(undisturbed)
        expected = [frame["files"][0]["sha256"]
                    for frame in self.frames(undisturbed, count=1000)]
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            job, survived = None, 0
            for kill in range(self.KILLS + 1):
                with support.Daemon(state_dir=state) as daemon:
                    if job is None:
                        daemon.push(moving("fake:slow=4"))
                    reply = daemon.request("POST", "/v1/jobs", body_of(scene, "1-200"),
                                           {"Idempotency-Key": "killed"})
                    job = job or reply.json()["id"]
                    self.assertEqual(job, reply.json()["id"])
                    done = reply.json()["frames"]["done"]
                    self.assertGreaterEqual(done, survived, "what was told is kept")
                    if kill == self.KILLS:
                        self.wait(job, daemon=daemon)
                        frames = daemon.request(
                            "GET", f"/v1/jobs/{job}/frames?count=1000").json()["frames"]
                        break
                    aim = min(190, done + chance.randrange(1, 30))
                    support.wait_until(lambda: daemon.request(
                        "GET", f"/v1/jobs/{job}").json()["frames"]["done"] >= aim, "some more")
                    time.sleep(chance.random() * 0.02)
                    survived = daemon.request(
                        "GET", f"/v1/jobs/{job}").json()["frames"]["done"]
                    daemon.stop(signal.SIGKILL)
            self.assertEqual(list(range(1, 201)), [frame["frame"] for frame in frames])
            self.assertEqual(expected, [frame["files"][0]["sha256"] for frame in frames])
            self.assertEqual({1}, {frame["attempts"] for frame in frames})
            results = os.path.join(state, "jobs", job)
            self.assertEqual([f"color.{n:04}.png" for n in range(1, 201)],
                             sorted(os.listdir(results)))
            for frame in frames:
                with open(os.path.join(results, frame["files"][0]["file"]), "rb") as file:
                    self.assertEqual(frame["files"][0]["sha256"], support.sha256(file.read()))

    def test_a_job_survives_a_stop_with_its_pause_and_a_lost_file_is_made_again(self):
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            with support.Daemon(state_dir=state) as daemon:
                scene = daemon.push(moving("fake:slow=10"))
                job = daemon.request("POST", "/v1/jobs", body_of(scene, "1-40")).json()["id"]
                path = f"/v1/jobs/{job}"
                support.wait_until(
                    lambda: daemon.request("GET", path).json()["frames"]["done"] > 3, "some")
                daemon.request("PATCH", path, {"paused": True, "priority": 7})
                self.assertEqual(0, daemon.stop())
            os.unlink(os.path.join(state, "jobs", job, "color.0002.png"))
            with support.Daemon(state_dir=state) as daemon:
                found = daemon.request("GET", path).json()
                self.assertEqual([True, 7], [found["paused"], found["priority"]])
                daemon.request("PATCH", path, {"paused": False})
                self.assertEqual(40, self.wait(job, daemon=daemon)["frames"]["done"])
                self.assertEqual(200, daemon.request("GET", path + "/frames/2/color").status)
                self.assertIn("color.0002.png' is gone", daemon.log())

    def test_a_database_of_the_version_before_is_brought_up_to_date(self):
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            database = os.path.join(state, "jobs", "jobs.db")
            with support.Daemon(state_dir=state) as daemon:
                scene = daemon.push(moving())
                job = daemon.request("POST", "/v1/jobs", body_of(scene)).json()["id"]
                self.wait(job, daemon=daemon)
            connection = sqlite3.connect(database)
            connection.executescript("ALTER TABLE job DROP COLUMN chosen;"
                                     "ALTER TABLE job DROP COLUMN ended_ms; DROP TABLE clock;"
                                     "PRAGMA user_version=1;")
            connection.close()
            with support.Daemon(state_dir=state) as daemon:
                self.assertEqual("done", daemon.request("GET", f"/v1/jobs/{job}").json()["state"])
                job = daemon.request("POST", "/v1/jobs", body_of(scene)).json()["id"]
                self.wait(job, daemon=daemon)

    def test_a_damaged_database_is_set_aside_and_a_newer_one_refused(self):
        with support.tempfile.TemporaryDirectory() as folder:
            state = os.path.join(folder, "state")
            os.makedirs(os.path.join(state, "jobs"))
            database = os.path.join(state, "jobs", "jobs.db")
            with open(database, "wb") as file:
                file.write(b"no database at all" * 100)
            with support.Daemon(state_dir=state) as daemon:
                self.assertEqual([], daemon.request("GET", "/v1/jobs").json()["jobs"])
                self.assertIn("set aside", daemon.log())
                self.assertTrue(os.path.exists(database + ".damaged-1"))
            with sqlite3.connect(database) as connection:
                connection.execute("PRAGMA user_version=99")
            connection.close()
            with self.assertRaisesRegex(RuntimeError, "version 99"):
                support.Daemon(state_dir=state)


if __name__ == "__main__":
    support.run_tests()
