# SPDX-License-Identifier: MIT
"""The pages of docs/reference that are data, and the changelog, agree with the sources.

    tests/style/test_reference.py ROOT BUILD
    tests/style/test_reference.py ROOT BUILD write

The second form writes the table of docs/reference/configuration.md. Settings come from the table
of server/base/config.c and from `vitraild --print-config`, limits from protocol/limits.h, errors
from the table of protocol/error.c.
"""

import re
import subprocess
import sys
import unittest

import sources

CONFIGURATION = "reference/configuration.md"
KEY = re.compile(r'\{"([a-z-]+)", KEY_(\w+), AT\(\w+\), ([^,]+), ([^,]+),\s*((?:"[^"]*"\s*)+)\}')
LIMIT = re.compile(r"^(?:#define |    )(LIMIT_\w+)(?: = | )([^,/\n]+?),?\s*(?:/\*|$)", re.MULTILINE)
ERROR = re.compile(r'\[ERROR_\w+\] = \{"(\w+)", "([^"]+)",\s*(\d+)\}')
TABLE = re.compile(r"^(\| flag \| default \| range .*\n\| ---.*\n)((?:\|.*\n)*)", re.MULTILINE)
ROW = re.compile(r"^\| `([\w-]+)` \| (.*) \|$", re.MULTILINE)
UNITS = ("bytes", "KiB", "MiB", "GiB", "TiB")


def number_of(text):
    """The value of a C constant: digits with a suffix, perhaps shifted; or a floating one."""
    shifted = re.fullmatch(r"\(?(-?)\(?(\d+)(?:ull|u)?(?: << (\d+))?\)?\)?", text.strip())
    if not shifted:
        return float(text)
    value = int(shifted[2]) << int(shifted[3] or 0)
    return -value if shifted[1] else value


def bytes_told(value):
    unit = 0
    while value >= 1024 and value % 1024 == 0 and unit + 1 < len(UNITS):
        value, unit = value // 1024, unit + 1
    return f"{value:,} {UNITS[unit]}"


def told(name, value):
    if isinstance(value, float):
        return re.sub(r"e[+]?(-?)0*", r"e\1", f"{value:g}")
    return bytes_told(value) if name.lower().endswith("bytes") else f"{value:,}"


def cells(text):
    """First cell of each row of a manual's tables, without its ticks, to the others."""
    return {name: rest.split(" | ") for name, rest in ROW.findall(text)}


# ---- settings ----

def names_in(source, array):
    return re.findall(r'"([a-z]+)"', re.search(rf"{array}\[\] = \{{(.*?)\}};", source, re.S)[1])


def range_told(source, kind, name, least, most):
    """In words, what a setting of this kind may be."""
    arrays = {"LEVEL": "level_names", "AUTO": "auto_names", "SELF_TEST": "self_test_names"}
    if kind in arrays:
        return ", ".join(f"`{one}`" for one in names_in(source, arrays[kind]))
    if kind == "COMPRESSION":
        return "`auto`, `on`, `off`"
    if kind not in {"BYTES", "INT"}:
        return {"BOOL": "switch", "PATH": "directory"}.get(kind, "text")
    low = told(name, abs(least)) if least else "0"
    zero = "0, or " if least < 0 else ""
    return zero + (f"{low} or more" if most is None else f"{low} to {told(name, most)}")


def defaults():
    """What vitraild sets where nobody says anything."""
    done = subprocess.run([str(sources.build_dir() / "bin" / "vitraild"), "--print-config"],
                          capture_output=True, text=True, check=True, timeout=60,
                          env={"HOME": "/", "PATH": "/"})
    return dict(line.split(" = ", 1) if " = " in line else (line.rstrip(" ="), "")
                for line in done.stdout.splitlines() if "=" in line)


def default_told(name, kind, value):
    if name == "state-dir":
        return "[below](#storage)"
    if kind == "BOOL":
        return {"false": "off", "true": "on"}[value]
    if kind in {"BYTES", "INT"}:
        return told(name, int(value)) if int(value) else "0"
    return f"`{value}`" if value else "none"


def settings():
    """The rows of the table of configuration.md."""
    source = sources.read("server/base/config.c")
    header = sources.read("server/base/config.h")
    named = {name: re.search(rf"{name} = (\d+)", header)[1]
             for name in ("WARM_UPS_MAX", "CONFIG_WORKERS_MAX")}
    values = defaults()
    for name, kind, least, most, words in KEY.findall(source):
        most = None if most == "INT64_MAX" else number_of(named.get(most, most))
        least = number_of(least)
        text = "".join(re.findall(r'"([^"]*)"', words)).replace("|", "/")
        yield (f"| `--{name}` | {default_told(name, kind, values[name])} | "
               f"{range_told(source, kind, name, least, most)} | {text} |")


