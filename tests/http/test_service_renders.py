# SPDX-License-Identifier: MIT
"""Renders over HTTP, on the test double: formats, tags, reports, order, cancellation."""
import concurrent.futures
import json
import socket
import struct
import time
import zlib

import support
from support import triangle

support.needs(support.FAKE)

MAGIC = {
    "image/png": b"\x89PNG\r\n\x1a\n",
    "image/jpeg": b"\xff\xd8\xff",
    "image/webp": b"RIFF",
    "image/x-exr": b"\x76\x2f\x31\x01",
}
ALL = set(MAGIC)


def read_png(content):
    """(width, height, bit depth, colour type, rows of bytes) of a PNG; knows every filter."""
    width, height, depth, colour = struct.unpack(">IIBB", content[16:26])
    data, at = b"", 8
    while at < len(content):
        (size,) = struct.unpack(">I", content[at : at + 4])
        if content[at + 4 : at + 8] == b"IDAT":
            data += content[at + 8 : at + 8 + size]
        at += 12 + size
    step = {0: 1, 2: 3, 4: 2, 6: 4}[colour] * depth // 8
    raw, rows, line = zlib.decompress(data), [], bytes(width * step)
    for y in range(height):
        kind, above = raw[y * (width * step + 1)], line
        line = bytearray(raw[y * (width * step + 1) + 1 : (y + 1) * (width * step + 1)])
        for i in range(len(line)):
            left = line[i - step] if i >= step else 0
            corner = above[i - step] if i >= step else 0
            guess = left + above[i] - corner
            paeth = min((left, above[i], corner), key=lambda v: abs(guess - v))
            line[i] = (line[i] + (0, left, above[i], (left + above[i]) // 2, paeth)[kind]) & 255
        rows.append(bytes(line))
    return width, height, depth, colour, rows


class Renders(support.ServiceTest):
    def setUp(self):
        self.scene = self.daemon.push(triangle())

    def media_type(self, accept=None, **members):
        reply = self.daemon.render(self.scene, {"Accept": accept} if accept else {}, **members)
        if reply.status != 200:
            return reply.status
        media_type = reply.header("Content-Type")
        self.assertTrue(reply.body.startswith(MAGIC[media_type]), reply.body[:16])
        return media_type

    def test_a_png_has_the_size_and_the_pixels(self):
        reply = self.daemon.render(self.scene, width=48, height=24, tone_mapping="none")
        width, height, depth, colour, rows = read_png(reply.body)
        self.assertEqual((48, 24, 8, 6), (width, height, depth, colour))
        self.assertEqual([0, 0, 0, 255], list(rows[0][:4]))
        # The double paints x / (width + height) into red: linear 47 / 72 is 210 in sRGB.
        self.assertAlmostEqual(210, rows[0][47 * 4], delta=1)

    def test_images_are_encoded_while_the_next_are_rendered(self):
        before = self.daemon.stats()["renders"]["overlapped"]
        for _ in range(3):  # one after the other
            self.assertEqual(200, self.daemon.render(self.scene, width=900, height=900).status)
        self.assertEqual(before, self.daemon.stats()["renders"]["overlapped"])
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            replies = [pool.submit(self.daemon.render, self.scene, width=1500 + i, height=1500)
                       for i in range(6)]
            self.assertEqual({200}, {reply.result().status for reply in replies})
        self.assertGreater(self.daemon.stats()["renders"]["overlapped"], before)

    def test_format_wins_over_accept(self):
        for name, media_type in (
            ("png", "image/png"),
            ("jpeg", "image/jpeg"),
            ("webp", "image/webp"),
            ("exr", "image/x-exr"),
        ):
            self.assertEqual(media_type, self.media_type("image/png;q=0.5, text/html", format=name))

    def test_accept_chooses_by_quality(self):
        table = {
            "*/*": "image/png",
            "image/*": "image/png",
            "image/jpeg": "image/jpeg",
            "": "image/png",
            "image/webp, image/jpeg;q=0.9": "image/webp",
            "image/webp;q=0.1, image/jpeg;q=0.2": "image/jpeg",
            "image/png;q=0, */*": "image/webp",
            "image/x-exr": "image/x-exr",
            "IMAGE/JPEG": "image/jpeg",
            "image/avif,image/webp,image/apng,image/*,*/*;q=0.8": "image/png",
            "text/html": 406,
            "image/avif": 406,
            "image/png;q=0": 406,
            "image/jpeg;q=nonsense": 406,
        }
        for accept, expected in table.items():
            self.assertEqual(expected, self.media_type(accept), accept)

    def test_a_query_has_no_members_but_explain(self):
        reply = self.daemon.request("POST", "/v1/renders?explian=1", {"scene": self.scene})
        self.assertEqual((400, "invalid_request"), (reply.status, reply.code))
        self.assertIn("'explian'", reply.json()["detail"])

    def test_406_lists_the_formats(self):
        reply = self.daemon.render(self.scene, {"Accept": "image/gif"})
        self.assertEqual("not_acceptable", reply.code)
        for media_type in ALL:
            self.assertIn(media_type, reply.json()["detail"])

    def test_every_output_comes_in_every_format_that_can_hold_it(self):
        for output in ("color", "depth", "normal", "albedo", "node", "material", "position",
                       "transmittance", "lights", "layers", "optical_depth"):
            for name in ("png", "jpeg", "webp", "exr"):
                reply = self.daemon.render(self.scene, output=output, format=name)
                cannot = (output in ("node", "material") and name in ("jpeg", "webp")
                          or output == "position" and name != "exr")
                self.assertEqual(
                    422 if cannot else 200, reply.status, (output, name, reply.body[:200])
                )

    def test_ids_are_exact_in_png(self):
        _, _, depth, colour, rows = read_png(
            self.daemon.render(self.scene, output="node", width=6).body
        )
        self.assertEqual((16, 0), (depth, colour))
        self.assertEqual(
            [0, 1, 2, 0, 1, 2], [int.from_bytes(rows[0][i : i + 2], "big") for i in range(0, 12, 2)]
        )

    def test_depth_is_shown_white_near_and_black_where_nothing_is(self):
        _, _, depth, _, rows = read_png(self.daemon.render(self.scene, output="depth").body)
        values = [int.from_bytes(rows[3][i : i + 2], "big") for i in range(0, len(rows[3]), 2)]
        self.assertEqual(16, depth)
        self.assertEqual([0, 65535], values[:2])
        self.assertEqual(sorted(values[1:], reverse=True), values[1:])

    def test_several_outputs_are_layers_of_one_exr(self):
        reply = self.daemon.render(self.scene, outputs=["color", "depth", "node"])
        self.assertEqual("image/x-exr", reply.header("Content-Type"))
        for channel in (b"R\0", b"A\0", b"Z\0", b"node.id\0"):
            self.assertIn(channel, reply.body[:2000])
        reply = self.daemon.render(self.scene, {"Accept": "image/png"}, outputs=["color", "depth"])
        self.assertEqual((406, "not_acceptable"), (reply.status, reply.code))
        reply = self.daemon.render(self.scene, outputs=["color", "depth"], format="png")
        self.assertEqual((400, "/format"), (reply.status, reply.json()["pointer"]))

    def test_the_reply_names_its_report(self):
        reply = self.daemon.render(self.scene, width=20, height=10)
        link = reply.header("Link")
        self.assertRegex(link, r'^</v1/frames/[0-9a-f]{16}>; rel="describedby"$')
        report = self.daemon.request("GET", link[1 : link.index(">")]).json()
        self.assertEqual(
            (self.scene, 20, 10, "fake"),
            (report["scene"], report["width"], report["height"], report["device"]),
        )
        self.assertEqual("fake.paint", report["plan"][0]["pass"])
        timing = dict(part.split(";dur=") for part in reply.header("Server-Timing").split(", "))
        self.assertEqual(
            {"queue", "paused", "prepare", "shadow", "light-list", "shade", "readback", "encode"}
            | {"other", "total"},
            set(timing),
        )
        stages = sum(float(ms) for stage, ms in timing.items() if stage != "total")
        self.assertAlmostEqual(float(timing["total"]), stages, delta=0.01)  # each is rounded
        self.assertGreater(float(timing["total"]), float(timing["encode"]))
        self.assertEqual(404, self.daemon.request("GET", "/v1/frames/0123456789abcdef").status)

    def test_the_newest_1024_reports_are_kept(self):
        first = self.daemon.render(self.scene).header("Link")
        before = self.daemon.stats()["frames_kept"]
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            list(pool.map(lambda _: self.daemon.render(self.scene, width=1, height=1), range(1024)))
        self.assertEqual(404, self.daemon.request("GET", first[1 : first.index(">")]).status)
        self.assertEqual(1024, self.daemon.stats()["frames_kept"])
        self.assertLessEqual(before, 1024)

    def test_the_tag_is_that_of_the_pixels(self):
        tag = self.daemon.render(self.scene).header("ETag")
        self.assertRegex(tag, r'^"[0-9a-f]{64}"$')
        same = {"exposure_ev": 0.0, "lights": None, "height": 16, "scene": self.scene, "width": 32}
        reply = self.daemon.request("POST", "/v1/renders", same)
        self.assertEqual(tag, reply.header("ETag"))
        for change in (
            {"width": 33},
            {"exposure_ev": 1},
            {"format": "jpeg"},
            {"output": "depth"},
            {"scene": self.daemon.push(triangle("another"))},
        ):
            members = {"scene": self.scene, **change}
            other = self.daemon.render(members.pop("scene"), **members)
            self.assertNotEqual(tag, other.header("ETag"), change)

    def test_the_tag_knows_the_budgets(self):
        tags = []
        for flags in (
            (),
            (),
            ("--gpu-budget-bytes", "64M"),
            ("--texture-budget-bytes", "64M"),
        ):
            with support.Daemon(*flags) as daemon:
                daemon.wait_ready()
                tags.append(daemon.render(daemon.push(triangle())).header("ETag"))
        self.assertEqual(tags[0], tags[1])
        self.assertEqual(3, len(set(tags)))

    def test_a_known_tag_is_answered_304_without_rendering(self):
        tag = self.daemon.render(self.scene, width=19).header("ETag")
        before = self.daemon.stats()["renders"]["rendered"]
        for value in (tag, "*", f"W/{tag}", f'"other", {tag}'):
            reply = self.daemon.render(self.scene, {"If-None-Match": value}, width=19)
            self.assertEqual((304, b""), (reply.status, reply.body))
            self.assertEqual(tag, reply.header("ETag"))
        self.assertEqual(before, self.daemon.stats()["renders"]["rendered"])
        self.assertEqual(
            200, self.daemon.render(self.scene, {"If-None-Match": '"stale"'}, width=19).status
        )

    def test_a_node_that_is_not_there_is_404_with_a_pointer(self):
        reply = self.daemon.render(self.scene, camera={"node": "Nobody"})
        self.assertEqual((404, "/camera/node"), (reply.status, reply.json().get("pointer")))

    def test_60_parallel_renders_are_all_answered(self):
        def one(index):
            reply = self.daemon.render(self.scene, width=16 + index, height=8)
            return reply.status, read_png(reply.body)[0]

        with concurrent.futures.ThreadPoolExecutor(60) as pool:
            self.assertEqual([(200, 16 + i) for i in range(60)], list(pool.map(one, range(60))))

    def test_a_connection_takes_one_request_after_the_other(self):
        connection = support.http.client.HTTPConnection("127.0.0.1", self.daemon.port, timeout=30)
        for width in range(5, 25):
            connection.request(
                "POST",
                "/v1/renders",
                json.dumps({"scene": self.scene, "width": width, "height": 4}),
                {"Content-Type": "application/json"},
            )
            reply = support.Reply(connection.getresponse())
            self.assertEqual(width, read_png(reply.body)[0])
        connection.close()


class Queue(support.ServiceTest):
    def begin(self, scene, headers=b"", **members):
        """Sends a render and does not wait; returns the connection."""
        body = json.dumps({"scene": scene, "width": 8, "height": 8, **members}).encode()
        peer = socket.create_connection(("127.0.0.1", self.daemon.port), timeout=60)
        peer.sendall(
            b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            + headers
            + b"Content-Length: %d\r\n\r\n" % len(body)
            + body
        )
        return peer

    def occupy(self, milliseconds, count=8):
        """Fills the worker's pipeline with slow renders, so that what comes next has to wait."""
        slow = self.daemon.push(triangle(f"fake:slow={milliseconds}"))
        peers = [self.begin(slow) for _ in range(count)]
        support.wait_until(
            lambda: self.daemon.stats()["renders"]["in_flight"] >= 2, "the worker is busy"
        )
        return peers

    def finish(self, peers):
        for peer in peers:
            self.assertTrue(peer.recv(20).startswith(b"HTTP/1.1 200"))
            peer.close()

    def test_urgent_renders_go_first(self):
        scene = self.daemon.push(triangle("fake:slow=100"))
        peers = self.occupy(150)
        order = []

        def one(urgency):
            self.daemon.render(scene, {"Priority": f"u={urgency}"})
            order.append(urgency)

        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            for urgency in (7, 3, 0):
                pool.submit(one, urgency)
                time.sleep(0.1)
        self.finish(peers)
        self.assertEqual([0, 3, 7], order)

    def test_a_client_that_leaves_is_taken_out_of_the_queue(self):
        def heard():
            renders = self.daemon.stats()["renders"]
            return sum(renders[k] for k in ("rendered", "cancelled", "waiting", "in_flight"))

        before = self.daemon.stats()["renders"]["cancelled"]
        scene = self.daemon.push(triangle())
        heard_before = heard()
        peers = self.occupy(500, 6)
        leaving = [self.begin(scene) for _ in range(5)]
        support.wait_until(lambda: heard() - heard_before == 11, "they wait behind the others")
        for peer in leaving:
            peer.close()
        support.wait_until(
            lambda: self.daemon.stats()["renders"]["cancelled"] - before == 5, "they are taken out"
        )
        self.finish(peers)
        self.assert_serves()

    def test_a_full_queue_replies_503_with_retry_after(self):
        scene = self.daemon.push(triangle())
        peers = self.occupy(1500, 4)
        waiting = [self.begin(scene) for _ in range(257)]
        support.wait_until(
            lambda: self.daemon.stats()["renders"]["waiting"] == 256, "the queue is full"
        )
        reply = self.daemon.render(scene)
        self.assertEqual((503, "overloaded"), (reply.status, reply.code))
        self.assertGreater(int(reply.header("Retry-After")), 0)
        statuses = [peer.recv(12)[9:] for peer in waiting]
        self.assertGreaterEqual(statuses.count(b"200"), 252)
        self.assertEqual(257, statuses.count(b"200") + statuses.count(b"503"))
        for peer in waiting:
            peer.close()
        self.finish(peers)
        self.assert_serves()


if __name__ == "__main__":
    support.run_tests()
