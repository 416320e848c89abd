# SPDX-License-Identifier: MIT
"""Watching views, on the test double: multipart, server-sent events, WebSockets, slow clients."""
import concurrent.futures
import os
import signal
import time

import support
from sockets import BINARY, CLOSE, PING, TEXT, Closed, Stream, WebSocket
from support import triangle, wait_until

support.needs(support.FAKE)

LOOK = {"eye": [0, 0, 5], "target": [0, 0, 0]}
MIB = 1 << 20


class WatchTest(support.ServiceTest):
    def setUp(self):
        self.scene = self.daemon.push(triangle())

    def make(self, **members):
        body = {"scene": self.scene, "width": 64, "height": 32, "stream": {"rest_ms": 50},
                **members}
        view = self.daemon.request("POST", "/v1/views", body).json()["id"]
        self.addCleanup(self.ask, "DELETE", view)
        return view

    def ask(self, method, view, body=None, what=""):
        return self.daemon.request(method, f"/v1/views/{view}{what}", body)

    def patch(self, view, **body):
        self.assertEqual(200, self.ask("PATCH", view, body).status)

    def image(self, view, query=""):
        return self.ask("GET", view, what="/image" + query).body

    def open(self, view, what, **options):
        opener = WebSocket if what == "socket" else Stream
        client = opener(self.daemon.port, f"/v1/views/{view}/{what}", **options)
        self.addCleanup(client.__exit__)
        return client

    def counts(self):
        return self.daemon.stats()["views"]


class Multipart(WatchTest):
    def test_quick_frames_while_it_changes_and_the_exact_one_at_rest(self):
        view = self.make()
        stream = self.open(view, "stream")
        self.assertIn("multipart/x-mixed-replace", stream.headers["content-type"])
        quick, _ = stream.part()
        self.assertEqual(("image/jpeg", "0", "0.5"), tuple(
            quick[name] for name in ("content-type", "x-view-exact", "x-view-scale")))
        exact, body = stream.part()
        self.assertEqual(("image/png", "1", "1"), tuple(
            exact[name] for name in ("content-type", "x-view-exact", "x-view-revision")))
        self.assertEqual(self.image(view, "?format=png"), body)

    def test_the_frame_at_rest_is_that_of_image_in_webp_too(self):
        view = self.make(stream={"rest_format": "webp", "rest_ms": 0})
        stream = self.open(view, "stream")
        headers, body = stream.part()
        while headers["x-view-exact"] == "0":
            headers, body = stream.part()
        self.assertEqual(self.image(view, "?format=webp&quality_percent=100"), body)

    def test_all_who_watch_share_one_render_and_one_encode(self):
        view = self.make(scene=self.daemon.push(triangle("fake:slow=30")))
        streams = [self.open(view, "stream") for _ in range(5)]
        exact = []
        for stream in streams:
            headers, body = stream.part()
            while headers["x-view-exact"] == "0":
                headers, body = stream.part()
            exact.append((headers["link"], body))
        self.assertEqual(1, len(set(exact)))

    def test_a_problem_is_a_part_and_the_stream_goes_on(self):
        view = self.make(scene=self.daemon.push(triangle("fake:error")))
        stream = self.open(view, "stream")
        headers, body = stream.part()
        self.assertEqual("application/problem+json", headers["content-type"])
        self.assertIn(b"GL error", body)
        self.patch(view, exposure_ev=1)
        self.assertEqual("application/problem+json", stream.part()[0]["content-type"])

    def test_deleting_the_view_ends_the_stream(self):
        view = self.make()
        stream = self.open(view, "stream")
        stream.part()
        self.ask("DELETE", view)
        with self.assertRaises(Closed):
            while True:
                stream.part()

    def test_a_stream_closed_mid_frame_leaves_nothing_behind(self):
        view = self.make(width=2000, height=2000)
        for _ in range(5):
            stream = self.open(view, "stream", receive_buffer=4096)
            stream.chunk()
            stream.peer.close()
        wait_until(lambda: self.counts()["watchers"] == 0, "watchers are gone")
        self.assert_serves()

    def test_there_is_no_stream_of_no_view(self):
        for what in ("stream", "events"):
            self.assertEqual(404, self.ask("GET", "nobody", what="/" + what).status)


