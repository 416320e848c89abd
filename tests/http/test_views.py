# SPDX-License-Identifier: MIT
"""Views over HTTP, on the test double: making, patching, images, limits, idle ones."""
import concurrent.futures
import time

import support
from support import triangle

support.needs(support.FAKE)

NO_OVERRIDES = {"nodes": {}, "materials": {}, "grids": {}}
LOOK = {"eye": [0, 0, 5], "target": [0, 0, 0]}


class ViewTest(support.ServiceTest):
    def setUp(self):
        self.scene = self.daemon.push(triangle())
        self.addCleanup(self.forget_views)

    def forget_views(self):
        for view in self.get("").json()["views"]:
            self.ask("DELETE", view["id"])

    def ask(self, method, view, body=None, headers=None):
        path = "/v1/views" + (f"/{view}" if view and view[0] != "?" else view)
        return self.daemon.request(method, path, body, headers)

    def get(self, path, headers=None):
        return self.ask("GET", path, None, headers)

    def make(self, **members):
        reply = self.ask("POST", "", {"scene": self.scene, "width": 32, "height": 16, **members})
        self.assertEqual(201, reply.status, reply.body)
        return reply.json()["id"]

    def members(self, view):
        return self.get(view).json()["view"]

    def patch(self, view, body, **headers):
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        return self.ask("PATCH", view, body, named)

    def counts(self):
        return self.daemon.stats()["views"]


class Making(ViewTest):
    def test_a_view_says_where_it_is_and_at_which_revision(self):
        reply = self.ask("POST", "", {"scene": self.scene})
        self.assertEqual(f"/v1/views/{reply.json()['id']}", reply.header("Location"))
        self.assertEqual('"1"', reply.header("ETag"))
        self.assertEqual((1280, 720, 1), tuple(reply.json()[name] for name in
                                               ("width", "height", "revision")))

    def test_a_body_made_from_a_view_makes_an_equal_view(self):
        first = self.make(camera={"fit": "iso"}, exposure_ev=1.5, stream={"budget_ms": 80},
                          overrides={"nodes": {"Triangle": {"visible": False}}},
                          lights=[{"type": "point", "position": [0, 1, 0]}])
        reply = self.ask("POST", "", self.members(first))
        second = reply.json()["id"]
        self.assertEqual(self.members(first), self.members(second))
        self.assertEqual(self.get(first + "/image").header("ETag"),
                         self.get(second + "/image").header("ETag"))

    def test_what_patches_change_is_at_the_top_of_the_view(self):
        view = self.make(exposure_ev=1)
        self.patch(view, {"exposure_ev": 2, "camera": {"fit": "top"}})
        whole = self.get(view).json()
        self.assertEqual((2, "top"), (whole["exposure_ev"], whole["camera"]["fit"]))
        for name, value in whole["view"].items():
            self.assertEqual(value, whole[name])

    def test_bad_members_are_refused_by_name(self):
        for member, value, status, pointer in (
            ("scene", "0" * 64, 404, "/scene"),
            ("scene", 7, 400, "/scene"),
            ("width", 0, 400, "/width"),
            ("outputs", ["depth"], 400, "/outputs"),
            ("format", "png", 400, "/format"),
            ("quality_percent", 5, 400, "/quality_percent"),
            ("animation", {"time_s": -1}, 400, "/animation/time_s"),
            ("animation", {"time": 1}, 400, "/animation/time"),
            ("animation", {"name": "Walk"}, 404, "/animation/name"),
            ("variant", "Midnight", 404, "/variant"),
            ("variant", 7, 400, "/variant"),
            ("colour", 1, 400, "/colour"),
            ("stream", {"budget_ms": 0}, 400, "/stream/budget_ms"),
            ("stream", {"format": "exr"}, 400, "/stream/format"),
            ("stream", {"rest_format": "jpeg"}, 400, "/stream/rest_format"),
            ("stream", {"rest_samples": 5}, 400, "/stream/rest_samples"),
            ("stream", {"rest_samples": 64}, 400, "/stream/rest_samples"),
            ("stream", [], 400, "/stream"),
            ("camera", {"node": "Nobody"}, 404, "/camera/node"),
        ):
            reply = self.ask("POST", "", {"scene": self.scene, member: value})
            self.assertEqual((status, pointer), (reply.status, reply.json().get("pointer")),
                             (member, value, reply.body))
        for body in ([], {}):
            self.assertEqual(400, self.ask("POST", "", body).status, body)
        self.assertEqual([], self.get("").json()["views"])

    def test_only_json_makes_a_view(self):
        reply = self.daemon.request("POST", "/v1/views", b"{}", {"Content-Type": "text/plain"})
        self.assertEqual(415, reply.status)

    def test_unknown_views_are_not_found(self):
        for method, path in (("GET", "nobody"), ("DELETE", "nobody"), ("GET", "nobody/image")):
            self.assertEqual("not_found", self.ask(method, path).code, (method, path))
        self.assertEqual("not_found", self.patch("nobody", {}).code)


