#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The options of `vitrail render` become the JSON of the API; wrong ones never reach a server."""
import hashlib
import json
import urllib.parse

from cli_support import CliTest, glb, main


def id_of(size):
    """What a server calls the scene glb(size)."""
    return hashlib.sha256(glb(size)).hexdigest()


class RequestTest(CliTest):
    def test_only_what_is_given_is_sent(self):
        request = self.render_request()
        self.assertEqual(set(request), {"scene", "format"})
        self.assertEqual(request["format"], "png")

    def test_what_neither_scene_nor_call_has_is_left_to_camera_and_exposure_of_our_choice(self):
        base = self.write("base.json", json.dumps({"width": 100}))
        fitted, auto = {"camera": {"fit": "three-quarter"}}, {"exposure_ev": "auto"}
        for cameras, lights, options, expected in (
                (0, 1, (), fitted), (1, 0, (), auto), (0, 0, (), fitted | auto),
                (0, 0, ("--camera", "node:A"), {"camera": {"node": "A"}} | auto),
                (0, 0, ("--exposure", "0"), fitted | {"exposure_ev": 0}),
                (1, 1, ("--no-scene-lights",), auto), (0, 0, ("--request", base), {}),
                (1, 0, ("--environment", "1:1"), {}),
                (1, 0, ("--light", "directional:dir=0,-1,0"), {})):
            with self.subTest(cameras=cameras, lights=lights, options=options):
                self.stub.described = {"camera_count": cameras, "light_count": lights}
                request = self.render_request(*options)
                self.assertEqual(expected, {name: request[name] for name in request
                                            if name in ("camera", "exposure_ev")})
        self.stub.described = {}  # a server that does not tell
        self.assertFalse({"camera", "exposure_ev"} & set(self.render_request()))

    def test_every_option_lands_in_its_member(self):
        request = self.render_request(
            "--size", "640x480", "--shadows", "deep-linked", "--shadow-resolution=2048",
            "--samples", "4", "--light-lists", "linked", "--transparency", "lists",
            "--blend-filter", "kim", "--refraction", "off", "--refraction-samples", "8",
            "--max-error", "0.01", "--budget-ms", "33.5",
            "--output", "depth", "--exposure", "-1.5", "--time", "2.5",
            "--animation", "Walk", "--variant", "Night", "--tone-mapping", "none",
            "--background", "0,0.5,1,1", "--environment", "1:0.1,0.2,0.3", "--no-scene-lights",
            "--studio", "on", "--ground-plane=-1.5", "--haze", "0.05", "--haze-color", "1,0.9,0.8",
            "--haze-anisotropy=-0.5", "--haze-falloff", "8", "--haze-base=-2.5")
        del request["scene"], request["format"]
        self.assertEqual(request, {
            "width": 640, "height": 480, "outputs": ["depth"], "exposure_ev": -1.5,
            "animation": {"name": "Walk", "time_s": 2.5}, "variant": "Night",
            "tone_mapping": "none", "background": [0, 0.5, 1, 1], "scene_lights": False,
            "studio": "on", "ground_plane": {"height": -1.5},
            "atmosphere": {"density": 0.05, "color": [1, 0.9, 0.8], "anisotropy": -0.5,
                           "falloff_m": 8, "base_m": -2.5},
            "environment": {"sky": [1, 1, 1], "ground": [0.1, 0.2, 0.3]},
            "quality": {"shadows": "deep-linked", "shadow_resolution": 2048, "samples": 4,
                        "light_lists": "linked", "transparency": "lists", "blend_filter": "kim",
                        "refraction": "off", "refraction_samples": 8,
                        "max_error": 0.01, "budget_ms": 33.5}})

    def test_an_exposure_is_a_number_or_auto(self):
        for text, value in (("auto", "auto"), ("0", 0), ("2.25", 2.25), ("-16", -16)):
            self.assertEqual(value, self.render_request("--exposure", text)["exposure_ev"])

    def test_the_ground_is_below_the_scene_or_at_a_height(self):
        self.assertEqual({}, self.render_request("--ground-plane", "auto")["ground_plane"])
        scene = self.write("box.glb", glb())
        _, err = self.run_cli("render", scene, "-o", "out.png", "--ground-plane", "floor", code=2)
        self.assertIn("a number of metres or auto", err)

    def test_haze_goes_over_that_of_the_request(self):
        base = self.write("hazy.json", json.dumps({"atmosphere": {"density": 1, "falloff_m": 3}}))
        request = self.render_request("--request", base, "--haze", "0.25")
        self.assertEqual({"density": 0.25, "falloff_m": 3}, request["atmosphere"])
        scene = self.write("box.glb", glb())
        _, err = self.run_cli("render", scene, "-o", "out.png", "--haze-color", "1,1", code=2)
        self.assertIn("--haze-color", err)

    def test_whole_numbers_are_sent_as_integers(self):
        self.render_request("--shadow-resolution", "512")
        body = self.stub.sent("POST", "/v1/renders")[-1].body
        self.assertIn(b'"shadow_resolution":512', body)

    def test_cameras(self):
        for text, camera in {
                "node:My Camera; 2": {"node": "My Camera; 2"},
                "fit:iso": {"fit": "iso"},
                "fit:three-quarter": {"fit": "three-quarter"},
                "ortho=3 fit:top": {"fit": "top", "ortho_height": 3},
                "ortho=2.5;node:Cam": {"node": "Cam", "ortho_height": 2.5},
                "eye=1,2,3 target=0,0,0 up=0,0,1 fov=30": {
                    "eye": [1, 2, 3], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 30},
                "eye=1e7,2,-3;target=0,0,0": {"eye": [1e7, 2, -3], "target": [0, 0, 0]},
                "matrix=1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1": {
                    "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]}}.items():
            self.assertEqual(self.render_request("--camera", text)["camera"], camera, text)

    def test_lights(self):
        request = self.render_request(
            "--light", "point:pos=0,3,0;color=1,0.8,0.6;intensity=100;range=0",
            "--light", "spot:pos=0,4,0;dir=0,-1,0;inner=20;outer=35;intensity=800;shadow=false",
            "--light", "directional:dir=0,-1,-0.3;intensity=5")
        self.assertEqual(request["lights"], [
            {"type": "point", "position": [0, 3, 0], "color": [1, 0.8, 0.6], "intensity": 100,
             "range": 0},
            {"type": "spot", "position": [0, 4, 0], "direction": [0, -1, 0],
             "inner_cone_deg": 20, "outer_cone_deg": 35, "intensity": 800, "shadow": False},
            {"type": "directional", "direction": [0, -1, -0.3], "intensity": 5}])

    def test_looks_of_smoke(self):
        request = self.render_request("--grid", "smoke:density=5;color=0.9,0.8,0.7",
                                      "--grid", "a:b:extinction=1,2,3;anisotropy=-0.5")
        self.assertEqual(request["overrides"]["grids"], {
            "smoke": {"density": 5, "color": [0.9, 0.8, 0.7]},
            "a:b": {"extinction": [1, 2, 3], "anisotropy": -0.5}})
        for spec, what in (("smoke", "NAME:density=5"), (":density=1", "NAME:density=5"),
                           ("smoke:thick=1", "thick"), ("smoke:color=1,2", "color")):
            _, told = self.run_cli("render", "0" * 64, "-o", "x.png", "--grid", spec, code=2)
            self.assertIn(what, told)

    def test_options_go_over_the_base_and_settings_over_both(self):
        base = self.write("base.json", json.dumps({
            "width": 100, "height": 50, "exposure_ev": 1,
            "lights": [{"type": "point"}], "quality": {"shadows": "map", "shadow_taps": 9}}))
        request = self.render_request(
            "--request", base, "--size", "10x20", "--shadows", "deep",
            "--light", "point:pos=1,1,1", "--set", "/quality/shadow_taps=16",
            "--set", "/overrides/nodes/a~1b~0c/visible=false",
            "--set", '/lights/-={"type": "spot"}', "--set", '/lights/0/intensity=3',
            "--set", '/animation={"name": "Wälk"}')
        self.assertEqual((request["width"], request["height"]), (10, 20))
        self.assertEqual(request["exposure_ev"], 1)
        self.assertEqual(request["quality"], {"shadows": "deep", "shadow_taps": 16})
        self.assertEqual(request["overrides"], {"nodes": {"a/b~c": {"visible": False}}})
        self.assertEqual(request["lights"], [{"type": "point", "intensity": 3},
                                             {"type": "point", "position": [1, 1, 1]},
                                             {"type": "spot"}])
        self.assertEqual(request["animation"], {"name": "Wälk"})

    def test_cuts_highlights_and_edges(self):
        request = self.render_request(
            "--clip", "0,-1,0,2.5", "--clip", "0,0,-1,1;cap=0.8,0.2,0.1",
            "--clip", "1,0,0,0;cap=true;shadows=true", "--clip", "1,0,0,1;shadows=false",
            "--highlight", "Door", "--highlight", "#3", "--set", "/highlight/width_px=3",
            "--edges", "crease=20;borders=false;silhouettes=true;color=1,0,0;width=2;hidden=0.1")
        self.assertEqual(request["clip_planes"], [
            {"plane": [0, -1, 0, 2.5]}, {"plane": [0, 0, -1, 1], "cap": [0.8, 0.2, 0.1]},
            {"plane": [1, 0, 0, 0], "cap": True, "shadows": True},
            {"plane": [1, 0, 0, 1], "shadows": False}])
        self.assertEqual(request["highlight"], {"nodes": ["Door", "#3"], "width_px": 3})
        self.assertEqual(request["edges"], {
            "crease_deg": 20, "borders": False, "silhouettes": True, "color": [1, 0, 0],
            "width_px": 2, "hidden": 0.1})
        self.assertEqual(self.render_request("--edges", "default")["edges"], {})

    def test_parts_are_sent_where_the_server_lacks_them_and_named_by_id(self):
        bolt = self.write("bolt.glb", glb(80))
        nobody = "0" * 64
        request = self.render_request(
            "--part", f"bolt={bolt};parent=Flange No. 2;pos=0.5,0,1e3",
            "--part", f"nut={nobody};parent=bolt/Thread;matrix=1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1")
        self.assertEqual(request["parts"], {
            "bolt": {"scene": id_of(80), "parent": "Flange No. 2",
                     "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0, 1000, 1]},
            "nut": {"scene": nobody, "parent": "bolt/Thread",
                    "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]}})
        self.assertIn(id_of(80), self.stub.scenes)

    def test_a_part_says_which_scene_of_its_file_it_is_and_how_it_is_read(self):
        bolt = self.write("bolt.glb", glb(80))
        request = self.render_request(
            "--part", f"a={bolt};scene=Night & day;pos=1,0,0",
            "--part", f"b={bolt};unit=mm;up=z;deflection=0.1;scene=#1", "--part", f"c={bolt}")
        queries = [urllib.parse.parse_qs(post.path.partition("?")[2])
                   for post in self.stub.sent("POST", "/v1/scenes")[:2]]
        for query in queries:
            self.assertEqual(["bolt.glb"], query.pop("name"))
        self.assertEqual(queries, [
            {"scene": ["Night & day"]},
            {"scene": ["#1"], "unit": ["mm"], "up": ["z"], "deflection": ["0.1"]}])
        self.assertEqual([set(request["parts"][name]) for name in "abc"],
                         [{"scene", "matrix"}, {"scene"}, {"scene"}])
        _, err = self.run_cli("render", self.scene(), "-o", "out.png", "--part",
                              f"a={'0' * 64};scene=Night", code=2)
        self.assertIn("--part: scene= says how a FILE is read", err)

    def test_parts_of_the_base_may_be_files_and_options_go_over_them(self):
        bolt, nut = self.write("bolt.glb", glb(80)), self.write("nut.glb", glb(96))
        base = self.write("base.json", json.dumps({
            "parts": {"a": {"scene": bolt, "visible": False}, "b": {"scene": bolt}}}))
        request = self.render_request("--request", base, "--part", f"b={nut}")
        self.assertEqual(request["parts"], {"a": {"scene": id_of(80), "visible": False},
                                            "b": {"scene": id_of(96)}})

    def test_outputs_may_be_listed_either_way(self):
        scene = self.scene()
        for options in (["--output", "color,depth"], ["--output", "color", "--output", "depth"]):
            self.run_cli("render", scene, "-o", "out.exr", "-q", *options)
            request = self.stub.sent("POST", "/v1/renders")[-1]
            self.assertEqual(request.json()["outputs"], ["color", "depth"])
            self.assertEqual(request.json()["format"], "exr")
            self.assertEqual(request.headers["Accept"], "image/x-exr")

    def test_format_follows_the_extension(self):
        scene = self.scene()
        for name, format_name in {"a.PNG": "png", "a.jpg": "jpeg", "a.jpeg": "jpeg",
                                  "a.webp": "webp", "a.b.exr": "exr"}.items():
            self.run_cli("render", scene, "-o", name, "-q")
            self.assertEqual(self.stub.sent("POST", "/v1/renders")[-1].json()["format"],
                             format_name)

    def test_wrong_command_lines_are_usage_errors_and_ask_no_server(self):
        scene = self.scene()
        base = self.write("base.json", '{"width": 1, "width": 2}')
        for options in (
                ["--size", "0x10"], ["--size", "10"], ["--size", "10x"], ["--size", "-1x5"],
                ["--size", "99999x10"], ["--size", "99999999999999999999x1"],
                ["--camera", "eye=1,2 target=0,0,0"], ["--camera", "eye=1,2,3"], ["--camera", ""],
                ["--camera", "eye=nan,0,0 target=0,0,0"], ["--camera", "orbit"],
                ["--camera", "eye=1,2,3 eye=1,2,3 target=0,0,0"],
                ["--light", "laser:pos=0,0,0"], ["--light", "point:dir=0,1,0"],
                ["--light", "point:pos=0,0,0;intensity=inf"], ["--light", "spot:inner"],
                ["--light", "point:pos=0x1,0,0"], ["--light", "point:shadow=maybe"],
                ["--background", "1,1,1"], ["--environment", "1"], ["--environment", "1:x"],
                ["--clip", "1,0,0"], ["--clip", "1,0,0,0;cap=maybe"], ["--clip", "1,0,0,0;cap=1,2"],
                ["--clip", ""], ["--clip", "1,0,0,0;thickness=2"], ["--edges", ""],
                ["--edges", "crease"], ["--edges", "crease=x"], ["--part", "a"], ["--part", "a="],
                ["--part", "=box.glb"], ["--part", "a=box.glb;pos=1,2"],
                ["--part", "a=box.glb", "--part", "a=box.glb"],
                ["--part", "a=box.glb;pos=0,0,0;matrix=1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1"],
                ["--exposure", "bright"], ["--exposure", ""],
                ["--exposure", "Auto"], ["--samples", ""], ["--set", "/a"], ["--set", "a=1"],
                ["--set", "/a=b"], ["--set", "/=1"], ["--size", "1x1", "--set", "/width/x=1"],
                ["--request", base], ["--format", "bmp"], ["--frobnicate"], ["--quiet=yes"],
                ["--timeout", "-1"], ["--spawn", "--server", "http://x"], ["--state-dir", "x"],
                ["--progress", "loud"], ["--server", "ftp://x"], ["--server", "http://"],
                ["--stats", "-", "-o", "-", "--format", "png"], ["-o", "out.tga"], ["-o", "out"],
                ["extra"], ["--size"]):
            with self.subTest(options=options):
                out, err = self.run_cli("render", scene, "-o", "out.png", *options, code=2)
                self.assertEqual(out, "")
                self.assertRegex(err, r"\Avitrail: [^\n]+\n\Z")
        self.assertEqual(self.stub.requests, [])
        self.assert_only("box.glb", "base.json")

    def test_missing_inputs_are_told_apart_from_wrong_usage(self):
        for arguments in (["no.glb"], [self.scene(), "--request", "no.json"], [self.folder],
                          [self.scene(), "--part", "a=no.glb"]):
            _, err = self.run_cli("render", *arguments, "-o", "out.png", code=66)
            self.assertIn("cannot read", err)
        self.assertEqual(self.stub.requests, [])

    def test_no_command_and_unknown_commands_are_usage_errors(self):
        self.run_cli(code=2)
        self.run_cli("rendre", code=2)
        self.run_cli("render", code=2)
        self.run_cli("render", self.scene(), code=2)

    def test_a_slip_is_answered_with_what_was_probably_meant(self):
        scene = self.scene()
        for arguments, meant in (
                (["rendr"], "did you mean 'render'? See 'vitrail --help'"),
                (["render", scene, "--colour"], "no such option: --colour; see 'vitrail render"),
                (["render", scene, "--camrea", "x"], "did you mean --camera? See 'vitrail render"),
                (["render", scene, "--camrea=x"], "no such option: --camrea; did you mean"),
                (["scenes", "--josn"], "did you mean --json? See 'vitrail scenes --help'"),
                (["render", scene, "--output", "x.png"], "where the image goes is -o FILE.png"),
                (["render", scene, "-o", "x.png", "--camera", "top"], "did you mean fit:top?"),
                (["render", scene, "-o", "x.png", "--camera", "eyes=0,0,5"],
                 "'eyes=0,0,5' is nothing that can be set here; did you mean eye=? "
                 "Known: eye=, target=, up=, matrix=, fov=, ortho="),
                (["render", scene, "-o", "x.png", "--light", "point:position=0,0,5"],
                 "'position=0,0,5' is nothing that can be set here. "
                 "Known: pos=, color=, intensity=, range=, shadow=")):
            with self.subTest(arguments=arguments):
                _, err = self.run_cli(*arguments, code=2)
                self.assertIn(meant, err)
        _, err = self.run_cli("nothing-like-it", code=2)
        self.assertEqual("vitrail: no such command: 'nothing-like-it'; see 'vitrail --help'\n", err)

    def test_help_names_every_command_and_every_option_it_takes(self):
        overview, _ = self.run_cli("--help")
        for command in ("render", "push", "scenes", "environments", "delete", "stats",
                        "capabilities", "health", "demo-scene"):
            self.assertIn("\n  %s" % command, overview)
            text, _ = self.run_cli(command, "--help")
            self.assertEqual(text, self.run_cli("help", command)[0])
            self.assertIn("vitrail " + command, text)
            if command != "demo-scene":
                self.assertIn("--server URL", text)
            self.assertLessEqual(max(map(len, text.splitlines())), 100)

    def test_version_is_one_line(self):
        self.assertRegex(self.run_cli("--version")[0], r"\Avitrail \d+\.\d+\.\d+\n\Z")


if __name__ == "__main__":
    main()
