# SPDX-License-Identifier: MIT
"""Broken, hostile and odd input: a problem that says what, and a daemon that serves on."""
import json
import os
import re
import struct

import support
from support import TRIANGLE, glb, multipart, triangle, triangle_document

support.needs(support.FAKE)

ID = "0" * 64
MANUAL = os.path.join(
    os.path.dirname(os.path.abspath(__file__)), "../../docs/reference/requests.md"
)


def changed(change):
    """A triangle whose document was changed by a function."""
    document = triangle_document()
    change(document)
    return glb(document, TRIANGLE)


def set_at(path, value):
    def change(document):
        for key in path[:-1]:
            document = document[key]
        document[path[-1]] = value

    return changed(change)


def documented_shadow_techniques():
    """The names that the manual of requests lists for `shadows`."""
    with open(MANUAL, encoding="utf-8") as manual:
        row = re.search(r"^\| `shadows` \| (`auto`.*?) \|", manual.read(), re.MULTILINE)
    return re.findall(r"`([a-z-]+)`", row.group(1))


class BadRequests(support.ServiceTest):
    def setUp(self):
        self.scene = self.daemon.push(triangle())

    def tearDown(self):
        self.assert_serves()

    def post(self, body):
        return self.daemon.request(
            "POST", "/v1/renders", body, {"Content-Type": "application/json"}
        )

    def test_broken_json_is_refused(self):
        deep = "[" * 100000
        for body in (
            b"",
            b"{",
            b"[]",
            b"null",
            b"\0",
            b'{"scene":"' + b"\xff" * 8 + b'"}',
            b"{}}",
            deep.encode(),
            b"\xef\xbb\xbf{}",
            b'{"scene":' + b"9" * 5000 + b"}",
        ):
            reply = self.post(body)
            self.assertEqual((400, "invalid_request"), (reply.status, reply.code), body[:20])

    def test_members_of_wrong_type_or_range_are_refused_with_a_pointer(self):
        table = [
            ("/width", 0),
            ("/width", -1),
            ("/width", 16385),
            ("/width", 1.5),
            ("/width", "1"),
            ("/height", 10**15),
            ("/scene", 5),
            ("/camera", []),
            ("/lights", {}),
            ("/lights/0", 1),
            ("/exposure_ev", "bright"),
            ("/exposure_ev", "automatic"),
            ("/exposure_ev", ["auto"]),
            ("/exposure_ev", 1e9),
            ("/background/1", [0, -1, 0, 0]),
            ("/quality/shadows", {"shadows": "no-such"}),
            ("/quality/samples", {"samples": 3}),
            ("/outputs", []),
            ("/output", "beauty"),
            ("/format", "gif"),
            ("/clip_planes/0", [[0, 0, 0, 1]]),
            ("/nonsense", 1),
        ]
        for pointer, value in table:
            member = pointer.split("/")[1]
            if pointer == "/lights/0":
                value = [value]
            reply = self.post(json.dumps({"scene": self.scene, member: value}).encode())
            self.assertEqual(400, reply.status, (pointer, value, reply.body))
            self.assertTrue(
                reply.json()["pointer"].startswith(pointer), (pointer, value, reply.json())
            )

    def test_numbers_that_are_no_numbers_are_refused(self):
        for number in ("NaN", "Infinity", "-Infinity", "1e999", "0x10", "+1", "01"):
            body = f'{{"scene":"{self.scene}","exposure_ev":{number}}}'.encode()
            self.assertEqual(400, self.post(body).status, number)

    def test_documented_techniques_are_there_and_unknown_ones_and_scenes_are_not(self):
        names = documented_shadow_techniques()
        self.assertIn("silhouette", names)
        for name in names:
            reply = self.daemon.render(self.scene, quality={"shadows": name})
            self.assertEqual(200, reply.status, name)
        reply = self.daemon.render(self.scene, quality={"shadows": "silhouettes"})
        self.assertEqual((400, "invalid_request", "/quality/shadows"),
                         (reply.status, reply.code, reply.json()["pointer"]))
        self.assertIn("silhouette", reply.json()["detail"])
        reply = self.daemon.render(ID)
        self.assertEqual(
            (404, "not_found", "/scene"), (reply.status, reply.code, reply.json()["pointer"])
        )

    def test_broken_json_is_told_in_plain_words(self):
        for text, words in ((b'"a\\u0000b"', "a text holds \\u0000"), (b"1e999", "too large"),
                            (b"9" * 40, "too large")):
            reply = self.post(b'{"scene":' + text + b"}")
            self.assertEqual(400, reply.status, text)
            self.assertIn(words, reply.json()["detail"])
            self.assertNotIn("JSON_", reply.json()["detail"])

    def test_an_explain_without_a_value_draws_nothing(self):
        for query in ("explain", "explain=", "explain=1&explain=json", "explain=1&x=2"):
            reply = self.daemon.request("POST", f"/v1/renders?{query}", {"scene": self.scene})
            self.assertEqual((400, "invalid_request"), (reply.status, reply.code), query)

    def test_cameras_that_see_nothing_are_refused(self):
        for camera in (
            {"eye": [0, 0, 0], "target": [0, 0, 0]},
            {"matrix": [0] * 16},
            {"fit": "beside"},
            {"eye": [0, 0, 5], "target": [0, 0, 0], "fov_y_deg": 180},
            {"node": ""},
            {"eye": [0, 5, 0], "target": [0, 0, 0], "up": [0, 1, 0]},
        ):
            self.assertEqual(400, self.daemon.render(self.scene, camera=camera).status, camera)

    def test_a_body_of_another_type_is_415(self):
        for media_type in (
            "text/plain",
            "application/x-www-form-urlencoded",
            "",
            "application/jsonx",
        ):
            reply = self.daemon.request("POST", "/v1/renders", b"{}", {"Content-Type": media_type})
            self.assertEqual(
                (415, "unsupported_media_type"), (reply.status, reply.code), media_type
            )

    def test_a_request_over_the_limit_is_413(self):
        reply = self.post(b" " * (33 << 20))
        self.assertEqual((413, "too_large"), (reply.status, reply.code))


