# SPDX-License-Identifier: MIT
"""A patch of a view is parsed once and written once: what stands between its text and that of a
picture holds structs and trees of JSON, no texts."""

import re
import unittest

import sources

BETWEEN = ["protocol/view_document.c", "server/views/views.c", "server/views/live.c"]
TEXTS = re.compile(r"\b(json_loads|json_dumps|render_request_parse|render_request_to_json)\(")


class OneParse(unittest.TestCase):
    def test_views_make_no_texts_on_their_way(self):
        strays = [f"{path}:{number}: {line.strip()}" for path in BETWEEN
                  for number, line in enumerate(sources.read(path).splitlines(), 1)
                  if TEXTS.search(line)]
        self.assertEqual([], strays)


if __name__ == "__main__":
    sources.run_tests(__name__)
