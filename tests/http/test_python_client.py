# SPDX-License-Identifier: MIT
"""The Python client against the daemon: what it sends, what it answers, what it raises."""
import ast
import concurrent.futures
import contextlib
import importlib.util
import io
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time

import support
from support import triangle

support.needs(support.FAKE)

PYTHON = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/python")
sys.path.insert(0, PYTHON)
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now


def example(name):
    """The module of an example."""
    path = os.path.join(PYTHON, "examples", name + ".py")
    spec = importlib.util.spec_from_file_location("example_" + name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class ClientTest(support.ServiceTest):
    def setUp(self):
        self.client = vitrail.Client(f"http://127.0.0.1:{self.daemon.port}")
        self.addCleanup(self.client.close)


class Scenes(ClientTest):
    def test_a_glb_is_posted_by_bytes_path_or_files_under_one_id(self):
        content = triangle("python")
        scene = self.client.post_scene(content)
        self.assertEqual(vitrail.scene_id(content), scene["id"])
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "part.glb")
            with open(path, "wb") as file:
                file.write(content)
            self.assertEqual(scene["id"], self.client.post_scene(path)["id"])
            self.assertEqual(scene["id"], vitrail.scene_id(path))
        self.assertEqual(scene["id"], self.client.post_scene({"part.glb": content})["id"])
        self.assertIn(scene["id"], [one["id"] for one in self.client.scenes()])
        self.assertEqual(["python"], self.client.scene(scene["id"])["node_names"])
        self.assertEqual("python", self.client.outline(scene["id"])["nodes"][0]["name"])

    def test_the_server_makes_its_demo_scene(self):
        scene = self.client.post_demo()
        self.assertEqual("demo", scene["name"])
        self.assertTrue(self.client.has_scene(scene["id"]))
        named = self.client.post_demo("a & b")
        self.assertEqual((scene["id"], "a & b"), (named["id"], named["name"]))

    def test_a_gltf_brings_the_files_that_it_names(self):
        document = support.triangle_document("files")
        document["buffers"][0]["uri"] = "sub%20folder/geometry.bin"
        files = {"scene.gltf": json.dumps(document).encode(),
                 "sub folder/geometry.bin": support.TRIANGLE}
        with tempfile.TemporaryDirectory() as folder:
            os.mkdir(os.path.join(folder, "sub folder"))
            for name, content in files.items():
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(content)
            scene = self.client.post_scene(os.path.join(folder, "scene.gltf"))
        self.assertEqual(support.manifest_id(files), scene["id"])
        self.assertEqual(vitrail.scene_id(files), scene["id"])

    def test_a_forgotten_scene_is_not_there(self):
        scene = self.client.post_scene(triangle("forgotten"), name="a & b")["id"]
        self.assertEqual("a & b", self.client.scene(scene)["name"])
        self.assertIsNone(self.client.rename_scene(scene, None)["name"])
        self.assertTrue(self.client.has_scene(scene))
        self.client.delete_scene(scene)
        self.assertFalse(self.client.has_scene(scene))

    def test_names_that_no_form_can_carry_are_refused_before_sending(self):
        with self.assertRaisesRegex(ValueError, "cannot be uploaded"):
            self.client.post_scene({'a".glb': triangle()})


class Renders(ClientTest):
    def test_an_image_says_its_type_tag_frame_and_times(self):
        scene = self.client.post_scene(triangle())["id"]
        image = self.client.render(scene, width=24, height=12)
        self.assertTrue(image.data.startswith(b"\x89PNG"))
        self.assertEqual("image/png", image.media_type)
        self.assertGreater(image.timings_ms["total"], 0)
        self.assertEqual(24, self.client.frame(image.frame)["width"])
        self.assertIsNone(self.client.render(scene, width=24, height=12, etag=image.etag))
        jpeg = self.client.render(scene, width=24, height=12, format="jpeg", quality_percent=70)
        self.assertEqual("image/jpeg", jpeg.media_type)

    def test_a_long_render_can_be_asked_how_far_it_is(self):
        scene = self.client.post_scene(triangle("fake:slow=1500"))["id"]
        told = []

        def render():
            with vitrail.Client(self.client.url) as other:
                return other.render(scene, width=24, height=12, request_id="slow")

        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            image = pool.submit(render)
            while not image.done():
                try:
                    told.append(self.client.render_status("slow"))
                except vitrail.VitrailError as problem:
                    self.assertEqual(404, problem.status)
                time.sleep(0.1)
            self.assertEqual("image/png", image.result().media_type)
        shares = [status["progress"]["share"] for status in told if "progress" in status]
        self.assertGreater(len(shares), 2)
        self.assertEqual(sorted(shares), shares)

    def test_a_large_upload_can_be_asked_how_far_its_reading_is(self):
        nodes = [{"name": f"Part {i}", "mesh": 0, "translation": [i, 0, 0]} for i in range(20_000)]
        content = triangle(nodes=nodes, scenes=[{"nodes": list(range(len(nodes)))}])
        told = []

        def post():
            with vitrail.Client(self.client.url) as other:
                return other.post_scene(content, request_id="large")

        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            summary = pool.submit(post)
            while not summary.done():
                try:
                    told.append(self.client.upload_status("large"))
                except vitrail.VitrailError as problem:
                    self.assertEqual(404, problem.status)
                time.sleep(0.02)
            self.assertEqual(20_000, summary.result()["nodes"])
        self.assertIn("decoding", {status["state"] for status in told})
        self.assertTrue([status for status in told if "progress" in status])

    def test_what_the_server_says_of_itself_is_answered(self):
        self.assertTrue(self.client.is_ready())
        self.assertEqual("fake", self.client.capabilities()["device"]["renderer"])
        self.assertGreater(self.client.stats()["uptime_s"], 0)


