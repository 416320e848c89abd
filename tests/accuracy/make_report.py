# SPDX-License-Identifier: MIT
"""Makes accuracy/report.html and accuracy/report.json of a build folder from the results.jsonl
beside them: technique by scene, error and time, pictures and differences, pass or fail.

usage: make_report.py BUILD_DIR [SOURCE_DIR]

Ends with 0 when the report was made, whatever it says: a failing result has already failed the test
that logged it. Ends with 1 when there is no log or a line of it cannot be read; what can be read is
reported all the same."""

import base64
import collections
import datetime
import html
import json
import math
import pathlib
import platform
import subprocess
import sys

FIELDS = {"suite": str, "scene": str, "technique": str, "metric": str, "pass": bool}
NUMBERS = ("error", "tolerance", "ms")
PICTURE_BYTES_MAX = 2 << 20
EMBEDDED_BYTES_MAX = 48 << 20  # of all pictures; the others are linked, they lie beside the report


# ---- reading ----

def fault_of(result):
    """Why a line's object is no result, or None."""
    if not isinstance(result, dict):
        return "is no object"
    for name, kind in FIELDS.items():
        if not isinstance(result.get(name), kind):
            return f"has no {name}"
    for name in NUMBERS:
        value = result.get(name)
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
            return f"{name} is no number"
    return None


def read_log(path):
    """(results, faults); a fault names its line."""
    results, faults = [], []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if not line.strip():
            continue
        try:
            result = json.loads(line)
            fault = fault_of(result)
        except ValueError as error:
            result, fault = None, f"is no JSON: {error}"
        if fault:
            faults.append(f"{path.name}:{number}: {fault}")
        else:
            results.append(result)
    return results, faults


def commit_of(source):
    done = subprocess.run(["git", "-C", str(source), "describe", "--always", "--dirty"],
                          capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def processor():
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.machine()


def device_of(build):
    path = build / "accuracy" / "device.txt"
    return path.read_text(encoding="utf-8").strip() if path.exists() else ""


# ---- numbers for people ----

def short(value):
    if value is None:
        return "not finite"
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.3g}"
    mantissa, _, exponent = f"{value:.1e}".partition("e")
    return f"{mantissa}e{int(exponent)}"


def milliseconds(value):
    if not value:
        return ""
    return f"{value:.0f} ms" if value >= 10 else f"{value:.1f} ms"


def badness(result):
    """Orders results of one cell: failures first, then by their share of the tolerance."""
    error, tolerance = result.get("error"), result.get("tolerance")
    share = math.inf if error is None else error / tolerance if tolerance else error
    return not result["pass"], share


# ---- pages ----

STYLE = """
:root { color-scheme: light dark; --ground: #fbfbfa; --text: #1d1f23; --faint: #6a7078;
  --line: #d9dce0; --card: #ffffff; --good: #e3f3e6; --good-text: #1d6b35; --bad: #fde2df;
  --bad-text: #a1251b; --bar: #8db89a; --bar-bad: #d9685c; }
@media (prefers-color-scheme: dark) { :root { --ground: #16181b; --text: #e6e7e9; --faint: #9aa1a9;
  --line: #33383e; --card: #1e2125; --good: #1b3324; --good-text: #8fd6a4; --bad: #43201d;
  --bad-text: #ff9d92; --bar: #4f8a62; --bar-bad: #b9483d; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem; max-width: 90rem; background: var(--ground);
  color: var(--text); font: 15px/1.45 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
.facts { color: var(--faint); margin: 0 0 1rem; }
.verdict { display: inline-block; padding: .5rem 1rem; border-radius: .5rem; font-weight: 600; }
.scroll { overflow-x: auto; border: 1px solid var(--line); border-radius: .5rem; }
table { border-collapse: collapse; background: var(--card); min-width: 100%; }
th, td { padding: .35rem .6rem; text-align: left; vertical-align: top; white-space: nowrap;
  border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; }
tr:last-child > * { border-bottom: 0; }
thead th { font-size: .85rem; color: var(--faint); font-weight: 600; }
tbody th { position: sticky; left: 0; background: var(--card); font-weight: 500;
  white-space: normal; min-width: 14rem; }
.next th span { visibility: hidden; } tbody tr:not(.next) > * { border-top: 2px solid var(--line); }
tbody th small, td small { display: block; color: var(--faint); font-weight: 400; }
.pass { background: var(--good); color: var(--good-text); }
.fail { background: var(--bad); color: var(--bad-text); font-weight: 600; }
.bar { height: 3px; margin-top: 3px; background: var(--line); }
.bar i { display: block; height: 3px; background: var(--bar); }
.fail .bar i { background: var(--bar-bad); }
.gallery { display: flex; flex-wrap: wrap; gap: .8rem; margin: .4rem 0 1.2rem; }
figure { margin: 0; padding: .4rem; background: var(--card); border: 1px solid var(--line);
  border-radius: .4rem; }
figure.fail { border: 2px solid var(--bar-bad); }
figure img { display: inline-block; width: 160px; height: auto; image-rendering: pixelated;
  vertical-align: top; }
figure img:hover { width: 480px; }
figcaption { font-size: .8rem; max-width: 322px; margin-top: .25rem; }
h3 { font-size: .95rem; margin: .9rem 0 .2rem; }
"""