class BadScenes(support.ServiceTest):
    def tearDown(self):
        self.assert_serves()

    def refuse(self, content, media_type="model/gltf-binary", status=422):
        before = self.daemon.stats()["decodes"]["crashes"]
        reply = self.daemon.post_scene(content, media_type)
        self.assertEqual(status, reply.status, (content[:60], reply.body))
        self.assertEqual(
            before, self.daemon.stats()["decodes"]["crashes"], (content[:60], reply.body)
        )
        self.assertTrue(reply.json()["detail"])
        return reply

    def test_truncated_glb_is_refused_at_every_length(self):
        whole = triangle()
        for length in list(range(1, 28)) + [len(whole) // 2, len(whole) - 1, len(whole) - 12]:
            self.refuse(whole[:length])

    def test_an_empty_body_is_refused(self):
        self.refuse(b"")

    def test_headers_that_lie_are_refused(self):
        whole = bytearray(triangle())
        for offset in (4, 8, 12):
            for value in (0, 1, 0x7FFFFFFF, 0xFFFFFFFF):
                content = bytearray(whole)
                struct.pack_into("<I", content, offset, value)
                self.refuse(bytes(content))

    def test_json_that_is_broken_is_refused(self):
        for text in (
            b"",
            b"{",
            b"[]",
            b"null",
            b"{}",
            b"\xff\xfe",
            b"[" * 50000,
            b'{"asset":{"version":"9.9"}}',
        ):
            self.refuse(glb(text, TRIANGLE))

    def test_counts_offsets_and_indices_that_lead_out_are_refused(self):
        for path, value in [
            (("accessors", 0, "count"), 4),
            (("accessors", 0, "count"), 2**31),
            (("accessors", 0, "count"), -1),
            (("accessors", 0, "bufferView"), 7),
            (("accessors", 0, "byteOffset"), 4),
            (("accessors", 0, "componentType"), 1),
            (("bufferViews", 0, "byteLength"), 10**12),
            (("bufferViews", 0, "buffer"), 3),
            (("bufferViews", 0, "byteOffset"), 2**40),
            (("buffers", 0, "byteLength"), 10**9),
            (("nodes", 0, "mesh"), 99),
            (("nodes", 0, "children"), [0]),
            (("scenes", 0, "nodes"), [5]),
        ]:
            self.refuse(set_at(path, value))

    def test_numbers_that_are_not_finite_are_refused(self):
        self.refuse(
            glb(triangle_document(), struct.pack("<9f", float("nan"), 0, 0, 1, 0, 0, 0, 1, 0))
        )
        self.refuse(
            glb(triangle_document(), struct.pack("<9f", float("inf"), 0, 0, 1, 0, 0, 0, 1, 0))
        )
        self.refuse(set_at(("nodes", 0, "translation"), [1e400, 0, 0]))

    def test_members_of_extensions_are_refused_by_their_place(self):
        """tests/unit/test_bad_members.c has all of them; these arrive as they were said."""

        def coat(value):
            coat = {"KHR_materials_clearcoat": {"clearcoatFactor": value}}
            return triangle(materials=[{"name": "Lacquer", "extensions": coat}])

        place = "materials[0].extensions.KHR_materials_clearcoat.clearcoatFactor"
        for content, words in [
            (coat("1"), place + " must be a number"),
            (coat(None), place + " must be a number"),
            (coat(float("nan")), place + " must be a number"),
            (coat(1.5), "material 0 'Lacquer': clearcoatFactor is 1.5, not in [0, 1]"),
            (
                set_at(("nodes", 0, "extensions"), {"KHR_lights_punctual": {"light": -1}}),
                "nodes[0].extensions.KHR_lights_punctual.light must be a whole number",
            ),
            (
                set_at(("bufferViews", 0, "extensions"), {"EXT_meshopt_compression": {}}),
                "bufferViews[0].extensions.EXT_meshopt_compression has no buffer",
            ),
            (set_at(("nodes", 0, "mesh"), 2**32), "nodes[0].mesh must be a whole number of at"),
        ]:
            self.assertIn(words, self.refuse(content).json()["detail"])

    def test_uris_that_lead_out_of_the_upload_are_refused(self):
        for uri in (
            "../secret.bin",
            "/etc/passwd",
            "file:///etc/passwd",
            "http://127.0.0.1/x",
            "..%2fsecret.bin",
            "a/../../b",
            "C:\\secret",
            "/proc/self/mem",
            "missing.bin",
        ):
            document = triangle_document()
            document["buffers"][0]["uri"] = uri
            reply = self.refuse(
                *multipart({"s.gltf": json.dumps(document).encode(), "t.bin": TRIANGLE})
            )
            self.assertNotIn(b"root:", reply.body)

    def test_a_required_extension_that_is_unknown_is_named(self):
        reply = self.refuse(
            triangle(extensionsUsed=["EXT_secret"], extensionsRequired=["EXT_secret"])
        )
        self.assertIn("EXT_secret", reply.json()["detail"])

    def test_an_optional_extension_that_is_unknown_is_a_warning(self):
        reply = self.daemon.post_scene(triangle(extensionsUsed=["EXT_fancy"]))
        self.assertEqual(201, reply.status)
        self.assertIn("EXT_fancy", reply.json()["extensions"]["ignored"])

    def test_names_of_parts_must_be_plain_relative_paths(self):
        content = triangle()
        for name in (
            "/abs.glb",
            "../up.glb",
            "a/../b.glb",
            "a//b.glb",
            "a/./b.glb",
            "a\\b.glb",
            "x" * 600 + ".glb",
            "tab\t.glb",
        ):
            self.refuse(*multipart({name: content}), status=400)

    def test_multipart_that_is_broken_is_400(self):
        body, media_type = multipart({"a.glb": triangle()})
        for bad, kind in (
            (body[:-6], media_type),
            (b"", media_type),
            (body, "multipart/form-data"),
            (body, "multipart/form-data; boundary="),
            (body, "multipart/form-data; boundary=other"),
            (body, "multipart/form-data; boundary=" + "b" * 71),
            (b"--xYzZy--\r\n", media_type),
            (body.replace(b"Content-Disposition", b"X"), media_type),
            (body.replace(b"form-data", b"attachment"), media_type),
            (body.replace(b"xYzZy\r\n", b"xYzZyQ", 1), media_type),
        ):
            self.refuse(bad, kind, status=400)

    def test_a_file_that_comes_twice_and_too_many_files_are_refused(self):
        body, media_type = multipart({"a.glb": triangle()})
        twice = body[: body.index(b"--xYzZy--")] + body
        self.refuse(twice, media_type, status=400)
        reply = self.refuse(*multipart({f"{i}.bin": b"x" for i in range(1025)}), status=413)
        self.assertIn("1024", reply.json()["detail"])

    def test_a_scene_of_another_type_is_415(self):
        for media_type in ("text/plain", "application/zip", "model/vnd.usdz+zip"):
            self.assertEqual(415, self.daemon.post_scene(triangle(), media_type).status)

    def test_random_damage_never_ends_a_decoder(self):
        import random

        rng = random.Random(2)
        for _ in range(60):
            content = bytearray(triangle())
            for _ in range(rng.randint(1, 12)):
                content[rng.randrange(len(content))] = rng.randrange(256)
            reply = self.daemon.post_scene(bytes(content))
            self.assertIn(reply.status, (200, 201, 422))
        self.assertEqual(0, self.daemon.stats()["decodes"]["crashes"])


if __name__ == "__main__":
    support.run_tests()