class Tradeoffs(ClientTest):
    def test_a_trade_off_is_measured_and_read_in_every_form(self):
        scene = self.client.post_scene(triangle("measured"))["id"]
        made = self.client.create_tradeoff(scene, width=16, height=16,
                                           tradeoff={"time_budget_s": 5, "max_settings": 1})
        found = self.client.wait_tradeoff(made["id"], poll_s=0.05)
        self.assertIn(found["state"], ("done", "failed"))  # the double has no true ray tracer
        self.assertTrue(self.client.tradeoff_as(made["id"], "html").startswith(b"<!"))


class Views(ClientTest):
    def setUp(self):
        super().setUp()
        scene = self.client.post_scene(triangle("viewed"))["id"]
        self.view = self.client.create_view(scene, width=32, height=24)
        self.addCleanup(self.view.__exit__)

    def test_a_patch_changes_the_view_and_its_revision(self):
        self.assertEqual(1, self.view.revision)
        self.view.patch({"overrides": {"nodes": {"viewed": {"visible": False}}}})
        self.assertEqual(2, self.view.revision)
        members = self.view.get()["view"]
        self.assertFalse(members["overrides"]["nodes"]["viewed"]["visible"])
        self.view.patch({"overrides": {"nodes": {"viewed": None}}}, revision=2)
        self.assertNotIn("viewed", self.view.get()["view"]["overrides"]["nodes"])

    def test_parts_and_times_are_put_and_taken_back(self):
        scene = self.view.scene
        self.view.put_part("lid", scene, parent="viewed")
        self.view.put_part("base", scene, visible=False)
        self.view.set_time(1.5)
        members = self.view.get()["view"]
        self.assertEqual({"name": None, "time_s": 1.5}, members["animation"])
        self.assertEqual((None, False), (members["parts"]["base"]["parent"],
                                         members["parts"]["base"]["visible"]))
        self.assertEqual("viewed", members["parts"]["lid"]["parent"])
        self.view.put_part("lid", scene, matrix=[2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1])
        self.assertEqual(2, self.view.get()["view"]["parts"]["lid"]["matrix"][5])
        self.assertIsNone(self.view.get()["view"]["parts"]["lid"]["parent"])
        self.view.remove_part("lid")
        self.view.set_time(None)
        members = self.view.get()["view"]
        self.assertEqual((["base"], None), (list(members["parts"]), members["animation"]))

    def test_haze_comes_and_goes_by_patches(self):
        self.view.patch({"atmosphere": {"density": 0.05, "anisotropy": 0.5}})
        self.view.patch({"atmosphere": {"density": 0.1}})
        haze = self.view.get()["view"]["atmosphere"]
        self.assertEqual((0.1, 0.5), (haze["density"], haze["anisotropy"]))
        self.view.patch({"atmosphere": None})
        self.assertIsNone(self.view.get()["view"]["atmosphere"])

    def test_a_stale_revision_is_refused_with_the_present_one(self):
        self.view.patch({"exposure_ev": 1})
        with self.assertRaises(vitrail.VitrailError) as caught:
            self.view.patch({"exposure_ev": 2}, revision=1)
        problem = caught.exception
        self.assertEqual((412, "precondition_failed", 2),
                         (problem.status, problem.code, problem.revision))

    def test_an_image_is_not_sent_again_when_its_tag_is_known(self):
        image = self.view.image()
        self.assertEqual(("image/png", 1), (image.media_type, image.revision))
        self.assertIsNone(self.view.image(etag=image.etag))
        self.view.patch({"width": 40})
        self.assertIsNotNone(self.view.image(etag=image.etag))
        jpeg = self.view.image(format="jpeg", quality_percent=50)
        self.assertEqual("image/jpeg", jpeg.media_type)

    def test_picking_answers_nodes_by_point_layer_and_rectangle(self):
        hit = self.view.pick(3.5, 2.5)
        layers = self.view.pick_through(3.5, 2.5)
        nodes = self.view.pick_rectangle(0, 0, 32, 24)
        self.assertEqual("viewed", hit["node"]["name"])
        self.assertEqual([hit["node"]] * 2, [layer["node"] for layer in layers])
        self.assertEqual(["viewed"], [found["node"]["name"] for found in nodes])
        with self.assertRaises(vitrail.VitrailError) as caught:
            self.view.pick(-1, 12)
        self.assertEqual(400, caught.exception.status)

    def test_a_stream_shows_changes_and_ends_with_an_exact_frame(self):
        frames = self.view.stream()
        self.addCleanup(frames.close)
        first = self.until_exact(frames)
        self.assertEqual((1, self.view.image().data), (first.revision, first.data))
        self.view.patch({"width": 48})
        second = self.until_exact(frames)
        self.assertEqual(2, second.revision)
        self.assertEqual(48, self.client.frame(second.frame)["width"])

    def until_exact(self, frames):
        for frame in frames:
            if frame.exact:
                return frame
        self.fail("the stream ended")

    def test_events_tell_of_changes_frames_and_the_end(self):
        events = self.view.events()
        self.addCleanup(events.close)
        first = next(events)
        self.assertEqual(("view", {"revision": 1}), (first.name, first.data))
        self.view.patch({"exposure_ev": 1})
        self.assertEqual(("view", {"revision": 2}), (lambda e: (e.name, e.data))(next(events)))
        self.view.image()
        frame = next(event for event in events if event.name == "frame")
        self.assertEqual((2, True), (frame.data["revision"], frame.data["exact"]))
        self.view.delete()
        self.assertEqual("gone", list(events)[-1].name)

    def test_a_view_is_found_by_its_id_and_gone_after_its_block(self):
        with self.client.create_view(self.view.scene) as view:
            self.assertEqual(view.id, self.client.view(view.id).id)
            self.assertIn(view.id, [one["id"] for one in self.client.views()])
        self.assertNotIn(view.id, [one["id"] for one in self.client.views()])


