# SPDX-License-Identifier: MIT
"""The manuals agree with the programs: links, flags and routes."""

import json
import re
import subprocess
import sys
import unittest
import urllib.parse

import sources

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)")
FENCE = re.compile(r"^(```|~~~).*?^\1\s*$", re.MULTILINE | re.DOTALL)
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*")
COMMAND = re.compile(r"^  ([a-z][a-z-]+) {2,}\S", re.MULTILINE)


def manuals():
    return [path for path in sources.files() if path.suffix == ".md"]


def anchors_of(text):
    """The names that a Markdown file's headings get, as the common renderers make them."""
    headings = re.findall(r"^#+\s+(.*?)\s*$", FENCE.sub("", text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def link_faults(path, text):
    faults = []
    for target in LINK.findall(FENCE.sub("", text)):
        if re.match(r"[a-z][a-z0-9+.-]*:", target):
            continue  # another host: not ours to fetch in a test
        name, _, anchor = target.partition("#")
        file = sources.root() / path.parent / urllib.parse.unquote(name) if name else None
        if file and not file.exists():
            faults.append(f"{path}: no such file: {target}")
        elif anchor and (not file or file.suffix == ".md"):
            pointed = file.read_text(encoding="utf-8") if file else text
            if anchor not in anchors_of(pointed):
                faults.append(f"{path}: no such heading: {target}")
    return faults


def help_of(program, *arguments):
    path = sources.build_dir() / "bin" / program
    done = subprocess.run([str(path), *arguments, "--help"], capture_output=True, text=True,
                          check=False, timeout=60)
    if done.returncode != 0:
        raise AssertionError(f"{program} {' '.join(arguments)} --help: {done.stderr}")
    return done.stdout


def missing_flags(shown, manual):
    return sorted(set(FLAG.findall(shown)) - set(FLAG.findall(manual)))


class Links(unittest.TestCase):
    def test_every_link_to_a_file_or_heading_resolves(self):
        faults = [fault for path in manuals() for fault in link_faults(path, sources.read(path))]
        self.assertGreater(len(manuals()), 3, "the manuals must have been found")
        self.assertEqual([], faults, "\n" + "\n".join(faults))

    def test_a_planted_dead_link_is_caught(self):
        path = sources.files()[0].parent / "README.md"
        self.assertEqual(1, len(link_faults(path, "see [this](docs/no-such-file.md)")))
        self.assertEqual(1, len(link_faults(path, "see [this](#no-such-heading)\n# Other\n")))
        self.assertEqual([], link_faults(path, "see [this](#some-heading)\n# Some heading\n"))


MENTION = re.compile(r"(?<![\w/.-])docs/[\w/-]+\.md")
MENTIONING = sources.CODE_SUFFIXES | {".js", ".md"}


def strays_of(path, text, known):
    return [f"{path}: {name}" for name in MENTION.findall(text) if name not in known]


class Mentions(unittest.TestCase):
    def test_every_manual_that_a_source_names_exists(self):
        known = {str(path) for path in manuals()}
        strays = [stray for path in sources.files()
                  if (path.suffix in MENTIONING or path.name == "openapi.json")
                  and path.name not in {"CHANGELOG.md", "test_docs.py"}
                  for stray in strays_of(path, sources.read(path), known)]
        self.assertEqual([], strays, "\n" + "\n".join(strays))

    def test_a_planted_mention_is_caught(self):
        known = {"docs/explanation/shading.md"}
        self.assertEqual([], strays_of("a.c", "(docs/explanation/shading.md, section 1)", known))
        self.assertEqual(["a.c: docs/lost.md"], strays_of("a.c", "/* docs/lost.md. */", known))


def linked_from(path):
    """The manuals that a manual links to, as paths from the root."""
    targets = LINK.findall(FENCE.sub("", sources.read(path)))
    files = {(sources.root() / path.parent / target.partition("#")[0]).resolve()
             for target in targets if not re.match(r"[a-z][a-z0-9+.-]*:|#", target)}
    return {manual for manual in manuals() if (sources.root() / manual).resolve() in files}


class Ways(unittest.TestCase):
    def test_a_reader_of_the_readme_finds_every_manual_within_two_clicks(self):
        start = next(path for path in manuals() if str(path) == "README.md")
        first = linked_from(start)
        found = first.union(*(linked_from(path) for path in first))
        docs = {path for path in manuals() if path.parts[0] == "docs"}
        self.assertGreater(len(docs), 10)
        self.assertEqual([], sorted(str(path) for path in docs - found))


TERM = re.compile(r"^\| (?!term |---)(.*?) \| (.*) \|$", re.MULTILINE)


def glossary_faults(text):
    rows = [(term.replace("`", "").lower(), meaning) for term, meaning in TERM.findall(text)]
    faults = [f"no link: {term}" for term, meaning in rows if not LINK.search(meaning)]
    terms = [term for term, _ in rows]
    return faults + [f"after {a}: {b}" for a, b in zip(terms, terms[1:]) if a >= b]


class Glossary(unittest.TestCase):
    def test_terms_are_in_order_and_each_has_a_link_to_its_page(self):
        text = sources.read_manual("explanation/glossary.md")
        self.assertGreater(len(TERM.findall(text)), 40)
        self.assertEqual([], glossary_faults(text))

    def test_a_planted_term_without_link_or_order_is_caught(self):
        rows = "| term | meaning |\n| --- | --- |\n| view | [x](y.md) |\n| tap | a texel |\n"
        self.assertEqual(["no link: tap", "after view: tap"], glossary_faults(rows))


class Flags(unittest.TestCase):
    def test_every_flag_of_vitrail_is_in_the_manual(self):
        overview = help_of("vitrail")
        commands = COMMAND.findall(overview)
        self.assertIn("render", commands)
        shown = overview + "".join(help_of("vitrail", command) for command in commands)
        self.assertEqual([], missing_flags(shown, sources.read_manual("reference/cli.md")))

    def test_every_command_of_vitrail_is_in_the_manual(self):
        manual = sources.read_manual("reference/cli.md")
        self.assertEqual([], [command for command in COMMAND.findall(help_of("vitrail"))
                              if f"vitrail {command}" not in manual])

    def test_the_manual_names_no_flag_that_vitrail_lacks(self):
        commands = COMMAND.findall(help_of("vitrail"))
        known = help_of("vitrail") + "".join(help_of("vitrail", name) for name in commands)
        known += help_of("vitraild") + "--help --version"
        self.assertEqual([], missing_flags(sources.read_manual("reference/cli.md"), known))

    def test_every_flag_of_vitraild_is_in_a_manual(self):
        manual = "".join(sources.read(path) for path in manuals() if path.parts[0] == "docs")
        self.assertEqual([], missing_flags(help_of("vitraild"), manual))

    def test_a_planted_flag_is_caught(self):
        self.assertEqual(["--new"], missing_flags("  --old X  text\n  --new  text", "`--old X`"))


class Routes(unittest.TestCase):
    def test_every_route_is_in_the_manual(self):
        document = json.loads(sources.read("server/openapi.json"))
        manual = sources.read_manual("reference/http.md")
        missing = [f"{method.upper()} {path}" for path, item in document["paths"].items()
                   for method in item if method in {"get", "head", "post", "patch", "put", "delete"}
                   if not route_is_told(manual, method.upper(), path)]
        self.assertGreater(len(document["paths"]), 5)
        self.assertEqual([], missing)

    def test_a_planted_route_is_caught(self):
        manual = "| `GET`, `HEAD` | `/v1/scenes/{id}` |\n\n### POST /v1/scenes\n"
        self.assertTrue(route_is_told(manual, "HEAD", "/v1/scenes/{id}"))
        self.assertTrue(route_is_told(manual, "POST", "/v1/scenes"))
        self.assertFalse(route_is_told(manual, "DELETE", "/v1/scenes/{id}"))
        self.assertFalse(route_is_told(manual, "GET", "/v1/scenes"))


def route_is_told(manual, method, path):
    """Some line of the manual names both the method and exactly this path."""
    exact = re.compile(re.escape(path) + r"(?![\w/{-])")
    return any(exact.search(line) and re.search(rf"\b{method}\b", line)
               for line in manual.splitlines())


if __name__ == "__main__":
    programs = [sources.build_dir() / "bin" / name for name in ("vitrail", "vitraild")]
    if not all(program.exists() for program in programs):
        print("skipped: the programs are not built")
        sys.exit(sources.SKIPPED_EXIT_CODE)
    sources.run_tests(__name__)
