# SPDX-License-Identifier: MIT
"""What goes wrong around the viewer: servers that stop, scenes that go, files that are too much."""
import base64
import json
import os
import re
import struct
import tempfile
import zlib

from page import REAL, PageTest, room, support

LINK = "return document.getElementById('status-link').textContent"
LOST = "return !document.getElementById('lost').hidden"
MESSAGE = "return document.querySelector('.message')?.innerText"
MESSAGES = "return document.querySelectorAll('.message').length"
TITLE = "return document.title"
NAMES = "return [...document.querySelectorAll('.scene-open strong')].map((e) => e.textContent)"


def png(rgb):
    """A picture of one pixel."""
    def chunk(kind, content):
        return (struct.pack(">I", len(content)) + kind + content
                + struct.pack(">I", zlib.crc32(kind + content)))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"\0" + bytes(rgb))) + chunk(b"IEND", b""))


class Trouble(PageTest):
    expects_refusal = True

    def is_expected(self, line):
        return super().is_expected(line) or "ERR_CONNECTION_REFUSED" in line \
            or "WebSocket" in line or "ERR_INCOMPLETE_CHUNKED" in line


class PassedOver(PageTest):
    program = os.path.join(support.BIN, "vitraild-hostile")
    environment = {"HOSTILE_DEVICES": "0:open:exit"}  # of the two that Mesa lists

    def test_the_status_line_tells_of_a_device_that_is_not_taken(self):
        self.load()
        status = "document.getElementById('status-device')"
        self.browser.wait(f"return !{status}.hidden", "the line is there")
        self.assertEqual("another device renders", self.browser.run(f"return {status}.textContent"))
        self.assertRegex(self.browser.run(f"return {status}.title"),
                         "surfaceless platform: passed over: its driver crashed twice when it was "
                         "opened: exit status 3")


class Stopping(Trouble):
    def is_expected(self, line):
        return super().is_expected(line) or "a status of 503" in line  # while it drains

    def test_a_server_that_stops_and_comes_back_is_said_and_nothing_is_lost(self):
        self.load()
        self.panel("tree")
        edited = self.changed_by(lambda: self.press("Hide Wall"))
        port, cls = self.daemon.port, type(self)
        state = tempfile.TemporaryDirectory()
        self.addCleanup(state.cleanup)
        os.rmdir(state.name)
        os.rename(self.daemon.state_dir, state.name)  # it outlives the first daemon
        self.daemon.stop()
        self.browser.wait(LOST, "the page says that the server is away")
        for _ in range(3):  # it does not take another line for that
            self.press("Try now")
            self.browser.run("return new Promise((done) => setTimeout(done, 300))")
        x, y = self.center()
        self.browser.drag((x, y), (x, y))
        frames = self.browser.run("return document.getElementById('picture').dataset.frames")
        self.browser.run("return new Promise((done) => setTimeout(done, 300))")
        self.assertEqual(0, self.browser.run(MESSAGES))  # the banner says it all
        cls.daemon = support.Daemon("--listen", f"127.0.0.1:{port}", "--render-timeout-s", "60",
                                    "--auto", cls.auto, program=REAL, state_dir=state.name)
        cls.addClassCleanup(cls.daemon.__exit__)
        cls.daemon.wait_ready()
        self.press("Try now")
        self.assertEqual(edited, self.settle(int(frames)))
        self.assertEqual("live", self.browser.run(LINK))
        self.assertFalse(self.browser.run(LOST))
        self.changed_by(lambda: self.press("Undo"))


class Going(Trouble):
    def test_a_scene_that_is_forgotten_by_others_is_said_and_listed_no_more(self):
        files = support.multipart({"other.glb": room(lambda document, binary: binary + bytes(4))})
        other = self.daemon.post_scene(*files).json()["id"]
        self.load(scene=other)
        self.panel("tree")
        self.assertEqual(204, self.daemon.request("DELETE", f"/v1/scenes/{other}").status)
        self.browser.run("document.querySelector('[aria-label=\"Hide Pane\"]').click()")
        text = self.browser.wait(MESSAGE, "a message")
        self.assertIn("other.glb is gone", text)
        self.assertEqual("Vitrail", self.browser.run(TITLE))
        self.browser.wait(f"return !(({NAMES.removeprefix('return ')}).includes('other.glb'))",
                          "it is not listed any more")
        self.assertFalse(self.browser.run("return document.getElementById('welcome').hidden"))

    def test_the_same_files_brought_again_go_on_with_the_edits(self):
        content = room(lambda document, binary: binary + bytes(8))
        scene = self.daemon.post_scene(*support.multipart({"again.glb": content})).json()["id"]
        self.load(scene=scene)
        self.panel("tree")
        self.changed_by(lambda: self.press("Hide Wall"))
        self.daemon.request("DELETE", f"/v1/scenes/{scene}")
        self.browser.run("document.getElementById('surface').dispatchEvent("
                         "new KeyboardEvent('keydown', { key: '2', bubbles: true }));")
        self.browser.wait(MESSAGE, "a message")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "again.glb")
            with open(path, "wb") as file:
                file.write(content)
            self.browser.type("#scene-files", path)
            self.browser.wait("return document.title.startsWith('again.glb')", "it is open again")
        self.settle()
        self.assertFalse(self.view()["overrides"]["nodes"]["#2"]["visible"])


