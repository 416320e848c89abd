# SPDX-License-Identifier: MIT
"""The Grafana dashboard asks for metrics, and labels of them, that the daemon has."""
import json
import os
import re

import support
from support import triangle

support.needs(support.FAKE)
DASHBOARD = os.path.join(os.path.dirname(os.path.abspath(__file__)),
                         "../../packaging/grafana/vitrail.json")
NAME = re.compile(r"\b(?:vitrail|process)_[a-z_]+")
GROUPED = re.compile(r"by \(([a-z, ]+)\)")
LEGEND = re.compile(r"{{(\w+)}}")


class Dashboard(support.ServiceTest):
    def metrics(self):
        """{name: names of its labels} after some of everything."""
        scene = self.daemon.push(triangle())
        self.daemon.render(scene)
        view = self.daemon.request("POST", "/v1/views", {"scene": scene}).json()["id"]
        self.daemon.request("GET", f"/v1/views/{view}/image")
        text = self.daemon.raw("GET", "/metrics").body.decode()
        found = {}
        for name, labels in re.findall(r"^(\w+)(?:\{(.*)\})? ", text, re.M):
            found.setdefault(name, set()).update(re.findall(r"(\w+)=\"", labels or ""))
        return found

    def test_every_metric_and_label_is_there(self):
        with open(DASHBOARD, encoding="utf-8") as file:
            dashboard = json.load(file)
        metrics = self.metrics()
        expressions = 0
        for panel in dashboard["panels"]:
            for target in panel["targets"]:
                expression = target["expr"]
                names = set(NAME.findall(expression))
                self.assertTrue(names, panel["title"])
                for name in names:
                    self.assertIn(name, metrics, panel["title"])
                wanted = {label.strip() for group in GROUPED.findall(expression)
                          for label in group.split(",")}
                wanted.update(LEGEND.findall(target["legendFormat"]))
                wanted.discard("instance")  # Prometheus adds it
                for label in wanted:
                    self.assertTrue(all(label in metrics[name] for name in names),
                                    (panel["title"], label))
                expressions += 1
        self.assertGreater(expressions, 20)

    def test_panels_do_not_overlap_and_have_numbers_of_their_own(self):
        with open(DASHBOARD, encoding="utf-8") as file:
            panels = json.load(file)["panels"]
        self.assertEqual(len(panels), len({panel["id"] for panel in panels}))
        cells = set()
        for panel in panels:
            place = panel["gridPos"]
            self.assertLessEqual(place["x"] + place["w"], 24)
            for x in range(place["x"], place["x"] + place["w"]):
                for y in range(place["y"], place["y"] + place["h"]):
                    self.assertNotIn((x, y), cells, panel["title"])
                    cells.add((x, y))


if __name__ == "__main__":
    support.run_tests()
