# SPDX-License-Identifier: MIT
"""Configuration: flags over environment over file over defaults; what is wrong is named."""
import os
import pathlib
import subprocess
import tempfile
import unittest

import support

support.needs(support.FAKE)


def run(*flags, environment=None, config=None):
    with tempfile.TemporaryDirectory() as folder:
        if config is not None:
            path = os.path.join(folder, "vitrail.ini")
            with open(path, "w", encoding="utf-8") as file:
                file.write(config)
            flags = ("--config", path, *flags)
        clean = {key: value for key, value in os.environ.items() if not key.startswith("VITRAIL_")}
        return subprocess.run(
            [support.FAKE, *flags],
            env={**clean, **(environment or {})},
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )


def printed(*flags, **more):
    """{key: (value, origin)} as --print-config tells them."""
    done = run(*flags, "--print-config", **more)
    assert done.returncode == 0, done.stderr
    values, origin = {}, None
    for line in done.stdout.splitlines():
        if line.startswith("; "):
            origin = line[2:]
        elif " = " in line or line.endswith(" ="):
            key, _, value = line.partition(" =")
            values[key] = (value.strip(), origin)
    return values


class Config(unittest.TestCase):
    def test_flags_win_over_environment_over_file_over_defaults(self):
        file = "[vitrail]\nrender-timeout-s = 11\ndecode_timeout_s = 12\ndevice = 3\n"
        environment = {"VITRAIL_RENDER_TIMEOUT_S": "21", "VITRAIL_DEVICE": "4"}
        values = printed("--device", "5", environment=environment, config=file)
        self.assertEqual(("12", "file"), values["decode-timeout-s"])
        self.assertEqual(("21", "environment"), values["render-timeout-s"])
        self.assertEqual(("5", "flag"), values["device"])
        self.assertEqual(("20", "default"), values["drain-timeout-s"])

    def test_a_device_is_a_number_a_node_an_address_or_software(self):
        for device in ("0", "64", "/dev/dri/renderD128", "0000:65:00.0", "65:00.0", "software"):
            self.assertEqual((device, "flag"), printed("--device", device)["device"])
            environment = {"VITRAIL_DEVICE": device}
            self.assertEqual((device, "environment"), printed(environment=environment)["device"])
        self.assertEqual(("0", "default"), printed()["device"])

    def test_all_devices_are_the_render_nodes_of_the_machine(self):
        folder = pathlib.Path("/dev/dri")
        nodes = sorted(folder.glob("renderD*"), key=lambda node: int(node.name[7:]))
        if nodes:
            listed = ",".join(map(str, nodes))
            self.assertEqual((listed, "flag"), printed("--device", "all")["device"])
        else:
            done = run("--device", "all", "--check-config")
            self.assertEqual(2, done.returncode)
            self.assertIn("device (flag): no render node in /dev/dri", done.stderr)

    def test_what_is_printed_can_be_read_back(self):
        text = run("--cache-bytes", "3G", "--print-config").stdout
        again = run("--print-config", config=text).stdout
        self.assertEqual(
            [line for line in text.splitlines() if not line.startswith(";")],
            [line for line in again.splitlines() if not line.startswith(";")],
        )
        self.assertIn(f"cache-bytes = {3 << 30}", again)

    def test_sizes_take_binary_suffixes(self):
        for text, value in (
            ("1048576", 1 << 20),
            ("2M", 2 << 20),
            ("2MiB", 2 << 20),
            ("1g", 1 << 30),
            ("3T", 3 << 40),
        ):
            self.assertEqual(str(value), printed("--cache-bytes=" + text)["cache-bytes"][0])

    def test_texture_compression_is_a_switch_or_a_word(self):
        for flags, value in (
            ([], "auto"),
            (["--texture-compression"], "on"),
            (["--texture-compression", "--no-warm-up"], "on"),
            (["--texture-compression=true"], "on"),
            (["--texture-compression=false"], "off"),
            (["--texture-compression", "off", "--no-warm-up"], "off"),
            (["--texture-compression=auto"], "auto"),
        ):
            values = printed(*flags)
            self.assertEqual(value, values["texture-compression"][0], flags)
            self.assertEqual("true" if flags[-1:] == ["--no-warm-up"] else "false",
                             values["no-warm-up"][0], flags)
        values = printed(environment={"VITRAIL_TEXTURE_COMPRESSION": "1"})
        self.assertEqual("on", values["texture-compression"][0])

    def test_the_self_test_is_repeated_as_asked(self):
        self.assertEqual(("auto", "default"), printed()["self-test"])
        self.assertEqual(("always", "flag"), printed("--self-test=always")["self-test"])
        values = printed(environment={"VITRAIL_SELF_TEST": "always"})
        self.assertEqual(("always", "environment"), values["self-test"])

    def test_what_is_wrong_is_named_and_the_status_is_2(self):
        table = [
            (("--no-such",), "--no-such"),
            (("--device",), "needs a value"),
            (("--device", "x"), "device"),
            (("--device", "100"), "renderD128"),
            (("--device", "65:00.8"), "PCI address"),
            (("--device", "-1"), "device"),
            (("--cache-bytes", "1"), "outside"),
            (("--gpu-budget-bytes", "1"), "outside [1048576, "),
            (("--cache-bytes", "9999999999T"), "cache-bytes"),
            (("--cache-bytes", "1Q"), "cache-bytes"),
            (("--listen", "nowhere"), "HOST:PORT"),
            (("--listen", "127.0.0.1:99999"), "port"),
            (("--listen", "example.org:1"), "neither an address"),
            (("--log-level", "loud"), "log-level"),
            (("--auto", "fastest"), "auto"),
            (("--self-test=never",), "self-test"),
            (("--self-test",), "needs a value"),
            (("--texture-compression=some",), "texture-compression"),
            (("stray",), "stray"),
            (("--config", "/nonexistent"), "/nonexistent"),
            (("--allow-remote=perhaps",), "allow-remote"),
            (("--state-dir", ""), "state-dir"),
            (("--dump-shaders", "/nonexistent"), "/nonexistent"),
            (("--dump-shaders", "/dev/null"), "/dev/null"),
            (("--allow-host", "x" * 600), "longer"),
        ]
        for flags, part in table:
            done = run(*flags, "--check-config")
            self.assertEqual(2, done.returncode, (flags, done.stdout))
            self.assertIn(part, done.stderr, flags)

    def test_unknown_keys_of_file_and_environment_are_errors_with_their_place(self):
        done = run("--check-config", config="[vitrail]\ndevice = 1\ncolour = blue\n")
        self.assertEqual(2, done.returncode)
        self.assertIn("line 3", done.stderr)
        self.assertIn("colour", done.stderr)
        self.assertIn("[other]", run("--check-config", config="[other]\ndevice = 1\n").stderr)
        self.assertIn("line 1", run("--check-config", config="nonsense\n").stderr)
        done = run("--check-config", environment={"VITRAIL_COLOUR": "blue"})
        self.assertEqual(2, done.returncode)
        self.assertIn("VITRAIL_COLOUR", done.stderr)
        for client in ("VITRAIL_SERVER", "VITRAIL_URL"):
            self.assertEqual(0, run("--check-config",
                                    environment={client: "http://x"}).returncode, client)

    def test_a_public_address_needs_to_be_allowed(self):
        for listen in ("0.0.0.0:0", "[::]:0", "192.0.2.1:80"):
            done = run("--listen", listen, "--check-config")
            self.assertEqual(2, done.returncode)
            self.assertIn("--allow-remote", done.stderr)
            self.assertEqual(
                0, run("--listen", listen, "--allow-remote", "--check-config").returncode
            )
        for listen in ("127.0.0.1:0", "127.1.2.3:0", "[::1]:0", "localhost:0"):
            self.assertEqual(0, run("--listen", listen, "--check-config").returncode, listen)

    def test_the_state_directory_follows_the_user(self):
        if os.geteuid() == 0:
            self.assertEqual("/var/lib/vitrail", printed()["state-dir"][0])
        else:
            self.assertEqual(
                "/x/vitrail", printed(environment={"XDG_STATE_HOME": "/x"})["state-dir"][0]
            )
            values = printed(environment={"XDG_STATE_HOME": "", "HOME": "/h"})
            self.assertEqual("/h/.local/state/vitrail", values["state-dir"][0])

    def test_version_and_help_are_said(self):
        self.assertRegex(run("--version").stdout, r"^vitraild \d+\.\d+\.\d+\n$")
        text = run("--help").stdout
        for key in printed():
            self.assertIn("--" + key, text)

    def test_an_address_in_use_and_an_unusable_state_directory_are_named(self):
        with support.Daemon() as daemon:
            done = run(
                "--listen", f"127.0.0.1:{daemon.port}", "--state-dir", daemon.state_dir + "-other"
            )
            self.assertEqual(1, done.returncode)
            self.assertIn("in use", done.stderr)
        done = run("--listen", "127.0.0.1:0", "--state-dir", "/proc/vitrail")
        self.assertEqual(1, done.returncode)
        self.assertIn("/proc/vitrail", done.stderr)

    def test_the_limits_that_are_set_are_kept(self):
        with support.Daemon(environment={"VITRAIL_MAX_UPLOAD_BYTES": "10K"}) as daemon:
            self.assertEqual(
                10 << 10, daemon.request("GET", "/v1/capabilities").json()["limits"]["upload_bytes"]
            )
            self.assertEqual(413, daemon.post_scene(bytes(11 << 10)).status)


if __name__ == "__main__":
    support.run_tests()
