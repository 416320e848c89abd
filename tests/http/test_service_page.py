# SPDX-License-Identifier: MIT
"""The viewer as it is served: types, tags, policy; and the outline of scenes that it edits."""
import os
import re

import support

support.needs(support.FAKE)

VIEWER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/viewer")
TYPES = {"html": "text/html; charset=utf-8", "js": "text/javascript; charset=utf-8",
         "css": "text/css; charset=utf-8", "svg": "image/svg+xml"}


def read(name):
    with open(os.path.join(VIEWER, name), "rb") as file:
        return file.read()


class Page(support.ServiceTest):
    def test_every_file_of_the_viewer_is_served_as_it_is_with_its_type(self):
        names = sorted(os.listdir(VIEWER))
        self.assertGreater(len(names), 10)
        for name in names:
            reply = self.daemon.request("GET", "/viewer/" + name)
            self.assertEqual(200, reply.status, name)
            self.assertEqual(read(name), reply.body, name)
            self.assertEqual(TYPES[name.rsplit(".", 1)[1]], reply.header("Content-Type"))

    def test_the_root_is_the_page(self):
        reply = self.daemon.request("GET", "/")
        self.assertEqual(read("index.html"), reply.body)
        self.assertEqual("text/html; charset=utf-8", reply.header("Content-Type"))

    def test_the_policy_lets_nothing_in_but_files_of_this_server(self):
        for path in ("/", "/viewer/main.js", "/viewer/icon.svg"):
            reply = self.daemon.request("GET", path)
            policy = dict(part.strip().split(" ", 1)
                          for part in reply.header("Content-Security-Policy").split(";"))
            self.assertEqual("'none'", policy["default-src"])
            for what in ("script-src", "style-src", "connect-src"):
                self.assertEqual("'self'", policy[what])
            self.assertEqual("'self' blob: data:", policy["img-src"])
            self.assertEqual("'none'", policy["frame-ancestors"])
            self.assertEqual("nosniff", reply.header("X-Content-Type-Options"))
            self.assertEqual("no-referrer", reply.header("Referrer-Policy"))

    def test_a_known_tag_is_304_and_each_content_has_its_own(self):
        tags = set()
        for path in ("/", "/viewer/main.js", "/viewer/viewer.css"):
            reply = self.daemon.request("GET", path)
            tag = reply.header("ETag")
            self.assertEqual(f'"{support.sha256(reply.body)}"', tag)
            self.assertEqual("no-cache", reply.header("Cache-Control"))
            again = self.daemon.request("GET", path, headers={"If-None-Match": tag})
            self.assertEqual((304, b"", tag), (again.status, again.body, again.header("ETag")))
            head = self.daemon.request("HEAD", path)
            self.assertEqual((200, b"", tag), (head.status, head.body, head.header("ETag")))
            tags.add(tag)
        self.assertEqual(3, len(tags))

    def test_other_names_are_404(self):
        for name in ("nothing.js", "..%2fmain.c", ".", "MAIN.JS", "%2e%2e", "a" * 300):
            reply = self.daemon.request("GET", "/viewer/" + name)
            self.assertEqual((404, "not_found"), (reply.status, reply.code), name)
        self.assertEqual(404, self.daemon.request("GET", "/viewer/").status)
        self.assertEqual(405, self.daemon.request("POST", "/viewer/main.js", b"x").status)

    def test_page_and_modules_name_no_other_server_and_hold_no_inline_code(self):
        page = read("index.html").decode()
        self.assertIsNone(re.search(r"<style|\son\w+=|\sstyle=|javascript:", page))
        self.assertEqual(["type=\"module\" src=\"/viewer/main.js\""],
                         re.findall(r"<script ([^>]*)></script>", page))
        for name in os.listdir(VIEWER):
            found = re.findall(r"https?://[^\s\"'`)]+", read(name).decode())
            self.assertEqual([], [url for url in found if "www.w3.org" not in url], name)
            for missing in re.findall(r'from "\./([^"]+)"', read(name).decode()):
                self.assertTrue(os.path.exists(os.path.join(VIEWER, missing)), (name, missing))


