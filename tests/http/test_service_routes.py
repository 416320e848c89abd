# SPDX-License-Identifier: MIT
"""Every route: status and schema as the OpenAPI document says, methods, headers, metrics."""
import re

import support
from support import triangle

support.needs(support.FAKE)

GETS = (
    "/",
    "/healthz",
    "/livez",
    "/readyz",
    "/metrics",
    "/openapi.json",
    "/v1/stats",
    "/v1/capabilities",
    "/v1/scenes",
    "/v1/environments",
    "/v1/views",
    "/v1/jobs", "/v1/tradeoffs",
)


class Routes(support.ServiceTest):
    def test_every_route_answers_as_documented(self):
        for path in GETS:
            self.assertEqual(200, self.daemon.request("GET", path).status, path)

    def test_the_document_lists_every_route_that_is_tested_and_no_other(self):
        documented = {path for path in self.daemon.api.document["paths"] if "{" not in path} - {
            "/v1/renders",
            "/v1/scenes/demo",
        }
        self.assertEqual(set(GETS), documented)

    def test_head_is_get_without_the_body(self):
        for path in GETS:
            head, get = self.daemon.request("HEAD", path), self.daemon.request("GET", path)
            self.assertEqual((get.status, b""), (head.status, head.body), path)
            self.assertEqual(get.header("Content-Type"), head.header("Content-Type"), path)

    def test_a_method_that_a_route_lacks_is_405_with_allow(self):
        table = {
            "/": "OPTIONS, GET, HEAD",
            "/v1/scenes": "OPTIONS, GET, HEAD, POST",
            "/v1/scenes/demo": "OPTIONS, POST",
            "/v1/scenes/" + "0" * 64: "OPTIONS, GET, HEAD, PATCH, DELETE",
            "/v1/environments": "OPTIONS, GET, HEAD, POST",
            "/v1/environments/" + "0" * 64: "OPTIONS, GET, HEAD, PATCH, DELETE",
            "/v1/renders": "OPTIONS, POST",
            "/v1/renders/one": "OPTIONS, GET, HEAD",
            "/v1/tradeoffs": "OPTIONS, GET, HEAD, POST",
            "/v1/tradeoffs/" + "0" * 16: "OPTIONS, GET, HEAD, DELETE",
        }
        for path, allow in table.items():
            for method in {"PUT", "PATCH", "BREW", "TRACE"} - set(allow.split(", ")):
                reply = self.daemon.request(method, path, b"{}")
                self.assertEqual(
                    (405, "method_not_allowed"), (reply.status, reply.code), (method, path)
                )
                self.assertEqual(allow, reply.header("Allow"))
                self.assertTrue(reply.json()["detail"].startswith(f"{method} cannot be done"))
            reply = self.daemon.request("OPTIONS", path)
            self.assertEqual((204, allow), (reply.status, reply.header("Allow")))
        self.assertEqual(405, self.daemon.request("GET", "/v1/renders").status)
        self.assertEqual(405, self.daemon.request("HEAD", "/v1/renders").status)

    def test_what_is_not_there_is_404(self):
        for path in (
            "/v1",
            "/v1/",
            "/v1/scenes/",
            "/v1/scenes//",
            "/v2/scenes",
            "/favicon.ico",
            "/..%2f..%2fetc",
            "/v1/scenes/" + "0" * 64 + "/x",
            "/v1/scenes/" + "a" * 4000,
            *([] if support.library_is_strict() else ["/v1/frames/" + "%00" * 9]),
            "/v1/scenes/..%2f..%2flock",
            "/v1/scenes/%3Cscript%3E",
            "/%ff%fe",
        ):
            reply = self.daemon.request("GET", path)
            self.assertEqual((404, "not_found"), (reply.status, reply.code), path)

    @support.unittest.skipUnless(support.library_is_strict(), "libmicrohttpd 0.9 lets NUL pass")
    def test_a_path_with_nul_is_refused_by_the_library_or_not_found(self):
        head = "GET /v1/frames/%00 HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
        answer = support.talk(self.daemon.port, head.encode())
        self.assertRegex(answer, rb"^HTTP/1\.1 (404|400) ")

    def test_every_reply_has_a_request_id_and_a_good_one_is_kept(self):
        self.assertEqual(
            "farm-7.frame_12",
            self.daemon.request(
                "GET", "/healthz", headers={"X-Request-Id": "farm-7.frame_12"}
            ).header("X-Request-Id"),
        )
        ids = {self.daemon.request("GET", "/healthz").header("X-Request-Id") for _ in range(20)}
        self.assertEqual(20, len(ids))
        for bad in ("a b", "x" * 65, "<script>", '"'):
            reply = self.daemon.request("GET", "/nowhere", headers={"X-Request-Id": bad})
            self.assertRegex(reply.header("X-Request-Id"), "^[0-9a-f]{16}$")

    def test_no_page_of_another_origin_is_let_in(self):
        reply = self.daemon.request("GET", "/v1/stats", headers={"Origin": "http://evil.example"})
        self.assertEqual(
            [], [name for name, _ in reply.headers if name.lower().startswith("access-control")]
        )

    def test_metrics_are_well_formed_and_count(self):
        self.daemon.render(self.daemon.push(triangle()))
        text = self.daemon.request("GET", "/metrics").body.decode()
        line = re.compile(r'^[a-z_]+(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [-+0-9.eE]+$')
        typed, seen = set(), set()
        for row in text.splitlines():
            if row.startswith("# TYPE "):
                name = row.split()[2]
                self.assertNotIn(name, typed, "one TYPE line per metric")
                typed.add(name)
            elif not row.startswith("#"):
                self.assertRegex(row, line)
                self.assertNotIn(row.rsplit(" ", 1)[0], seen)
                seen.add(row.rsplit(" ", 1)[0])
                self.assertIn(
                    re.sub(r"_(bucket|sum|count)$", "", re.split("[{ ]", row)[0])
                    if re.search(r"_(bucket|sum|count)(\{|$| )", row.split(" ")[0])
                    else re.split("[{ ]", row)[0],
                    typed,
                )
        for name in (
            "vitrail_build_info",
            "vitrail_http_requests_total",
            "vitrail_http_request_duration_seconds",
            "vitrail_render_stage_duration_seconds",
            "vitrail_render_queue_depth",
            "vitrail_render_queue_age_seconds",
            "vitrail_worker_restarts_total",
            "vitrail_gpu_memory_bytes",
            "vitrail_scene_cache_bytes",
            "vitrail_scene_cache_entries",
            "vitrail_scene_cache_hits_total",
            "vitrail_scene_cache_misses_total",
            "vitrail_scene_cache_evictions_total",
            "vitrail_decode_worker_crashes_total",
            "vitrail_decode_worker_timeouts_total",
        ):
            self.assertIn(name, typed)
        self.assertIn(
            'vitrail_http_requests_total{route="/v1/renders",method="POST",code="200"} ', text
        )
        self.assertNotIn("0" * 64, text)

    def test_capabilities_name_the_device_and_the_limit_as_configured(self):
        capabilities = self.daemon.request("GET", "/v1/capabilities").json()
        self.assertEqual("fake", capabilities["device"]["renderer"])
        self.assertEqual(2 << 30, capabilities["limits"]["upload_bytes"])
        self.assertIn("KHR_lights_punctual", capabilities["extensions"])

    def test_software_beside_hardware_is_warned_of_and_serves(self):
        self.assertNotIn("warning", self.daemon.request("GET", "/readyz").json())
        device = self.daemon.request("GET", "/v1/capabilities").json()["device"]
        self.assertEqual(["EGL device 1: taken"], device["devices"])
        self.assertNotIn("warning", device)
        with support.Daemon("--device", "63") as daemon:
            daemon.wait_ready()
            ready = daemon.request("GET", "/readyz")
            self.assertEqual(200, ready.status)
            self.assertIn("there is hardware", ready.json()["warning"])
            device = daemon.request("GET", "/v1/capabilities").json()["device"]
            self.assertEqual(ready.json()["warning"], device["warning"])
            self.assertIn("there is hardware", daemon.log())

    def test_the_cache_lets_go_of_what_does_not_fit(self):
        with support.Daemon("--cache-bytes", "1M") as daemon:
            daemon.wait_ready()
            big = [support.glb(self.large_document(f"big-{i}"), self.LARGE) for i in range(3)]
            scenes = [daemon.push(content) for content in big]
            for scene in scenes * 2:
                self.assertEqual(200, daemon.render(scene).status)
            cache = daemon.stats()["cache"]
            self.assertGreater(cache["evictions"], 2)
            self.assertEqual(1, cache["scenes"])

    LARGE = support.struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) * 30000

    def large_document(self, node):
        document = support.triangle_document(node)
        document["accessors"][0]["count"] = 90000
        document["bufferViews"][0]["byteLength"] = document["buffers"][0]["byteLength"] = len(
            self.LARGE
        )
        return document


if __name__ == "__main__":
    support.run_tests()
