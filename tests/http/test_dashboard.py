# SPDX-License-Identifier: MIT
"""The Grafana dashboard asks for metrics and labels that the daemon has; Prometheus answers."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
import urllib.parse

import support
from support import triangle

support.needs(support.FAKE)
DASHBOARD = os.path.join(os.path.dirname(os.path.abspath(__file__)),
                         "../../packaging/grafana/vitrail.json")
NAME = re.compile(r"\b(?:vitrail|process)_[a-z_]+")
GROUPED = re.compile(r"by \(([a-z, ]+)\)")
LEGEND = re.compile(r"{{(\w+)}}")
VARIABLE = re.compile(r"\$\{?(\w+)")
PROMETHEUS, PROMTOOL = shutil.which("prometheus"), shutil.which("promtool")


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

    def test_it_has_what_grafana_asks_for(self):
        """Of a file that is imported: docs/sources/dashboards/build-dashboards/view-dashboard-json-
        model of Grafana. Variables that are used are there, or Grafana's own."""
        with open(DASHBOARD, encoding="utf-8") as file:
            text = file.read()
        dashboard = json.loads(text)
        self.assertNotIn("id", dashboard)  # Grafana gives it
        self.assertTrue(dashboard["title"])
        self.assertRegex(dashboard["uid"], r"^[\w-]{1,40}$")
        self.assertTrue(36 <= dashboard["schemaVersion"] <= 42, "data sources are objects")
        self.assertEqual({"from", "to"}, set(dashboard["time"]))
        self.assertIsInstance(dashboard["annotations"]["list"], list)
        variables = dashboard["templating"]["list"]
        for variable in variables:
            self.assertIn(variable["type"], ("datasource", "query"))
            self.assertTrue(variable["query"])
        known = {variable["name"] for variable in variables} | {"__all", "__rate_interval"}
        self.assertEqual(set(), set(VARIABLE.findall(text)) - known)
        for panel in dashboard["panels"]:
            self.assertIn(panel["type"], ("stat", "timeseries"), panel["title"])
            self.assertEqual({"x", "y", "w", "h"}, set(panel["gridPos"]))
            self.assertEqual({"type": "prometheus", "uid": "${datasource}"}, panel["datasource"])
            self.assertEqual({"defaults", "overrides"}, set(panel["fieldConfig"]))
            ids = [target["refId"] for target in panel["targets"]]
            self.assertEqual(sorted(set(ids)), sorted(ids), panel["title"])

    @unittest.skipUnless(PROMTOOL, "promtool is not installed")
    def test_promtool_finds_no_fault_in_the_metrics(self):
        self.metrics()
        said = subprocess.run([PROMTOOL, "check", "metrics"], check=False, capture_output=True,
                              input=self.daemon.raw("GET", "/metrics").body, timeout=60)
        self.assertEqual((0, b"", b""), (said.returncode, said.stdout, said.stderr))

    def start_prometheus(self):
        """A Prometheus that asks the daemon every second; its port."""
        folder = tempfile.TemporaryDirectory(prefix="vitrail-prometheus-")
        self.addCleanup(folder.cleanup)
        configuration = os.path.join(folder.name, "prometheus.json")  # JSON is YAML
        with open(configuration, "w", encoding="utf-8") as file:
            json.dump({"global": {"scrape_interval": "1s"},
                       "scrape_configs": [{"job_name": "vitrail", "static_configs": [
                           {"targets": [f"127.0.0.1:{self.daemon.port}"]}]}]}, file)
        port = support.free_ports(1)[0]
        with open(os.path.join(folder.name, "log"), "wb") as log:
            prometheus = subprocess.Popen(
                [PROMETHEUS, f"--config.file={configuration}",
                 f"--storage.tsdb.path={folder.name}/data",
                 f"--web.listen-address=127.0.0.1:{port}"], stdout=log, stderr=log)
        self.addCleanup(prometheus.wait)
        self.addCleanup(prometheus.kill)
        return port

    @staticmethod
    def query(port, expression):
        """The samples that Prometheus answers, or None while it does not serve."""
        connection = support.http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        try:
            connection.request("GET", "/api/v1/query?" +
                               urllib.parse.urlencode({"query": expression}))
            reply = json.loads(connection.getresponse().read())
        except (OSError, ValueError):
            return None
        finally:
            connection.close()
        if reply["status"] != "success":
            raise AssertionError((expression, reply))
        return reply["data"]["result"]

    @unittest.skipUnless(PROMETHEUS, "prometheus is not installed")
    def test_prometheus_answers_every_query(self):
        self.metrics()  # some of everything, before the first samples and between them
        port = self.start_prometheus()
        support.wait_until(lambda: self.query(port, "count_over_time(vitrail_build_info[1m]) > 3"),
                           "Prometheus has asked for the metrics more than three times")
        self.metrics()
        with open(DASHBOARD, encoding="utf-8") as file:
            panels = json.load(file)["panels"]
        for panel in panels:
            for target in panel["targets"]:
                expression = target["expr"].replace("$instance", ".*").replace(
                    "$__rate_interval", "1m")
                self.assertNotIn("$", expression)
                with self.subTest(panel=panel["title"], query=expression):
                    self.assertTrue(self.query(port, expression), "no sample")


if __name__ == "__main__":
    support.run_tests()