class Patching(ViewTest):
    def test_members_merge_and_null_takes_them_back(self):
        view = self.make(camera=LOOK, quality={"samples": 1, "shadow_taps": 9})
        self.patch(view, {"camera": {"eye": [1, 2, 3]}, "quality": {"samples": None},
                          "stream": {"budget_ms": 90}})
        after = self.members(view)
        self.assertEqual([1, 2, 3], after["camera"]["eye"])
        self.assertEqual([0, 0, 0], after["camera"]["target"])
        self.assertEqual((None, 9), (after["quality"]["samples"], after["quality"]["shadow_taps"]))
        self.assertEqual(90, after["stream"]["budget_ms"])
        self.patch(view, {"quality": None, "camera": None, "stream": None})
        fresh = self.members(self.make())
        self.assertEqual(fresh, self.members(view))

    def test_haze_merges_and_null_takes_it_away(self):
        view = self.make()
        self.patch(view, {"atmosphere": {"density": 0.1, "falloff_m": 4}})
        self.patch(view, {"atmosphere": {"density": 0.2, "color": [1, 0.5, 0]}})
        self.assertEqual({"density": 0.2, "color": [1, 0.5, 0], "anisotropy": 0, "falloff_m": 4,
                          "base_m": 0}, self.members(view)["atmosphere"])
        self.patch(view, {"atmosphere": None})
        self.assertIsNone(self.members(view)["atmosphere"])
        for patch, pointer in (({"color": [1, 1, 1]}, "/atmosphere/density"),
                               ({"density": 0.1, "anisotropy": 1}, "/atmosphere/anisotropy")):
            reply = self.patch(view, {"atmosphere": patch})
            self.assertEqual((400, pointer), (reply.status, reply.json()["pointer"]))

    def test_the_time_of_an_animation_merges(self):
        view = self.make(animation={"time_s": 1})
        self.assertEqual({"name": None, "time_s": 1}, self.members(view)["animation"])
        tag = self.get(f"{view}/image").header("ETag")
        self.patch(view, {"animation": {"time_s": 2.5}})
        self.assertEqual({"name": None, "time_s": 2.5}, self.members(view)["animation"])
        self.assertNotEqual(tag, self.get(f"{view}/image").header("ETag"))
        self.assertEqual("/animation/name",
                         self.patch(view, {"animation": {"name": "Walk"}}).json()["pointer"])
        self.patch(view, {"animation": None})
        self.assertIsNone(self.members(view)["animation"])

    def test_overrides_come_and_go_one_by_one(self):
        view = self.make()
        moved = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]
        self.patch(view, {"overrides": {"nodes": {"Triangle": {"matrix": moved}}}})
        self.patch(view, {"overrides": {"nodes": {"#0": {"visible": False}}}})
        nodes = self.members(view)["overrides"]["nodes"]
        self.assertEqual({"Triangle": {"matrix": moved}, "#0": {"visible": False}}, nodes)
        self.patch(view, {"overrides": {"nodes": {"Triangle": {"matrix": None, "visible": True}}}})
        self.assertEqual({"visible": True}, self.members(view)["overrides"]["nodes"]["Triangle"])
        self.patch(view, {"overrides": {"nodes": {"Triangle": {"visible": None}, "#0": None}}})
        self.assertEqual({}, self.members(view)["overrides"]["nodes"])

    def test_overrides_are_cleared_as_a_whole(self):
        view = self.make(overrides={"nodes": {"Triangle": {"visible": False}}})
        self.patch(view, {"overrides": {"nodes": None}})
        self.assertEqual(NO_OVERRIDES, self.members(view)["overrides"])
        self.patch(view, {"overrides": {"nodes": {"Triangle": {"visible": False}}}})
        self.patch(view, {"overrides": None})
        self.assertEqual(NO_OVERRIDES, self.members(view)["overrides"])

    def lit(self):
        return self.make(lights=[{"type": "point", "position": [i, 1, 0]} for i in range(4)])

    def places(self, view):
        return [(one["type"], one["position"][0]) for one in self.members(view)["lights"]]

    def test_lights_change_come_and_go_by_their_index(self):
        view = self.lit()
        before = self.members(view)["lights"]
        self.assertEqual(200, self.patch(view, {"lights": {"2": {"intensity": 7}}}).status)
        self.assertEqual([*before[:2], {**before[2], "intensity": 7}, before[3]],
                         self.members(view)["lights"])
        self.patch(view, {"lights": {"2": {"intensity": None}}})
        self.assertEqual(before, self.members(view)["lights"])
        disk = {"type": "disk", "position": [9, 1, 0], "direction": [0, -1, 0], "radius": 2}
        self.patch(view, {"lights": {"5": {**disk, "position": [8, 1, 0]}, "0": None, "4": disk,
                                     "1": disk, "2": None}})
        self.assertEqual([("disk", 9), ("point", 3), ("disk", 9), ("disk", 8)], self.places(view))
        self.patch(view, {"lights": {str(i): None for i in range(4)}})
        self.assertEqual([], self.members(view)["lights"])
        self.patch(view, {"lights": {"0": disk}})
        self.assertEqual([("disk", 9)], self.places(view))

    def test_bad_patches_of_single_lights_are_refused_by_their_index(self):
        view = self.lit()
        before = self.members(view)
        light = {"type": "point", "position": [0, 0, 0]}
        for lights, pointer, word in (
            ({"3": {"intensity": -1}}, "/lights/3/intensity", "-1"),
            ({"1": None, "3": {"radius": 1}}, "/lights/3/radius", "point light has none"),
            ({"0": {"color": [1, 1, 1]}, "2": {"type": "point"}}, "/lights/2/position", "absent"),
            ({"4": {"intensity": 1}}, "/lights/4/type", "absent"),
            ({"5": light}, "/lights", "without gaps"), ({"4": None}, "/lights/4", "4 lights"),
            ({"01": light}, "/lights/01", "4 lights"), ({"-1": light}, "/lights/-1", "4 lights"),
            ({"first": light}, "/lights/first", "4 lights"), ({"": light}, "/lights/", "4 lights"),
            ({"99999999999999999999": light}, "/lights/99999999999999999999", "4 lights"),
            ({"0": 7}, "/lights/0", "a light or null"), ({"0": []}, "/lights/0", "a light or null"),
        ):
            reply = self.patch(view, {"lights": lights, "exposure_ev": 1})
            self.assertEqual((400, pointer), (reply.status, reply.json()["pointer"]), reply.body)
            self.assertIn(word, reply.json()["detail"])
            self.assertTrue(reply.json()["detail"].startswith(pointer), reply.body)
        self.assertEqual(before, self.members(view))
        made = self.ask("POST", "", {"scene": self.scene, "lights": {"0": light}})
        self.assertEqual((400, "/lights"), (made.status, made.json()["pointer"]))

    def test_there_are_never_more_lights_than_the_limit(self):
        light = {"type": "point", "position": [0, 0, 0]}
        view = self.make(lights=[light] * 65536)
        for lights, status in (({"65536": light}, 413), ({"65536": light, "0": None}, 200),
                               ({"65535": {"intensity": 3}}, 200)):
            self.assertEqual(status, self.patch(view, {"lights": lights}).status, lights)
        last = self.members(view)["lights"]
        self.assertEqual((65536, 3), (len(last), last[-1]["intensity"]))

    def test_a_camera_may_turn_to_the_ground_and_back(self):
        view = self.make(camera={"eye": [0, 1, 5], "target": [0, 0, 0]})
        for eye in ([0, 5, 0], [0, 1, 5], [0, -5, 0], [4, 1, 0]):
            reply = self.patch(view, {"camera": {"eye": eye}})
            self.assertEqual(200, reply.status, (eye, reply.body))
            self.assertEqual(eye, self.members(view)["camera"]["eye"])

    def test_a_fitted_camera_keeps_its_projection_until_another_form_is_named(self):
        view = self.make(camera={"fit": "iso", "projection": "orthographic"})
        self.patch(view, {"camera": {"fit": "back"}})
        self.assertEqual("orthographic", self.members(view)["camera"]["projection"])
        self.assertEqual(200, self.patch(view, {"camera": LOOK}).status)
        self.assertNotIn("projection", self.members(view)["camera"])

    def test_unknown_members_name_those_of_a_view(self):
        view = self.make()
        reply = self.patch(view, {"heigth": 4})
        self.assertEqual((400, "/heigth"), (reply.status, reply.json()["pointer"]))
        self.assertIn("did you mean height?", reply.json()["detail"])
        self.assertNotIn("quality_percent", reply.json()["detail"])

    def test_a_patch_may_change_the_form_of_the_camera(self):
        view = self.make(camera={**LOOK, "fov_y_deg": 30})
        self.assertEqual(200, self.patch(view, {"camera": {"fit": "top"}}).status)
        self.assertEqual({"fit": "top", "fov_y_deg": 30, "ortho_height": None},
                         self.members(view)["camera"])
        both = self.patch(view, {"camera": {"fit": "top", "node": "Triangle"}})
        self.assertEqual(400, both.status)

    def test_members_that_there_are_not_are_refused_also_as_null(self):
        view = self.make(lights=[{"type": "point", "position": [0, 0, 0]}])
        for patch, pointer in (
            ({"exposur_ev": None}, "/exposur_ev"), ({"camera": {"fov": None}}, "/camera/fov"),
            ({"overrides": {"nodes": {"Triangle": {"visable": None}}}},
             "/overrides/nodes/Triangle/visable"),
            ({"lights": {"0": {"power": None}}}, "/lights/0/power"),
            ({"quality": {"shadow": None}}, "/quality/shadow"),
        ):
            reply = self.patch(view, patch)
            self.assertEqual((400, pointer), (reply.status, reply.json()["pointer"]), reply.body)
        gone = {"overrides": {"nodes": {"NoSuch": None}}, "parts": {"none": None}}
        self.assertEqual(200, self.patch(view, gone).status)

    def test_a_refused_patch_changes_nothing(self):
        view = self.make(camera=LOOK)
        before = self.get(view).json()
        for body, status in (
            ({"exposure_ev": 3, "width": 0}, 400),
            ({"overrides": {"nodes": {"Triangle": {"visible": False}, "Lid": {}}}}, 404),
            ({"overrides": {"nodes": {"Triangle": {"visible": 1}}}}, 400),
            ({"overrides": {"nodes": []}}, 400),
            ({"overrides": {"meshes": {}}}, 400),
            ({"overrides": {"materials": {"Glass": {"ior": 1.5}}}}, 404),
            ({"overrides": {"nodes": {"#1": {"visible": False}}}}, 404),
            ({"scene": None}, 400),
            ({"scene": "0" * 64}, 400),
            ({"id": "x"}, 400),
            ([{"op": "add"}], 400),
        ):
            self.assertEqual(status, self.patch(view, body).status, body)
        after = self.get(view).json()
        before.pop("idle_s"), after.pop("idle_s")
        self.assertEqual(before, after)

    def test_refusals_point_into_the_patch(self):
        view = self.make()
        reply = self.patch(view, {"overrides": {"nodes": {"a/b~c": {"visible": True}}}})
        self.assertEqual(("not_found", "/overrides/nodes/a~1b~0c"),
                         (reply.code, reply.json()["pointer"]))
        reply = self.patch(view, {"lights": [{"type": "point", "position": [0, 0]}]})
        self.assertEqual("/lights/0/position", reply.json()["pointer"])

    def test_every_patch_counts_and_if_match_guards(self):
        view = self.make()
        self.assertEqual('"2"', self.patch(view, {}).header("ETag"))
        self.assertEqual(200, self.patch(view, {"exposure_ev": 1}, If_Match='"2"').status)
        stale = self.patch(view, {"exposure_ev": 2}, If_Match='"2"')
        self.assertEqual((412, '"3"', 3), (stale.status, stale.header("ETag"),
                                           stale.json()["revision"]))
        for tags, status in (("*", 200), ('"9", "4"', 200), ('W/"5"', 412), ("5", 412)):
            self.assertEqual(status, self.patch(view, {}, If_Match=tags).status, tags)
        self.assertEqual(412, self.ask("DELETE", view, None, {"If-Match": '"1"'}).status)
        self.assertEqual(304, self.get(view, {"If-None-Match": '"5"'}).status)
        self.assertEqual(204, self.ask("DELETE", view, None, {"If-Match": '"5"'}).status)
        self.assertEqual(404, self.get(view).status)

    def test_both_media_types_are_patches_and_no_other(self):
        view = self.make()
        for media_type, status in (("application/json", 200),
                                   ("application/merge-patch+json; charset=utf-8", 200),
                                   ("application/json-patch+json", 415), ("text/plain", 415)):
            reply = self.daemon.request("PATCH", f"/v1/views/{view}", b"{}",
                                        {"Content-Type": media_type})
            self.assertEqual(status, reply.status, media_type)
        self.assertIn("merge-patch", reply.header("Accept-Patch"))

    def test_broken_texts_are_refused(self):
        view = self.make()
        for text in (b"", b"{", b"\xff{}", b'{"a":1,"a":2}', b"[" * 100):
            reply = self.daemon.request("PATCH", f"/v1/views/{view}", text,
                                        {"Content-Type": "application/json"})
            self.assertEqual(400, reply.status, text)

    def test_clients_that_patch_at_once_lose_no_patch(self):
        view = self.make()
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            replies = list(pool.map(lambda n: self.patch(view, {"exposure_ev": n % 9}), range(40)))
        self.assertEqual([200] * 40, [reply.status for reply in replies])
        self.assertEqual(41, self.get(view).json()["revision"])


