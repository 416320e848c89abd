# SPDX-License-Identifier: MIT
"""Two workers that really draw: their pictures are the same bits, also those whose technique goes
by what was measured and learned, and a worker that is killed costs a job nothing. Uses what drivers
offer; without any the file is skipped."""
import concurrent.futures
import glob
import json
import os
import re
import signal
import struct
import unittest

import support
from test_service_real import lit_floor

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)

SIZE = {"width": 96, "height": 64}


def turning(glb):
    """The GLB with an animation that lifts its first node for a hundred seconds."""
    length, = struct.unpack_from("<I", glb, 12)
    document, binary = json.loads(glb[20:20 + length]), glb[28 + length:]
    data = struct.pack("<2f", 0, 100) + struct.pack("<6f", 0, 0, 0, 0, 1, 0)
    views, accessors, start = document["bufferViews"], document["accessors"], len(binary)
    views += [{"buffer": 0, "byteOffset": start, "byteLength": 8},
              {"buffer": 0, "byteOffset": start + 8, "byteLength": 24}]
    accessors += [{"bufferView": len(views) - 2, "componentType": 5126, "count": 2,
                   "type": "SCALAR", "min": [0], "max": [100]},
                  {"bufferView": len(views) - 1, "componentType": 5126, "count": 2,
                   "type": "VEC3"}]
    document["buffers"][0]["byteLength"] = start + len(data)
    document["animations"] = [{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": len(accessors) - 2, "output": len(accessors) - 1}]}]
    return support.glb(document, binary + data)


def start(*flags, **options):
    daemon = support.Daemon(*flags, program=REAL, **options).wait_device()
    support.wait_until(lambda: all(worker["ready"] for worker in daemon.stats()["workers"]),
                       "all workers are ready", 180)
    return daemon


def workers(daemon, member):
    return [worker[member] for worker in daemon.stats()["workers"]]


def run_job(daemon, scene, frames):
    view = {**SIZE, "quality": {"shadows": "deep"}}  # auto may differ: one worker is faster
    body = {"scene": scene, "view": view, "frames": frames, "frame_rate": 1}
    return daemon.request("POST", "/v1/jobs", body).json()["id"]


def wait_for(daemon, name):
    def state():
        return daemon.request("GET", f"/v1/jobs/{name}").json()["state"]

    support.wait_until(lambda: state() not in ("queued", "running"), "the job ends", 300)
    assert state() == "done"
    frames = daemon.request("GET", f"/v1/jobs/{name}/frames").json()["frames"]
    return {frame["frame"]: frame["files"][0]["sha256"] for frame in frames}


def expected_times(daemon, scene, index, count):
    """What that worker expected of each of so many frames, which it then drew."""
    quality = {"shadows": "raytraced", "samples": 1, "budget_ms": 60000}
    drawn, expected = workers(daemon, "rendered")[index], []
    for step in range(count):
        camera = {"eye": [step / 8, 2, 3], "target": [0, 0, 0]}
        reply = daemon.render(scene, quality=quality, camera=camera, **SIZE)
        report = re.match("<(.*?)>", reply.header("Link")).group(1)
        expected.append(daemon.request("GET", report).json()["chosen"]["expected_ms"])
    assert workers(daemon, "rendered")[index] == drawn + count
    return expected


def expected_by_second(daemon, scene, count):
    """Likewise of the second worker, while the first one, which goes before it, stands still with
    two frames that teach no times."""
    first = workers(daemon, "pid")[0]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        os.kill(first, signal.SIGSTOP)
        try:
            waiting = [pool.submit(daemon.render, scene, quality={"shadows": "raytraced"}, **SIZE)
                       for _ in range(2)]
            support.wait_until(lambda: workers(daemon, "in_flight") == [2, 0], "both wait")
            expected = expected_times(daemon, scene, 1, count)
        finally:
            os.kill(first, signal.SIGCONT)
        assert [one.result().status for one in waiting] == [200, 200]
    return expected


class TwoWorkers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = start("--workers", "2")
        cls.scene = cls.daemon.push(turning(lit_floor()))

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            assert cls.daemon.stop() == 0

    def test_a_job_is_that_of_one_worker_also_when_one_is_killed(self):
        name = run_job(self.daemon, self.scene, "1-12")
        support.wait_until(lambda: min(workers(self.daemon, "rendered")) > 1, "both draw it", 120)
        os.kill(workers(self.daemon, "pid")[1], signal.SIGKILL)
        made = wait_for(self.daemon, name)
        self.assertEqual(list(range(1, 13)), sorted(made))
        self.assertEqual([0, 1], workers(self.daemon, "crashes"))
        self.assertGreaterEqual(self.daemon.stats()["renders"]["rendered"], 12)
        with start("--workers", "1", "--auto", "raster") as alone:
            scene = alone.push(turning(lit_floor()))
            self.assertEqual(made, wait_for(alone, run_job(alone, scene, "1-12")))
            self.assertEqual(0, alone.stop())

    def test_the_same_request_gives_the_same_bytes_on_each(self):
        for quality in ({"shadows": "auto"}, {"shadows": "deep", "samples": 4}):
            support.wait_until(lambda: all(workers(self.daemon, "ready")), "both are ready", 120)
            self.daemon.render(self.scene, quality=quality, **SIZE)  # so that one has it
            before = workers(self.daemon, "rendered")
            replies = self.ask_until_both_drew(before, quality)
            self.assertEqual({200}, {reply.status for reply in replies})
            bodies = {}  # by tag, which changes when more is learned
            for reply in replies:
                bodies.setdefault(reply.header("ETag"), set()).add(reply.body)
            self.assertEqual({1}, {len(of_tag) for of_tag in bodies.values()}, quality)
            self.assertLess(len(bodies), len(replies), quality)

    def ask_until_both_drew(self, before, quality):
        """More at once than one worker is given before another one is."""
        replies = []
        with concurrent.futures.ThreadPoolExecutor(6) as pool:
            def both_drew():
                asked = [pool.submit(self.daemon.render, self.scene, quality=quality,
                                     format="png", timeout=300, **SIZE) for _ in range(6)]
                replies.extend(reply.result() for reply in asked)
                now = workers(self.daemon, "rendered")
                return all(new > old for new, old in zip(now, before))

            support.wait_until(both_drew, "both drew it", 120)
        return replies

    def test_what_one_measured_all_go_by(self):
        log = self.daemon.log()
        self.assertEqual(1, log.count("shadows auto takes the faster by forecast"), log)
        self.assertLess(log.index("shadows auto takes the faster"), log.index("worker 2 is ready"))

    def test_frames_of_every_worker_teach(self):
        with support.tempfile.TemporaryDirectory() as state:
            with start("--workers", "2", state_dir=state) as first:
                scene = first.push(lit_floor())
                first.render(scene, quality={"shadows": "auto"}, **SIZE)  # measures the device
                first.stop()
            speed, = glob.glob(f"{state}/cache/device-speed*.json")
            learned = speed.replace("device-speed", "forecasts")
            with open(speed, encoding="utf-8") as file:
                numbers = json.load(file)
            with open(speed, "w", encoding="utf-8") as file:  # so that frames have much to teach
                json.dump({key: value if key == "key" else 8 * value
                           for key, value in numbers.items()}, file)
            with start("--workers", "2", state_dir=state) as daemon, \
                    concurrent.futures.ThreadPoolExecutor(2) as pool:
                keeper = workers(daemon, "pid")[0]

                def ask(step=0):  # frames that keep surfaces of the last one teach nothing
                    camera = {"eye": [step / 8, 2, 3], "target": [0, 0, 0]}
                    return daemon.render(scene, quality={"shadows": "auto"}, camera=camera,
                                         **SIZE).status

                os.kill(keeper, signal.SIGSTOP)
                try:
                    waiting = [pool.submit(ask) for _ in range(2)]  # too few to teach anything
                    support.wait_until(lambda: workers(daemon, "in_flight") == [2, 0], "both wait")
                    self.assertEqual({200}, {ask(step) for step in range(8)})
                    self.assertEqual([0, 8], workers(daemon, "rendered"))
                finally:
                    os.kill(keeper, signal.SIGCONT)
                self.assertEqual([200, 200], [one.result() for one in waiting])
                support.wait_until(lambda: os.path.exists(learned), "something is learned")
                with open(learned, encoding="utf-8") as file:
                    self.assertGreaterEqual(json.load(file)["observations"], 3)
                daemon.stop()

    def test_times_of_every_worker_teach_all_others(self):
        with support.tempfile.TemporaryDirectory() as state:
            with start("--workers", "2", state_dir=state) as first:
                scene = first.push(lit_floor())
                first.render(scene, quality={"shadows": "auto"}, **SIZE)  # measures the device
                first.stop()
            speed, = glob.glob(f"{state}/cache/device-speed*.json")
            with open(speed, encoding="utf-8") as file:
                numbers = json.load(file)
            with open(speed, "w", encoding="utf-8") as file:  # so that frames have much to teach
                json.dump({key: value if key == "key" else 30 * value
                           for key, value in numbers.items()}, file)
            for is_first_taught in (True, False):
                for kept in glob.glob(f"{state}/cache/budgets*.json"):
                    os.remove(kept)
                with start("--workers", "2", state_dir=state) as daemon:
                    if is_first_taught:
                        taught = expected_by_second(daemon, scene, 8)
                        learned, = expected_times(daemon, scene, 0, 1)
                    else:
                        taught = expected_times(daemon, scene, 0, 8)
                        learned, = expected_by_second(daemon, scene, 1)
                    self.assertLess(2 * learned, taught[0], taught)
                    daemon.stop()
                kept, = glob.glob(f"{state}/cache/budgets*.json")
                with open(kept, encoding="utf-8") as file:  # which the first one wrote
                    self.assertEqual(9, json.load(file)["observations"])


if __name__ == "__main__":
    support.run_tests()
