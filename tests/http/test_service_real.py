# SPDX-License-Identifier: MIT
"""The daemon over the real renderer: what is posted is drawn, and the report says how."""
import base64
import json
import os
import re
import struct
from xml.dom import minidom

import support
from image_files import png_bytes
from test_service_renders import read_png

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)


def linear_from_srgb(value):
    """IEC 61966-2-1."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def lit_floor():
    """A white floor of 4 by 4 metres, a red pane over its middle, a lamp above, a camera."""
    positions = struct.pack("<12f", -2, 0, -2, 2, 0, -2, -2, 0, 2, 2, 0, 2)
    normals = struct.pack("<12f", *[0, 1, 0] * 4)
    indices = struct.pack("<6H", 0, 2, 1, 1, 2, 3)
    glass = {
        "name": "Glass",
        "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}},
        "doubleSided": True,
    }
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_transmission"],
        "extensions": {
            "KHR_lights_punctual": {
                "lights": [{"type": "point", "name": "Lamp", "intensity": 40, "color": [1, 1, 1]}]
            }
        },
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"name": "Floor", "mesh": 0},
            {"name": "Pane", "mesh": 1, "translation": [0, 1, 0], "scale": [0.25, 1, 0.25]},
            {
                "name": "Lamp",
                "translation": [0, 3, 0],
                "extensions": {"KHR_lights_punctual": {"light": 0}},
            },
        ],
        "materials": [
            {"name": "Floor", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}},
            glass,
        ],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": which}
                ]
            }
            for which in (0, 1)
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "min": [-2, 0, -2],
                "max": [2, 0, 2],
            },
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 12},
        ],
        "buffers": [{"byteLength": 108}],
    }
    return support.glb(document, positions + normals + indices)


def swinging_lamp():
    """The lit floor, whose lamp and pane an animation moves along x by 1 m/s for two seconds."""
    (_, _, _, length, _), content = struct.unpack("<4sIIII", lit_floor()[:20]), lit_floor()
    document = json.loads(content[20 : 20 + length])
    binary = content[20 + length + 8 :]
    keys = struct.pack("<2f", 0, 2) + struct.pack("<6f", 0, 1, 0, 2, 1, 0)
    keys += struct.pack("<6f", 0, 3, 0, 2, 3, 0)
    begin = len(binary)
    for offset, size in ((0, 8), (8, 24), (32, 24)):
        document["accessors"].append({
            "bufferView": len(document["bufferViews"]), "componentType": 5126, "count": 2,
            "type": "SCALAR" if size == 8 else "VEC3"})
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": begin + offset, "byteLength": size})
    document["buffers"][0]["byteLength"] = begin + len(keys)
    document["animations"] = [
        {"name": name,
         "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}],
         "samplers": [{"input": 3, "output": output}]}
        for name, node, output in (("Pane", 1, 4), ("Lamp", 2, 5))]
    return support.glb(document, binary + keys)


class Real(support.unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # passes of maps are looked at
        cls.daemon = support.Daemon("--auto", "raster", program=REAL).wait_device()
        cls.scene = cls.daemon.push(lit_floor())

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            assert cls.daemon.stop() == 0

    CAMERA = {"eye": [0, 3, 0.001], "target": [0, 0, 0], "up": [0, 0, -1], "fov_y_deg": 60}

    def render(self, **members):
        members = {"width": 64, "height": 64, "camera": self.CAMERA, "provenance": False, **members}
        reply = self.daemon.render(self.scene, timeout=300, **members)
        self.assertEqual(200, reply.status, reply.body[:500])
        return reply

    def floor_pixel(self, x, **members):
        """Red, green, blue of the floor x metres from its middle, no pane in the way."""
        camera = {"eye": [x, 0.5, 0.001], "target": [x, 0, 0], "up": [0, 0, -1], "fov_y_deg": 20}
        linear = {"tone_mapping": "none", "exposure_ev": -2}
        _, _, _, _, rows = read_png(self.render(camera=camera, **linear, **members).body)
        return list(rows[32][32 * 4 : 32 * 4 + 3])

    def test_light_that_went_through_red_glass_is_red(self):
        red, green, blue = self.floor_pixel(0)
        self.assertGreater(red, 60)
        self.assertLess(max(green, blue), 3)
        red, green, blue = self.floor_pixel(1.5)
        self.assertGreater(min(red, green, blue), 20)
        self.assertLess(max(red, green, blue) - min(red, green, blue), 3)

    def test_a_background_is_a_colour_of_the_screen(self):
        """Behind everything, and through the red pane, which passes no green and no blue."""
        away = {"eye": [0, 1, 0], "target": [0, 2, 0.001], "up": [0, 0, 1]}
        below = {"eye": [0, 0.1, 0], "target": [0, 2, 0.001], "up": [0, 0, 1], "fov_y_deg": 5}
        for shadows in ("map", "deep", "raytraced"):
            for code in ((0x1d, 0x1e, 0x22), (255, 255, 255)):
                linear = [linear_from_srgb(value / 255) for value in code]
                look = {"background": linear, "exposure_ev": -12, "quality": {"shadows": shadows}}
                *_, rows = read_png(self.render(camera=away, **look).body)
                self.assertEqual([*code, 255], list(rows[5][20:24]), shadows)
            *_, rows = read_png(self.render(camera=below, **look).body)
            red, green, blue, alpha = rows[32][128:132]
            self.assertGreater(red, 245)  # what its surface reflects is not let through
            self.assertLess(max(green, blue), 2)
            self.assertEqual(255, alpha)

    def stats_of(self, reply):
        path = re.match("<(.*?)>", reply.header("Link")).group(1)
        return self.daemon.request("GET", path).json()

    def test_a_metered_exposure_is_told_and_is_that_of_the_picture(self):
        """The picture is that of the number; larger and smaller ones have the same number."""
        for shadows in ("deep", "raytraced"):
            look = {"quality": {"shadows": shadows}, "background": [0.2, 0.3, 0.4, 1]}
            metered = self.render(exposure_ev="auto", **look)
            stats = self.stats_of(metered)
            number = stats["exposure_ev"]
            self.assertNotEqual(0, number)
            self.assertIn("exposure", [each["pass"] for each in stats["plan"]])
            self.assertEqual(metered.body, self.render(exposure_ev=number, **look).body)
            larger = self.render(exposure_ev="auto", width=640, height=640, **look)
            self.assertEqual(number, self.stats_of(larger)["exposure_ev"])
            self.assertIn("exposure", self.stats_of(larger)["reused"])
            self.assertEqual(metered.body, self.render(exposure_ev="auto", **look).body)
        linear = [self.render(exposure_ev=ev, format="exr") for ev in ("auto", 0)]
        self.assertEqual(linear[0].body, linear[1].body)
        self.assertIsNone(self.stats_of(linear[0])["exposure_ev"])

    def test_a_view_with_a_metered_exposure_stands_still(self):
        """Its pictures are those of the number, and a light that is changed is metered anew."""
        body = {"scene": self.scene, "width": 48, "height": 32, "exposure_ev": "auto",
                "camera": self.CAMERA, "quality": {"shadows": "deep"}}
        reply = self.daemon.request("POST", "/v1/views", body)
        self.assertEqual(201, reply.status, reply.body)
        path = f"/v1/views/{reply.json()['id']}"
        first = self.daemon.request("GET", f"{path}/image?format=png")
        number = self.stats_of(first)["exposure_ev"]
        lamp = {"type": "point", "position": [0, 2, 0], "intensity": 4000}
        self.assertEqual(200, self.daemon.request("PATCH", path, {"lights": [lamp]}).status)
        bright = self.stats_of(self.daemon.request("GET", f"{path}/image?format=png"))
        self.assertLess(bright["exposure_ev"], number - 1)
        self.daemon.request("PATCH", path, {"lights": None, "exposure_ev": number})
        again = self.daemon.request("GET", f"{path}/image?format=png")
        self.assertEqual(first.body, again.body)
        refused = self.daemon.request("PATCH", path, {"exposure_ev": "automatic"})
        self.assertEqual((400, "/exposure_ev"), (refused.status, refused.json()["pointer"]))
        self.daemon.request("DELETE", path)

    def test_a_normal_map_over_coordinates_that_are_not_there_is_flat(self):
        content = lit_floor()
        length, = struct.unpack("<I", content[12:16])
        document, binary = json.loads(content[20:20 + length]), content[20 + length + 8:]
        image = base64.b64encode(png_bytes(2, 2, bytes([128, 128, 255, 255] * 4))).decode()
        at = len(binary)
        binary += struct.pack("<8f", 0, 0, 1, 0, 0, 1, 1, 1)
        document["buffers"][0]["byteLength"] = len(binary)
        document["bufferViews"].append({"buffer": 0, "byteOffset": at, "byteLength": 32})
        document["accessors"].append({"bufferView": len(document["bufferViews"]) - 1, "count": 4,
                                      "componentType": 5126, "type": "VEC2"})
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        attributes["TEXCOORD_0"] = len(document["accessors"]) - 1
        document["images"] = [{"uri": "data:image/png;base64," + image}]
        document["textures"] = [{"source": 0}]
        plain = self.daemon.push(support.glb(document, binary))
        document["materials"][0]["normalTexture"] = {"index": 0, "texCoord": 1}
        mapped = self.daemon.push(support.glb(document, binary))
        pictures = {scene: self.daemon.render(scene, timeout=300, width=48, height=48,
                                              provenance=False,
                                              camera=self.CAMERA, quality={"shadows": "raytraced"})
                    for scene in (plain, mapped)}
        self.assertEqual([200, 200], [reply.status for reply in pictures.values()])
        self.assertEqual(pictures[plain].body, pictures[mapped].body)

    def test_an_edit_of_the_glass_changes_the_light_behind_it(self):
        blue = {"materials": {"Glass": {"base_color": [0, 0, 1, 1]}}}
        pixel = self.floor_pixel(0, overrides=blue)
        self.assertLess(max(pixel[:2]), 3)
        self.assertGreater(pixel[2], 60)
        hidden = {"nodes": {"Pane": {"visible": False}}}
        pixel = self.floor_pixel(0, overrides=hidden)
        self.assertGreater(min(pixel), 60)

    def test_a_time_of_the_animation_is_the_scene_with_its_nodes_there(self):
        scene = self.daemon.push(swinging_lamp())
        summary = self.daemon.request("GET", f"/v1/scenes/{scene}").json()
        self.assertEqual([{"name": "Pane", "duration_s": 2.0}, {"name": "Lamp", "duration_s": 2.0}],
                         summary["animations"])
        self.assertEqual(2, summary["animation_count"])

        def image(**members):
            members = {"width": 48, "height": 48, "camera": self.CAMERA, **members}
            reply = self.daemon.render(scene, timeout=300, provenance=False, **members)
            self.assertEqual(200, reply.status, reply.body[:500])
            return reply.body

        def moved(pane, lamp):
            matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
            pane_matrix = [0.25, *matrix[1:10], 0.25, 0, pane, 1, 0, 1]
            return {"nodes": {"Pane": {"matrix": pane_matrix},
                              "Lamp": {"matrix": [*matrix, lamp, 3, 0, 1]}}}

        rest = image()
        self.assertEqual(image(overrides=moved(0.75, 0.75)), image(animation={"time_s": 0.75}))
        self.assertNotEqual(rest, image(animation={"time_s": 0.75}))
        self.assertEqual(image(overrides=moved(2, 2)), image(animation={"time_s": 1e6}))
        self.assertEqual(image(overrides=moved(0, 1)),
                         image(animation={"time_s": 1, "name": "Lamp"}))
        self.assertEqual(image(overrides=moved(1, 0)),
                         image(animation={"time_s": 1, "name": "#0"}))
        self.assertEqual(rest, image(animation={}))
        reply = self.daemon.render(scene, animation={"name": "Door"})
        self.assertEqual(("not_found", 404), (reply.code, reply.status))
        self.assertIn("Door", reply.json()["detail"])

    def test_a_variant_changes_materials_and_keeps_the_shadows(self):
        document = support.triangle_document("Sail")
        document["materials"] = [
            {"name": name, "doubleSided": True,
             "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0}}
            for name, color in (("Linen", [1, 1, 1]), ("Red", [1, 0, 0]))]
        extension = "KHR_materials_variants"
        document["extensionsUsed"] = document["extensionsRequired"] = [extension]
        document["extensions"] = {extension: {"variants": [{"name": "Calm"}, {"name": "Storm"}]}}
        [primitive] = document["meshes"][0]["primitives"]
        primitive["material"] = 0
        primitive["extensions"] = {extension: {"mappings": [{"material": 1, "variants": [1]}]}}
        scene = self.daemon.push(support.glb(document, support.TRIANGLE))
        summary = self.daemon.request("GET", f"/v1/scenes/{scene}").json()
        self.assertEqual((2, ["Calm", "Storm"]), (summary["variant_count"], summary["variants"]))
        self.assertEqual([], summary["extensions"]["ignored"])
        light = {"type": "spot", "position": [0, 0, 3], "direction": [0, 0, -1], "intensity": 50}

        def image(**members):
            reply = self.daemon.render(scene, timeout=300, width=32, height=32,
                                       provenance=False, lights=[light],
                                       quality={"shadows": "map"}, **members)
            self.assertEqual(200, reply.status, reply.body[:500])
            link = reply.header("Link")
            report = self.daemon.request("GET", link[1:link.index(">")]).json()
            return reply.body, report["counts"]["shadow_maps_built"]

        plain, _ = image()
        self.assertEqual(plain, image(variant="Calm")[0])
        storm, built = image(variant="Storm")
        self.assertNotEqual(plain, storm)
        self.assertEqual(0, built)
        red = {"materials": {"Linen": {"base_color": [1, 0, 0, 1]}}}
        self.assertEqual(storm, image(overrides=red)[0])
        reply = self.daemon.render(scene, variant="Fog")
        self.assertEqual(("not_found", 404), (reply.code, reply.status))
        self.assertIn("no variant 'Fog', but 'Calm', 'Storm'", reply.json()["detail"])

    def test_the_report_tells_the_passes_and_why(self):
        link = self.render(quality={"shadow_resolution": 256}).header(
            "Link"
        )  # none is kept of these
        report = self.daemon.request("GET", link[1 : link.index(">")]).json()
        shadows = [one for one in report["plan"] if one["technique"] == "deep"]
        self.assertTrue(shadows, report["plan"])
        self.assertTrue(all(one["because"] for one in report["plan"]))
        self.assertEqual(1, report["counts"]["lights"])
        self.assertGreater(report["counts"]["events"], 0)

    def test_a_new_camera_rebuilds_no_shadows(self):
        self.render()
        link = self.render(camera={"fit": "iso"}).header("Link")
        report = self.daemon.request("GET", link[1 : link.index(">")]).json()
        self.assertEqual(0, report["counts"]["shadow_maps_built"])
        self.assertGreater(report["counts"]["shadow_maps_reused"], 0)

    def explain(self, form, accept=None, **members):
        body = {"scene": self.scene, "width": 64, "height": 64, "camera": self.CAMERA, **members}
        headers = {"Accept": accept} if accept else None
        return self.daemon.request("POST", f"/v1/renders?explain={form}", body, headers)

    def test_explain_tells_the_passes_that_a_render_then_runs(self):
        quality = {"shadow_resolution": 128}  # none is kept of these
        plan = self.explain("json", quality=quality).json()
        rendered = self.daemon.stats()["renders"]["rendered"]
        link = self.render(quality=quality).header("Link")
        report = self.daemon.request("GET", link[1 : link.index(">")]).json()
        self.assertEqual(
            {(one["pass"], one["technique"]) for one in plan["passes"]},
            {(one["pass"], one["technique"]) for one in report["plan"]},
        )
        after = self.daemon.stats()["renders"]["rendered"]
        self.assertEqual(rendered + 1, after, "to explain is not to render")

    def test_explain_tells_the_warnings_of_the_frame(self):
        quality = {"shadows": "stochastic", "transparency": "weighted-blended"}
        warnings = self.explain("json", quality=quality).json()["warnings"]
        link = self.render(quality=quality).header("Link")
        report = self.daemon.request("GET", link[1 : link.index(">")]).json()
        self.assertTrue(any("weighted-blended" in one for one in warnings), warnings)
        self.assertEqual(warnings, [one for one in report["warnings"] if "environment" not in one])
        text = self.explain("text", quality=quality).body.decode()
        self.assertIn(f"Warnings:\n  {warnings[0]}", text)
        plan = self.explain("json", quality={"shadows": "raytraced"}).json()
        self.assertEqual([], plan["warnings"])

    def programs(self, **members):
        plan = self.explain("json", **members).json()
        return {one["id"]: one for line in plan["passes"] for one in line["programs"]}, plan

    def test_explain_names_the_programs_that_a_render_then_builds(self):
        quality = {"shadows": "deep", "shadow_compression": 0.02, "shadow_resolution": 32}
        view = {"quality": quality, "width": 40}
        before, plan = self.programs(**view)
        absent = {name for name, one in before.items() if one["place"] == "absent"}
        self.assertTrue(any("SUBTEXELS=1" in before[name]["defines"] for name in absent))
        self.assertEqual(len(before), plan["counts"]["programs"])
        places = [one["place"] for one in before.values()]  # a worker that was replaced has files
        self.assertEqual(places.count("memory"), plan["counts"]["programs_in_memory"])
        self.assertEqual(places.count("disk"), plan["counts"]["programs_on_disk"])
        link = self.render(**view).header("Link")
        counts = self.daemon.request("GET", link[1 : link.index(">")]).json()["counts"]
        after, _ = self.programs(**view)
        self.assertEqual(before.keys(), after.keys())
        built = {name for name in absent if after[name]["place"] == "memory"}
        self.assertEqual(counts["programs_built"], len(built))
        self.assertTrue(all(after[name]["is_conditional"] for name in absent - built))
        self.assertGreater(len(built), 0)

    def test_explain_gives_the_sources_by_name(self):
        reply = self.explain("glsl", quality={"shadows": "deep"})
        self.assertEqual("text/plain; charset=utf-8", reply.header("Content-Type"))
        text = reply.body.decode()
        for name, one in self.programs(quality={"shadows": "deep"})[0].items():
            for file in one["files"]:
                self.assertEqual(1, text.count(f"// ==== {name}-{file} ====\n#version 450"))

    def test_explain_draws_and_negotiates(self):
        for form, kind, part in (
            ("text", "text/plain; charset=utf-8", "Not required:"),
            ("dot", "text/vnd.graphviz", "digraph plan {"),
            ("svg", "image/svg+xml", "shadow.deep.count"),
        ):
            reply = self.explain(form)
            self.assertEqual((200, kind), (reply.status, reply.header("Content-Type")))
            self.assertIn(part, reply.body.decode())
        minidom.parseString(self.explain("1", "image/svg+xml").body)
        self.assertEqual(406, self.explain("1", "image/png").status)
        self.assertEqual(400, self.explain("no").status)
        self.assertEqual(404, self.explain("1", camera={"node": "Nobody"}).status)

    def test_a_warm_scene_compiles_no_program(self):
        self.render()
        link = self.render(camera={"fit": "iso"}).header("Link")
        counts = self.daemon.request("GET", link[1 : link.index(">")]).json()["counts"]
        self.assertEqual(0, counts["programs_built"])
        self.assertGreater(counts["programs_reused"], 0)

    def test_the_same_request_gives_the_same_bytes_and_tag(self):
        first, second = self.render(), self.render()
        self.assertEqual(first.body, second.body)
        self.assertEqual(first.header("ETag"), second.header("ETag"))

    def test_what_compressed_lists_are_is_said(self):
        quality = {"shadows": "deep", "shadow_compression": 0.02, "shadow_prefilter": 2}
        link = self.render(quality=quality).header("Link")
        frame = self.daemon.request("GET", link[1 : link.index(">")]).json()
        self.assertEqual((1, 2, 0.02), tuple(
            frame["compression"][k] for k in ("maps", "prefilter", "max_error")))
        self.assertLess(0, frame["compression"]["nodes"])
        self.assertIn("shadow.deep.compress", [line["pass"] for line in frame["plan"]])
        refused = self.daemon.render(self.scene, quality={**quality, "shadows": "map"})
        self.assertEqual(400, refused.status)
        self.assertEqual("/quality/shadow_compression", refused.json()["pointer"])

    def test_ids_name_what_is_seen(self):
        _, _, _, _, rows = read_png(self.render(output="node").body)
        ids = {int.from_bytes(row[i : i + 2], "big") for row in rows for i in range(0, 128, 2)}
        self.assertIn(1, ids)

    def test_a_node_that_is_not_there_is_named(self):
        reply = self.daemon.render(self.scene, camera={"node": "Nobody"})
        self.assertIn(reply.status, (400, 404))
        self.assertIn("Nobody", reply.json()["detail"])

    def test_a_worker_that_is_killed_is_replaced(self):
        pid = self.daemon.worker_pid()
        os.kill(pid, support.signal.SIGKILL)
        self.render()
        self.assertNotEqual(pid, self.daemon.worker_pid())

    def test_driver_caches_go_to_the_state_directory_and_sources_where_asked(self):
        with support.tempfile.TemporaryDirectory() as home:
            state = os.path.join(home, "state")
            names = ("HOME", "TMPDIR", "XDG_CACHE_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR")
            environment = {name: home for name in names} | {"MESA_SHADER_CACHE_DIR": None}
            dump = os.path.join(home, "shaders")
            os.mkdir(dump)
            with support.Daemon(
                "--dump-shaders", dump, program=REAL, state_dir=state, environment=environment
            ) as daemon:
                daemon.wait_ready()
                self.assertEqual(200, daemon.render(daemon.push(lit_floor())).status)
                self.assertEqual(0, daemon.stop())
            self.assertEqual(["shaders", "state"], sorted(os.listdir(home)))
            file = "[0-9a-f]{16}-[a-z_0-9]+[.](vert|tesc|tese|geom|frag|comp)[.]glsl$"
            self.assertTrue(all(re.match(file, name)
                                for name in os.listdir(dump)))
            sources = [open(os.path.join(dump, name)).read() for name in os.listdir(dump)]
            self.assertTrue(any("shadow_transmittance(" in source for source in sources))
            self.assertTrue(all("void main()" in source for source in sources))
            kept = ["cache", "environments", "jobs", "lock", "scenes", "tmp", "tradeoffs"]
            self.assertEqual(kept, sorted(os.listdir(state)))

    def test_compiled_programs_outlive_the_daemon_and_damage(self):
        with support.tempfile.TemporaryDirectory() as state:
            folder = os.path.join(state, "cache", "programs")

            def files():
                return len(os.listdir(folder)) if os.path.exists(folder) else 0

            def start(*flags):
                with support.Daemon("--auto", "raster", *flags, program=REAL,
                                    state_dir=state) as daemon:
                    daemon.wait_ready()
                    support.wait_until(  # before anything is rendered
                        lambda: daemon.stats()["programs"]["kept"] ==
                        (0 if flags else files()), "what is kept", 5)
                    device = daemon.request("GET", "/v1/capabilities").json()["device"]
                    if not device["program_binaries"]:
                        self.skipTest("the driver gives no compiled programs")
                    body = {"scene": daemon.push(lit_floor()), "width": 64, "height": 64,
                            "camera": self.CAMERA, "quality": {"shadows": "deep"}}
                    plan = daemon.request("POST", "/v1/renders?explain=json", body).json()["counts"]
                    reply = daemon.request("POST", "/v1/renders", body)
                    self.assertEqual(200, reply.status)
                    link = reply.header("Link")
                    counts = daemon.request("GET", link[1 : link.index(">")]).json()["counts"]
                    return reply.body, counts, plan, daemon.stats()["programs"]

            image, counts, plan, programs = start()
            self.assertGreater(counts["programs_built"], 1)  # beside those of the self-test
            self.assertEqual((0, 0), (counts["programs_loaded"], plan["programs_on_disk"]))
            self.assertEqual(programs["kept"], len(os.listdir(folder)))
            sizes = [os.stat(os.path.join(folder, name)).st_size for name in os.listdir(folder)]
            self.assertEqual(programs["kept_bytes"], sum(sizes))
            drawn, every, kept = counts["programs_built"], programs["compiled"], programs["kept"]
            again, counts, plan, programs = start()
            self.assertEqual(image, again)
            self.assertEqual(0, counts["programs_built"])
            # the first start drew the scene of the self-test, and the picture found its programs
            self.assertGreater(counts["programs_loaded"], drawn)
            self.assertGreaterEqual(plan["programs_on_disk"], counts["programs_loaded"])
            # a device is proven before its files are trusted
            proof, disk = programs["compiled"], programs["disk"]
            self.assertEqual(every - kept, proof)
            self.assertTrue(drawn < disk <= kept, (drawn, disk, kept))
            for name in os.listdir(folder):
                path = os.path.join(folder, name)
                with open(path, "r+b") as stream:
                    stream.truncate(os.stat(path).st_size // 2)
            again, counts, _, programs = start()
            self.assertEqual(image, again)
            self.assertEqual((proof + disk, 0), (programs["compiled"], programs["disk"]))
            again, _, _, programs = start("--program-bytes", "0")
            self.assertEqual((image, 0, 0), (again, programs["disk"], programs["kept"]))


if __name__ == "__main__":
    support.run_tests()
