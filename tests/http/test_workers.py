# SPDX-License-Identifier: MIT
"""Several workers: which one gets what, what stays equal, and what the end of one costs. On the
test double."""
import concurrent.futures
import os
import signal
import struct
import subprocess
import tempfile

import support
from sockets import WebSocket
from support import triangle, wait_until

support.needs(support.FAKE)

TIMES = struct.pack("<2f", 0, 1000)
PLACES = struct.pack("<6f", 0, 0, 0, 1, 0, 0)


def moving(node):
    """A triangle whose node moves for a thousand seconds."""
    document = support.triangle_document(node)
    start = len(support.TRIANGLE)
    document["buffers"][0]["byteLength"] = start + len(TIMES) + len(PLACES)
    document["bufferViews"] += [{"buffer": 0, "byteOffset": start, "byteLength": len(TIMES)},
                                {"buffer": 0, "byteOffset": start + len(TIMES),
                                 "byteLength": len(PLACES)}]
    document["accessors"] += [
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR",
         "min": [0], "max": [1000]},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}]
    document["animations"] = [{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": 1, "output": 2}]}]
    return support.glb(document, support.TRIANGLE + TIMES + PLACES)


def start(*flags, count=2):
    daemon = support.Daemon("--workers", str(count), *flags)
    wait_until(lambda: daemon.request("GET", "/v1/stats").json()["workers"][count - 1]["ready"],
               "all workers are ready")
    return daemon


def workers(daemon, member):
    return [worker[member] for worker in daemon.stats()["workers"]]


def submit(daemon, scene, frames, **members):
    body = {"scene": scene, "view": {"width": 32, "height": 16}, "frames": frames,
            "frame_rate": 1, **members}
    reply = daemon.request("POST", "/v1/jobs", body)
    assert reply.status == 202, reply.body
    return reply.json()["id"]


def job(daemon, name):
    return daemon.request("GET", f"/v1/jobs/{name}").json()


def wait_for(daemon, name):
    wait_until(lambda: job(daemon, name)["state"] not in ("queued", "running"), "it ends", 60)
    return job(daemon, name)


def digests(daemon, name):
    frames = daemon.request("GET", f"/v1/jobs/{name}/frames").json()["frames"]
    return {frame["frame"]: frame["files"][0]["sha256"] for frame in frames}


class Workers(support.unittest.TestCase):
    def test_frames_of_a_job_go_to_all_and_are_those_of_one_worker(self):
        with start(count=1) as alone:
            name = submit(alone, alone.push(moving("fake:slow=50")), "1-20")
            self.assertEqual("done", wait_for(alone, name)["state"])
            expected = digests(alone, name)
            alone.stop()
        with start() as daemon:
            name = submit(daemon, daemon.push(moving("fake:slow=50")), "1-20")
            self.assertEqual("done", wait_for(daemon, name)["state"])
            self.assertEqual(expected, digests(daemon, name))
            made = workers(daemon, "rendered")
            self.assertEqual(20, sum(made), "every frame is made once")
            self.assertGreater(min(made), 1, "two are on the way to each")
            self.assertEqual([1, 1], workers(daemon, "cache_misses"), "each loads the scene once")

    def test_scenes_spread_and_requests_go_where_their_scene_is(self):
        with start() as daemon:
            scenes = [daemon.push(triangle(f"Scene {i}")) for i in range(4)]
            for _ in range(3):
                for scene in scenes:
                    self.assertEqual(200, daemon.render(scene).status)
            self.assertEqual([6, 6], workers(daemon, "rendered"))
            self.assertEqual([2, 2], workers(daemon, "cache_misses"))

    def test_a_killed_worker_costs_its_own_frame_alone(self):
        with start() as daemon:
            scene = daemon.push(moving("fake:slow=100"))
            other = daemon.push(triangle("fake:slow=3000"))
            daemon.render(scene)
            with concurrent.futures.ThreadPoolExecutor(1) as pool:
                long = pool.submit(daemon.render, other)
                wait_until(lambda: workers(daemon, "in_flight") == [0, 1], "the other has it")
                name = submit(daemon, scene, "1-12")
                wait_until(lambda: daemon.stats()["workers"][0]["in_flight"] > 0, "it is drawn")
                os.kill(workers(daemon, "pid")[0], signal.SIGKILL)
                self.assertEqual(200, long.result(60).status)
            self.assertEqual("done", wait_for(daemon, name)["state"])
            frames = daemon.request("GET", f"/v1/jobs/{name}/frames").json()["frames"]
            self.assertEqual(list(range(1, 13)), [frame["frame"] for frame in frames])
            self.assertEqual({"done"}, {frame["state"] for frame in frames})
            stats = daemon.stats()
            self.assertEqual([1, 0], workers(daemon, "crashes"))
            self.assertEqual(14, stats["renders"]["rendered"], "each picture once")
            self.assertEqual(0, stats["renders"]["retried"], "the other went on")
            self.assertEqual(0, stats["worker"]["quarantined_scenes"])
            wait_until(lambda: all(workers(daemon, "ready")), "it is replaced")
            self.assertRegex(daemon.log(), "warning front: worker 1 ended with signal 9")

    def test_the_same_request_gives_the_same_bytes_on_each(self):
        with start() as daemon, concurrent.futures.ThreadPoolExecutor(4) as pool:
            scene = daemon.push(triangle("fake:slow=300"))
            asked = [pool.submit(daemon.render, scene, format="png") for _ in range(4)]
            replies = [reply.result(60) for reply in asked]
            self.assertEqual([2, 2], workers(daemon, "rendered"))
            self.assertEqual({200}, {reply.status for reply in replies})
            self.assertEqual(1, len({reply.body for reply in replies}))
            self.assertEqual(1, len({reply.header("ETag") for reply in replies}))

    def test_a_view_stays_on_its_worker_while_a_job_takes_all(self):
        with start() as daemon:
            view_scene = daemon.push(triangle("fake:slow=5"))
            film = daemon.push(moving("fake:slow=20"))
            body = {"scene": view_scene, "width": 32, "height": 16, "stream": {"rest_ms": 10000}}
            view = daemon.request("POST", "/v1/views", body).json()["id"]
            with WebSocket(daemon.port, f"/v1/views/{view}/socket") as client:
                client.until_type("frame")
                home = workers(daemon, "rendered").index(1)
                name = submit(daemon, film, "1-1000")
                wait_until(lambda: min(workers(daemon, "rendered")) > 2, "both draw the film")
                for seq in range(1, 11):
                    client.send(type="camera", seq=seq,
                                camera={"eye": [0, seq, 5], "target": [0, 0, 0]})
                    client.until_type("frame", seq=seq)
            self.assertEqual("running", job(daemon, name)["state"], "the view went first")
            daemon.request("DELETE", f"/v1/jobs/{name}")
            # The film and the view at its worker; the film alone at the other.
            scenes = workers(daemon, "scenes")
            self.assertEqual((2, 1), (scenes[home], scenes[1 - home]))

    def test_an_urgent_picture_goes_before_the_frames_that_all_workers_draw(self):
        with start() as daemon:
            light, film = daemon.push(triangle()), daemon.push(moving("fake:slow=600"))
            daemon.render(light)
            name = submit(daemon, film, "1-40")
            wait_until(lambda: min(workers(daemon, "in_flight")) > 0, "both draw the film")
            before = job(daemon, name)["frames"]["done"]
            for _ in range(5):
                daemon.render(light, headers={"Priority": "u=0"})
            done = job(daemon, name)["frames"]["done"] - before
            self.assertLessEqual(done, 4, "five that waited for pieces would see ten")
            daemon.request("DELETE", f"/v1/jobs/{name}")

    def test_one_that_cannot_start_leaves_the_others_alone(self):
        with support.Daemon("--device", "0,64").wait_ready() as daemon:
            wait_until(lambda: daemon.stats()["workers"][1].get("problem"), "it is said")
            self.assertEqual({"ready": 1, "configured": 2},
                             daemon.request("GET", "/readyz").json()["workers"])
            self.assertEqual(200, daemon.render(daemon.push(triangle())).status)
            first, second = daemon.stats()["workers"]
            self.assertEqual((True, False), (first["ready"], second["ready"]))
            self.assertIn("there is no device 64", second["problem"])
            self.assertEqual(("0", "64"), (first["device"], second["device"]))

    def test_where_the_first_cannot_start_the_second_serves(self):
        with support.Daemon("--device", "64,0").wait_ready() as daemon:
            self.assertEqual(200, daemon.render(daemon.push(triangle())).status)
            self.assertEqual([False, True], workers(daemon, "ready"))

    def test_a_device_of_another_kind_is_not_used(self):
        with support.Daemon("--device", "0,62").wait_ready() as daemon:
            wait_until(lambda: daemon.stats()["workers"][1].get("problem") and
                       workers(daemon, "pid")[1] is None, "it is said, and it is gone")
            second = daemon.stats()["workers"][1]
            self.assertIn("its device is another fake, 1, that of the others fake, 1",
                          second["problem"])
            self.assertEqual((1, None, False), (second["starts"], second["pid"], second["ready"]))
            self.assertEqual(200, daemon.render(daemon.push(triangle())).status)

    def test_metrics_name_the_worker(self):
        with start() as daemon:
            daemon.render(daemon.push(triangle()))
            text = daemon.request("GET", "/metrics").body.decode()
            self.assertIn('vitrail_worker_ready{worker="2"} 1\n', text)
            self.assertIn('vitrail_worker_renders_total{worker="1"} 1\n', text)
            self.assertIn('vitrail_renders_total{result="done"} 1\n', text)

    def test_a_deleted_scene_is_forgotten_by_all(self):
        with start() as daemon:
            scene = daemon.push(moving("fake:slow=50"))
            name = submit(daemon, scene, "1-12")
            wait_for(daemon, name)
            self.assertEqual([1, 1], workers(daemon, "scenes"))
            daemon.request("DELETE", f"/v1/jobs/{name}")
            self.assertEqual(204, daemon.request("DELETE", f"/v1/scenes/{scene}").status)
            for text in ("Another", "Third"):
                daemon.render(daemon.push(triangle(text)))
            wait_until(lambda: workers(daemon, "scenes") == [1, 1], "each has one of the others")


class Configuration(support.unittest.TestCase):
    def refused(self, *flags):
        with tempfile.TemporaryDirectory() as folder:
            ended = subprocess.run([support.FAKE, "--state-dir", folder, "--check-config", *flags],
                                   capture_output=True, text=True, check=False)
        self.assertEqual(2, ended.returncode, ended.stdout)
        return ended.stderr

    def printed(self, *flags):
        ended = subprocess.run([support.FAKE, "--print-config", *flags],
                               capture_output=True, text=True, check=True)
        return ended.stdout

    def test_numbers_of_workers_are_checked(self):
        for number in ("0", "17"):
            self.assertIn("[1, 16]", self.refused("--workers", number))
        self.assertIn("not a valid value", self.refused("--workers", "many"))
        self.assertIn("workers: 1 for the 2 devices of '1,2'",
                      self.refused("--device", "1,2", "--workers", "1"))

    def test_devices_of_a_list_are_checked_each(self):
        self.assertIn("device 2 of '1,fast'", self.refused("--device", "1,fast"))
        self.assertIn("device 2 of '1,' is empty", self.refused("--device", "1,"))
        self.assertIn("more than 16 devices", self.refused("--device", ",".join("1" * 17)))

    def test_there_is_one_worker_for_each_device_listed(self):
        self.assertIn("workers = 1\n", self.printed())
        self.assertIn("workers = 3\n", self.printed("--device", "1,2,software"))
        self.assertIn("workers = 4\n", self.printed("--device", "1,2", "--workers", "4"))


if __name__ == "__main__":
    support.run_tests()