class Configuration(unittest.TestCase):
    def test_the_table_is_that_of_the_program(self):
        rows = list(settings())
        self.assertGreater(len(rows), 20)
        self.assertEqual(rows, TABLE.search(sources.read_manual(CONFIGURATION))[2].splitlines())

    def test_numbers_of_c_are_read(self):
        self.assertEqual(1 << 20, number_of("1 << 20"))
        self.assertEqual(2 << 30, number_of("(2ull << 30)"))
        self.assertEqual(("32 MiB", "65,536", "0.001", "1e12", "1e-9"),
                         (told("X_BYTES", 32 << 20), told("X", 65536), told("X", 0.001),
                          told("X", 1e12), told("X", 1e-9)))
        with self.assertRaises(ValueError):
            number_of("sizeof x")


# ---- limits ----

def limit_faults(source, manual):
    """Limits that the manual lacks, has with another value, or has and the source lacks."""
    known = {name: told(name, number_of(value)) for name, value in LIMIT.findall(source)}
    rows = cells(manual)
    shown = {name: rows[name][0] for name in rows if name.startswith("LIMIT_")}
    return sorted(f"{name}: {known.get(name)}, in the manual {shown.get(name)}"
                  for name in known.keys() | shown.keys() if known.get(name) != shown.get(name))


class Limits(unittest.TestCase):
    def test_every_limit_is_in_the_manual_with_its_value(self):
        source = sources.read("protocol/limits.h")
        self.assertEqual(source.count("    LIMIT_") + source.count("#define LIMIT_"),
                         len(LIMIT.findall(source)))
        self.assertEqual([], limit_faults(source, sources.read_manual("reference/limits.md")))

    def test_planted_limits(self):
        source = "enum {\n    LIMIT_A = 1 << 10, /* why */\n};\n#define LIMIT_B_BYTES (1u << 20)\n"
        right = "| `LIMIT_A` | 1,024 | x |\n| `LIMIT_B_BYTES` | 1 MiB | x |\n"
        self.assertEqual([], limit_faults(source, right))
        self.assertEqual(1, len(limit_faults(source, right.replace("1,024", "1,000"))))
        self.assertEqual(1, len(limit_faults(source, right.replace("LIMIT_B_BYTES", "LIMIT"))))
        self.assertEqual(1, len(limit_faults(source, right + "| `LIMIT_C` | 3 | x |\n")))


# ---- errors ----

def error_faults(source, manual):
    known = {name: [status, title] for name, title, status in ERROR.findall(source)}
    del known["none"]
    rows = cells(manual)
    shown = {name: rest[:2] for name, rest in rows.items() if rest[0].isdigit()}
    return sorted(f"{name}: {known.get(name)}, in the manual {shown.get(name)}"
                  for name in known.keys() | shown.keys() if known.get(name) != shown.get(name))


class Errors(unittest.TestCase):
    def test_every_code_is_in_the_manual_with_status_and_title(self):
        source = sources.read("protocol/error.c")
        self.assertGreater(len(ERROR.findall(source)), 15)
        self.assertEqual(source.count("] = {\""), len(ERROR.findall(source)))
        self.assertEqual([], error_faults(source, sources.read_manual("reference/errors.md")))

    def test_planted_errors(self):
        source = '[ERROR_NONE] = {"none", "No", 200},\n[ERROR_IO] = {"io", "A file",\n   500},\n'
        self.assertEqual([], error_faults(source, "| `io` | 500 | A file | when |\n"))
        self.assertEqual(1, len(error_faults(source, "| `io` | 503 | A file | when |\n")))
        self.assertEqual(1, len(error_faults(source, "")))


# ---- version ----

def released(changelog):
    """The newest version, with the date of its release."""
    return re.search(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", changelog, re.M).groups()


class Version(unittest.TestCase):
    def test_the_program_has_the_newest_version_of_the_changelog(self):
        version, _ = released(sources.read("CHANGELOG.md"))
        self.assertIn(f"project(vitrail VERSION {version} ", sources.read("CMakeLists.txt"))

    def test_the_newest_release_is_the_first_one_named(self):
        text = "## [Unreleased]\n\n## [0.2.0] - 2027-01-01\n\n## [0.1.0] - 2026-11-23\n"
        self.assertEqual(("0.2.0", "2027-01-01"), released(text))


def write():
    path = sources.root() / "docs" / CONFIGURATION
    table = "\n".join(settings()) + "\n"
    text = TABLE.sub(lambda found: found[1] + table, path.read_text(encoding="utf-8"))
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    if not (sources.build_dir() / "bin" / "vitraild").exists():
        print("skipped: the programs are not built")
        sys.exit(sources.SKIPPED_EXIT_CODE)
    if sys.argv[3:] == ["write"]:
        write()
    else:
        sources.run_tests(__name__)