class Images(ViewTest):
    def test_an_image_shows_the_present_revision(self):
        view = self.make()
        self.patch(view, {"width": 8})
        reply = self.get(view + "/image")
        self.assertEqual(("2", "image/png"), (reply.header("X-View-Revision"),
                                              reply.header("Content-Type")))
        self.assertEqual(8, int.from_bytes(reply.body[16:20], "big"))
        frame = self.daemon.request("GET", reply.header("Link").split(">")[0][1:]).json()
        self.assertEqual((view, 2), (frame["view"], frame["revision"]))

    def test_an_unchanged_image_is_a_304_and_costs_no_render(self):
        view = self.make()
        tag = self.get(view + "/image").header("ETag")
        before = self.daemon.stats()["renders"]["rendered"]
        not_modified = self.counts()["not_modified"]
        for _ in range(5):
            self.assertEqual(304, self.get(view + "/image", {"If-None-Match": tag}).status)
        self.assertEqual(before, self.daemon.stats()["renders"]["rendered"])
        self.assertEqual(not_modified + 5, self.counts()["not_modified"])

    def test_the_tag_is_of_all_that_decides_pixels_and_nothing_else(self):
        view = self.make()
        tag = self.get(view + "/image").header("ETag")
        for query in ("?aov=depth", "?format=jpeg", "?format=jpeg&quality_percent=50"):
            other = self.get(view + "/image" + query).header("ETag")
            self.assertNotEqual(tag, other, query)
        self.patch(view, {"stream": {"budget_ms": 99}})
        self.assertEqual(tag, self.get(view + "/image").header("ETag"))
        self.patch(view, {"exposure_ev": 1})
        self.assertNotEqual(tag, self.get(view + "/image").header("ETag"))
        self.patch(view, {"exposure_ev": 0})
        self.assertEqual(tag, self.get(view + "/image").header("ETag"))
        self.patch(view, {"atmosphere": {"density": 0.1}})
        self.assertNotEqual(tag, self.get(view + "/image").header("ETag"))

    def test_asking_again_is_answered_from_what_is_kept(self):
        view = self.make(exposure_ev=2)
        first = self.get(view + "/image")
        before = self.daemon.stats()["renders"]["rendered"]
        again = self.get(view + "/image")
        self.assertEqual(first.body, again.body)
        self.assertEqual(first.header("Link"), again.header("Link"))
        self.assertEqual(before, self.daemon.stats()["renders"]["rendered"])

    def test_equal_images_at_once_share_one_render(self):
        scene = self.daemon.push(triangle("fake:slow=300"))
        view = self.make(scene=scene)
        before, shared = self.daemon.stats()["renders"]["rendered"], self.counts()["shared"]
        with concurrent.futures.ThreadPoolExecutor(6) as pool:
            bodies = list(pool.map(lambda _: self.get(view + "/image").body, range(6)))
        self.assertEqual(1, len(set(bodies)))
        self.assertEqual(before + 1, self.daemon.stats()["renders"]["rendered"])
        self.assertEqual(shared + 5, self.counts()["shared"])

    def test_accept_and_query_choose_the_format(self):
        view = self.make()
        for query, accept, expected in (
            ("", "image/webp", "image/webp"),
            ("?format=exr", "image/webp", "image/x-exr"),
            ("?aov=node", "image/webp, image/png;q=0.1", "image/png"),
        ):
            reply = self.get(view + "/image" + query, {"Accept": accept})
            self.assertEqual(expected, reply.header("Content-Type"), query)

    def test_bad_queries_are_refused(self):
        view = self.make()
        for query, status in (
            ("?aov=colour", 400), ("?aov=position&format=png", 422), ("?format=gif", 400),
            ("?aov=node&format=jpeg", 422), ("?quality_percent=0", 400),
            ("?quality_percent=1.5", 400), ("?format=png&quality_percent=50", 400),
            ("?size=5", 400), ("?quality_percent=", 400), ("?aov=color&aov=depth", 400),
            ("?aov", 400), ("?aov=color%00", 400), ("?format=jpeg&quality_percent=0x10", 400),
            ("?format=jpeg&quality_percent=%2050", 400),
        ):
            self.assertEqual(status, self.get(view + "/image" + query).status, query)
        self.assertEqual(406, self.get(view + "/image", {"Accept": "text/html"}).status)

    def test_the_image_of_a_deleted_scene_is_not_found(self):
        scene = self.daemon.push(triangle("Gone"))
        view = self.make(scene=scene)
        self.assertEqual(200, self.get(view + "/image").status)
        self.daemon.request("DELETE", f"/v1/scenes/{scene}")
        reply = self.get(view + "/image")  # though it is kept, for when the scene comes again
        self.assertEqual((404, "/scene"), (reply.status, reply.json()["pointer"]))
        self.assertEqual(404, self.get(view + "/pick?x=1&y=1").status)
        self.assertEqual(scene, self.daemon.push(triangle("Gone")))
        self.assertEqual(200, self.get(view + "/image").status)

    def test_a_render_that_fails_is_a_problem_and_the_view_stays(self):
        view = self.make(scene=self.daemon.push(triangle("fake:error")))
        self.assertEqual("internal", self.get(view + "/image").code)
        self.assertEqual(200, self.get(view).status)