class Events(WatchTest):
    def test_changes_and_frames_are_told_with_their_stats(self):
        view = self.make()
        events = self.open(view, "events")
        self.assertEqual("text/event-stream", events.headers["content-type"])
        self.assertEqual(("view", {"revision": 1}), events.event())
        self.patch(view, exposure_ev=1)
        self.assertEqual(("view", {"revision": 2}), events.event())
        link = self.ask("GET", view, what="/image").header("Link")
        name, frame = events.event()
        self.assertEqual(("frame", 2, True), (name, frame["revision"], frame["exact"]))
        self.assertIn(frame["stats"]["id"], link)
        schema = {"$ref": "#/components/schemas/Frame"}
        self.assertEqual([], list(self.daemon.api.schemas.check(frame["stats"], schema)))

    def test_looking_on_renders_nothing(self):
        view = self.make()
        before = self.daemon.stats()["renders"]["rendered"]
        events = self.open(view, "events")
        self.assertEqual(("view", {"revision": 1}), events.event())
        self.patch(view, exposure_ev=1)
        self.assertEqual(("view", {"revision": 2}), events.event())
        time.sleep(0.3)
        self.assertEqual(before, self.daemon.stats()["renders"]["rendered"])

    def test_the_end_is_told(self):
        view = self.make()
        events = self.open(view, "events")
        events.event()
        self.ask("DELETE", view)
        self.assertEqual(("gone", {}), events.event())
        with self.assertRaises(Closed):
            events.event()


class Overlays(WatchTest):
    def test_what_lies_over_the_picture_needs_no_quick_frame(self):
        view = self.make()
        socket = self.open(view, "socket")
        socket.until_type("frame", exact=True)
        for patch in ({"highlight": {"nodes": ["#0"]}}, {"edges": {}},
                      {"highlight": {"nodes": ["#0"], "width_px": 4}}, {"highlight": None}):
            self.patch(view, **patch)
            frame = socket.until_type("frame")
            self.assertTrue(frame["exact"], patch)
        before = self.counts()["moving_frames"]
        self.patch(view, highlight={"nodes": ["#0"]}, camera=LOOK)
        self.assertFalse(socket.until_type("frame")["exact"])
        self.assertEqual(before + 1, self.counts()["moving_frames"])
        self.patch(view, highlight=None)  # while it moves, as before
        self.assertFalse(socket.until_type("frame")["exact"])


class Progress(WatchTest):
    """Frames of the double that take a second and tell how far they are."""

    def watch(self, ms, what, **members):
        self.scene = self.daemon.push(triangle(f"fake:slow={ms}"))
        view = self.make(stream={"rest_ms": 50, "budget_ms": 10}, **members)
        return view, self.open(view, what)

    def messages_before_exact(self, socket):
        messages = []
        while True:
            message = socket.receive()
            if message["type"] == "frame":
                socket.send(type="ack")
                if message["exact"]:
                    return messages
            messages.append((time.monotonic(), message))

    def test_a_long_frame_tells_a_socket_how_far_it_is(self):
        _, socket = self.watch(1600, "socket")
        messages = self.messages_before_exact(socket)
        quick = next(i for i, (_, m) in enumerate(messages) if m["type"] == "frame")
        for began, part in ((messages[0][0], messages[:quick]),
                            (messages[quick][0], messages[quick + 1:])):
            told = [(at, m) for at, m in part if m["type"] == "progress"]
            self.assertGreater(len(told), 2)
            self.assertGreater(told[0][0] - began, 0.4)  # nothing in the first half of a second
            self.assertLess(len(told), 4 * (told[-1][0] - began) + 2)  # four times a second at most
            self.assertEqual({"shading"}, {m["stage"] for _, m in told})
            shares = [m["share"] for _, m in told]
            self.assertEqual(sorted(set(shares)), shares)
            self.assertLessEqual(shares[-1], 1)

    def test_the_time_that_is_left_follows_from_the_pace(self):
        _, socket = self.watch(2500, "socket")
        known = [m for _, m in self.messages_before_exact(socket)
                 if m["type"] == "progress" and m["left_s"] is not None]
        self.assertGreater(len(known), 3)
        for message in known:  # a busy machine takes longer than the double says
            self.assertGreater(message["left_s"], 0.5 * 2.5 * (1 - message["share"]) - 0.1)
        self.assertGreater(max(m["left_s"] for m in known), known[-1]["left_s"])

    def test_quick_frames_tell_nothing(self):
        _, socket = self.watch(100, "socket")
        kinds = {m["type"] for _, m in self.messages_before_exact(socket)}
        self.assertNotIn("progress", kinds)

    def test_events_and_the_view_tell_it_too_and_then_no_more(self):
        view, events = self.watch(1600, "events")
        self.assertNotIn("progress", self.ask("GET", view).json())
        socket = self.open(view, "socket")
        name, data = events.event()
        while name != "progress":
            name, data = events.event()
        self.assertEqual({"stage", "share", "left_s"}, set(data))
        wait_until(lambda: "progress" in self.ask("GET", view).json(), "the view tells it")
        self.messages_before_exact(socket)
        self.assertNotIn("progress", self.ask("GET", view).json())

    def test_a_paused_frame_goes_on_telling_of_itself(self):
        _, socket = self.watch(1500, "socket")
        socket.until_type("frame", exact=False)
        light = self.daemon.push(triangle("fake:slow=20"))
        shares = []
        while True:
            message = socket.receive()
            if message["type"] == "frame":
                break
            if message["type"] == "progress":
                shares.append(message["share"])
                self.assertEqual(200, self.daemon.render(light, {"Priority": "u=0"}).status)
        self.assertEqual(sorted(shares), shares)