class Refused(Trouble):
    def open_link(self, state):
        text = base64.urlsafe_b64encode(json.dumps(state).encode()).decode().rstrip("=")
        self.browser.go(f"http://127.0.0.1:{self.daemon.port}/#scene={self.scene}&view={text}")

    def test_a_first_view_that_is_refused_is_tried_again_when_it_is_mended(self):
        self.open_link({"view": {"quality": {"shadows": "painted"}}})
        self.assertIn("painted", self.browser.wait(MESSAGE, "a message"))
        self.assertEqual("refused", self.browser.run(LINK))
        self.assertEqual(1, self.browser.run(MESSAGES))
        self.panel("render")
        self.enter("Shadows", "map", "#panel-render")
        self.settle()
        self.assertEqual("live", self.browser.run(LINK))
        self.assertEqual("map", self.view()["quality"]["shadows"])

    def test_what_was_refused_with_a_bad_edit_is_sent_again_without_it(self):
        for kind in (0, 1):  # socket, stream
            self.browser.go(f"http://127.0.0.1:{self.daemon.port}/")
            exposure = self.browser.run("""const [scene, kind] = arguments;
              const { Live } = await import('/viewer/live.js');
              const { Vitrail } = await import('/viewer/vitrail.js');
              const live = new Live(new Vitrail(), kind);
              const good = { scene, width: 64, height: 48, camera: { fit: 'iso' }, stream: {} };
              const next = (type) => new Promise((done) =>
                live.addEventListener(type, ({ detail }) => done(detail), { once: true }));
              live.show(good);
              await next('frame');
              live.show({ ...good, exposure_ev: 2, tone_mapping: 'sepia' });
              const { pointer } = await next('problem');
              const shown = new Promise((done) => live.addEventListener('frame', async () => {
                const document = await live.view.get().catch(() => null); // null: it has stopped
                if (document?.view.exposure_ev === 2) done(document.view.exposure_ev);
              }));
              live.show({ ...good, exposure_ev: 2 });
              const found = await shown;
              live.stop();
              return [pointer, found];""", self.scene, kind)
            self.assertEqual(["/tone_mapping", 2], exposure)


class Bringing(Trouble):
    def write(self, folder, files):
        for name, content in files.items():
            path = os.path.join(folder, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as file:
                file.write(content)

    def test_a_folder_with_textures_is_dropped_and_opened(self):
        self.load()
        document = support.triangle_document("Leaf")
        document["buffers"][0]["uri"] = "data/geometry.bin"
        document["images"] = [{"uri": "textures/green%20leaf.png"}]
        document["textures"] = [{"source": 0}]
        document["materials"] = [{"name": "Green", "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0}}}]
        document["meshes"][0]["primitives"][0]["material"] = 0
        with tempfile.TemporaryDirectory() as folder:
            self.write(folder, {"leaf/leaf.gltf": json.dumps(document).encode(),
                                "leaf/data/geometry.bin": support.TRIANGLE,
                                "leaf/textures/green leaf.png": png((0, 255, 0))})
            self.browser.drop(self.center(), os.path.join(folder, "leaf"))
            self.browser.wait("return document.title.startsWith('leaf.gltf')", "it is open")
        self.assertEqual(0, self.browser.run(MESSAGES))
        self.assertTrue(self.browser.run("return document.getElementById('drop').hidden"))
        self.settle()

    def test_a_missing_texture_is_named(self):
        self.load()
        document = support.triangle_document("Leaf")
        document["buffers"][0]["uri"] = "geometry.bin"
        document["images"] = [{"uri": "leaf.png"}]
        document["textures"] = [{"source": 0}]
        document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
        document["meshes"][0]["primitives"][0]["material"] = 0
        with tempfile.TemporaryDirectory() as folder:
            self.write(folder, {"leaf.gltf": json.dumps(document).encode(),
                                "geometry.bin": support.TRIANGLE})
            self.browser.drop(self.center(), os.path.join(folder, "leaf.gltf"),
                              os.path.join(folder, "geometry.bin"))
            self.assertIn("leaf.png", self.browser.wait(MESSAGE, "a message"))

    def test_several_files_are_several_scenes(self):
        self.load()
        with tempfile.TemporaryDirectory() as folder:
            self.write(folder, {f"part-{i}.glb": support.triangle(f"Part {i}") for i in range(3)})
            self.browser.drop(self.center(), *(os.path.join(folder, f"part-{i}.glb")
                                               for i in range(3)))
            self.browser.wait("return document.title.startsWith('part-2.glb')", "all are here")
        names = self.browser.run(NAMES)
        self.assertEqual(["part-2.glb", "part-1.glb", "part-0.glb"], names[:3])

    def test_nothing_of_use_is_said(self):
        self.load()
        with tempfile.TemporaryDirectory() as folder:
            self.write(folder, {"notes.txt": b"hello"})
            self.browser.drop(self.center(), os.path.join(folder, "notes.txt"))
            self.assertIn("None of these files", self.browser.wait(MESSAGE, "a message"))


class TooMuch(Trouble):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = support.Daemon("--max-upload-bytes", "1M", program=REAL)
        cls.addClassCleanup(cls.small.__exit__)

    def test_a_file_that_the_server_will_not_take_is_not_sent(self):
        self.browser.go(f"http://127.0.0.1:{self.small.port}/")
        self.browser.wait("return document.querySelector('.scenes')", "the page is there")
        self.browser.wait("""return document.getElementById('panel-render').textContent
          .includes('deep')""", "what the server can do is known")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "huge.glb")
            with open(path, "wb") as file:
                file.truncate(3 << 20)
            self.browser.type("#scene-files", path)
            text = self.browser.wait(MESSAGE, "a message")
        self.assertTrue(re.search(r"huge\.glb was not sent\s+It has 3\.0 MiB; this server takes up"
                                  r" to 1\.0 MiB", text), text)
        self.assertEqual([], self.small.request("GET", "/v1/scenes").json()["scenes"])


if __name__ == "__main__":
    support.run_tests()
