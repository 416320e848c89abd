# SPDX-License-Identifier: MIT
"""Scenes over HTTP: what is taken, by which id, what is kept and what is forgotten."""
import base64
import concurrent.futures
import json
import os
import stat
import subprocess

import support
from image_files import png_bytes
from support import TRIANGLE, glb, manifest_id, multipart, sha256, triangle, triangle_document

support.needs(support.FAKE)


def gltf_files(prefix=""):
    document = triangle_document()
    document["buffers"][0]["uri"] = prefix + "triangle.bin"
    return {"scene.gltf": json.dumps(document).encode(), prefix + "triangle.bin": TRIANGLE}


def post_demo(daemon, query=""):
    return daemon.request("POST", "/v1/scenes/demo" + query)


class DemoScene(support.ServiceTest):
    def test_it_is_the_scene_that_the_command_line_writes(self):
        content = subprocess.run([os.path.join(support.BIN, "vitrail"), "demo-scene", "-o", "-"],
                                 check=True, capture_output=True).stdout
        reply = post_demo(self.daemon)
        self.assertEqual((201, "demo"), (reply.status, reply.json()["name"]))
        self.assertEqual(sha256(content), reply.json()["id"])
        self.assertEqual("/v1/scenes/" + reply.json()["id"], reply.header("Location"))
        self.assertEqual(len(content), reply.json()["bytes"]["upload"])
        self.assertEqual(12, reply.json()["light_count"])
        self.assertEqual(200, self.daemon.post_scene(content).status)

    def test_one_that_is_here_is_not_decoded_again_and_keeps_its_name(self):
        path = "/v1/scenes/" + post_demo(self.daemon, "?name=chapel").json()["id"]
        decoded = self.daemon.stats()["decodes"]["decoded"]
        again = post_demo(self.daemon)
        self.assertEqual((200, "chapel"), (again.status, again.json()["name"]))
        self.assertEqual(decoded, self.daemon.stats()["decodes"]["decoded"])
        named = post_demo(self.daemon, "?name=glass")
        self.assertEqual((200, "glass"), (named.status, named.json()["name"]))
        self.assertEqual(204, self.daemon.request("DELETE", path).status)
        self.assertEqual((201, "demo"), (lambda r: (r.status, r.json()["name"]))(
            post_demo(self.daemon)))

    def test_posts_at_the_same_time_make_one_scene(self):
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            replies = list(pool.map(lambda _: post_demo(self.daemon), range(2)))
        self.assertEqual(1, len({reply.json()["id"] for reply in replies}))
        self.assertLessEqual({reply.status for reply in replies}, {200, 201})

    def test_it_keeps_to_the_limits_of_uploads(self):
        for query in ("?name=", "?nam=x", "?name=a%0Ab", "?scene=%230"):
            self.assertEqual(400, post_demo(self.daemon, query).status, query)
        with support.Daemon("--max-upload-bytes", "10240") as daemon:
            reply = post_demo(daemon)
            self.assertEqual((413, "too_large"), (reply.status, reply.code))
            self.assertEqual([], daemon.request("GET", "/v1/scenes").json()["scenes"])

    def test_a_texture_that_needs_more_memory_than_decoders_have_is_refused(self):
        side = 4096
        uri = "data:image/png;base64," + base64.b64encode(
            png_bytes(side, side, bytes(4 * side * side))).decode()
        look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        content = triangle("large", images=[{"uri": uri}], textures=[{"source": 0}],
                           materials=[look])
        with support.Daemon("--decode-memory-bytes", str(64 << 20)) as daemon:
            reply = daemon.post_scene(content)
            self.assertEqual((422, "invalid_scene"), (reply.status, reply.code))
            self.assertIn("decoding needs more than", reply.json()["detail"])
            self.assertEqual([], os.listdir(os.path.join(daemon.state_dir, "tmp")))


