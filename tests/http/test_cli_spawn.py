#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`vitrail --spawn`: a private daemon is started, waited for and ended, however the call ends.

The daemon here is a stand-in with a worker process of its own, so that whatever is left is seen."""
import json
import os
import shutil
import signal
import sys
import time

from cli_support import PNG, VITRAIL, CliTest, main

FAKE = """#!%(python)s
import json, os, signal, sys, time
sys.path.insert(0, %(tests)r)
plan = json.load(open(%(plan)r))
arguments = dict(zip(sys.argv[1::2], sys.argv[2::2]))
state = arguments["--state-dir"]
note = {"argv": sys.argv[1:], "pid": os.getpid(),
        "blocked": list(signal.pthread_sigmask(signal.SIG_BLOCK, [])),
        "server": os.environ.get("VITRAIL_SERVER"), "state_exists": os.path.isdir(state),
        "fds": sorted(int(f) for f in os.listdir("/proc/self/fd"))}
worker = os.fork()
if worker == 0:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(60)
    os._exit(0)
note["worker"] = worker
with open(%(note)r + ".tmp", "w") as file:
    json.dump(note, file)
os.rename(%(note)r + ".tmp", %(note)r)
if plan.get("die"):
    print("warming up", flush=True)
    print("no usable device: EGL said no", file=sys.stderr, flush=True)
    sys.exit(3)
if plan.get("ignore_term"):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
if plan.get("mute"):
    time.sleep(60)
import cli_support
stub = cli_support.Stub()
ready_at = time.monotonic() + plan.get("ready_after_s", 0)
stub.special["GET", "/readyz"] = lambda h, r: (
    False if time.monotonic() >= ready_at and
    (not plan.get("ready_after_upload") or stub.scenes)
    else h.problem(503, "no_device", "warming up"))
if plan.get("die_in_render"):
    stub.special["POST", "/v1/renders"] = lambda h, r: os._exit(9)
if plan.get("hang"):
    stub.special["POST", "/v1/renders"] = lambda h, r: time.sleep(60)
