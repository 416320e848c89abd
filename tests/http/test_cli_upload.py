#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The uploads of `vitrail`: what is sent, what is not sent again, what never leaves."""
import hashlib
import json
import os
import unittest
import urllib.parse

from cli_support import CliTest, glb, main, multipart_parts


def gltf(buffers=(), images=()):
    return json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": u} for u in buffers],
                       "images": [{"uri": u} for u in images]})


class UploadTest(CliTest):
    def upload(self):
        request = self.stub.sent("POST", "/v1/scenes")[-1]
        return multipart_parts(request.headers["Content-Type"], request.body)

    def test_glb_is_sent_as_it_is_and_its_id_printed(self):
        content = glb(3_000_000)
        out, _ = self.run_cli("push", self.scene(content))
        request = self.stub.sent("POST", "/v1/scenes")[0]
        self.assertEqual(request.headers["Content-Type"], "model/gltf-binary")
        self.assertEqual(request.body, content)
        self.assertEqual(out, hashlib.sha256(content).hexdigest() + "\n")

    def test_a_glb_is_called_as_its_file(self):
        self.run_cli("push", self.scene(name="folder/Tür & Tor 100%.glb"))
        query = self.stub.sent("POST", "/v1/scenes")[0].path.partition("?")[2]
        self.assertEqual(urllib.parse.parse_qs(query, strict_parsing=True),
                         {"name": ["Tür & Tor 100%.glb"]})

    def test_a_scene_can_be_given_a_name(self):
        self.run_cli("push", self.scene(), "--name", "the box")
        self.assertIn("?name=the%20box", self.stub.sent("POST", "/v1/scenes")[0].path)
        (scene_id,) = self.stub.scenes
        self.run_cli("push", self.scene(), "--name", "another")  # the server has it: no upload
        self.assertEqual(len(self.stub.sent("POST", "/v1/scenes")), 1)
        self.assertEqual(self.stub.names, {scene_id: "another"})
        _, err = self.run_cli("push", self.scene(), self.scene(), "--name", "both", code=2)
        self.assertIn("--name is for one FILE, and there are 2", err)

    def test_one_scene_of_a_file_is_asked_for_by_name(self):
        self.run_cli("push", self.scene())
        self.run_cli("push", self.scene(), "--scene", "#1 & more", "--name", "x")
        path = self.stub.sent("POST", "/v1/scenes")[-1].path
        self.assertIn("?name=x&scene=%231%20%26%20more", path)
        _, err = self.run_cli("push", self.scene(), self.scene(), "--scene", "Night", code=2)
        self.assertIn("--scene is for one FILE, and there are 2", err)

    def test_every_command_that_takes_a_file_takes_one_scene_of_it(self):
        for command in (("render", "-o", "a.png"), ("explain",), ("view", "create"),
                        ("orbit", "-n", "1", "-o", "b_%d.png"), ("tradeoff",)):
            with self.subTest(command):
                sent = len(self.stub.sent("POST", "/v1/scenes"))
                verbs = command[:2] if command[0] == "view" else command[:1]
                rest = command[len(verbs):]
                # what the stand-in server answers after the upload is no matter here
                process = self.start(*verbs, self.scene(), *rest, "--scene", "Night")
                process.communicate(timeout=60)
                posts = self.stub.sent("POST", "/v1/scenes")[sent:]
                self.assertEqual([post.path.partition("&")[2] for post in posts], ["scene=Night"])
                _, err = self.run_cli(*verbs, "ab" * 32, *rest, "--scene", "Night", code=2)
                self.assertIn("--scene says how a FILE is read", err)
        _, err = self.run_cli("view", "show", "--scene", "Night", code=2)
        self.assertIn("--scene is for 'view create FILE'", err)

    def test_the_server_makes_the_demo_scene_and_nothing_is_sent(self):
        out, _ = self.run_cli("push", "--demo")
        self.assertEqual(out, "de" * 32 + "\n")
        (request,) = self.stub.sent("POST", "/v1/scenes/demo")
        self.assertEqual((request.path, request.body), ("/v1/scenes/demo", b""))
        out, _ = self.run_cli("push", "--demo", "--name", "T & T", "--json")
        self.assertEqual(json.loads(out), {"file": None, "id": "de" * 32, "sent": False,
                                           "warnings": []})
        self.assertIn("?name=T%20%26%20T", self.stub.sent("POST", "/v1/scenes/demo")[-1].path)
        content = glb(5000)
        out, _ = self.run_cli("push", self.scene(content), "--demo")
        self.assertEqual(out.split(), ["de" * 32, hashlib.sha256(content).hexdigest()])

    def test_a_procedure_is_sent_as_a_gltf_of_its_own(self):
        self.run_cli("push", "--procedure", "smoke:seed=3;color=1,0.5,0")
        (request,) = self.stub.sent("POST", "/v1/scenes")
        self.assertEqual("model/gltf+json", request.headers["Content-Type"])
        self.assertEqual("/v1/scenes?name=smoke", request.path)
        document = json.loads(request.body)
        (grid,) = document["extensions"]["VITRAIL_density_grids"]["grids"]
        self.assertEqual({"name": "smoke", "min": [-1, 0, -1], "max": [1, 4, 1], "density": 20,
                          "size": [64, 128, 64], "color": [1, 0.5, 0],
                          "procedure": {"type": "smoke", "seed": 3}}, grid)
        self.run_cli("push", "--procedure", "fog:density=0.5;min=0,0,0;max=8,1,8;detail=2",
                     "--name", "mist")
        request = self.stub.sent("POST", "/v1/scenes")[-1]
        (grid,) = json.loads(request.body)["extensions"]["VITRAIL_density_grids"]["grids"]
        self.assertEqual("/v1/scenes?name=mist", request.path)
        self.assertEqual([161, 20, 161], grid["size"])  # cubes, 2^19 of them
        self.assertEqual((0.5, {"type": "fog", "detail": 2}), (grid["density"], grid["procedure"]))

    def test_a_wrong_procedure_is_told_before_anything_is_sent(self):
        for spec, told in (("steam", "smoke, fog or cloud"), ("", "smoke, fog or cloud"),
                           ("smoke:size=8", "3 numbers"), ("smoke:sed=3", "seed"),
                           ("fog:density=thick", "number")):
            _, err = self.run_cli("push", self.scene(), "--procedure", spec, code=2)
            self.assertIn(told, err)
        _, err = self.run_cli("push", "--procedure", "fog", "--procedure", "fog", "--name", "both",
                              code=2)
        self.assertIn("--name is for one FILE, and there are 2", err)
        _, err = self.run_cli("push", "--procedure", "fog", "--unit", "mm", code=2)
        self.assertIn("--unit, --up and --deflection are for a FILE", err)
        self.assertEqual([], self.stub.sent("POST", "/v1/scenes"))

    def test_a_push_of_nothing_is_a_wrong_command_line(self):
        _, err = self.run_cli("push", code=2)
        self.assertIn("push needs a FILE, or --demo", err)
        _, err = self.run_cli("push", "--demo", self.scene(), "--name", "both", code=2)
        self.assertIn("--name is for one FILE, and there are 2", err)
        self.stub.special[("POST", "/v1/scenes/demo")] = lambda handler, _: handler.problem(
            413, "too_large", "too many scenes")
        _, err = self.run_cli("push", "--demo", code=1)
        self.assertIn("too many scenes", err)

    def test_a_scene_of_the_server_is_found_by_name_or_first_digits(self):
        first, second, third = "c0ffee" + 58 * "1", "c0de" + 60 * "2", "d" * 64
        self.stub.scenes.update((first, second, third))
        self.stub.names.update({first: "cup.glb", second: "twin.glb", third: "twin.glb"})
        for said, meant in (("c0ff", first), ("scene:c0ff", first), ("scene:cup.glb", first),
                            ("c0de", second), ("d" * 64, third)):
            self.run_cli("render", said, "-o", "out.png")
            self.assertEqual(self.stub.sent("POST", "/v1/renders")[-1].json()["scene"], meant)
        out, _ = self.run_cli("scenes", "cup.glb", "--json")
        self.assertEqual(json.loads(out)["id"], first)
        _, err = self.run_cli("scenes", "scene:twin.glb", code=2)
        self.assertIn("means 2 scenes: c0de22222222 twin.glb, dddddddddddd twin.glb", err)
        for said in ("beef", "scene:none.glb", "scene:"):
            _, err = self.run_cli("render", said, "-o", "out.png", code=66)
            self.assertIn("the server has no scene that is called", err)
        self.run_cli("delete", "cup.glb")
        self.assertEqual(self.stub.scenes, {second, third})

    def test_a_file_goes_before_the_first_digits_of_an_id(self):
        self.stub.scenes.add("c0ff" + 60 * "1")
        self.scene(name="c0ff")
        self.run_cli("render", "c0ff", "-o", "out.png")
        self.assertEqual(len(self.stub.sent("POST", "/v1/scenes")), 1)

    def test_known_glb_is_not_sent_again(self):
        content = glb(5000)
        scene_id = hashlib.sha256(content).hexdigest()
        self.stub.scenes.add(scene_id)
        out, _ = self.run_cli("push", self.scene(content), "--json")
        self.assertEqual(json.loads(out),
                         {"file": self.path("box.glb"), "id": scene_id, "sent": False,
                          "warnings": []})
        self.assertEqual(self.stub.sent("POST", "/v1/scenes"), [])
        self.run_cli("push", self.path("box.glb"), "--force")
        self.assertEqual(len(self.stub.sent("POST", "/v1/scenes")), 1)

    def test_scene_dropped_after_the_question_is_sent_after_all(self):
        content = glb(5000)
        scene_id = hashlib.sha256(content).hexdigest()
        self.stub.special["HEAD", "/v1/scenes/" + scene_id] = lambda h, r: h.answer(200) or True
        out, _ = self.run_cli("render", self.scene(content), "-o", "out.png", "--json")
        self.assertTrue(json.loads(out)["sent"])
        self.assertEqual(len(self.stub.sent("POST", "/v1/scenes")), 1)
        self.assertEqual(len(self.stub.sent("POST", "/v1/renders")), 2)

    def test_scene_id_is_rendered_without_any_upload(self):
        self.stub.scenes.add("c0" * 32)
        self.run_cli("render", "c0" * 32, "-o", "out.png")
        self.assertEqual([r.path for r in self.stub.requests],
                         ["/v1/scenes/" + "c0" * 32, "/v1/renders", "/v1/frames/f1"])

    def test_warnings_of_a_scene_are_told(self):
        self.stub.scene_warnings = ["1 skinned node is not deformed"]
        _, err = self.run_cli("push", self.scene())
        self.assertIn("box.glb: 1 skinned node is not deformed", err)
        self.assertEqual("", self.run_cli("push", self.scene(), "-q")[1])
        out, _ = self.run_cli("push", self.scene(), "--json")
        self.assertEqual(self.stub.scene_warnings, json.loads(out)["warnings"])
        _, err = self.run_cli("render", self.scene(), "-o", "out.png")
        self.assertIn("the scene: 1 skinned node", err)
        out, _ = self.run_cli("render", self.scene(), "-o", "out.png", "--json")
        self.assertEqual(self.stub.scene_warnings, json.loads(out)["scene_warnings"])

    def test_strict_takes_warnings_for_failures(self):
        self.stub.scene_warnings = ["1 skinned node is not deformed"]
        out, err = self.run_cli("push", self.scene(), "--strict", code=1)
        self.assertIn("--strict: 1 warning: 1 skinned", err)
        self.assertEqual(65, len(out))
        _, err = self.run_cli("render", self.scene(), "-o", "out.png", "--strict", code=1)
        self.assertIn("--strict: 2 warnings, the first: 1 skinned", err)
        self.assert_only("box.glb")
        self.stub.scene_warnings = []
        self.run_cli("push", self.scene(), "--strict")

    def test_several_files_print_their_ids_in_order(self):
        paths = [self.write("%d.glb" % i, glb(100 + i)) for i in range(3)]
        out, _ = self.run_cli("push", *paths)
        self.assertEqual(out.split(), [hashlib.sha256(glb(100 + i)).hexdigest() for i in range(3)])

    def test_gltf_is_sent_with_every_file_it_names(self):
        self.write("a b/scene one.gltf", gltf(
            ["geo%20metry.bin", "./sub/../geo%20metry.bin",
             "data:application/octet-stream;base64,AA=="],
            ["textures/r%C3%A9d.png", "textures/red%2Bblue.png", "DATA:image/png;base64,AA=="]))
        self.write("a b/geo metry.bin", b"\0\1\r\n--\2")
        self.write("a b/textures/réd.png", b"red")
        self.write("a b/textures/red+blue.png", b"both")
        self.write("a b/unused.png", b"never named")
        out, _ = self.run_cli("push", "a b/scene one.gltf")
        self.assertEqual(out, "ab" * 32 + "\n")
        self.assertEqual(self.upload(), {
            name: (name, self.read("a b/" + name))
            for name in ("scene one.gltf", "geo metry.bin", "textures/réd.png",
                         "textures/red+blue.png")})

    def test_gltf_without_other_files_is_one_part(self):
        self.run_cli("push", self.write("x.gltf", gltf()))
        self.assertEqual(list(self.upload()), ["x.gltf"])

    def test_no_uri_leads_out_of_the_folder(self):
        secret = self.write("secret.bin", b"private")
        self.write("in/link.bin", b"")
        os.remove(self.path("in/link.bin"))
        os.symlink(secret, self.path("in/link.bin"))
        os.mkfifo(self.path("in/pipe.bin"))
        os.makedirs(self.path("in/folder"))
        for uri in ("../secret.bin", "%2e%2e/secret.bin", "x/../../secret.bin", secret,
                    "/etc/passwd", "file://" + secret, "FILE:" + secret, "http://localhost/x",
                    "link.bin", "pipe.bin", "folder", "a%00b", "..", "", "./", "%2Fetc/passwd"):
            for tables in ([uri], ()), ((), [uri]):
                with self.subTest(uri=uri):
                    _, err = self.run_cli("push", self.write("in/x.gltf", gltf(*tables)), code=1)
                    self.assertRegex(err, r"/(buffers|images)/0/uri")
        self.assertEqual(self.stub.requests, [])

    def test_gltf_through_a_linked_folder_is_taken(self):
        self.write("real/x.gltf", gltf(["sub/b.bin"]))
        self.write("real/sub/b.bin", b"1")
        os.symlink("real", self.path("alias"))
        self.run_cli("push", "alias/x.gltf")
        self.assertEqual(set(self.upload()), {"x.gltf", "sub/b.bin"})

    def test_missing_file_is_named_before_anything_is_sent(self):
        _, err = self.run_cli("push", self.write("x.gltf", gltf(["gone.bin"])), code=66)
        self.assertIn("gone.bin", err)
        self.assertIn("/buffers/0/uri", err)
        self.assertEqual(self.stub.requests, [])

    def test_what_is_no_gltf_is_refused_with_the_line(self):
        for text in ("{\n\"asset\":\n", "", "glT", "\x00\x01", "[" * 5000):
            _, err = self.run_cli("push", self.write("x.gltf", text), code=1)
            self.assertIn("not glTF: line", err)

    def test_odd_but_valid_tables_are_left_to_the_server(self):
        for text in ('{"buffers": 3}', '{"images": [1, null, {"uri": 5}]}', '[]',
                     '{"buffers": {}}'):
            self.run_cli("push", self.write("x.gltf", text))

    def test_too_many_files_are_refused_before_they_are_sent(self):
        names = ["b%d.bin" % i for i in range(1025)]
        for name in names:
            self.write(name, b"")
        _, err = self.run_cli("push", self.write("x.gltf", gltf(names)), code=1)
        self.assertIn("1024", err)

    def test_bad_file_among_several_sends_none(self):
        self.run_cli("push", self.scene(), "gone.glb", code=66)
        self.assertEqual(self.stub.requests, [])

    @unittest.skipIf(os.getuid() == 0, "root reads everything")
    def test_unreadable_file_is_an_input_failure(self):
        os.chmod(self.scene(), 0)
        self.run_cli("push", self.path("box.glb"), code=66)


if __name__ == "__main__":
    main()