class Scenes(support.ServiceTest):
    def test_a_glb_has_the_sha256_of_its_bytes_as_id(self):
        content = triangle("by-sha")
        reply = self.daemon.post_scene(content)
        self.assertEqual(201, reply.status)
        self.assertEqual(sha256(content), reply.json()["id"])
        self.assertEqual("/v1/scenes/" + sha256(content), reply.header("Location"))
        self.assertEqual(1, reply.json()["triangles"])
        self.assertEqual(["by-sha"], reply.json()["node_names"])

    def test_identical_content_is_answered_200_with_the_same_id(self):
        content = triangle("twice")
        first, second = self.daemon.post_scene(content), self.daemon.post_scene(content)
        self.assertEqual((201, 200), (first.status, second.status))
        self.assertEqual(first.json(), second.json())

    def test_octet_stream_is_taken_when_it_is_a_glb(self):
        self.assertEqual(
            201, self.daemon.post_scene(triangle("octets"), "application/octet-stream").status
        )
        reply = self.daemon.post_scene(b"PK\3\4 no glb", "application/octet-stream")
        self.assertEqual((415, "unsupported_media_type"), (reply.status, reply.code))

    def test_a_gltf_that_holds_its_buffers_is_taken_as_one_body(self):
        document = triangle_document("embedded")
        document["buffers"][0]["uri"] = (
            "data:application/octet-stream;base64," + base64.b64encode(TRIANGLE).decode()
        )
        content = json.dumps(document).encode()
        reply = self.daemon.post_scene(content, "model/gltf+json")
        self.assertEqual((201, sha256(content)), (reply.status, reply.json()["id"]))

    def test_several_files_have_the_sha256_of_their_manifest(self):
        for prefix in ("", "data/deep er/", "ünïcode❤/"):
            files = gltf_files(prefix)
            reply = self.daemon.post_scene(*multipart(files))
            self.assertEqual(201, reply.status, reply.body)
            self.assertEqual(manifest_id(files), reply.json()["id"])
            self.assertEqual("scene.gltf", reply.json()["name"])

    def test_the_order_and_the_field_of_names_do_not_change_the_id(self):
        files = gltf_files("other/")
        backwards = dict(reversed(files.items()))
        ids = {
            self.daemon.post_scene(*multipart(files)).json()["id"],
            self.daemon.post_scene(*multipart(backwards, boundary="b" * 70)).json()["id"],
            self.daemon.post_scene(*multipart(files, name_from="name")).json()["id"],
        }
        self.assertEqual({manifest_id(files)}, ids)

    def test_one_file_as_multipart_has_the_id_of_the_file(self):
        content = triangle("single")
        self.assertEqual(
            sha256(content), self.daemon.post_scene(*multipart({"a.glb": content})).json()["id"]
        )

    def test_a_scene_of_a_file_is_a_scene_of_its_own(self):
        content = triangle("several", scenes=[{"name": "Day", "nodes": [0]}, {"name": "Night é"}])
        own = self.daemon.post_scene(content).json()
        self.assertEqual((sha256(content), ["Day", "Night é"], 0, 1),
                         (own["id"], own["file_scenes"], own["file_scene"], own["triangles"]))
        for query, text in (("?scene=Night%20%C3%A9&name=dark", "Night é"), ("?scene=%231", "#1")):
            reply = self.daemon.post_scene(content, query=query)
            other = reply.json()
            manifest = f"vitrail-scene-of-1\n{own['id']} {text}\n".encode()
            self.assertEqual((201, sha256(manifest), 1, 0),
                             (reply.status, other["id"], other["file_scene"], other["triangles"]))
            self.assertEqual(200, self.daemon.post_scene(content, query=query).status)
        files = {**gltf_files("several/"), "more.bin": b"more"}
        manifest = f"vitrail-scene-of-1\n{manifest_id(files)} #0\n".encode()
        reply = self.daemon.post_scene(*multipart(files), query="?scene=%230")
        self.assertEqual(sha256(manifest), reply.json()["id"])

    def test_a_scene_that_the_file_does_not_have_is_refused(self):
        content = triangle("few", scenes=[{"name": "Day", "nodes": [0]}])
        for scene in ("Dusk", "%231", "%23", "%23-1", "day", "%23184467440737095516160"):
            reply = self.daemon.post_scene(content, query="?scene=" + scene)
            self.assertEqual((400, "invalid_request"), (reply.status, reply.code), scene)
            self.assertIn("among its 1: 'Day'", reply.json()["detail"])
        for query in ("?scene=", "?scene=a%0Ab", "?scene=%FF", "?scene=" + 513 * "n"):
            self.assertEqual(400, self.daemon.post_scene(content, query=query).status, query)
        without = triangle_document("none")
        del without["scenes"], without["scene"]
        reply = self.daemon.post_scene(glb(without, TRIANGLE), query="?scene=%230")
        self.assertIn("no scene '#0' among its 0", reply.json()["detail"])

    def test_the_list_grows_and_shrinks_in_order(self):
        ids = [self.daemon.push(triangle(f"listed-{i}")) for i in range(3)]
        listed = [
            scene["id"] for scene in self.daemon.request("GET", "/v1/scenes").json()["scenes"]
        ]
        self.assertEqual(set(ids), set(ids) & set(listed))
        self.assertEqual(204, self.daemon.request("DELETE", "/v1/scenes/" + ids[1]).status)
        listed = [
            scene["id"] for scene in self.daemon.request("GET", "/v1/scenes").json()["scenes"]
        ]
        self.assertIn(ids[0], listed)
        self.assertNotIn(ids[1], listed)

    def test_a_scene_is_called_as_the_post_says(self):
        content = triangle("named")
        reply = self.daemon.post_scene(content, query="?name=T%C3%BCr%20%26%20Tor")
        self.assertEqual((201, "Tür & Tor"), (reply.status, reply.json()["name"]))
        self.assertEqual((200, "Tür & Tor"), self.status_and_name(self.daemon.post_scene(content)))
        again = self.daemon.post_scene(content, query="?name=gate")
        self.assertEqual((200, "gate"), self.status_and_name(again))
        files = multipart(gltf_files("named/"))
        reply = self.daemon.post_scene(*files, query="?name=by+hand")
        self.assertEqual((201, "by hand"), self.status_and_name(reply))

    def test_a_patch_names_a_scene_or_takes_the_name_away(self):
        path = "/v1/scenes/" + self.daemon.push(triangle("patched"))
        tags = [self.daemon.request("GET", path).header("ETag")]
        for name in ("first", "second ❤", None):
            reply = self.patch(path, {"name": name})
            self.assertEqual((200, name), self.status_and_name(reply))
            listed = self.daemon.request("GET", "/v1/scenes").json()["scenes"]
            self.assertEqual([name], [s["name"] for s in listed if path.endswith(s["id"])])
            self.assertEqual(name, self.daemon.request("GET", path).json()["name"])
            tags.append(self.daemon.request("GET", path).header("ETag"))
        self.assertEqual(3, len(set(tags)))  # a known tag is no excuse for an old name
        self.assertEqual(tags[0], tags[3])
        self.assertEqual(200, self.patch(path, {}).status)

    def test_names_that_are_none_are_refused(self):
        scene = triangle("misnamed")
        for query in ("?name=", "?name=a%0Ab", "?name=%FF", "?name=" + 513 * "n",
                      "?nam=x", "?name=a&name=b"):
            self.assertEqual(400, self.daemon.post_scene(scene, query=query).status, query)
        path = "/v1/scenes/" + self.daemon.push(scene)
        for patch, pointer in (({"name": ""}, "/name"), ({"name": 7}, "/name"), ([], ""),
                               ({"name": "a\nb"}, "/name"), ({"name": 513 * "n"}, "/name"),
                               ({"nam": "x"}, "/nam")):
            reply = self.patch(path, patch)
            self.assertEqual((400, pointer), (reply.status, reply.json().get("pointer", "")), patch)
        self.assertEqual(404, self.patch("/v1/scenes/" + "0" * 64, {"name": "x"}).status)
        reply = self.daemon.request("PATCH", path, b"{}", {"Content-Type": "text/plain"})
        self.assertEqual(415, reply.status)
        self.assertIsNone(self.daemon.request("GET", path).json()["name"])

    def patch(self, path, members):
        return self.daemon.request("PATCH", path, json.dumps(members).encode(),
                                   {"Content-Type": "application/merge-patch+json"})

    @staticmethod
    def status_and_name(reply):
        return reply.status, reply.json()["name"]

    def test_a_deleted_scene_is_gone_and_can_come_back(self):
        content = triangle("deleted")
        scene = self.daemon.push(content)
        self.assertEqual(200, self.daemon.render(scene).status)
        self.assertEqual(204, self.daemon.request("DELETE", "/v1/scenes/" + scene).status)
        for method in ("GET", "HEAD", "DELETE"):
            self.assertEqual(404, self.daemon.request(method, "/v1/scenes/" + scene).status)
        reply = self.daemon.render(scene)
        self.assertEqual(
            (404, "not_found", "/scene"), (reply.status, reply.code, reply.json()["pointer"])
        )
        self.assertEqual(201, self.daemon.post_scene(content).status)
        self.assertEqual(200, self.daemon.render(scene).status)

    def test_head_tells_whether_a_scene_is_there(self):
        scene = self.daemon.push(triangle("head"))
        self.assertEqual(200, self.daemon.request("HEAD", "/v1/scenes/" + scene).status)
        self.assertEqual(404, self.daemon.request("HEAD", "/v1/scenes/" + "0" * 64).status)

    def test_a_summary_is_not_sent_again_when_its_tag_is_known(self):
        scene = self.daemon.push(triangle("tagged"))
        tag = self.daemon.request("GET", "/v1/scenes/" + scene).header("ETag")
        reply = self.daemon.request(
            "GET", "/v1/scenes/" + scene, headers={"If-None-Match": f'"x", W/{tag}'}
        )
        self.assertEqual((304, b""), (reply.status, reply.body))

    def test_parallel_uploads_of_the_same_scene_make_one(self):
        content = triangle("parallel")
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            replies = list(pool.map(lambda _: self.daemon.post_scene(content), range(8)))
        self.assertEqual({200, 201}, {reply.status for reply in replies} | {200})
        self.assertEqual(1, sum(reply.status == 201 for reply in replies))

    def test_a_large_upload_is_streamed_not_held(self):
        def resident():
            text = self.daemon.request("GET", "/metrics").body.decode()
            return next(
                float(line.split()[1])
                for line in text.splitlines()
                if line.startswith("process_resident_memory_bytes ")
            )

        before = resident()
        big = glb(triangle_document("big"), TRIANGLE + bytes(96 << 20))
        self.daemon.push(big)
        self.assertLess(resident() - before, 32 << 20)