class Outline(support.ServiceTest):
    def scene(self):
        document = support.triangle_document("Pane")
        document["nodes"] = [
            {"name": "Root", "children": [1, 2, 3], "translation": [1, 2, 3]},
            {"name": "Pane", "mesh": 0, "scale": [2, 2, 2]},
            {"name": "Lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"name": "Eye", "camera": 0},
        ]
        document["materials"] = [{"name": "Ruby", "alphaMode": "BLEND", "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0, 0.25, 0.5], "roughnessFactor": 0.25}}]
        document["meshes"][0]["primitives"][0]["material"] = 0
        document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]
        document["extensionsUsed"] = ["KHR_lights_punctual"]
        document["extensions"] = {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "color": [1, 0.5, 0.25], "intensity": 40,
             "spot": {"outerConeAngle": 0.5}}]}}
        return self.daemon.push(support.glb(document, support.TRIANGLE))

    def test_it_tells_what_can_be_edited_in_the_words_of_requests(self):
        outline = self.daemon.request("GET", f"/v1/scenes/{self.scene()}/outline").json()
        nodes = {node["name"]: node for node in outline["nodes"]}
        root = [node["name"] for node in outline["nodes"]].index("Root")
        self.assertIsNone(nodes["Root"]["parent"])
        self.assertEqual(root, nodes["Pane"]["parent"])
        self.assertEqual([0], nodes["Pane"]["materials"])
        self.assertEqual([1, 2, 3, 3, 4, 3], nodes["Pane"]["bounds"])
        self.assertIsNone(nodes["Lamp"]["bounds"])
        self.assertEqual([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1], nodes["Pane"]["matrix"])
        self.assertEqual([1, 2, 3, 1], nodes["Root"]["matrix"][12:])
        self.assertNotIn("matrix", nodes["Lamp"])
        ruby = outline["materials"][0]
        self.assertEqual(("Ruby", [0.5, 0, 0.25, 0.5], 0.25, "blend"),
                         (ruby["name"], ruby["base_color"], ruby["roughness"], ruby["alpha_mode"]))
        lamp = outline["lights"][0]
        self.assertEqual(("spot", [1, 2, 3], [0, 1, 0], 40),
                         (lamp["type"], lamp["position"], lamp["up"], lamp["intensity"]))
        self.assertAlmostEqual(28.6479, lamp["outer_cone_deg"], places=3)
        self.assertAlmostEqual(28.6479, outline["cameras"][0]["fov_y_deg"], places=3)
        self.assertEqual([1, 2, 3, 1], outline["cameras"][0]["matrix"][12:])

    def test_its_values_can_be_sent_back_as_they_are(self):
        scene = self.scene()
        outline = self.daemon.request("GET", f"/v1/scenes/{scene}/outline").json()
        lamp = {key: value for key, value in outline["lights"][0].items()
                if key not in ("name", "node")}
        ruby = {key: value for key, value in outline["materials"][0].items() if key != "name"}
        del ruby["attenuation_color"]  # goes with a distance only, and this one is infinite
        eye = {key: value for key, value in outline["cameras"][0].items()
               if key not in ("name", "node")}
        reply = self.daemon.render(scene, lights=[lamp], scene_lights=False, camera=eye,
                                   overrides={"materials": {"#0": ruby}})
        self.assertEqual(200, reply.status, reply.body)

    def test_it_lists_the_nodes_of_large_assemblies(self):
        document = support.triangle_document("Part")
        document["nodes"] = [{"name": "Root", "children": list(range(1, 10001))}] + [
            {"name": f"Part {i}", "mesh": 0, "translation": [i, 0, 0]} for i in range(10000)]
        scene = self.daemon.push(support.glb(document, support.TRIANGLE))
        nodes = self.daemon.request("GET", f"/v1/scenes/{scene}/outline").json()["nodes"]
        self.assertEqual(10001, len(nodes))
        last = next(node for node in nodes if node["name"] == "Part 9999")
        self.assertEqual((9999, "Root"), (last["matrix"][12], nodes[last["parent"]]["name"]))

    def test_the_summary_is_free_of_it_and_an_unknown_scene_is_404(self):
        summary = self.daemon.request("GET", f"/v1/scenes/{self.scene()}").json()
        self.assertNotIn("outline", summary)
        reply = self.daemon.request("GET", f"/v1/scenes/{'0' * 64}/outline")
        self.assertEqual((404, "not_found"), (reply.status, reply.code))


if __name__ == "__main__":
    support.run_tests()
