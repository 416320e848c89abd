#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the series of the benchmarks: times against numbers, both logarithmic, with fitted lines.

    vitrail-bench scaling --json > S.json;  plot_scaling.py S.json [-o build/bench]

Writes scaling.html, one page without references to anything outside, and beside it each of its
figures as scaling-SCENE-SUBJECT.svg. A figure has the series of one subject of one scene, each with
its points, the least-squares line through them and its exponent, and says device, date and
protocol. Any other document of vitrail-bench that has series will do, too; "-" reads from standard
input."""
import argparse
import html
import json
import math
import os
import re
import sys

WIDTH, PLOT_HEIGHT, LEFT, RIGHT, TOP, ROW = 840, 340, 74, 24, 54, 20
# Told apart by marker and dash as well as by colour, on light and on dark. A sixth line has the
# first colour again with the second marker, and so on.
LIGHT = ("#0b62a8", "#b84a00", "#0a7a52", "#8a3a8f", "#6b5b00")
DARK = ("#6cb6ff", "#ff9d57", "#4fd1a1", "#e08ae6", "#e3cf5a")
MARKERS = ("circle", "square", "diamond", "triangle", "cross")
DASHES = ("none", "7 3", "2 3", "9 3 2 3", "12 4")


def colours(palette, paper, ink, faint, grid):
    rules = [f".paper{{fill:{paper}}}.ink{{fill:{ink}}}.faint{{fill:{faint}}}",
             f".grid{{stroke:{grid}}}.axis{{stroke:{faint}}}"]
    rules += [f".s{i}{{stroke:{c}}}.s{i} .mark{{fill:{c}}}" for i, c in enumerate(palette)]
    return "".join(rules)


STYLE = ("svg{font:13px system-ui,sans-serif}.title{font-size:16px;font-weight:600}"
         ".small{font-size:11px}.grid,.axis{stroke-width:1;fill:none}"
         ".fit{stroke-width:1.6;fill:none}.mark{stroke-width:1.5}" +
         colours(LIGHT, "#ffffff", "#1c1f23", "#5a6068", "#e3e6ea") +
         "@media(prefers-color-scheme:dark){" +
         colours(DARK, "#15181c", "#eceff3", "#a3abb5", "#333a42") + "}")


def escape(text):
    return html.escape(str(text), quote=True)


def number(value):
    """Three digits, as a person would write them."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def fit(points):
    """Exponent and factor of y = factor * x^exponent by least squares of the logarithms."""
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mean_x = sum(x for x, _ in logs) / len(logs)
    mean_y = sum(y for _, y in logs) / len(logs)
    spread = sum((x - mean_x) ** 2 for x, _ in logs)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in logs) / spread
    return slope, math.exp(mean_y - slope * mean_x)


def measured(series):
    """The points that noise has not swallowed."""
    return [(x, y) for x, y in series["points"] if y is not None]


def figures(document):
    """[(scene, subject, series of them)] in the order of the document, without empty figures."""
    groups = {}
    for one in document["series"]:
        groups.setdefault((one["scene"], one["subject"]), []).append(one)
    return [(scene, subject, group) for (scene, subject), group in groups.items()
            if any(measured(one) for one in group)]


def bound(document, series, tail=""):
    """What the program says of the exponent: " (≤ 1.05, met)", or nothing."""
    for check in document["checks"]:
        if (check["name"] == f"exponent of {series['name']}{tail}" and "target" in check and
                all(check[key] == series[key] for key in ("suite", "scene", "subject"))):
            relation, limit = check["target"].split()
            verdict = "met" if check["is_met"] else "missed"
            return f" ({'≤' if relation == '<=' else '≥'} {float(limit):.2f}, {verdict})"
    return ""


def verdicts(document, series):
    """The exponents in words."""
    told = []
    for key, tail, words in (("exponent", "", "exponent"),
                             ("exponent_last_half", ", last half", "last half")):
        if series.get(key) is not None:
            told.append(f"{words} {series[key]:.2f}{bound(document, series, tail)}")
    return ", ".join(told) or "too few points for an exponent"


def sources(document):
    machine = document["machine"]
    return (f"{machine['device']}, {machine['processor']}, {machine['cores']} cores; "
            f"load {machine['load_begin']:.1f} to {machine['load_end']:.1f}; {machine['date']}",
            f"medians of processor time; {machine['protocol']}")