class Kept(support.unittest.TestCase):
    def test_scenes_survive_a_restart_and_are_rendered_after_it(self):
        with support.Daemon() as daemon:
            scene = daemon.push(triangle("kept"))
            daemon.request("PATCH", "/v1/scenes/" + scene, {"name": "kept.glb"})
            summary = daemon.request("GET", "/v1/scenes/" + scene).json()
            self.assertEqual(0, daemon.stop())
            with support.Daemon(state_dir=daemon.state_dir) as again:
                self.assertEqual(summary, again.request("GET", "/v1/scenes/" + scene).json())
                self.assertEqual(200, again.render(scene).status)
                self.assertEqual(200, again.post_scene(triangle("kept")).status)

    def test_scenes_survive_a_daemon_that_is_killed(self):
        with support.Daemon() as daemon:
            scene = daemon.push(triangle("killed"))
            daemon.stop(support.signal.SIGKILL)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                self.assertEqual(200, again.render(scene).status)

    def test_half_written_and_foreign_things_are_removed_at_start(self):
        with support.Daemon() as daemon:
            good, bad = daemon.push(triangle("good")), daemon.push(triangle("bad"))
            daemon.stop()
            scenes = os.path.join(daemon.state_dir, "scenes")
            os.truncate(os.path.join(scenes, bad, "summary.json"), 20)
            os.mkdir(os.path.join(scenes, "1" * 64))
            with open(os.path.join(daemon.state_dir, "tmp", "left"), "wb") as left:
                left.write(b"x")
            with support.Daemon(state_dir=daemon.state_dir) as again:
                listed = [
                    scene["id"] for scene in again.request("GET", "/v1/scenes").json()["scenes"]
                ]
                self.assertEqual([good], listed)
                self.assertEqual([], os.listdir(os.path.join(daemon.state_dir, "tmp")))

    def test_a_state_directory_has_one_daemon(self):
        with support.Daemon() as daemon:
            done = support.subprocess.run(
                [support.FAKE, "--listen", "127.0.0.1:0", "--state-dir", daemon.state_dir],
                capture_output=True,
                timeout=30,
                check=False,
            )
            self.assertEqual(1, done.returncode)
            self.assertIn(b"in use by another daemon", done.stderr)

    def test_nothing_is_written_outside_the_state_directory(self):
        with support.tempfile.TemporaryDirectory() as home:
            state = os.path.join(home, "deep", "state")
            environment = {
                "HOME": home,
                "TMPDIR": home,
                "XDG_STATE_HOME": home,
                "XDG_CACHE_HOME": home,
            }
            with support.Daemon(state_dir=state, environment=environment) as daemon:
                files = gltf_files("../../../")
                reply = daemon.post_scene(*multipart(files))
                self.assertEqual(400, reply.status)
                daemon.render(daemon.push(triangle()))
                daemon.stop()
            self.assertEqual(["deep"], os.listdir(home))
            self.assertEqual(["state"], os.listdir(os.path.join(home, "deep")))
            kept = ["cache", "environments", "jobs", "lock", "scenes", "tmp", "tradeoffs"]
            self.assertEqual(kept, sorted(os.listdir(state)))
            self.assertEqual([], os.listdir(os.path.join(state, "tmp")))
            self.assertEqual(0o700, stat.S_IMODE(os.stat(state).st_mode))

    def test_an_upload_over_the_limit_is_refused_before_it_is_sent(self):
        with support.Daemon("--max-upload-bytes", "100K") as daemon:
            for size in (200 << 10, 8 << 20):
                reply = daemon.post_scene(bytes(size))
                self.assertEqual((413, "too_large"), (reply.status, reply.code))
            head = (
                "POST /v1/scenes HTTP/1.1\r\nHost: localhost\r\nContent-Type: model/gltf-binary\r\n"
                f"Content-Length: {1 << 40}\r\nExpect: 100-continue\r\n\r\n"
            )
            answer = support.talk(daemon.port, head.encode())
            self.assertTrue(answer.startswith(b"HTTP/1.1 413 "), answer[:100])

            def chunks():
                for _ in range(20):
                    yield bytes(10 << 10)

            reply = daemon.post_scene(chunks())
            self.assertEqual((413, "too_large"), (reply.status, reply.code))
            self.assertEqual(201, daemon.post_scene(triangle()).status)


if __name__ == "__main__":
    support.run_tests()