class Picking(ViewTest):
    def pick(self, view, **query):
        text = "&".join(f"{name}={value}" for name, value in query.items())
        return self.get(f"{view}/pick?{text}")

    def test_a_point_says_what_is_there_and_null_where_nothing_is(self):
        view = self.make()
        found = self.pick(view, x=3.5, y=2.5).json()
        self.assertEqual({"name": "Triangle", "index": 0, "path": ["Triangle"]},
                         found["hit"]["node"])
        self.assertEqual((view, 1, 3.5), (found["view"], found["revision"], found["x"]))
        nothing = self.pick(view, x=31.5, y=2.5)
        self.assertEqual((200, None), (nothing.status, nothing.json()["hit"]))

    def test_through_lists_the_layers_nearest_first(self):
        view = self.make()
        hits = self.pick(view, x=1, y=1, through=1).json()["hits"]
        self.assertEqual([(1.0, True), (2.0, False)],
                         [(hit["depth"], hit["transparent"]) for hit in hits])
        self.assertEqual([], self.pick(view, x=30, y=1, through=1).json()["hits"])

    def test_a_rectangle_is_clipped_and_names_each_node_once(self):
        view = self.make()
        found = self.pick(view, x=0, y=10, width=1000, height=1000).json()
        self.assertEqual((32, 6), (found["width"], found["height"]))
        self.assertEqual([("Triangle", 192)],
                         [(node["node"]["name"], node["pixels"]) for node in found["nodes"]])
        self.assertEqual([], self.pick(view, x=30, y=0, width=1, height=1).json()["nodes"])

    def test_bad_queries_are_refused(self):
        view = self.make()
        for query in ({}, {"x": 1}, {"x": -1, "y": 0}, {"x": "a", "y": 0}, {"x": "nan", "y": 0},
                      {"x": 33, "y": 0}, {"x": 0, "y": 17}, {"x": 1, "y": 1, "width": 2},
                      {"x": 1.5, "y": 1, "width": 2, "height": 2}, {"x": 1, "y": 1, "through": 2},
                      {"x": 32, "y": 0, "width": 1, "height": 1}, {"x": 1, "y": 1, "z": 1}):
            self.assertEqual(400, self.pick(view, **query).status, query)
        self.assertEqual(404, self.pick("nobody", x=1, y=1).status)
        large = self.make(width=4096, height=4096)
        self.assertEqual(413, self.pick(large, x=0, y=0, width=4096, height=4096).status)

    def test_a_pick_that_ends_its_worker_is_a_problem_and_the_service_goes_on(self):
        view = self.make(scene=self.daemon.push(triangle("fake:crash")))
        self.assertEqual("render_failed", self.pick(view, x=1, y=1).code)
        self.assert_serves()