class Sockets(WatchTest):
    def exact(self, client, **expected):
        return client.until_type("frame", exact=True, **expected)

    def test_camera_up_frames_down_and_the_last_is_exact(self):
        view = self.make()
        client = self.open(view, "socket")
        self.assertEqual({"type": "hello", "view": view, "revision": 1, "credit": 2},
                         client.receive())
        for seq in range(1, 6):
            client.send(type="camera", seq=seq, camera={**LOOK, "eye": [0, 0, 1 + seq]})
        frame = self.exact(client, seq=5)
        self.assertEqual((6, "image/png", 64, 32), (frame["revision"], frame["format"],
                                                    frame["width"], frame["height"]))
        self.assertEqual(self.image(view), frame["image"])
        eye = self.ask("GET", view).json()["view"]["camera"]["eye"]
        self.assertEqual([0, 0, 6], eye)

    def test_a_change_takes_the_place_of_an_exact_frame_on_its_way(self):
        view = self.make(scene=self.daemon.push(triangle("fake:slow=150")))
        client = self.open(view, "socket")
        client.until_type("frame", exact=False)
        time.sleep(0.12)  # 50 ms of rest, and the exact frame has begun
        client.send(type="camera", seq=1, camera=LOOK)
        while True:
            message = client.receive()
            self.assertNotEqual("error", message["type"], message)
            if message["type"] == "frame":
                break
        self.assertEqual((1, False), (message["seq"], message["exact"]))
        client.send(type="ack", count=2)
        self.assertEqual(self.exact(client, seq=1)["image"], self.image(view))

    def frames_until_refined(self, client):
        frames = [client.until_type("frame")]
        while not frames[-1]["refined"]:
            client.send(type="ack")
            frames.append(client.until_type("frame"))
        client.send(type="ack")
        return frames

    def test_the_exact_frame_is_followed_by_a_refined_one(self):
        view = self.make(stream={"rest_ms": 50, "rest_samples": 16})
        before = self.counts()["refined_frames"]
        client = self.open(view, "socket")
        frames = self.frames_until_refined(client)
        self.assertEqual([(True, False), (True, True)],
                         [(frame["exact"], frame["refined"]) for frame in frames[-2:]])
        self.assertEqual(before + 1, self.counts()["refined_frames"])
        same = self.make(quality={"samples": 16})
        self.assertEqual(self.image(same), frames[-1]["image"])
        # lines over it keep its samples: no frame with fewer comes between
        client.send(type="patch", patch={"edges": {"color": [1, 0, 0]}})
        self.assertTrue(client.until_type("frame")["refined"])

    def test_a_change_ends_a_refinement(self):
        scene = self.daemon.push(triangle("fake:slow=400"))
        view = self.make(scene=scene, stream={"rest_ms": 50, "rest_samples": 8})
        client = self.open(view, "socket")
        self.exact(client, refined=False)
        client.send(type="ack", count=2)
        time.sleep(0.05)  # the refined frame has begun
        client.send(type="camera", seq=1, camera=LOOK)
        message = client.until_type("frame")
        self.assertEqual((1, False), (message["seq"], message["exact"]))
        client.send(type="ack", count=2)
        self.assertEqual(1, self.frames_until_refined(client)[-1]["seq"])

    def test_nothing_is_refined_that_has_as_many_samples_or_a_target(self):
        for quality in ({"samples": 16}, {"max_error": 0.5}, {"budget_ms": 1000},
                        {"reference": True}):
            view = self.make(stream={"rest_ms": 0, "rest_samples": 16}, quality=quality)
            client = self.open(view, "socket")
            self.exact(client, refined=False)
            client.send(type="ack", count=2)
            client.send(type="ping", id=1)
            time.sleep(0.1)
            client.send(type="camera", seq=7, camera=LOOK)
            message = client.until_type("frame")
            self.assertEqual((7, False), (message["seq"], message["refined"]), quality)

    def test_a_camera_is_answered_without_waiting_for_acknowledgements_of_tcp(self):
        client = self.open(self.make(stream={"rest_ms": 10000}), "socket")
        client.until_type("hello")
        times = []
        for seq in range(31):
            began = time.monotonic()
            client.send(type="camera", seq=seq, camera={**LOOK, "eye": [0, seq, 5]})
            client.until_type("frame", seq=seq)
            times.append(time.monotonic() - began)
        # The first ones are not delayed. Other work may delay some, an acknowledgement delays all.
        self.assertLess(sorted(times[16:])[2], 0.035, "a delayed acknowledgement takes 40 ms")

    def test_a_camera_replaces_the_old_one(self):
        view = self.make(camera={**LOOK, "fov_y_deg": 20, "up": [1, 0, 0]})
        client = self.open(view, "socket")
        client.until_type("hello")
        client.send(type="camera", camera={"fit": "top"})
        client.until_type("changed", revision=2)
        self.assertEqual({"fit": "top", "fov_y_deg": None, "ortho_height": None},
                         self.ask("GET", view).json()["view"]["camera"])

    def test_patches_are_answered_and_others_hear_of_them(self):
        view = self.make()
        one, two = self.open(view, "socket"), self.open(view, "socket")
        two.until_type("hello")
        one.send(type="patch", id=5, patch={"exposure_ev": 1})
        self.assertEqual({"type": "patched", "id": 5, "revision": 2}, one.until_type("patched"))
        self.assertEqual(2, two.until_type("changed")["revision"])
        one.send(type="patch", id="late", revision=1, patch={"exposure_ev": 2})
        error = one.until_type("error")
        self.assertEqual(("late", "precondition_failed", 2),
                         (error["id"], error["code"], error["revision"]))
        one.send(type="quality", budget_ms=70)
        one.until_type("patched", id=None)
        self.assertEqual(70, self.ask("GET", view).json()["view"]["stream"]["budget_ms"])

    def test_what_cannot_be_read_is_told_and_the_socket_stays(self):
        client = self.open(self.make(), "socket")
        for text, pointer in (
            (b"", None), (b"{", None),
            (b"[]", None), (b"{}", "/type"), (b'{"type":"jump"}', "/type"),
            (b'{"type":"ack","count":0}', "/count"), (b'{"type":"ack","size":1}', "/size"),
            (b'{"type":"camera"}', "/camera"), (b'{"type":"camera","camera":[]}', "/camera"),
            (b'{"type":"camera","camera":{"eye":[0],"target":[0,0,0]}}', "/camera/eye"),
            (b'{"type":"camera","seq":-1,"camera":{}}', "/seq"),
            (b'{"type":"patch","patch":{"width":0}}', "/width"),
            (b'{"type":"patch","patch":3}', "/patch"), (b'{"type":"ping","id":[]}', "/id"),
            (b'{"type":"quality","format":"exr"}', "/stream/format"),
        ):
            client.send_frame(TEXT, text)
            error = client.until_type("error")
            self.assertEqual(pointer, error.get("pointer"), (text, error))
        client.send(type="ping", id=7)
        self.assertEqual(7, client.until_type("pong")["id"])

    def test_without_credit_nothing_is_sent_and_with_it_the_newest(self):
        view = self.make()
        client = self.open(view, "socket")
        frames = [m for m in (client.receive() for _ in range(3)) if m["type"] == "frame"]
        self.assertEqual(2, len(frames), "hello and two frames")
        for n in range(5):
            client.send(type="camera", seq=n, camera={**LOOK, "eye": [0, 1, 3 + n]})
        client.send(type="ping", id=1)
        while (message := client.receive())["type"] != "pong":
            self.assertNotEqual("frame", message["type"])
        client.send(type="ack")
        while (message := client.receive())["type"] != "frame":
            pass
        self.assertEqual(4, message["seq"])

    def test_malformed_frames_are_answered_with_close_codes(self):
        cases = {
            "not masked": (1002, lambda c: c.send_frame(TEXT, b"{}", is_masked=False)),
            "a reserved bit": (1002, lambda c: c.send_frame(TEXT, b"{}", first=0xC0)),
            "an unknown opcode": (1002, lambda c: c.send_frame(3, b"")),
            "a long ping": (1002, lambda c: c.send_frame(PING, b"x" * 126)),
            "a split ping": (1002, lambda c: c.send_frame(PING, b"x", first=0)),
            "a continuation of nothing": (1002, lambda c: c.send_frame(0, b"x")),
            "binary": (1003, lambda c: c.send_frame(BINARY, b"x")),
            "not UTF-8": (1007, lambda c: c.send_frame(TEXT, b"\xff\xfe")),
            "too long": (1009, lambda c: c.send_frame(TEXT, b"x", length=1 << 30)),
            "half a code": (1002, lambda c: c.send_frame(CLOSE, b"\x03")),
            "no code": (None, lambda c: c.send_frame(CLOSE, b"")),
            "a code of no use": (1002, lambda c: c.send_frame(CLOSE, b"\x03\xed")),
            "a reason that is not UTF-8": (1007, lambda c: c.send_frame(CLOSE, b"\x03\xe8\xff")),
            "a length in too many bytes": (1002, lambda c: c.peer.sendall(
                b"\x81\xfe\0\x02\0\0\0\0{}")),
            "too long in pieces": (1009, lambda c: (
                c.send_frame(TEXT, b"x" * (1 << 20), first=0),
                c.send_frame(0, b"x", length=2))),
            "a goodbye": (1000, lambda c: c.send_frame(CLOSE, b"\x03\xe8bye")),
        }
        view = self.make()
        for name, (code, act) in cases.items():
            client = self.open(view, "socket")
            act(client)
            self.assertEqual(code, client.close_code(), name)
        wait_until(lambda: self.counts()["watchers"] == 0, "watchers are gone")

    def test_handshakes_that_are_none_are_refused(self):
        view = self.make()
        port = self.daemon.port
        for headers, status in (
            ({"Upgrade": None}, 400), ({"Upgrade": "h2c"}, 400), ({"Connection": "close"}, 400),
            ({"Sec-WebSocket-Version": "8"}, 400), ({"Sec-WebSocket-Key": "short"}, 400),
            ({"Sec-WebSocket-Key": None}, 400), ({"Origin": "http://evil.example"}, 400),
            ({"Sec-Fetch-Site": "cross-site"}, 400), ({"Host": "evil.example"}, 400),
            ({"Origin": f"http://127.0.0.1:{port}"}, 101), ({}, 101),
        ):
            client = self.open(view, "socket", headers=headers)
            self.assertEqual(status, client.status, headers)
        missing = self.open("nobody", "socket")
        self.assertEqual(404, missing.status)

    def test_deleting_the_view_closes_its_sockets(self):
        view = self.make()
        client = self.open(view, "socket")
        client.until_type("hello")
        self.ask("DELETE", view)
        self.assertEqual(1001, client.close_code())

    def test_a_message_in_pieces_is_one_message(self):
        client = self.open(self.make(), "socket")
        client.send_frame(TEXT, b'{"type":"pi', first=0)
        client.send_frame(0, b'ng","id":3}')
        self.assertEqual(3, client.until_type("pong")["id"])

    def test_a_flood_of_pings_by_one_who_reads_nothing_is_bounded(self):
        view = self.make()
        flood = self.open(view, "socket", receive_buffer=4096)
        flood.peer.settimeout(0.3)
        ping = bytes([0x80 | PING, 0x80 | 125]) + bytes(4) + b"x" * 125
        before = self.resident()
        # Kernels hold 40 MiB of a stream that nobody reads; the daemon is to hold next to none.
        with self.assertRaises(TimeoutError):
            for _ in range(256):
                flood.peer.sendall(ping * (MIB // len(ping)))
        self.assertLess(self.resident() - before, 8 * MIB)
        self.assert_serves()

    def test_clients_that_never_read_slow_nobody_and_hold_little(self):
        view = self.make(width=1200, height=800)
        fast = self.open(view, "socket")
        self.exact(fast)
        before = self.resident()
        lazy = [self.open(view, "socket", receive_buffer=4096) for _ in range(8)]
        lazy += [self.open(view, "stream", receive_buffer=4096) for _ in range(8)]
        for n in range(20):
            fast.send(type="camera", seq=n, camera={**LOOK, "eye": [0, 0, 5 + n]})
            fast.until_type("frame", seq=n)
        self.assertEqual(17, self.counts()["watchers"])
        self.assertLess(self.resident() - before, 64 << 20)
        for client in lazy:
            client.peer.close()
        wait_until(lambda: self.counts()["watchers"] == 1, "the lazy ones are gone")

    def resident(self):
        with open(f"/proc/{self.daemon.process.pid}/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGESIZE")

    def test_moving_frames_get_smaller_until_they_hold_the_budget(self):
        view = self.make(scene=self.daemon.push(triangle("fake:slow=40")),
                         stream={"budget_ms": 10, "min_scale": 0.2})
        client = self.open(view, "socket")
        scales = []
        for n in range(8):
            client.send(type="camera", seq=n, camera={**LOOK, "eye": [0, 0, 5 + n]})
            scales.append(client.until_type("frame", seq=n, exact=False)["scale"])
        # The test double tells a cost of a millisecond however long it sleeps; encoding adds less.
        self.assertEqual(scales, sorted(scales), "what is cheap grows")
        self.assertEqual(1, scales[-1])

    def test_a_worker_that_dies_under_a_stream_is_replaced_under_it(self):
        view = self.make(scene=self.daemon.push(triangle("fake:slow=150")))
        client = self.open(view, "socket")
        client.until_type("hello")
        client.send(type="camera", seq=1, camera=LOOK)
        os.kill(self.daemon.worker_pid(), signal.SIGKILL)
        self.exact(client, seq=1)
        self.assert_serves()

    def test_many_sockets_come_and_go(self):
        views = [self.make() for _ in range(4)]

        def visit(n):
            with WebSocket(self.daemon.port, f"/v1/views/{views[n % 4]}/socket") as client:
                client.send(type="camera", seq=n, camera={**LOOK, "eye": [0, n, 5]})
                return client.until_type("frame", seq=n)["seq"]

        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            self.assertEqual(list(range(40)), list(pool.map(visit, range(40))))
        wait_until(lambda: self.counts()["watchers"] == 0, "watchers are gone")


class Limits(WatchTest):
    flags = ("--connections", "12", "--view-idle-s", "1")

    def test_half_of_all_connections_may_watch_and_no_more(self):
        view = self.make()
        kept = [self.open(view, "stream") for _ in range(6)]
        self.assertEqual([200] * 6, [stream.status for stream in kept])
        self.assertEqual(503, self.ask("GET", view, what="/stream").status)
        self.assertEqual(503, self.open(view, "socket").status)

    def test_a_watched_view_is_not_forgotten(self):
        view = self.make()
        client = self.open(view, "socket")
        client.until_type("frame", exact=True)
        time.sleep(2.2)
        listed = self.daemon.request("GET", "/v1/views").json()["views"]
        self.assertIn(view, [one["id"] for one in listed])


class Stopping(support.unittest.TestCase):
    def test_a_stop_ends_streams_and_sockets_at_once(self):
        with support.Daemon().wait_ready() as daemon:
            body = {"scene": daemon.push(triangle()), "width": 32, "height": 16}
            view = daemon.request("POST", "/v1/views", body).json()["id"]
            path = f"/v1/views/{view}/"
            with WebSocket(daemon.port, path + "socket") as client, \
                    Stream(daemon.port, path + "stream") as stream, \
                    Stream(daemon.port, path + "events") as events:
                client.until_type("frame", exact=True)
                stream.part()
                began = time.monotonic()
                self.assertEqual(0, daemon.stop())
                self.assertLess(time.monotonic() - began, 5)
                self.assertEqual(1001, client.close_code())
                with self.assertRaises(Closed):
                    while True:
                        stream.part()
                while events.event()[0] != "gone":
                    pass


if __name__ == "__main__":
    support.run_tests()
