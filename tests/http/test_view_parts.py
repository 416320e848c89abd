# SPDX-License-Identifier: MIT
"""Parts of views over the real renderer: other scenes on nodes, against the same in one file."""
import json
import struct

import support
import test_service_real as real
from test_service_environments import hdr

LOOK = {"eye": [0.3, 2.5, 2], "target": [0, 0.5, 0], "fov_y_deg": 70}
MOVED = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0.25, 0, 1]
NOBODY = "0" * 64


def scene(nodes, roots, content=real.lit_floor()):
    """The meshes, materials and lamp of the lit floor, with these nodes."""
    length, = struct.unpack("<I", content[12:16])
    document = json.loads(content[20 : 20 + length])
    document["nodes"] = nodes
    document["scenes"] = [{"nodes": roots}]
    return support.glb(document, content[20 + length + 8 :])


FLOOR = {"name": "Floor", "mesh": 0}
LAMP = {"name": "Lamp", "translation": [0, 3, 0],
        "extensions": {"KHR_lights_punctual": {"light": 0}}}
PANE = {"name": "Pane", "mesh": 1, "translation": [0, 1, 0], "scale": [0.25, 1, 0.25]}


class Parts(support.unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon("--auto", "raster", program=real.REAL).wait_device()
        cls.room = cls.daemon.push(scene([FLOOR, LAMP], [0, 1]))
        cls.pane = cls.daemon.push(scene([PANE], [0]))

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            assert cls.daemon.stop() == 0

    def ask(self, method, path, body=None, expected=200):
        reply = self.daemon.request(method, "/v1/views" + path, body, timeout=300)
        self.assertEqual(expected, reply.status, reply.body[:600])
        return reply

    def make(self, **members):
        body = {"scene": self.room, "width": 64, "height": 48, "camera": LOOK,
                "quality": {"shadow_resolution": 128}, **members}
        view = self.ask("POST", "", body, 201).json()["id"]
        self.addCleanup(self.daemon.request, "DELETE", f"/v1/views/{view}")
        return view

    def image(self, view, query=""):
        return self.ask("GET", f"/{view}/image{query}").body

    def picture(self, query="", **members):
        return self.image(self.make(**members), query)

    def frame(self, view):
        """The report of the view's frame."""
        link = self.ask("GET", f"/{view}/image").header("Link")
        return self.daemon.request("GET", link[1 : link.index(">")]).json()

    def problem(self, body, expected, view=None):
        view = view or self.make()
        return self.ask("PATCH", f"/{view}", body, expected).json()

    # ---- what is seen ----

    def test_a_part_is_what_its_nodes_would_be_in_the_file(self):
        holder = {"name": "window", "matrix": MOVED, "children": [3]}
        whole = self.daemon.push(scene([FLOOR, LAMP, holder, PANE], [0, 1, 2]))
        parts = {"window": {"scene": self.pane, "matrix": MOVED}}
        for quality in ({"shadow_resolution": 128}, {"shadows": "raytraced"},
                        {"shadows": "raytraced-shadows"}, {"reference": True}):
            with_part = self.picture(parts=parts, quality=quality)
            self.assertEqual(self.picture(scene=whole, quality=quality), with_part, quality)
            self.assertNotEqual(self.picture(quality=quality), with_part, quality)
        for aov in ("node", "depth", "normal", "layers", "transmittance"):
            query = f"?aov={aov}&format=exr"
            self.assertEqual(self.picture(query, scene=whole),
                             self.picture(query, parts=parts), aov)

    def test_parts_hang_on_nodes_and_on_each_other(self):
        inner = {"scene": self.pane, "parent": "outer", "matrix": MOVED}
        outer = {"scene": self.pane, "parent": "Lamp", "matrix": MOVED}
        lifted = [*MOVED[:12], 1, 3.5, 0, 1]
        flat = {"inner": {"scene": self.pane, "matrix": lifted},
                "outer": {"scene": self.pane, "matrix": [*MOVED[:12], 0.5, 3.25, 0, 1]}}
        camera = {"eye": [0, 8, 3], "target": [0, 2, 0]}
        expected = self.picture(parts=flat, camera=camera)
        self.assertEqual(expected, self.picture(parts={"inner": inner, "outer": outer},
                                                camera=camera))
        self.assertEqual(expected, self.picture(parts={"outer": outer, "inner": inner},
                                                camera=camera))
        deep = {**inner, "parent": "outer/Pane"}
        self.assertNotEqual(expected, self.picture(parts={"inner": deep, "outer": outer},
                                                   camera=camera))

    def test_a_part_comes_and_goes_by_patches(self):
        view = self.make()
        empty = self.image(view)
        self.ask("PATCH", f"/{view}", {"parts": {"window": {"scene": self.pane}}})
        seen = self.image(view)
        self.assertNotEqual(empty, seen)
        self.ask("PATCH", f"/{view}", {"parts": {"window": {"matrix": MOVED}}})
        self.assertNotEqual(seen, self.image(view))
        self.ask("PATCH", f"/{view}", {"parts": {"window": {"matrix": None, "visible": False}}})
        self.assertEqual(empty, self.image(view))
        self.ask("PATCH", f"/{view}", {"parts": {"window": {"visible": True}}})
        self.assertEqual(seen, self.image(view))
        self.ask("PATCH", f"/{view}", {"parts": {"window": None}})
        self.assertEqual(empty, self.image(view))
        self.assertEqual({}, self.ask("GET", f"/{view}").json()["view"]["parts"])

    def test_a_render_takes_parts_too(self):
        members = {"width": 32, "height": 32, "camera": LOOK}
        plain = self.daemon.render(self.room, **members)
        parts = {"window": {"scene": self.pane}}
        shown = self.daemon.render(self.room, parts=parts, **members)
        self.assertEqual((200, 200), (plain.status, shown.status), shown.body[:300])
        self.assertNotEqual(plain.body, shown.body)
        reply = self.daemon.render(self.room, parts={"window": {"scene": NOBODY}}, **members)
        self.assertEqual((404, "not_found", "/parts"),
                         (reply.status, reply.code, reply.json()["pointer"]))

    # ---- names ----

    def test_what_is_in_a_part_is_called_by_its_name_and_the_parts(self):
        view = self.make(parts={"window": {"scene": self.pane}}, camera={
            "eye": [0, 2.5, 0], "target": [0, 1, 0], "up": [0, 0, -1]})
        hit = self.ask("GET", f"/{view}/pick?x=32&y=24").json()["hit"]
        self.assertEqual({"name": "window/Pane", "index": 3, "path": ["window", "window/Pane"]},
                         hit["node"])
        self.assertEqual("window/Glass", hit["material"]["name"])
        shown = self.image(view)
        hidden = self.picture(camera=self.ask("GET", f"/{view}").json()["view"]["camera"])
        for node in ("window", "window/Pane", "window/#0"):
            self.ask("PATCH", f"/{view}", {"overrides": {"nodes": {node: {"visible": False}}}})
            self.assertEqual(hidden, self.image(view), node)
            self.ask("PATCH", f"/{view}", {"overrides": {"nodes": None}})
        self.assertEqual(shown, self.image(view))
        for material in ("window/Glass", "window/#1"):
            blue = {"base_color": [0, 0, 1, 1]}
            self.ask("PATCH", f"/{view}", {"overrides": {"materials": {material: blue}}})
            self.assertNotEqual(shown, self.image(view), material)
            self.ask("PATCH", f"/{view}", {"overrides": {"materials": None}})
        self.ask("PATCH", f"/{view}", {"overrides": {"nodes": {"window/Door": {"visible": True}}}})
        problem = self.ask("GET", f"/{view}/image", expected=404).json()
        self.assertIn("window/Door", problem["detail"])

    def test_with_a_part_go_the_overrides_of_what_was_in_it(self):
        hidden = {"visible": False}
        view = self.make(parts={"window": {"scene": self.pane}, "win": {"scene": self.pane}},
                         overrides={"nodes": {"window": hidden, "window/Pane": hidden,
                                              "Floor": hidden, "win/Pane": hidden},
                                    "materials": {"window/Glass": {"ior": 1}}})
        self.ask("PATCH", f"/{view}", {"parts": {"window": None}})
        self.assertEqual({"nodes": {"Floor": hidden, "win/Pane": hidden}, "materials": {},
                          "grids": {}},
                         self.ask("GET", f"/{view}").json()["view"]["overrides"])
        self.image(view)

    def test_what_is_in_a_part_can_be_highlighted_and_has_edges(self):
        holder = {"name": "window", "matrix": MOVED, "children": [3]}
        whole = self.daemon.push(scene([FLOOR, LAMP, holder, PANE], [0, 1, 2]))
        parts = {"window": {"scene": self.pane, "matrix": MOVED}}
        plain = self.picture(parts=parts)
        for overlay in ({"highlight": {"nodes": ["window"]}}, {"edges": {"crease_deg": 20}}):
            shown = self.picture(parts=parts, **overlay)
            self.assertNotEqual(plain, shown)
            self.assertEqual(self.picture(scene=whole, **overlay), shown, overlay)
        view = self.make(parts=parts, highlight={"nodes": ["window/Pane"]})
        self.ask("PATCH", f"/{view}", {"parts": {"window": None}})
        self.assertIsNone(self.ask("GET", f"/{view}").json()["view"]["highlight"])

    def test_the_animation_of_a_part_moves_it_alone(self):
        swing = self.daemon.push(real.swinging_lamp())
        parts = {"a": {"scene": swing}, "b": {"scene": swing}}
        camera = {"eye": [1, 6, 3], "target": [1, 0, 0]}

        def at(**members):
            return self.picture(parts=parts, camera=camera, **members)

        pane = {"matrix": [0.25, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.25, 0, 1, 1, 0, 1]}
        self.assertEqual(at(overrides={"nodes": {"a/Pane": pane}}),
                         at(animation={"time_s": 1, "name": "a/Pane"}))
        self.assertNotEqual(at(animation={"time_s": 1, "name": "a/Pane"}),
                            at(animation={"time_s": 1}))

    # ---- cost ----

    def test_a_scene_is_held_once_whoever_shows_it(self):
        many = {f"p{i:02}": {"scene": self.pane, "matrix": [*MOVED[:12], 0.1 * i, 0.2, 0, 1]}
                for i in range(30)}
        one = self.make(parts={"p00": many["p00"]})
        self.image(one)
        before = self.daemon.stats()
        bytes_of_one = self.frame(one)["bytes"]["scene"]
        other = self.make(parts=many)
        self.image(other)
        after = self.daemon.stats()
        self.assertEqual(bytes_of_one, self.frame(other)["bytes"]["scene"])
        self.assertEqual(before["cache"]["misses"], after["cache"]["misses"])

    def test_shadows_out_of_a_parts_reach_are_kept(self):
        lights = [{"type": "point", "position": [x, 1.5, 0], "intensity": 20, "range": 2}
                  for x in (-1.8, 1.8)]
        view = self.make(scene_lights=False, lights=lights,
                         parts={"b": {"scene": self.pane, "matrix": [*MOVED[:12], 1.5, 0, 0, 1]}})
        self.image(view)
        near_first = [*MOVED[:12], -1.5, 0, 0, 1]
        self.ask("PATCH", f"/{view}", {"parts": {"c": {"scene": self.pane, "matrix": near_first}}})
        counts = self.frame(view)["counts"]
        self.assertEqual((1, 1), (counts["shadow_maps_built"], counts["shadow_maps_reused"]))
        # what stood before it came stands still; the picture is another, so that it is made
        self.ask("PATCH", f"/{view}", {"parts": {"c": None}, "exposure_ev": 1})
        counts = self.frame(view)["counts"]
        self.assertEqual((0, 2), (counts["shadow_maps_built"], counts["shadow_maps_reused"]))

    # ---- what is refused ----

    def test_bad_parts_are_refused_by_name(self):
        pane = {"scene": self.pane}
        for parts, status, pointer in (
            ({"x": {"scene": NOBODY}}, 404, "/parts/x/scene"),
            ({"x": {}}, 400, "/parts/x/scene"),
            ({"x": {"scene": "abc"}}, 404, "/parts/x/scene"),
            ({"x": 7}, 400, "/parts/x"),
            ({"a/b": pane}, 400, "/parts/a~1b"),
            ({"#1": pane}, 400, "/parts/#1"),
            ({"": pane}, 400, "/parts/"),
            ({"x" * 257: pane}, 400, "/parts"),  # too long for a pointer
            ({"x": {**pane, "matrix": [1] * 16}}, 400, "/parts/x/matrix"),
            ({"x": {**pane, "transform": MOVED}}, 400, "/parts/x/transform"),
            ({f"p{i}": pane for i in range(257)}, 413, "/parts"),
            ([], 400, "/parts"),
            ({"x": {**pane, "parent": "Roof"}}, 404, "/parts/x/parent"),
            ({"x": {**pane, "parent": "y/Pane"}}, 404, "/parts/x/parent"),
            ({"x": {**pane, "parent": "#99"}}, 404, "/parts/x/parent"),
            ({"Floor": pane}, 400, "/parts/Floor"),
        ):
            problem = self.problem({"parts": parts}, status)
            self.assertEqual(pointer, problem["pointer"], problem)
            members = {"scene": self.room, "parts": parts}
            made = self.daemon.request("POST", "/v1/views", members)
            self.assertEqual((status, pointer), (made.status, made.json()["pointer"]))

    def test_parts_that_do_not_fit_together_are_told_when_they_are_drawn(self):
        for parts, status, word in (
            ({"y": {"scene": self.pane},
              "x": {"scene": self.pane, "parent": "y/Roof"}}, 404, "Roof"),
            ({"x": {"scene": self.pane, "parent": "x"}}, 404, "'x'"),
            ({"x": {"scene": self.pane, "parent": "y"},
              "y": {"scene": self.pane, "parent": "x/Pane"}}, 404, "'y'"),
            ({f"p{i}": {"scene": self.pane, "parent": f"p{i - 1}" if i else None}
              for i in range(17)}, 413, "16"),
        ):
            view = self.make(parts=parts)
            problem = self.ask("GET", f"/{view}/image", expected=status).json()
            self.assertIn(word, problem["detail"])
            self.ask("PATCH", f"/{view}", {"parts": None})
            self.image(view)

    def test_a_part_does_not_go_from_under_others(self):
        view = self.make(parts={"y": {"scene": self.pane}, "x": {
            "scene": self.pane, "parent": "y/Pane"}})
        problem = self.problem({"parts": {"y": None}}, 404, view)
        self.assertEqual("/parts/x/parent", problem["pointer"])
        self.ask("PATCH", f"/{view}", {"parts": {"y": None, "x": {"parent": None}}})
        self.image(view)

    def test_a_deleted_scene_is_named_until_its_part_goes(self):
        gone = self.daemon.push(scene([{**PANE, "name": "Gone"}], [0]))
        view = self.make(parts={"x": {"scene": gone}})
        self.image(view)
        self.assertEqual(204, self.daemon.request("DELETE", f"/v1/scenes/{gone}").status)
        self.ask("PATCH", f"/{view}", {"exposure_ev": 1})
        problem = self.ask("GET", f"/{view}/image", expected=404).json()
        self.assertIn(gone, problem["detail"])
        self.ask("PATCH", f"/{view}", {"parts": {"x": None}})
        self.image(view)

    def test_more_scenes_than_a_message_carries_are_refused(self):
        scenes = [self.daemon.push(scene([{**PANE, "name": f"N{i}"}], [0])) for i in range(17)]
        parts = {f"p{i}": {"scene": one} for i, one in enumerate(scenes)}
        self.assertEqual("/parts", self.problem({"parts": parts}, 413)["pointer"])
        del parts["p0"]
        self.picture(parts=parts)
        self.look_with_all_that_a_message_carries(parts)

    def look_with_all_that_a_message_carries(self, parts):
        """The scene, 16 parts, a map and the reference of a trade-off."""
        image = self.daemon.request("POST", "/v1/environments", hdr(
            8, 4, lambda x, y: (1, 0.2, 0.1) if x < 4 else (0.1, 0.2, 1)), {
            "Content-Type": "application/octet-stream"}).json()["id"]
        members = {"parts": parts, "environment": {"image": image}}
        self.assertNotEqual(self.picture(parts=parts), self.picture(**members))
        reply = self.daemon.request("POST", "/v1/tradeoffs", {
            "scene": self.room, "width": 16, "height": 16, "camera": LOOK,
            "tradeoff": {"max_settings": 2, "repeats": 1}, **members})
        self.assertEqual(202, reply.status, reply.body[:600])
        path = reply.header("Location")

        def measured():
            return self.daemon.request("GET", path).json()

        support.wait_until(lambda: measured()["stage"] in ("times", "ended"),
                           "errors against the reference are measured", 200)
        told = measured()
        self.assertNotEqual("failed", told["state"], told)
        self.assertTrue([s for s in told["settings"] if s["error"]], told)
        self.daemon.request("DELETE", path)


if __name__ == "__main__":
    support.run_tests()