class Limits(ViewTest):
    flags = ("--views", "6", "--views-per-client", "4", "--view-idle-s", "1")

    def test_one_client_makes_so_many_views_and_no_more(self):
        made = [self.make() for _ in range(4)]
        reply = self.ask("POST", "", {"scene": self.scene})
        self.assertEqual((429, "too_many_requests", "30"),
                         (reply.status, reply.code, reply.header("Retry-After")))
        self.ask("DELETE", made[0])
        self.make()

    def test_idle_views_are_forgotten_and_used_ones_are_not(self):
        idle, used = self.make(), self.make()
        deadline = time.monotonic() + 10
        while any(view["id"] == idle for view in self.get("").json()["views"]):
            self.assertLess(time.monotonic(), deadline, "the idle view is still there")
            self.assertEqual(200, self.get(used).status)
            time.sleep(0.2)
        self.assertEqual(404, self.get(idle).status)


class Short(ViewTest):
    def test_a_view_asked_for_a_short_time_goes_before_the_others(self):
        kept = self.make()
        reply = self.ask("POST", "?expires_s=1", {"scene": self.scene})
        self.assertEqual((201, 1), (reply.status, reply.json()["expires_s"]))
        short = reply.json()["id"]
        support.wait_until(lambda: [view["id"] for view in self.get("").json()["views"]] == [kept],
                           "the short view is forgotten")
        self.assertEqual(404, self.get(short).status)

    def test_no_view_is_kept_longer_than_the_service_keeps_them(self):
        reply = self.ask("POST", "?expires_s=86400", {"scene": self.scene})
        self.assertEqual((201, 900), (reply.status, reply.json()["expires_s"]))

    def test_times_that_are_none_are_refused(self):
        for query in ("expires_s=0", "expires_s=-1", "expires_s=86401", "expires_s=x", "expires_s=",
                      "expires_s=1.5", "idle_s=3"):
            with self.subTest(query=query):
                reply = self.ask("POST", f"?{query}", {"scene": self.scene})
                self.assertEqual((400, "invalid_request"), (reply.status, reply.code))
                self.assertIn(query.split("=")[0], reply.json()["detail"])


class Crowd(ViewTest):
    flags = ("--views", "300", "--views-per-client", "1000")

    def test_a_thousand_views_meet_the_limit_and_the_service_goes_on(self):
        statuses = [self.ask("POST", "", {"scene": self.scene}).status for _ in range(1000)]
        self.assertEqual({201: 300, 503: 700}, {s: statuses.count(s) for s in set(statuses)})
        self.assert_serves()


if __name__ == "__main__":
    support.run_tests()