class Pictures:
    """PNG files below the build folder as data: addresses, as long as there is room."""

    def __init__(self, build):
        self.build, self.used = build.resolve(), 0

    def tag(self, name, what):
        path = (self.build / name).resolve()
        text = html.escape(what, quote=True)
        if not path.is_relative_to(self.build) or not path.is_file():
            return f"<span>no picture: {html.escape(name)}</span>"
        size = path.stat().st_size
        if size > PICTURE_BYTES_MAX or self.used + size > EMBEDDED_BYTES_MAX:
            beside = pathlib.PurePosixPath("..", path.relative_to(self.build).as_posix())
            return f'<img loading="lazy" alt="{text}" src="{html.escape(str(beside), quote=True)}">'
        self.used += size
        data = base64.b64encode(path.read_bytes()).decode()
        return f'<img alt="{text}" title="{text}" src="data:image/png;base64,{data}">'


def cell_html(results):
    if not results:
        return "<td></td>"
    worst = max(results, key=badness)
    error, tolerance = worst.get("error"), worst.get("tolerance")
    kind = "pass" if worst["pass"] else "fail"
    share = 1 if error is None else min(error / tolerance, 1) if tolerance else float(error > 0)
    count = f"worst of {len(results)}, " if len(results) > 1 else ""
    times = [r["ms"] for r in results if r.get("ms")]
    ms = milliseconds(sum(times) / len(times)) if times else ""
    word = "" if worst["pass"] else "FAIL "
    return (f'<td class="{kind}">{word}{short(error)}'
            f'<small>{count}limit {short(tolerance)}</small><small>{ms}</small>'
            f'<div class="bar"><i style="width:{100 * share:.0f}%"></i></div></td>')


def matrix_html(results):
    """Rows are scene and metric, columns techniques, in the order of the log."""
    techniques = list(dict.fromkeys(r["technique"] for r in results))
    rows = collections.defaultdict(lambda: collections.defaultdict(list))
    for result in results:
        rows[result["scene"], result["metric"]][result["technique"]].append(result)
    head = "".join(f"<th>{html.escape(name)}</th>" for name in techniques)
    body = ""
    last = None
    for (scene, metric), cells in rows.items():
        kind = ' class="next"' if scene == last else ""
        body += (f"<tr{kind}><th><span>{html.escape(scene)}</span>"
                 f"<small>{html.escape(metric)}</small></th>" +
                 "".join(cell_html(cells[name]) for name in techniques) + "</tr>\n")
        last = scene
    return (f'<div class="scroll"><table><thead><tr><th>scene and metric</th>{head}</tr></thead>'
            f"<tbody>\n{body}</tbody></table></div>\n")