print("a line before", flush=True)
print("listening on " + stub.url, flush=True)
open(os.path.join(state, "something"), "w").close()
time.sleep(60)
"""


class SpawnTest(CliTest):
    def setUp(self):
        super().setUp()
        os.mkdir(self.path("tmp"))
        os.mkdir(self.path("bin"))
        self.environment.update(TMPDIR=self.path("tmp"))
        self.program = shutil.copy(VITRAIL, self.path("bin", "vitrail"))
        self.plan()

    def plan(self, folder="bin", **plan):
        """Puts the stand-in in place; it will do as planned."""
        self.write("plan.json", json.dumps(plan))
        tests = os.path.dirname(os.path.abspath(__file__))
        text = FAKE % {"python": sys.executable, "tests": tests,
                       "plan": self.path("plan.json"), "note": self.path("note.json")}
        os.chmod(self.write(folder + "/vitraild", text), 0o755)

    def note(self):
        deadline = time.monotonic() + 20
        while not os.path.exists(self.path("note.json")) and time.monotonic() < deadline:
            time.sleep(0.02)
        return json.loads(self.read("note.json"))

    def assert_nothing_left(self):
        """Neither daemon nor worker nor folder, at once or within the moment that a kill takes."""
        note = self.note()
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            if not (self.is_running(note["pid"]) or self.is_running(note["worker"]) or
                    os.listdir(self.path("tmp"))):
                return
            time.sleep(0.02)
        self.fail("left behind: %r" % [self.is_running(note["pid"]),
                                       self.is_running(note["worker"]),
                                       os.listdir(self.path("tmp"))])

    def is_running(self, pid):
        try:
            with open("/proc/%d/stat" % pid, encoding="ascii", errors="replace") as file:
                return file.read().rpartition(")")[2].split()[0] not in "ZX"
        except OSError:
            return False

    def spawn(self, *arguments, **options):
        return self.run_cli("render", self.scene(), "-o", "out.png", "--spawn", *arguments,
                            program=self.program, **options)

    def start_render(self, **options):
        """A call that has got as far as waiting for its image."""
        process = self.start("render", self.scene(), "-o", "out.png", "--spawn",
                             "--progress", "json", program=self.program, **options)
        for line in process.stderr:
            if b"rendering" in line:
                return process
        self.fail("it never came to rendering")

    def test_private_daemon_renders_and_is_gone_when_the_call_returns(self):
        self.spawn()
        self.assertEqual(self.read("out.png"), PNG)
        note = self.note()
        self.assertFalse(self.is_running(note["pid"]))
        self.assertFalse(self.is_running(note["worker"]))
        self.assertEqual(os.listdir(self.path("tmp")), [])
        self.assertEqual(self.stub.requests, [], "$VITRAIL_SERVER must not be asked")

    def test_daemon_starts_in_a_clean_place(self):
        self.spawn()
        note = self.note()
        self.assertEqual(note["argv"][:2], ["--listen", "127.0.0.1:0"])
        self.assertTrue(note["state_exists"])
        self.assertTrue(note["argv"][3].startswith(self.path("tmp") + "/"))
        self.assertEqual(note["blocked"], [])
        self.assertIsNone(note["server"])
        self.assertLessEqual(max(note["fds"]), 4, "descriptors of the client leak into the daemon")

    def test_daemon_that_is_not_ready_yet_is_waited_for(self):
        self.plan(ready_after_s=1)
        started = time.monotonic()
        self.spawn()
        self.assertGreater(time.monotonic() - started, 1)

    def test_progress_says_rendering_once_the_daemon_is_ready(self):
        self.plan(ready_after_s=1)
        _, err = self.spawn("--progress", "json", "-q")
        stages = [json.loads(line)["stage"] for line in err.splitlines()]
        self.assertIn("starting", stages)
        self.assertNotIn("starting", stages[stages.index("rendering"):])

    def test_scene_is_sent_while_the_daemon_starts(self):
        self.plan(ready_after_upload=True)
        self.spawn("--timeout", "20")
        self.assertEqual(self.read("out.png"), PNG)

    def test_state_dir_is_used_and_kept(self):
        self.spawn("--state-dir", self.path("kept"))
        self.assertEqual(self.note()["argv"][3], self.path("kept"))
        self.assertTrue(os.path.exists(self.path("kept", "something")))
        self.assertEqual(os.listdir(self.path("tmp")), [])

    def test_daemon_in_path_is_used_when_none_is_beside_the_program(self):
        os.remove(self.path("bin", "vitraild"))
        self.environment["PATH"] = self.path("other") + ":" + self.environment["PATH"]
        self.plan(folder="other")
        self.spawn()

    def test_no_daemon_anywhere_is_unavailable(self):
        os.remove(self.path("bin", "vitraild"))
        self.environment["PATH"] = self.path("nowhere")
        self.assertIn("no vitraild", self.spawn(code=69)[1])

    def test_daemon_that_does_not_start_is_unavailable_and_says_why(self):
        self.plan(die=True)
        _, err = self.spawn(code=69)
        self.assertIn("status 3: no usable device: EGL said no\n", err)
        self.assert_nothing_left()
        self.assertFalse(os.path.exists(self.path("out.png")))

    def test_file_that_is_no_program_is_unavailable(self):
        os.chmod(self.write("bin/vitraild", "\x7fELF not really"), 0o755)
        self.assertIn("cannot execute", self.spawn(code=69)[1])
        self.assertEqual(os.listdir(self.path("tmp")), [])

    def test_daemon_that_never_listens_is_given_up_at_the_timeout(self):
        self.plan(mute=True)
        self.spawn("--timeout", "1", code=75)
        self.assert_nothing_left()

    def test_daemon_that_dies_in_a_render_is_temporary(self):
        self.plan(die_in_render=True)
        _, err = self.spawn(code=75)
        self.assertIn("the private vitraild ended with status 9", err)
        self.assert_nothing_left()
        self.assertFalse(os.path.exists(self.path("out.png")))

    def test_daemon_that_ignores_terminate_is_killed(self):
        self.plan(ignore_term=True)
        started = time.monotonic()
        self.spawn()
        self.assertLess(time.monotonic() - started, 15)
        self.assert_nothing_left()

    def test_signals_to_the_client_end_the_daemon(self):
        self.plan(hang=True)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            self.interrupt_render(lambda p, n=number: p.send_signal(n), 128 + number)

    def test_kill_of_the_client_ends_the_daemon(self):
        self.plan(hang=True)
        self.interrupt_render(lambda p: p.kill(), -signal.SIGKILL)

    def test_kill_of_the_whole_group_ends_the_daemon(self):
        self.plan(hang=True)
        self.interrupt_render(lambda p: os.killpg(p.pid, signal.SIGKILL), -signal.SIGKILL,
                              start_new_session=True)

    def interrupt_render(self, end, code, **options):
        if os.path.exists(self.path("note.json")):
            os.remove(self.path("note.json"))
        process = self.start_render(**options)
        end(process)
        process.communicate(timeout=20)
        self.assertEqual(process.returncode, code)
        self.assert_nothing_left()
        self.assertFalse(os.path.exists(self.path("out.png")))

    def test_kill_of_the_keeper_ends_the_daemon(self):
        self.plan(hang=True)

        def kill_keeper():
            with open("/proc/%d/stat" % self.note()["pid"], encoding="ascii") as file:
                keeper = int(file.read().rpartition(")")[2].split()[1])
            os.kill(self.note()["worker"], signal.SIGKILL)  # a real worker sees its daemon go
            os.kill(keeper, signal.SIGKILL)
        process = self.start_render()
        kill_keeper()
        process.communicate(timeout=20)
        self.assertEqual(process.returncode, 75)
        deadline = time.monotonic() + 10
        while self.is_running(self.note()["pid"]) and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertFalse(self.is_running(self.note()["pid"]))

    def test_every_remote_command_can_spawn(self):
        for command in (["health"], ["stats"], ["capabilities"], ["scenes"],
                        ["push", self.scene()]):
            self.run_cli(*command, "--spawn", program=self.program)
        self.assert_nothing_left()


if __name__ == "__main__":
    main()
