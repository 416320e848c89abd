# SPDX-License-Identifier: MIT
"""NaN, infinity and numbers beyond every range, at every place that takes a number: refused with
the place or index of the offender, and the daemon serves on."""
import json
import struct

import support
from support import TRIANGLE, glb, triangle, triangle_document

support.needs(support.FAKE)

# As JSON writes, or pretends to write, numbers that are none; the last one overflows a double.
NOT_FINITE = ("NaN", "-Infinity", "1e999")

MATRIX = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
LIGHT = {"type": "spot", "position": [0, 2, 0], "direction": [0, -1, 0]}


def with_number(members, path, number):
    """The members as JSON, with the raw text of a number at a path."""
    members = json.loads(json.dumps(members))
    place = members
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = "@number@"
    return json.dumps(members).replace('"@number@"', number).encode()


class HostileRequests(support.ServiceTest):
    PLACES = [
        ({"camera": {"eye": [0, 0, 3], "target": [0, 0, 0]}}, ("camera", "eye", 1)),
        ({"camera": {"eye": [0, 0, 3], "target": [0, 0, 0]}}, ("camera", "target", 2)),
        ({"camera": {"matrix": MATRIX}}, ("camera", "matrix", 13)),
        ({"camera": {"fov_y_deg": 40}}, ("camera", "fov_y_deg")),
        ({"camera": {"ortho_height": 1}}, ("camera", "ortho_height")),
        ({"lights": [LIGHT, {**LIGHT, "intensity": 5}]}, ("lights", 1, "intensity")),
        ({"lights": [LIGHT, LIGHT, LIGHT]}, ("lights", 2, "position", 0)),
        ({"lights": [LIGHT]}, ("lights", 0, "direction", 1)),
        ({"lights": [{**LIGHT, "color": [1, 1, 1]}]}, ("lights", 0, "color", 2)),
        ({"lights": [{**LIGHT, "range": 1}]}, ("lights", 0, "range")),
        ({"lights": [{**LIGHT, "outer_cone_deg": 1}]}, ("lights", 0, "outer_cone_deg")),
        (
            {"overrides": {"nodes": {"Triangle": {"matrix": MATRIX}}}},
            ("overrides", "nodes", "Triangle", "matrix", 12),
        ),
        (
            {"overrides": {"materials": {"Glass": {"base_color": [1, 1, 1, 1]}}}},
            ("overrides", "materials", "Glass", "base_color", 3),
        ),
        (
            {"overrides": {"materials": {"Glass": {"transmission": 1}}}},
            ("overrides", "materials", "Glass", "transmission"),
        ),
        ({"clip_planes": [[0, 1, 0, 1], [0, 1, 0, 1]]}, ("clip_planes", 1, 3)),
        ({"background": [0, 0, 0, 0]}, ("background", 3)),
        ({"environment": {"sky": [0, 0, 0]}}, ("environment", "sky", 0)),
        ({"exposure_ev": 0}, ("exposure_ev",)),
        ({"quality": {"max_error": 1}}, ("quality", "max_error")),
    ]

    def setUp(self):
        self.scene = self.daemon.push(triangle())

    def tearDown(self):
        self.assert_serves()

    def post(self, body):
        return self.daemon.request(
            "POST", "/v1/renders", body, {"Content-Type": "application/json"}
        )

    def test_what_is_no_finite_number_is_refused_everywhere(self):
        for members, path in self.PLACES:
            for number in NOT_FINITE:
                reply = self.post(with_number({"scene": self.scene, **members}, path, number))
                self.assertEqual(
                    (400, "invalid_request"), (reply.status, reply.code), (path, number)
                )
                self.assertTrue(reply.json()["detail"], (path, number))

    def test_what_is_beyond_its_range_is_refused_with_its_place(self):
        for members, path in self.PLACES:
            for number in ("1e300", "-1e300"):
                reply = self.post(with_number({"scene": self.scene, **members}, path, number))
                self.assertEqual(
                    (400, "invalid_request"), (reply.status, reply.code), (path, number)
                )
                pointer = "/" + "/".join(str(key) for key in path)
                found = reply.json()["pointer"]
                self.assertTrue(
                    pointer.startswith(found) and found.count("/") >= min(2, pointer.count("/")),
                    (path, number, reply.json()),
                )

    def test_a_million_lights_are_refused_by_number(self):
        light = json.dumps({"type": "point", "position": [0, 1, 0]})
        lights = ",".join([light] * 65_537)
        reply = self.post(f'{{"scene":"{self.scene}","lights":[{lights}]}}'.encode())
        self.assertIn(reply.status, (400, 413))
        self.assertIn("65536", reply.json()["detail"].replace(",", ""))
        whole = ",".join([light] * 1_000_000)
        reply = self.post(f'{{"scene":"{self.scene}","lights":[{whole}]}}'.encode())
        self.assertEqual((413, "too_large"), (reply.status, reply.code))


class HostileScenes(support.ServiceTest):
    def tearDown(self):
        self.assert_serves()

    def refuse(self, content, *words):
        reply = self.daemon.post_scene(content)
        self.assertEqual(422, reply.status, reply.body)
        for word in words:
            self.assertIn(word, reply.json()["detail"])
        self.assertEqual(0, self.daemon.stats()["decodes"]["crashes"])

    def test_a_vertex_that_is_no_number_is_named_by_its_index(self):
        good = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        for value in (float("nan"), float("inf"), float("-inf")):
            for place in (0, 4, 8):
                floats = [*good[:place], value, *good[place + 1 :]]
                self.refuse(
                    glb(triangle_document(), struct.pack("<9f", *floats)), f"element {place // 3}"
                )

    def test_a_node_that_leads_nowhere_is_named(self):
        for member, value in (
            ("translation", [0, 1e400, 0]),
            ("scale", [1e400, 1, 1]),
            ("matrix", [*MATRIX[:12], 1e999, 0, 0, 1]),
        ):
            document = triangle_document()
            document["nodes"][0][member] = value
            text = glb(document, TRIANGLE)  # json writes Infinity, as a broken exporter does
            self.refuse(text)

    def test_a_light_or_material_out_of_its_range_is_named(self):
        def lit(**light):
            document = triangle_document()
            document["extensionsUsed"] = ["KHR_lights_punctual"]
            document["extensions"] = {
                "KHR_lights_punctual": {"lights": [{"type": "point"}, {"type": "point", **light}]}
            }
            document["nodes"][0]["extensions"] = {"KHR_lights_punctual": {"light": 1}}
            return glb(document, TRIANGLE)

        def coloured(color):
            document = triangle_document()
            document["materials"] = [
                {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1]}},
                {"pbrMetallicRoughness": {"baseColorFactor": color}},
            ]
            document["meshes"][0]["primitives"][0]["material"] = 1
            return glb(document, TRIANGLE)

        self.refuse(lit(intensity=-1), "light 1")
        self.refuse(lit(color=[1, 1, -5]), "light 1")
        self.refuse(lit(range=-2), "light 1")
        self.refuse(coloured([1, 1, 1, 1.5]), "material 1")
        self.refuse(coloured([1, -1, 1, 1]), "material 1")


if __name__ == "__main__":
    support.run_tests()