def figure_html(result, pictures):
    tags = ""
    for name, what in (("image", "image"), ("difference", "difference")):
        if result.get(name):
            tags += pictures.tag(result[name], f"{result['scene']}, {result['technique']}: {what}")
    kind = "" if result["pass"] else ' class="fail"'
    word = "" if result["pass"] else "FAIL: "
    return (f"<figure{kind}>{tags}<figcaption>{word}{html.escape(result['technique'])}: "
            f"{html.escape(result['metric'])} {short(result.get('error'))} "
            f"{milliseconds(result.get('ms'))}</figcaption></figure>\n")


def gallery_html(results, pictures):
    scenes = collections.defaultdict(dict)
    for result in results:
        if result.get("image") or result.get("difference"):
            key = result.get("image"), result.get("difference")
            scenes[result["scene"]].setdefault(key, result)
            if not result["pass"]:
                scenes[result["scene"]][key] = result
    text = ""
    for scene, shown in scenes.items():
        text += f"<h3>{html.escape(scene)}</h3>\n<div class=\"gallery\">\n"
        text += "".join(figure_html(result, pictures) for result in shown.values()) + "</div>\n"
    return text


def failures_html(results, faults):
    items = [f"{r['suite']}: {r['scene']}, {r['technique']}: {r['metric']} "
             f"{short(r.get('error'))}, limit {short(r.get('tolerance'))}"
             for r in results if not r["pass"]] + faults
    if not items:
        return ""
    lines = "".join(f'<li class="fail">{html.escape(item)}</li>' for item in items)
    return f"<ul>{lines}</ul>"


def page_html(report, pictures):
    results = report["results"]
    failed, total = report["failed"], len(results)
    is_good = not failed and not report["faults"] and total > 0
    told = f"{total - failed} of {total} results within their tolerance"
    if failed:
        told = f"{failed} of {total} results out of tolerance"
    if not total:
        told += "; nothing was logged"
    elif report["faults"]:
        told += f"; {len(report['faults'])} lines cannot be read"
    facts = " · ".join(html.escape(fact) for fact in
                       (report["device"], report["processor"], report["date"],
                        f"commit {report['commit']}" if report["commit"] else "") if fact)
    sections = ""
    for suite in dict.fromkeys(r["suite"] for r in results):
        own = [r for r in results if r["suite"] == suite]
        sections += (f"<h2>{html.escape(suite)}</h2>\n" + matrix_html(own) +
                     gallery_html(own, pictures))
    return (f"<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
            f"<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
            f"<title>Vitrail: accuracy</title><style>{STYLE}</style></head><body>\n"
            f"<h1>Accuracy of every technique</h1>\n<p class=\"facts\">{facts}</p>\n"
            f"<p class=\"verdict {'pass' if is_good else 'fail'}\">{html.escape(told)}</p>\n"
            f"{failures_html(results, report['faults'])}\n{sections}"
            f"<p class=\"facts\">Each cell: the largest error, its limit, the time of a frame, and "
            f"how much of the limit is used. What the metrics mean is in "
            f"docs/reference/accuracy.md. "
            f"Difference pictures: black is none, pale yellow the most.</p></body></html>\n")


def make_report(build, source):
    """The report as the object that report.json holds."""
    log = build / "accuracy" / "results.jsonl"
    results, faults = read_log(log) if log.exists() else ([], [f"{log.name} is not there"])
    return {"format": 1, "device": device_of(build), "processor": processor(),
            "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
            "commit": commit_of(source), "passed": sum(r["pass"] for r in results),
            "failed": sum(not r["pass"] for r in results), "faults": faults, "results": results}


def main():
    if len(sys.argv) not in (2, 3):
        print(__doc__, file=sys.stderr)
        return 2
    build = pathlib.Path(sys.argv[1])
    source = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).parents[2])
    folder = build / "accuracy"
    folder.mkdir(parents=True, exist_ok=True)
    report = make_report(build, source)
    page = page_html(report, Pictures(build))
    (folder / "report.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    (folder / "report.html").write_text(page, encoding="utf-8")
    print(f"{folder / 'report.html'}: {report['passed']} passed, {report['failed']} failed")
    for fault in report["faults"]:
        print(f"make_report: {fault}", file=sys.stderr)
    return 1 if report["faults"] or not report["results"] else 0


if __name__ == "__main__":
    sys.exit(main())