class Errors(ClientTest):
    def test_a_problem_is_raised_with_its_members(self):
        scene = self.client.post_scene(triangle())["id"]
        with self.assertRaises(vitrail.VitrailError) as caught:
            self.client.render(scene, width=-3)
        problem = caught.exception
        self.assertEqual((400, "invalid_request", "/width"),
                         (problem.status, problem.code, problem.pointer))
        self.assertRegex(problem.request_id, "^[0-9a-f]{16}$")
        self.assertIn("width", str(problem))
        with self.assertRaises(vitrail.VitrailError) as caught:
            self.client.scene("0" * 64)
        self.assertEqual(404, caught.exception.status)

    def test_no_server_is_an_error_of_the_same_kind(self):
        with socket.socket() as reserved:
            reserved.bind(("127.0.0.1", 0))
            client = vitrail.Client(f"http://127.0.0.1:{reserved.getsockname()[1]}", timeout_s=5)
            with self.assertRaises(vitrail.VitrailError) as caught:
                client.stats()
        self.assertEqual((0, "no_reply"), (caught.exception.status, caught.exception.code))
        self.assertFalse(client.is_ready())
        with self.assertRaises(ValueError):
            vitrail.Client("ftp://127.0.0.1")

    def test_a_busy_server_is_asked_again_as_often_as_wanted(self):
        answers = [503, 503, 200]
        with socket.create_server(("127.0.0.1", 0)) as server:
            def serve():
                for status in answers:
                    peer, _ = server.accept()
                    with peer:
                        peer.recv(65536)
                        body = b'{"detail": "busy", "code": "overloaded"}'
                        peer.sendall(b"HTTP/1.1 %d x\r\nRetry-After: 0\r\nConnection: close\r\n"
                                     b"Content-Length: %d\r\n\r\n%s" % (status, len(body), body))
            thread = threading.Thread(target=serve)
            thread.start()
            client = vitrail.Client(f"http://127.0.0.1:{server.getsockname()[1]}", retries=2)
            self.assertEqual("overloaded", client.stats()["code"])
            thread.join(20)
        self.assertFalse(thread.is_alive())

    def test_a_connection_is_kept_between_requests(self):
        before = self.client.stats()["http"]["connections"]
        for _ in range(20):
            self.client.stats()
        self.assertLessEqual(self.client.stats()["http"]["connections"], before)