class Axis:
    """Logarithms of values to pixels; a little room on both sides."""

    def __init__(self, values, begin, end):
        low, high = math.log10(min(values)), math.log10(max(values))
        room = max(0.06 * (high - low), 0.05)
        self.low, self.high, self.begin, self.end = low - room, high + room, begin, end

    def at(self, value):
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.begin + share * (self.end - self.begin)

    def ticks(self):
        """Powers of ten, or also twice and five times them where these are few."""
        decades = range(math.floor(self.low), math.ceil(self.high) + 1)
        steps = (1,) if self.high - self.low > 3 else (1, 2, 5)
        if self.high - self.low < 0.5:
            steps = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9)
        ticks = [s * 10.0 ** d for d in decades for s in steps]
        return [t for t in ticks if self.low <= math.log10(t) <= self.high]


def marker(kind, x, y, title):
    shapes = {
        "circle": f'<circle class="mark" cx="{x:.1f}" cy="{y:.1f}" r="4.5">',
        "square": f'<path class="mark" d="M{x - 4:.1f} {y - 4:.1f}h8v8h-8z">',
        "diamond": f'<path class="mark" d="M{x:.1f} {y - 5.8:.1f}l5.8 5.8-5.8 5.8-5.8-5.8z">',
        "triangle": f'<path class="mark" d="M{x:.1f} {y - 5.2:.1f}l5.4 9.4h-10.8z">',
        "cross": f'<path class="mark" d="M{x - 4.5:.1f} {y - 4.5:.1f}l9 9m0-9l-9 9">',
    }
    name = "circle" if kind == "circle" else "path"
    return f"{shapes[kind]}<title>{escape(title)}</title></{name}>"


def draw_axes(horizontal, vertical, group):
    bottom, parts, free = TOP + PLOT_HEIGHT, [], -math.inf
    for value in sorted({x for one in group for x, _ in measured(one)}):
        x = horizontal.at(value)
        parts.append(f'<path class="grid" d="M{x:.1f} {TOP}V{bottom}"/>')
        if x > free:  # labels of near numbers would lie over each other
            parts.append(f'<text class="ink" text-anchor="middle" x="{x:.1f}" y="{bottom + 18}">'
                         f"{value:,.0f}</text>")
            free = x + 46
    for value in vertical.ticks():
        y = vertical.at(value)
        parts.append(f'<path class="grid" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>'
                     f'<text class="ink" text-anchor="end" x="{LEFT - 8}" y="{y + 4:.1f}">'
                     f"{number(value)}</text>")
    parts.append(f'<path class="axis" d="M{LEFT} {TOP}V{bottom}H{WIDTH - RIGHT}"/>'
                 f'<text class="faint" text-anchor="middle" x="{(LEFT + WIDTH - RIGHT) / 2}" '
                 f'y="{bottom + 38}">{escape(group[0]["of"])}</text>'
                 f'<text class="faint" x="{LEFT - 46}" y="{TOP - 12}">'
                 f'{escape(group[0]["unit"])}</text>')
    return parts


def draw_series(document, row, one, horizontal, vertical, legend_y):
    points = measured(one)
    index = (row + row // len(LIGHT)) % len(MARKERS)
    parts = [f'<g class="series s{row % len(LIGHT)}" data-name="{escape(one["name"])}" '
             f'data-points="{len(points)}">']
    dash = f'stroke-dasharray="{DASHES[index]}"'
    if len(points) >= 2:
        slope, factor = fit(points)
        ends = [(x, factor * x ** slope) for x in (points[0][0], points[-1][0])]
        path = "L".join(f"{horizontal.at(x):.2f} {vertical.at(y):.2f}" for x, y in ends)
        parts.append(f'<path class="fit" {dash} data-exponent="{slope:.4f}" d="M{path}"/>')
    for x, y in points:
        parts.append(marker(MARKERS[index], horizontal.at(x), vertical.at(y),
                            f"{one['name']}: {number(x)} {one['of']}, {number(y)} {one['unit']}"))
    parts.append(f'<path class="fit" {dash} d="M{LEFT} {legend_y - 4}h34"/>')
    parts.append(marker(MARKERS[index], LEFT + 17, legend_y - 4, one["name"]) + "</g>")
    lost = len(one["points"]) - len(points)
    parts.append(f'<text class="ink" x="{LEFT + 44}" y="{legend_y}">{escape(one["name"])}: '
                 f"{escape(verdicts(document, one))}"
                 f"{f'; {lost} lost in noise' if lost else ''}</text>")
    return parts


def extent(group):
    """All times of the points and of the ends of the lines."""
    times = []
    for one in group:
        points = measured(one)
        times += [y for _, y in points]
        if len(points) >= 2:
            slope, factor = fit(points)
            times += [factor * x ** slope for x, _ in points]
    return times


def draw(document, scene, subject, group):
    legend = TOP + PLOT_HEIGHT + 66
    height = legend + ROW * len(group) + 44
    horizontal = Axis([x for one in group for x, _ in measured(one)], LEFT, WIDTH - RIGHT)
    vertical = Axis(extent(group), TOP + PLOT_HEIGHT, TOP)
    title = f"{scene}: {subject}"
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
             f'width="{WIDTH}" height="{height}" role="img" aria-label="{escape(title)}">'
             f"<style>{STYLE}</style>",
             f'<rect class="paper" width="{WIDTH}" height="{height}"/>'
             f'<text class="ink title" x="{LEFT}" y="24">{escape(title)}</text>']
    parts += draw_axes(horizontal, vertical, group)
    for row, one in enumerate(group):
        parts += draw_series(document, row, one, horizontal, vertical, legend + ROW * row)
    for row, text in enumerate(sources(document)):
        parts.append(f'<text class="faint small" x="{LEFT}" y="{height - 28 + 15 * row}">'
                     f"{escape(text)}</text>")
    return "\n".join(parts) + "\n</svg>\n"


