# SPDX-License-Identifier: MIT
"""The rows of protocol/shadow_technique.h stand in the OpenAPI document and in the manual."""

import json
import re
import unittest

import sources


def names():
    rows = sources.read("protocol/shadow_technique.h").split("#define SHADOW_TECHNIQUES(ROW)")[1]
    rows = rows.split("enum shadow_technique {")[0]
    return re.findall(r'ROW\(\w+,\s*(?:\\\s*)?"([a-z-]+)"', rows)


class Techniques(unittest.TestCase):
    def test_the_rows_are_found(self):
        self.assertGreaterEqual(len(names()), 7)
        self.assertEqual("auto", names()[0])

    def test_openapi_takes_the_names(self):
        schemas = json.loads(sources.read("server/openapi.json"))["components"]["schemas"]
        enums = [member["enum"] for schema in schemas.values()
                 for name, member in schema.get("properties", {}).items()
                 if name == "shadows" and "deep" in member.get("enum", [])]
        self.assertTrue(enums)
        for enum in enums:
            self.assertEqual(names(), [name for name in enum if name is not None])

    def test_the_manual_lists_them(self):
        quality = sources.read_manual("requests.md").split("\n## Quality\n")[1]
        row = re.search(r"^\| `shadows` \|([^|]*)\|", quality, re.MULTILINE)
        self.assertEqual(names(), re.findall(r"`([a-z-]+)`", row[1]))

    def test_only_techniques_name_the_kinds_of_structures(self):
        """All others ask the table: renderer/shadows/technique.h."""
        kinds = re.compile(r"\bSHADOW_(MAP|DEEP|LINKED)\b")
        homes = re.compile(
            r"renderer/shadows/(technique_\w+|shadow_(deep|linked)\w*|shadow_compress)\.[ch]")
        strays = [f"{path}:{number}: {line.strip()}" for path in sources.files()
                  if path.suffix in sources.C_SUFFIXES and path.parts[0] in {"renderer", "server"}
                  and not homes.fullmatch(str(path))
                  for number, line in enumerate(sources.read(path).splitlines(), 1)
                  if kinds.search(line.split("/*")[0])]
        self.assertEqual([], strays)


if __name__ == "__main__":
    sources.run_tests(__name__)
