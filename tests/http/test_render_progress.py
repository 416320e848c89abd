# SPDX-License-Identifier: MIT
"""How far a render is that a client waits for, by its request id, on the test double."""
import concurrent.futures
import http.client
import json
import time

import support
from support import triangle

support.needs(support.FAKE)


class RenderProgress(support.ServiceTest):
    def setUp(self):
        self.pool = concurrent.futures.ThreadPoolExecutor(4)
        self.addCleanup(self.pool.shutdown)

    def scene(self, ms):
        """One whose renders take so long."""
        return self.daemon.push(triangle(f"fake:slow={ms}"))

    def begin(self, scene, request_id, **members):
        """The reply to come."""
        headers = {"X-Request-Id": request_id}
        return self.pool.submit(self.daemon.render, scene, headers, **members)

    def status(self, request_id):
        return self.daemon.request("GET", f"/v1/renders/{request_id}")

    def wait_for(self, request_id, is_so, what):
        found = []

        def look():
            reply = self.status(request_id)
            found[:] = [reply.json()]
            return reply.status == 200 and is_so(found[0])

        support.wait_until(look, what)
        return found[0]

    def test_a_long_render_tells_how_far_it_is(self):
        scene = self.scene(2500)
        began = time.monotonic()
        reply = self.begin(scene, "far.1")
        seen = []
        while not reply.done():
            status = self.status("far.1")
            if status.status == 200:
                seen.append(status.json())
            time.sleep(0.05)
        took_s = time.monotonic() - began
        self.assertEqual(200, reply.result().status)
        for status in seen:
            self.assertEqual(("far.1", scene), (status["request_id"], status["scene"]))
            self.assertLessEqual(status["elapsed_s"], took_s + 0.1)
        told = [status for status in seen if "progress" in status]
        self.assertGreater(len(told), 5)
        self.assertEqual({"rendering"}, {status["state"] for status in told})
        self.assertEqual({"shading"}, {status["progress"]["stage"] for status in told})
        shares = [status["progress"]["share"] for status in told]
        self.assertEqual(sorted(shares), shares)
        self.assertGreater(len(set(shares)), 3)
        self.assertGreater(told[0]["elapsed_s"], 0.4)  # of quicker ones nothing is told
        left = [status["progress"]["left_s"] for status in told]
        self.assertTrue(any(value is not None and 0 <= value < 3 for value in left), left)

    def test_what_has_ended_or_never_came_is_404(self):
        self.assertEqual("not_found", self.status("nobody").code)
        self.assertEqual(200, self.begin(self.scene(50), "ended").result().status)
        reply = self.status("ended")
        self.assertEqual((404, "not_found"), (reply.status, reply.code))
        self.assertIn("'ended'", reply.json()["detail"])
        self.assertEqual(404, self.status("x" * 100).status)

    def test_a_render_that_failed_is_404(self):
        scene = self.daemon.push(triangle("fake:error"))
        self.assertEqual(500, self.daemon.render(scene, {"X-Request-Id": "bad"}).status)
        self.assertEqual(404, self.status("bad").status)

    def test_one_behind_others_waits(self):
        scene, before = self.scene(50), self.scene(3000)
        first = self.begin(before, "first")
        self.wait_for("first", lambda status: status["state"] == "rendering", "it is begun")
        second = self.begin(scene, "second")
        status = self.wait_for("second", lambda _: True, "it is there")
        self.assertEqual(("waiting", scene), (status["state"], status["scene"]))
        self.assertNotIn("progress", status)
        self.assertEqual([200, 200], [first.result().status, second.result().status])

    def test_one_that_makes_way_is_paused_and_goes_on(self):
        urgent = self.scene(300)
        self.assertEqual(200, self.daemon.render(urgent).status)  # the worker has its scene now
        slow = self.begin(self.scene(2000), "slow")
        self.wait_for("slow", lambda status: "progress" in status, "it is under way")
        other = self.pool.submit(self.daemon.render, urgent, {"Priority": "u=0"}, width=48)
        status = self.wait_for("slow", lambda status: status["state"] == "paused", "it is paused")
        self.assertIn("progress", status)
        self.wait_for("slow", lambda status: status["state"] == "rendering", "it goes on")
        self.assertEqual([200, 200], [slow.result().status, other.result().status])

    def test_an_image_of_a_view_tells_it_to_each_who_waits(self):
        scene = self.scene(1800)
        view = self.daemon.request("POST", "/v1/views",
                                   {"scene": scene, "width": 32, "height": 16}).json()["id"]
        path = f"/v1/views/{view}/image"
        first, second = (self.pool.submit(self.daemon.request, "GET", path, None,
                                          {"X-Request-Id": name}) for name in ("a", "b"))
        for name in ("a", "b"):
            status = self.wait_for(name, lambda status: "progress" in status, "it is told")
            self.assertEqual((name, scene), (status["request_id"], status["scene"]))
        self.assertEqual([200, 200], [first.result().status, second.result().status])
        self.assertEqual(404, self.status("a").status)

    def test_of_several_with_one_id_the_newest_is_meant(self):
        scene, before = self.scene(900), self.scene(3000)
        first = self.begin(before, "twice")
        self.wait_for("twice", lambda status: status["state"] == "rendering", "it is begun")
        second = self.begin(scene, "twice")
        self.wait_for("twice", lambda status: status["scene"] == scene, "the other one is told")
        self.assertEqual([200, 200], [first.result().status, second.result().status])
        self.assertEqual(404, self.status("twice").status)

    def test_one_whose_client_left_is_404_soon(self):
        scene = self.scene(4000)
        peer = http.client.HTTPConnection("127.0.0.1", self.daemon.port, timeout=30)
        peer.request("POST", "/v1/renders", json.dumps({"scene": scene, "width": 32, "height": 16}),
                     {"Content-Type": "application/json", "X-Request-Id": "left"})
        self.wait_for("left", lambda status: status["state"] == "rendering", "it is begun")
        peer.close()
        support.wait_until(lambda: self.status("left").status == 404, "it is gone", 3)


if __name__ == "__main__":
    support.run_tests()