def file_name(scene, subject):
    return "scaling-" + re.sub(r"[^a-z0-9]+", "-", f"{scene}-{subject}".lower()) + ".svg"


PAGE_STYLE = """:root{color-scheme:light dark}
body{font:15px/1.5 system-ui,sans-serif;max-width:52rem;margin:2rem auto;padding:0 1rem;
background:#fff;color:#1c1f23}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.5rem 0 2.5rem}
td,th{padding:.2rem .8rem .2rem 0;text-align:right;border-bottom:1px solid #e3e6ea}
td:first-child,th:first-child{text-align:left}
svg{max-width:100%;height:auto}
div{overflow-x:auto}
@media(prefers-color-scheme:dark){body{background:#15181c;color:#eceff3}
td,th{border-color:#333a42}}"""


def table(group):
    numbers = sorted({x for one in group for x, _ in one["points"]})
    rows = [f'<tr><th>{escape(group[0]["unit"])} at {escape(group[0]["of"])}</th>' +
            "".join(f"<th>{x:,.0f}</th>" for x in numbers) + "</tr>"]
    for one in group:
        times = {x: y for x, y in one["points"]}
        cells = (number(times[x]) if times.get(x) else "–" for x in numbers)
        rows.append(f"<tr><td>{escape(one['name'])}</td>" +
                    "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return "<div><table>" + "\n".join(rows) + "</table></div>"


def page(document, drawn):
    machine = "".join(f"<tr><td>{escape(key)}</td><td>{escape(value)}</td></tr>"
                      for key, value in document["machine"].items())
    body = [f"<section>{svg}{table(group)}</section>" for svg, group in drawn]
    return ("<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">"
            "<meta name=\"viewport\" content=\"width=device-width\">"
            f"<title>Vitrail: how times grow</title><style>{PAGE_STYLE}</style>"
            "<h1>How times grow</h1><p>Both axes are logarithmic: a power law is a straight line, "
            "and its slope is the exponent. The line is fitted to all points; the last half "
            "of them says what large numbers do. Medians of processor time.</p>"
            f"<div><table>{machine}</table></div>" + "\n".join(body) + "</html>\n")


def main():
    parser = argparse.ArgumentParser(description="draws the series of vitrail-bench scaling")
    parser.add_argument("document", help="what --json wrote, or - for standard input")
    parser.add_argument("-o", "--output", default=os.path.join("build", "bench"), metavar="FOLDER")
    wanted = parser.parse_args()
    try:
        with sys.stdin if wanted.document == "-" else open(wanted.document,
                                                           encoding="utf-8") as file:
            document = json.load(file)
        groups = figures(document)
    except (OSError, ValueError, KeyError, TypeError) as problem:
        sys.exit(f"plot_scaling.py: {wanted.document}: not a document of vitrail-bench: {problem}")
    if not groups:
        sys.exit(f"plot_scaling.py: {wanted.document}: no series: take those of the suite scaling")
    os.makedirs(wanted.output, exist_ok=True)
    drawn = []
    for scene, subject, group in groups:
        svg = draw(document, scene, subject, group)
        drawn.append((svg, group))
        with open(os.path.join(wanted.output, file_name(scene, subject)), "w",
                  encoding="utf-8") as file:
            file.write(svg)
    path = os.path.join(wanted.output, "scaling.html")
    with open(path, "w", encoding="utf-8") as file:
        file.write(page(document, drawn))
    print(path)


if __name__ == "__main__":
    main()
