#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Exit codes, errors, atomic outputs, progress and signals of `vitrail`, against a stub server."""
import json
import os
import pty
import re
import signal
import socket
import stat
import subprocess
import threading
import time

from cli_support import FRAME, PNG, VITRAIL, CliTest, main

RENDER = ("POST", "/v1/renders")


class OutcomeTest(CliTest):
    def render(self, *arguments, **options):
        return self.run_cli("render", self.scene(), "-o", "out.png", *arguments, **options)

    def answer_with(self, status, code, detail="because", pointer=None, headers=()):
        self.stub.special[RENDER] = lambda h, r: h.problem(status, code, detail, pointer, headers)

    def hang(self):
        """Makes renders never answer; returns an event that is set once one is asked for."""
        asked, release = threading.Event(), threading.Event()
        self.addCleanup(release.set)

        def wait(handler, request):
            asked.set()
            release.wait(30)
        self.stub.special[RENDER] = wait
        return asked

    # Success

    def test_render_writes_the_image_and_says_so(self):
        out, err = self.render()
        self.assertEqual(self.read("out.png"), PNG)
        self.assertRegex(out, r"\Aout\.png: 5\.9 KiB in [0-9.]+ s, scene [0-9a-f]{64}\n\Z")
        self.assertEqual(err, "vitrail: warning: no light in the scene\n")
        self.assert_only("box.glb", "out.png")

    def test_json_result_holds_what_a_script_needs(self):
        out, err = self.render("--json")
        result = json.loads(out)
        self.assertEqual(result["output"], "out.png")
        self.assertEqual(result["frame"], "f1")
        self.assertEqual(result["size_bytes"], len(PNG))
        self.assertEqual(result["content_type"], "image/png")
        self.assertEqual(result["warnings"], FRAME["warnings"])
        self.assertEqual(result["timings_ms"], FRAME["timings_ms"])
        self.assertEqual(err, "")

    def test_quiet_says_nothing(self):
        self.assertEqual(self.render("--quiet"), ("", ""))

    def test_image_to_stdout_is_just_the_image(self):
        process = self.start("render", self.scene(), "-o", "-", "--format", "png")
        out, _ = process.communicate(timeout=30)
        self.assertEqual((process.returncode, out), (0, PNG))
        self.assert_only("box.glb")

    def test_stats_are_written_beside_the_image_or_to_stdout(self):
        self.render("--stats", "out.json")
        self.assertEqual(json.loads(self.read("out.json")), FRAME)
        out, _ = self.render("--stats", "-")
        self.assertEqual(json.loads(out), FRAME)

    def test_stats_that_cannot_be_had_fail_the_call_and_leave_nothing(self):
        self.stub.special["GET", "/v1/frames/f1"] = lambda h, r: h.problem(404, "not_found", "gone")
        self.render("--stats", "out.json", code=1)
        self.assert_only("box.glb")
        self.render()

    def test_other_commands_print_an_outline_or_json(self):
        self.stub.scenes.add("ab" * 32)
        for command in (["stats"], ["stats", "f1"], ["capabilities"], ["scenes"],
                        ["scenes", "ab" * 32]):
            out, err = self.run_cli(*command, "--json")
            json.loads(out)
            self.assertEqual(err, "")
        out, _ = self.run_cli("stats")
        self.assertIn("device:\n  renderer: stub\n  is_robust: yes\nformats: png, exr\n", out)
        out, _ = self.run_cli("stats", "f1")
        self.assertIn("- pass: shade, because: always, technique: clustered, ms: 3.5", out)
        self.assertIn("ready: http://127.0.0.1", self.run_cli("health")[0])
        self.run_cli("delete", "ab" * 32)
        self.assertEqual(self.stub.scenes, set())

    def test_text_of_the_server_cannot_drive_the_terminal(self):
        self.stub.scenes.add("ab" * 32)
        out, _ = self.run_cli("scenes")
        self.assertEqual(out, "ab" * 32 + "  12 triangles, 2 materials, 1 lights, 3.0 MiB  "
                         "box?[2J.glb\n")
        self.assertNotIn("\x1b", out)
        self.answer_with(400, "invalid_request", "a\x1b]0;b\x07\x9b\u0085c")
        _, err = self.render(code=1)
        self.assertIn("a?]0;b???c (invalid_request)", err.replace("\ufffd", "?"))

    def test_ids_that_are_none_never_reach_a_path(self):
        for command in (["stats", "../../x"], ["stats", ""]):
            self.run_cli(*command, code=2)
        self.assertEqual(self.stub.requests, [])
        for command in (["delete", "../stats"], ["scenes", "ab"], ["delete", "AB" * 32]):
            self.run_cli(*command, code=66)
        self.assertEqual({r.path for r in self.stub.requests}, {"/v1/scenes"})

    # Refusals and failures

    def test_refusal_is_one_sentence_with_code_and_pointer(self):
        self.answer_with(400, "invalid_request", "expected 3 numbers", "/camera/eye")
        _, err = self.render(code=1)
        self.assertEqual(err, "vitrail: the render was refused: expected 3 numbers "
                              "(invalid_request at /camera/eye)\n")
        _, err = self.render("--json", code=1)
        self.assertEqual(json.loads(err), {
            "exit_code": 1, "code": "invalid_request", "pointer": "/camera/eye", "status": 400,
            "detail": "the render was refused: expected 3 numbers"})
        self.assert_only("box.glb")

    def test_every_code_of_the_protocol_becomes_a_documented_exit_code(self):
        again = {"too_many_requests", "render_failed", "io", "overloaded", "interrupted",
                 "no_device", "no_memory", "timeout"}
        source = os.path.join(os.path.dirname(__file__), "../../protocol/error.c")
        with open(source, encoding="utf-8") as file:
            table = re.findall(r'\[ERROR_\w+\]\s*=\s*\{"(\w+)",\s*"[^"]*",\s*(\d+)\}', file.read())
        self.assertLessEqual(again, {code for code, _ in table})
        for code, status in table:
            if code == "none":
                continue
            self.answer_with(int(status), code)
            _, err = self.render(code=75 if code in again else 1)
            self.assertIn("(%s)" % code, err)
            self.assert_only("box.glb")

    def test_statuses_of_proxies_become_exit_codes_too(self):
        for status, expected in ((401, 1), (403, 1), (405, 1), (408, 75), (502, 75), (503, 75)):
            self.stub.special[RENDER] = lambda h, r, s=status: h.answer(s, b"<html>")
            self.render(code=expected)

    def test_passwords_are_not_shown(self):
        _, err = self.run_cli("health", "--server", "http://me:secret@127.0.0.1:1/x/", code=69)
        self.assertIn("no server at http://127.0.0.1:1/x:", err)
        url = self.stub.url.replace("//", "//me:secret@")
        self.assertEqual(self.run_cli("health", "--server", url)[0],
                         "ready: %s\n" % self.stub.url)
        self.assertTrue(self.stub.requests[-1].headers["Authorization"].startswith("Basic "))

    def test_retry_after_is_passed_on(self):
        self.answer_with(503, "overloaded", headers=[("Retry-After", "7")])
        self.assertIn("try again in 7 s", self.render(code=75)[1])
        self.assertEqual(json.loads(self.render("--json", code=75)[1])["retry_after_s"], 7)

    def test_refused_upload_names_the_file_and_renders_nothing(self):
        self.stub.special["POST", "/v1/scenes"] = lambda h, r: h.problem(
            422, "invalid_scene", "accessor 3 is out of bounds")
        _, err = self.render(code=1)
        self.assertIn("box.glb' was refused: accessor 3 is out of bounds (invalid_scene)", err)
        self.assertEqual(self.stub.sent(*RENDER), [])

    def test_upload_refused_while_it_is_still_being_sent(self):
        listener = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(listener.close)

        def refuse():
            for _ in range(2):
                peer, _ = listener.accept()
                head = peer.recv(65536)
                if head.startswith(b"HEAD"):
                    peer.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n"
                                 b"Connection: close\r\n\r\n")
                else:
                    body = json.dumps({"code": "too_large", "detail": "limit is 1 MB"}).encode()
                    peer.sendall(b"HTTP/1.1 413 Too Large\r\nContent-Length: %d\r\n"
                                 b"Connection: close\r\n\r\n%s" % (len(body), body))
                peer.close()
        threading.Thread(target=refuse, daemon=True).start()
        scene = self.write("big.glb", b"glTF" + bytes(30_000_000))
        _, err = self.run_cli("push", scene, "--server",
                              "http://127.0.0.1:%d" % listener.getsockname()[1], code=1)
        self.assertIn("limit is 1 MB (too_large)", err)

    def test_nobody_there_is_unavailable(self):
        with socket.create_server(("127.0.0.1", 0)) as gone:
            url = "127.0.0.1:%d" % gone.getsockname()[1]
        for command in (["render", self.scene(), "-o", "out.png"], ["health"], ["stats"],
                        ["push", self.scene()]):
            _, err = self.run_cli(*command, "--server", url, code=69)
            self.assertIn("no server at http://" + url, err)
        self.run_cli("health", "--server", "http://no-such-host.invalid", code=69)
        self.assert_only("box.glb")

    def test_health_tells_not_ready_from_dead(self):
        self.stub.special["GET", "/readyz"] = lambda h, r: h.problem(503, "no_device", "no GL")
        _, err = self.run_cli("health", code=75)
        self.assertIn("no GL (no_device)", err)

    def test_answers_of_something_else_are_not_taken_for_ours(self):
        page = [("Content-Type", "text/html")]
        self.stub.special[RENDER] = lambda h, r: h.answer(200, b"<html>", page)
        self.render(code=69)
        self.stub.special[RENDER] = lambda h, r: h.answer(404, b"<html>", page)
        self.assertIn("is this a vitrail server?", self.render(code=1)[1])
        self.stub.special["POST", "/v1/scenes"] = lambda h, r: h.answer(200, b"[]")
        self.run_cli("push", self.write("other.gltf", "{}"), code=69)
        self.assert_only("box.glb", "other.gltf")

    def test_connection_that_breaks_off_is_temporary_and_leaves_no_file(self):
        self.stub.special[RENDER] = lambda h, r: (
            h.answer(200, PNG, [("Content-Type", "image/png")], length=len(PNG) + 1),
            h.connection.shutdown(socket.SHUT_RDWR))
        self.assertIn("broke off", self.render(code=75)[1])
        self.stub.special[RENDER] = lambda h, r: h.connection.shutdown(socket.SHUT_RDWR)
        self.render(code=75)
        self.assert_only("box.glb")

    def test_timeout_is_temporary(self):
        self.hang()
        started = time.monotonic()
        self.assertIn("--timeout", self.render("--timeout", "0.5", code=75)[1])
        self.assertLess(time.monotonic() - started, 5)
        self.assert_only("box.glb")

    def test_proxy_of_the_environment_is_not_used_for_this_machine(self):
        self.environment["http_proxy"] = "http://127.0.0.1:9"
        self.render()

    # Outputs

    def test_failure_leaves_an_earlier_image_as_it_was(self):
        self.write("out.png", b"earlier")
        self.answer_with(422, "unsupported")
        self.render(code=1)
        self.assertEqual(self.read("out.png"), b"earlier")
        self.assert_only("box.glb", "out.png")

    def test_outputs_are_replaced_whole_with_the_usual_mode(self):
        self.write("out.png", b"x" * 10 * len(PNG))
        before = os.stat(self.path("out.png")).st_ino
        old = os.umask(0o027)
        try:
            self.render()
        finally:
            os.umask(old)
        after = os.stat(self.path("out.png"))
        self.assertEqual(self.read("out.png"), PNG)
        self.assertNotEqual(after.st_ino, before)
        self.assertEqual(stat.S_IMODE(after.st_mode), 0o640)

    def test_link_to_an_output_survives(self):
        self.write("elsewhere/real.png", b"earlier")
        os.symlink("elsewhere/real.png", self.path("out.png"))
        self.render()
        self.assertTrue(os.path.islink(self.path("out.png")))
        self.assertEqual(self.read("elsewhere/real.png"), PNG)
        self.assertEqual(os.listdir(self.path("elsewhere")), ["real.png"])

    def test_device_is_written_and_not_replaced(self):
        os.mkfifo(self.path("pipe.png"))
        with subprocess.Popen(["cat", self.path("pipe.png")], stdout=subprocess.PIPE) as reader:
            self.run_cli("render", self.scene(), "-o", "pipe.png")
            self.assertEqual(reader.stdout.read(), PNG)
        self.assertTrue(stat.S_ISFIFO(os.stat(self.path("pipe.png")).st_mode))

    def test_output_that_cannot_be_created_is_known_before_the_render(self):
        os.makedirs(self.path("folder.png"))
        for output in ("none/out.png", "folder.png", "/proc/out.png", "box.glb/out.png"):
            _, err = self.run_cli("render", self.scene(), "-o", output, "--format", "png", code=73)
            self.assertIn("cannot write '%s'" % output, err)
        self.run_cli("render", self.scene(), "-o", "out.png", "--stats", "none/x.json", code=73)
        self.assertEqual(self.stub.requests, [])
        self.assert_only("box.glb", "folder.png")

    def test_full_disk_is_an_output_failure(self):
        self.run_cli("render", self.scene(), "-o", "/dev/full", "--format", "png", code=73)
        with open("/dev/full", "wb") as full:
            process = subprocess.run([VITRAIL, "stats"], stdout=full, stderr=subprocess.PIPE,
                                     env=self.environment, check=False)
        self.assertEqual(process.returncode, 73, process.stderr)

    # Signals and progress

    def test_signals_end_a_render_at_once_and_leave_no_file(self):
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
            asked = self.hang()
            process = self.start("render", self.scene(), "-o", "out.png")
            self.assertTrue(asked.wait(20))
            started = time.monotonic()
            process.send_signal(number)
            _, err = process.communicate(timeout=20)
            self.assertEqual(process.returncode, code)
            self.assertLess(time.monotonic() - started, 2)
            self.assertRegex(err, rb"\Avitrail: interrupted \([^\n]+\)\n\Z")
            self.assert_only("box.glb")

    def test_nohup_keeps_a_render_alive(self):
        asked = self.hang()
        process = self.start("render", self.scene(), "-o", "out.png",
                             preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        self.assertTrue(asked.wait(20))
        process.send_signal(signal.SIGHUP)
        time.sleep(0.3)
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=20)
        self.assertEqual(process.returncode, 143)

    def test_json_progress_goes_through_the_stages_without_going_back(self):
        _, err = self.render("--progress", "json", "-q")
        lines = [json.loads(line) for line in err.splitlines()]
        stages = list(dict.fromkeys(line["stage"] for line in lines))
        usual = ["uploading", "reading scene", "rendering", "receiving", "done"]
        self.assertEqual(stages, [stage for stage in usual if stage in stages])
        self.assertLessEqual({"rendering", "done"}, set(stages))
        percents = [line["progress"] for line in lines]
        self.assertEqual(percents, sorted(percents))
        self.assertEqual(percents[-1], 100)

    def test_afanasy_progress_is_what_its_parser_reads(self):
        _, err = self.render("--progress", "afanasy", "-q")
        for line in err.splitlines():
            self.assertRegex(line, r"\A(PROGRESS: \d+%|ACTIVITY: [a-z ]+)\Z")
        self.assertTrue(err.endswith("PROGRESS: 100%\n"))

    def render_with_statuses(self, *statuses):
        """Renders take until the server has told all of these, one after the other."""
        self.stub.statuses = list(statuses)

        def wait(handler, request):
            deadline = time.monotonic() + 20
            while self.stub.statuses and time.monotonic() < deadline:
                time.sleep(0.02)
            time.sleep(0.2)  # the last one is shown
            return False
        self.stub.special[RENDER] = wait

    @staticmethod
    def status(state, stage=None, share=0., left_s=None):
        status = {"request_id": "x", "scene": "ab" * 32, "state": state, "elapsed_s": 1.5}
        if stage:
            status["progress"] = {"stage": stage, "share": share, "left_s": left_s}
        return status

    def looks(self):
        return [r.path for r in self.stub.requests if r.path.startswith("/v1/renders/")]

    def test_json_progress_tells_the_pass_of_a_long_render(self):
        self.render_with_statuses(
            self.status("waiting"), self.status("rendering"),
            self.status("rendering", "shadows", 0.5, 12.25),
            self.status("rendering", "shading", 0.25), self.status("encoding"))
        _, err = self.render("--progress", "json", "-q")
        lines = [json.loads(line) for line in err.splitlines()]
        told = [line for line in lines if "state" in line]
        self.assertEqual(["waiting", "rendering", "rendering", "rendering", "encoding"],
                         [line["state"] for line in told])
        self.assertEqual({"rendering"}, {line["stage"] for line in told})
        self.assertEqual([("shadows", 0.5, 12.25), ("shading", 0.25, None)],
                         [(line["pass"], line["share"], line["left_s"])
                          for line in told if "pass" in line])
        self.assertEqual([40, 40, 50, 67, 90], [line["progress"] for line in told])
        times = [line["elapsed_s"] for line in lines]
        self.assertEqual(sorted(times), times)
        self.assertGreater(times[-1], 2)  # five looks
        sent = self.stub.sent("POST", "/v1/renders")[0].headers["X-Request-Id"]
        self.assertEqual({"/v1/renders/" + sent}, set(self.looks()))
        self.assertRegex(sent, r"\Avitrail-[0-9a-f]{16}\Z")

    def test_plain_progress_is_lines_for_people(self):
        self.render_with_statuses(*[self.status("waiting")] * 3,
                                  *[self.status("rendering", "rays", 0.344, 12.3)] * 3)
        _, err = self.render("--progress", "plain", "-q")
        self.assertRegex(err, r"(?m)^vitrail: rendering \(0 s\)$")
        self.assertRegex(err, r"(?m)^vitrail: rendering: waiting for other renders \(\d+ s\)$")
        self.assertRegex(err, r"(?m)^vitrail: rendering 34%: rays, 12 s left \(\d+ s\)$")
        self.assertTrue(err.endswith(" s)\n"))
        self.assertNotIn("\x1b", err)
        self.assertEqual(1, err.count("rays"))  # nothing new was told

    def test_afanasy_progress_grows_while_a_render_lasts(self):
        self.render_with_statuses(*[self.status("rendering", "rays", share)
                                    for share in (0.1, 0.3, 0.2, 0.9)])
        _, err = self.render("--progress", "afanasy", "-q")
        percents = [int(p) for p in re.findall(r"PROGRESS: (\d+)%", err)]
        self.assertEqual(sorted(percents), percents)
        self.assertLessEqual({45, 55, 85, 100}, set(percents))

    def test_nobody_is_asked_how_far_it_is_where_nobody_looks(self):
        for arguments in ((), ("--quiet",), ("--progress", "none")):
            self.render_with_statuses()
            wait = self.stub.special[RENDER]
            self.stub.special[RENDER] = lambda h, r: time.sleep(1) or wait(h, r)
            self.render(*arguments)
            self.assertEqual([], self.looks())

    def test_a_server_that_tells_nothing_or_nonsense_renders_all_the_same(self):
        self.render_with_statuses(
            b"<html>", b"[]", b"null", b"x" * 9000, {"state": 7, "progress": 3},
            {"state": "\x1b[2J", "progress": {"stage": "\x1b]0;b\x07", "share": 1e9,
                                             "left_s": "soon"}},
            {"state": "rendering", "progress": {"stage": "a" * 999, "share": -4, "left_s": -1}})
        _, err = self.render("--progress", "plain", "-q")
        self.assertNotIn("\x1b", err)
        self.assertEqual(self.read("out.png"), PNG)
        self.stub.special[RENDER] = lambda h, r: time.sleep(1.2) or False  # 404 on all looks
        _, err = self.render("--progress", "json", "-q")
        self.assertNotIn("state", err)
        self.assertGreater(len(self.looks()), 7)

    def on_terminal(self, *arguments):
        master, terminal = pty.openpty()
        process = subprocess.Popen([VITRAIL, *arguments], cwd=self.folder, env=self.environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=terminal)
        os.close(terminal)
        seen = b""
        try:
            while chunk := os.read(master, 65536):
                seen += chunk
        except OSError:
            pass
        os.close(master)
        process.communicate(timeout=30)
        return process.returncode, seen.decode()

    def test_terminal_shows_the_pass_of_a_long_render_in_its_bar(self):
        self.render_with_statuses(self.status("waiting"), self.status("paused", "rays", 0.5),
                                  self.status("rendering", "rays", 0.5, 3.6))
        code, seen = self.on_terminal("render", self.scene(), "-o", "out.png")
        self.assertEqual(code, 0)
        self.assertRegex(seen, r"\r\x1b\[Krendering     \d\.\d s  waiting for other renders")
        bar = r"rendering     \[############------------\]  50%  "
        self.assertRegex(seen, bar + "paused for urgent renders")
        self.assertRegex(seen, bar + r"rays, 4 s left  \d s")

    def test_terminal_gets_a_bar_that_is_wiped_at_the_end(self):
        code, seen = self.on_terminal("render", self.scene(), "-o", "out.png")
        self.assertEqual(code, 0)
        self.assertIn("\r\x1b[Krendering", seen)
        self.assertEqual(seen.rpartition("\r\x1b[K")[2].strip(),
                         "vitrail: warning: no light in the scene")
        code, seen = self.on_terminal("render", self.scene(), "-o", "out.png", "--quiet")
        self.assertEqual((code, seen), (0, ""))


if __name__ == "__main__":
    main()
