#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The commands of the tutorial, of the how-to pages and of the explanations do what the pages show.

    tests/http/test_manual_commands.py BIN
    tests/http/test_manual_commands.py BIN take [PAGE ...]

The second form runs the pages, prints the output of each block and stores the figures beside the
page. A page is read so:

- All blocks of `sh` are one script of bash, which runs in an empty folder beside a daemon without
  scenes. A block below the line `<!-- not run: REASON -->` is left out.
- A block of another language whose first line is a comment with a file name is that file.
- A block of `text` is the output of the block of `sh` before it. Numbers, ids and lines that tell
  what the server chose may differ, `...` stands for any text, alone on a line for any lines.
- A figure whose name begins with that of the page is a file that the script writes.
"""
import difflib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import support

REAL = os.path.join(support.BIN, "vitraild")
ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
DOCS = os.path.join(ROOT, "docs")
BLOCK = re.compile(r"^(<!-- not run: [^\n]+ -->\n)?```(\w+)\n(.*?)^```$", re.M | re.S)
FILE = re.compile(r"(?:#|//|<!--) ([\w.-]+\.[a-z]+)\b")
FIGURE = re.compile(r"!\[[^\]]+\]\(([\w.-]+)\)")
# What another run writes differently: ids, and numbers with sign, decimals and exponent.
VARIES = re.compile(r"\b[0-9a-f]{16,64}\b|[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")
CHOSEN = "chosen: "  # begins the line that tells what the server chose, another on another device
# Of a figure: rays and maps draw the vessel 0.06 apart; with glass of another colour it is 0.12.
FLIP_MAX = 0.09
SCRIPT_S = 600


def pages():
    """Those that have a command to run or a figure that a command draws."""
    names = [os.path.join(folder, name) for folder in ("tutorial", "how-to", "explanation")
             for name in sorted(os.listdir(os.path.join(DOCS, folder))) if name.endswith(".md")]
    return [name for name in names if (page := page_of(name)).scripts or page.figures]


def page_of(name):
    with open(os.path.join(DOCS, name), encoding="utf-8") as file:
        return Page(file.read(), name)


class Page:
    def __init__(self, text, name="page.md"):
        self.name, self.text = name, text
        self.stem = os.path.splitext(os.path.basename(name))[0]
        self.scripts, self.outputs, self.files = [], {}, {}
        for left_out, language, body in BLOCK.findall(text):
            self.take(bool(left_out), language, body)
        self.figures = [figure for figure in FIGURE.findall(text) if figure.startswith(self.stem)]

    def take(self, is_left_out, language, body):
        named = FILE.match(body)
        if is_left_out:
            return
        if language == "sh":
            self.scripts.append(body)
        elif language == "text" and self.scripts:
            self.outputs[len(self.scripts) - 1] = body
        elif named:
            self.files[named[1]] = body

    def script(self):
        steps = ["set -euo pipefail\n"]
        for index, body in enumerate(self.scripts):
            steps.append(f"exec >output.{index} 2>&1\n{body}")
        return "".join(steps)


def pattern_of(line):
    """What a line of shown output allows."""
    def fixed(text):
        return ".*".join(re.escape(part) for part in text.split("..."))

    if line.startswith(CHOSEN):
        return CHOSEN + ".*"
    pieces, start = [], 0
    for found in VARIES.finditer(line):
        pieces += [fixed(line[start:found.start()]), "[-+0-9a-f.,e]+"]
        start = found.end()
    return "".join(pieces) + fixed(line[start:])


def is_as_shown(output, shown):
    lines = shown.rstrip("\n").split("\n")
    pattern = "\n".join("(?s:.*)" if line == "..." else pattern_of(line) for line in lines)
    return re.fullmatch(pattern, output.rstrip("\n")) is not None


def frames_of(figure):
    """How many frames an animated WebP file has; 0 of any other."""
    with open(figure, "rb") as file:
        content = file.read()
    return content.count(b"ANMF") if content[12:16] == b"VP8X" else 0


class Run:
    """A page that was run: its folder, and the output of each block."""

    def __init__(self, page, folder, port):
        self.page, self.folder = page, folder
        address = f"127.0.0.1:{port}"
        for name, body in page.files.items():
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(body.replace("127.0.0.1:8090", address))
        path = f"{support.BIN}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path, "VITRAIL_SERVER": f"http://{address}",
                       "PYTHONDONTWRITEBYTECODE": "1",
                       "PYTHONPATH": os.path.join(ROOT, "clients/python")}
        script = page.script().replace("127.0.0.1:8090", address)
        done = subprocess.run(["bash", "-c", script], cwd=folder, env=environment,
                              stdin=subprocess.DEVNULL, timeout=SCRIPT_S, check=False)
        self.status = done.returncode
        self.outputs = [self.output(index) for index in range(len(page.scripts))]

    def output(self, index):
        path = os.path.join(self.folder, f"output.{index}")
        if not os.path.exists(path):
            return None
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read()

    def faults(self):
        """Sentences on what the page does not keep."""
        if self.status != 0:
            last = max(index for index, output in enumerate(self.outputs) if output is not None)
            yield f"status {self.status} in\n{self.page.scripts[last]}\n{self.outputs[last]}"
            return
        for index, shown in self.page.outputs.items():
            if not is_as_shown(self.outputs[index], shown):
                lines = difflib.unified_diff(shown.splitlines(), self.outputs[index].splitlines(),
                                             "shown", "written", lineterm="")
                yield "\n".join([self.page.scripts[index], *lines])
        for figure in self.page.figures:
            yield from self.figure_faults(figure)

    def figure_faults(self, figure):
        made = os.path.join(self.folder, figure)
        stored = os.path.join(DOCS, os.path.dirname(self.page.name), figure)
        if not os.path.exists(made):
            yield f"{figure}: no command writes it"
            return
        if frames_of(stored):
            if frames_of(made) != frames_of(stored):
                yield f"{figure}: {frames_of(made)} frames, {frames_of(stored)} in the manual"
            return
        done = subprocess.run([os.path.join(support.BIN, "vitrail"), "compare", made, stored,
                               "--metric", "flip", "--max-error", str(FLIP_MAX)],
                              capture_output=True, text=True, check=False)
        if done.returncode != 0:
            yield f"{figure}: {done.stdout}{done.stderr}"


def run_page(name, folder):
    page = page_of(name)
    with support.Daemon(program=REAL) as daemon:
        daemon.wait_device().wait_ready()
        return Run(page, folder, daemon.port)


class Commands(unittest.TestCase):
    def test_every_command_of_a_page_succeeds_and_writes_what_the_page_shows(self):
        for name in pages():
            with self.subTest(page=name), tempfile.TemporaryDirectory() as folder:
                faults = list(run_page(name, folder).faults())
                self.assertEqual([], faults, "\n\n".join([name, *faults]))

    def test_a_wrong_page_is_caught(self):
        text = "```sh\necho 1 of 2 panes\n```\n\n```text\n%s\n```\n![A pane](page-none.webp)\n"
        right, wrong = Page(text % "7 of 9 ..."), Page(text % "7 of 9 lamps")
        self.assertEqual((1, ["page-none.webp"]), (len(right.scripts), right.figures))
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(1, len(list(Run(right, folder, 1).faults())), "the figure is missing")
            self.assertEqual(2, len(list(Run(wrong, folder, 1).faults())))
            failing = Page("```sh\nfalse\n```\n")
            self.assertIn("status 1", next(Run(failing, folder, 1).faults()))


def take(names):
    for name in names or pages():
        with tempfile.TemporaryDirectory() as folder:
            run = run_page(name, folder)
            for script, output in zip(run.page.scripts, run.outputs):
                print(f"---- {name}\n{script}----\n{output}")
            print(f"---- {name}: status {run.status}")
            for figure in run.page.figures:
                made = os.path.join(folder, figure)
                shutil.copyfile(made, os.path.join(DOCS, os.path.dirname(name), figure))
                print(f"{figure}: {os.path.getsize(made) >> 10} KiB")


if __name__ == "__main__":
    support.needs(REAL)
    support.needs(os.path.join(support.BIN, "vitrail"))
    if sys.argv[2:3] == ["take"]:
        take(sys.argv[3:])
    else:
        support.run_tests()
