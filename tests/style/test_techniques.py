# SPDX-License-Identifier: MIT
"""The rows of protocol/shadow_technique.h and protocol/transparency.h stand in the OpenAPI document
and in the manual, their techniques are named in their own sources alone, and the defaults of
protocol/quality_defaults.h in no other source."""

import json
import re
import unittest

import sources


# rows that make whole pictures, and may be named where that is told from rasterising
RENDERERS = ("RAYTRACED",)

# member of `quality` -> header, its table, its enum, a name that is no other enum's, rows at least
TABLES = {
    "shadows": ("protocol/shadow_technique.h", "SHADOW_TECHNIQUES", "shadow_technique", "deep", 10),
    "transparency": ("protocol/transparency.h", "TRANSPARENCIES", "transparency", "lists", 2),
}


def ids(member):
    """{id in C: name on the wire}"""
    header, table, enum, _, _ = TABLES[member]
    rows = sources.read(header).split(f"#define {table}(ROW)")[1].split(f"enum {enum} {{")[0]
    return dict(re.findall(r'ROW\((\w+),\s*(?:\\\s*)?"([a-z-]+)"', rows))


def naming_a_technique():
    """What matches an id or a name of one: a whole renderer may be told from the others."""
    found = {key: name for key, name in ids("shadows").items()
             if key not in ("AUTO", "NONE", *RENDERERS)}
    return re.compile(rf"\bSHADOWS_({'|'.join(found)})\b|\"({'|'.join(found.values())})\"")


def defaults():
    text = sources.read(DEFAULTS)
    return {name: int(value) for name, value in re.findall(r"#define (\w+_DEFAULT\w*) (\d+)", text)}


DEFAULTS = "protocol/quality_defaults.h"


class Defaults(unittest.TestCase):
    def test_the_manual_says_them(self):
        found = defaults()
        quality = sources.read_manual("reference/requests.md").split("\n## Quality\n")[1]
        said = dict(re.findall(r"^\| `(\w+)` \|[^|]*\|\s*([^|]*?)\s*\|", quality, re.MULTILINE))
        self.assertEqual(str(found["SHADOW_RESOLUTION_DEFAULT"]), said["shadow_resolution"])
        self.assertEqual(f"{found['SHADOW_TAPS_DEFAULT']}; stochastic ones "
                         f"{found['SHADOW_TAPS_DEFAULT_NOISY']}", said["shadow_taps"])
        self.assertEqual(f"{found['AREA_SAMPLES_DEFAULT']}; with `reference` "
                         f"{found['AREA_SAMPLES_DEFAULT_REFERENCE']}", said["area_samples"])
        self.assertTrue(said["samples"].startswith(str(found["SAMPLES_DEFAULT"])), said["samples"])

    def test_no_other_source_has_them(self):
        """As what stands in for 0, as a constant, or in a sentence."""
        member = r"(shadow_resolution|shadow_taps|area_samples|->samples|\.samples)"
        subject = r"(texels per side|\*[^*]* per pixel|per area light)"
        said = re.compile(rf"{member} *(> 0)? *\?[^;?]*: *([2-9]|\d\d+)\b"
                          r"|\bshadow_resolution *[=!]=? *1024\b"
                          r"|\b(RESOLUTION|TAPS|SAMPLES)_DEFAULT\w* *= *\d"
                          r"|\bDEFAULT_(RESOLUTION|TAPS|SAMPLES) *="
                          rf"|{subject}[^;]*; *(default|0 =|0 means) *\d")
        strays = [f"{path}:{number}: {line.strip()}" for path in sources.files()
                  if path.suffix in sources.C_SUFFIXES and str(path) != DEFAULTS
                  and path.parts[0] in {"renderer", "server", "protocol", "clients"}
                  for number, line in enumerate(sources.read(path).splitlines(), 1)
                  if said.search(line) and "reference_samples" not in line]
        self.assertEqual([], strays)


class Techniques(unittest.TestCase):
    def test_the_rows_are_found(self):
        for member, (_, _, _, own, least) in TABLES.items():
            self.assertGreaterEqual(len(list(ids(member).values())), least)
            self.assertEqual("auto", list(ids(member).values())[0])
            self.assertIn(own, list(ids(member).values()))

    def test_openapi_takes_the_names(self):
        """The build writes them in (cmake/embed_text.cmake)."""
        schemas = json.loads(sources.read("server/openapi.json"))["components"]["schemas"]
        for member, (_, table, _, _, _) in TABLES.items():
            enums = [found["enum"] for schema in schemas.values()
                     for name, found in schema.get("properties", {}).items()
                     if name == member and "enum" in found]
            self.assertEqual([[table, None]], enums)

    def test_the_manual_lists_them(self):
        quality = sources.read_manual("reference/requests.md").split("\n## Quality\n")[1]
        for member in TABLES:
            row = re.search(rf"^\| `{member}` \|([^|]*)\|", quality, re.MULTILINE)
            self.assertEqual(list(ids(member).values()), re.findall(r"`([a-z-]+)`", row[1]))

    def strays(self, words, homes, suffixes):
        words, homes = re.compile(words), re.compile(homes)
        return [f"{path}:{number}: {line.strip()}" for path in sources.files()
                if path.suffix in suffixes and path.parts[0] != "tests"
                and not homes.fullmatch(str(path))
                for number, line in enumerate(sources.read(path).splitlines(), 1)
                if words.search(re.split("//|/[*]", line)[0])]

    def test_only_techniques_name_techniques(self):
        """All others ask the row (protocol/shadow_technique.h) or the table (technique.h)."""
        homes = (r"protocol/shadow_technique\.h"
                 r"|renderer/shadows/(technique|shadow_(deep|linked|traced))\w*\.[ch]"
                 # a transparency has the name of a technique
                 r"|protocol/transparency\.h"
                 # counters on the wire that are older than lights_by_technique
                 r"|protocol/plan_document\.c"
                 # `map` is also a picture of differences
                 r"|clients/(compare/print|vitrail/compare_options)\.c")
        self.assertEqual([], self.strays(naming_a_technique(), homes, sources.C_SUFFIXES))

    def test_a_planted_name_is_seen(self):
        for line in ("= SHADOWS_DEEP,", "{SHADOWS_DEEP_LINKED}", '"raytraced-shadows"', '("map")'):
            self.assertTrue(naming_a_technique().search(line), line)
        for line in ("SHADOWS_AUTO", "SHADOWS_RAYTRACED)", "SHADOWS_RASTER_DEFAULT", '"maps"'):
            self.assertFalse(naming_a_technique().search(line), line)

    def test_only_techniques_name_structures(self):
        """All others ask the table (technique.h)."""
        homes = r"renderer/shadows/(technique\w*|shadow_(deep|linked)\w*)\.[ch]"
        self.assertEqual([], self.strays(r"\bshadow_(structure|method)_(map|deep|linked|rays)\b",
                                         homes, sources.C_SUFFIXES))

    def test_only_lookups_name_techniques_in_shaders(self):
        """shadow_lists.glsl asks SHADOW_LISTS."""
        homes = r"shaders/shadows/shadow_lookup_\w+\.glsl"
        self.assertEqual([], self.strays(r"\bshadow_(run|list)_(deep|linked)\b", homes, {".glsl"}))


if __name__ == "__main__":
    sources.run_tests(__name__)