class Package(support.unittest.TestCase):
    def test_cameras_of_an_orbit_look_at_the_middle_from_all_around(self):
        cameras = vitrail.orbit({"min": [0, 0, 0], "max": [2, 4, 2]}, 4, pitch_deg=0)
        self.assertEqual([[1, 2, 1]] * 4, [camera["target"] for camera in cameras])
        east = cameras[1]["eye"]
        self.assertGreater(east[0], 2)
        self.assertAlmostEqual(1, east[2])

    def test_every_public_function_is_typed(self):
        for folder, _, names in os.walk(os.path.join(PYTHON, "vitrail")):
            for name in names:
                if not name.endswith(".py"):
                    continue
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    tree = ast.parse(file.read())
                for node in ast.walk(tree):
                    if isinstance(node, ast.FunctionDef):
                        where = f"{name}:{node.name}"
                        self.assertIsNotNone(node.returns, where)
                        for argument in node.args.args + node.args.kwonlyargs:
                            if argument.arg != "self":
                                self.assertIsNotNone(argument.annotation, where)
        self.assertTrue(os.path.exists(os.path.join(PYTHON, "vitrail", "py.typed")))

    def test_pip_installs_it_from_the_folder_without_a_network(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(PYTHON, os.path.join(folder, "source"))
            done = subprocess.run(
                [sys.executable, "-m", "pip", "install", "-q", "--no-index", "--target",
                 os.path.join(folder, "target"), os.path.join(folder, "source")],
                capture_output=True, text=True, check=False)
            if "No module named pip" in done.stderr:
                self.skipTest("this Python has no pip")
            self.assertEqual(0, done.returncode, done.stderr)
            installed = os.listdir(os.path.join(folder, "target", "vitrail"))
            self.assertIn("py.typed", installed)
            self.assertIn("client.py", installed)

    def test_importing_needs_nothing_but_the_standard_library(self):
        code = ("import sys; sys.path.insert(0, sys.argv[1]); import vitrail; "
                "print(vitrail.__version__)")
        done = subprocess.run([sys.executable, "-ISB", "-c", code, PYTHON], capture_output=True,
                              text=True, check=False)
        self.assertEqual((0, "0.1.0\n"), (done.returncode, done.stdout), done.stderr)


class Examples(ClientTest):
    def run_example(self, name, *arguments):
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            example(name).main(*arguments, f"http://127.0.0.1:{self.daemon.port}")
        return said.getvalue()

    def test_post_scene_says_what_it_made_and_why(self):
        with tempfile.TemporaryDirectory() as folder:
            path, out = os.path.join(folder, "a.glb"), os.path.join(folder, "a.png")
            with open(path, "wb") as file:
                file.write(triangle("example"))
            said = self.run_example("post_scene", path, out)
            self.assertIn("1 triangles", said)
            self.assertGreater(os.path.getsize(out), 50)

    def test_orbit_views_writes_so_many_images_from_one_load(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.glb")
            with open(path, "wb") as file:
                file.write(triangle("turned"))
            self.assertIn("3 images", self.run_example("orbit_views", path, folder + "/o_", "3"))
            self.assertEqual(["a.glb", "o_00.png", "o_01.png", "o_02.png"],
                             sorted(os.listdir(folder)))

    def test_watch_stats_prints_a_line_for_each_frame_until_the_view_is_gone(self):
        scene = self.client.post_scene(triangle("watched"))["id"]
        view = self.client.create_view(scene, width=16, height=16)
        said = io.StringIO()
        events = view.events()
        next(events)  # by now the server tells its watchers
        def edit():
            view.image()
            view.delete()
        timer = threading.Timer(0.5, edit)
        timer.start()
        with contextlib.redirect_stdout(said):
            example("watch_stats").main(view.id, f"http://127.0.0.1:{self.daemon.port}")
        timer.join()
        events.close()
        self.assertRegex(said.getvalue(), r"revision +1 exact +\d+ bytes")

    def test_a_cad_session_makes_as_many_revisions_as_edits(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.glb")
            with open(path, "wb") as file:
                file.write(triangle("assembly"))
            said = self.run_example("cad_session", path, "100")
            self.assertIn("revision 101,", said)
            self.assertIn("100 edits: median", said)


if __name__ == "__main__":
    support.run_tests()
