#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Holds the programs of a folder of dumped shaders to what drivers' compilers may make of them.

usage: check_programs.py COMPILE_PROGRAMS DUMPS CHIP [--write|--part]
       check_programs.py --glslang VALIDATOR DUMPS

The first form links all programs for a chip and compares, by the name of the shader with its
variant and by the most of all programs that have it, with program_limits.txt beside this file: size
(instructions on Intel, bytes of code on AMD) and spills (registers stored and fetched on Intel;
vector registers spilled on AMD). A variant is named by those defines that make programs heavy and
few scenes need, so that their limits leave the usual programs no room. A line of the table that no
program answers to is a fault, too, unless the folder holds a --part of the programs. --write puts
what was found, and a twentieth more of size, into the table.
The second form has the reference front end link them."""

import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
TABLE = HERE / "program_limits.txt"
ROOM = 1.05  # compilers of the same Mesa differ by the processor they run on, not by more
SKIPPED = 77

# iris: one message per width of SIMD that was compiled; radeonsi: one per shader
INTEL = re.compile(r"\b(\w+) SIMD\d+ shader: (\d+) inst\w*[,.].*? (\d+):(\d+) spills:fills")
AMD = re.compile(r"Code Size: (\d+) .*Spilled VGPRs: (\d+) .*\((\w+), ")
# glslang 12 takes arrays of a patch for arrays by vertex, and finds sizes that are alike to differ.
ALIKE = re.compile(r"ERROR: Linking [\w ]+: Array sizes must be compatible:\n"
                   r" +[\w ]+: (\".*\")\n +[\w ]+: \1\n")
# Of a define that begins a shader's text: the name that it gives to the variant.
VARIANTS = {"HAS_MEDIA": "media", "SHADOW_HAS_MEDIA": "media", "MEDIA": "media", "MEDIUM": "media",
            "CUT_PLANES": "cut", "HAS_PLANES": "cut", "SHADOW_FAITHFUL": "faithful",
            "SHADOW_HAS_NODES": "nodes", "KEYED": "keyed", "NET": "net", "SAMPLES_APART": "apart",
            "HAS_LOBES": "lobes", "HAS_GRIDS": "grids", "HAS_AREA_FORM": "areas",
            "HAS_AREA_SAMPLES": "areas", "HAS_ATMOSPHERE": "haze",
            "HAS_MORE_LOBES": "films", "HAS_ENVIRONMENT_MAP": "map",
            "TONE_HAS_CHOICE": "tones"}
# Likewise by how the value begins: shadows by moments, which are there for comparison.
VALUES = {"SHADOW_LISTS": "moments"}
STAGES = {"CS": "comp", "FS": "frag", "PS": "frag", "VS": "vert", "TCS": "tesc", "TES": "tese",
          "GS": "geom"}


def cost_of(message):
    """(stage, size, spills) of a driver's message, or None."""
    intel = INTEL.search(message)
    if intel:
        return STAGES.get(intel[1]), int(intel[2]), int(intel[3]) + int(intel[4])
    amd = AMD.search(message)
    return amd and (STAGES.get(amd[3]), int(amd[1]), int(amd[2]))


def variant_of(text):
    """"+cut+media", or "" of a usual one, by the defines before the text's first other line."""
    found = set()
    for line in text.splitlines():
        words = line.split()
        if words and not line.startswith("#"):
            break
        if len(words) == 3 and words[0] == "#define" and words[1] in VARIANTS:
            value = words[2] if words[1] == "NET" else ""
            found.add(VARIANTS[words[1]] + value)
        if len(words) == 3 and words[2].startswith(VALUES.get(words[1], "\n")):
            found.add(VALUES[words[1]])
    return "".join(f"+{name}" for name in sorted(found))


def name_in(dumps):
    """Names a file of the folder by its shader and variant."""
    return lambda name: name[17:] + variant_of((pathlib.Path(dumps) / name).read_text())


def costs_of(lines, name_of=lambda name: name[17:]):
    """{shader: [size, spills]}: the most of its programs, and the number of programs."""
    costs = collections.defaultdict(lambda: [0, 0])
    said = []
    count = 0
    for line in lines:
        kind, _, rest = line.rstrip("\n").partition("\t")
        if kind == "said":
            said.append(rest.split("\t", 1)[1])
        if kind in ("linked", "failed"):
            names = [name_of(name) for name in rest.split("\t") if name]
            count += 1
            for stage, size, spills in filter(None, map(cost_of, said)):
                for name in names:
                    if f".{stage}." in name:
                        costs[name] = [max(costs[name][0], size), max(costs[name][1], spills)]
            said = []
    return dict(costs), count


def read_table(text):
    """{(chip, shader): (size, spills)}"""
    rows = (line.split() for line in text.splitlines() if line and line[0] != "#")
    return {(chip, shader): (int(size), int(spills)) for chip, shader, size, spills in rows}


def write_table(table):
    head = [line for line in TABLE.read_text().splitlines() if line.startswith("#")]
    rows = [f"{chip:8}{shader:47}{size:>7}{spills:>7}"
            for (chip, shader), (size, spills) in sorted(table.items())]
    TABLE.write_text("\n".join(head + rows) + "\n")


def faults_of(chip, costs, table):
    """What is over its limit, or has none."""
    faults = []
    for shader, (size, spills) in sorted(costs.items()):
        if (chip, shader) not in table:
            faults.append(f"{chip} {shader}: {size}, {spills} spills: no line in {TABLE.name}")
            continue
        most, most_spills = table[chip, shader]
        if size > most:
            faults.append(f"{chip} {shader}: size {size}, limit {most}")
        if spills > most_spills:
            faults.append(f"{chip} {shader}: {spills} spills, limit {most_spills}")
    return faults


def absent_of(chip, costs, table):
    """Shaders that have a limit, while no program that has them was composed or told of."""
    return [f"{shader_chip} {shader}: has a limit, and no program was told of"
            for shader_chip, shader in sorted(table) if shader_chip == chip and shader not in costs]


def compile_for(chip, program, dumps):
    driver = ("amd-" if re.match(r"vega|navi|gfx|renoir|raven|polaris", chip) else "intel-") + chip
    # the thread that links compiles, so that messages come while it does
    environment = dict(os.environ, mesa_glthread="false", GALLIUM_THREAD="0",
                       MESA_SHADER_CACHE_DISABLE="true")
    return subprocess.run([str(HERE / "with"), driver, program, dumps], text=True, check=False,
                          capture_output=True, env=environment)


def check_chip(program, dumps, chip, option):
    done = compile_for(chip, program, dumps)
    if done.returncode == SKIPPED:
        print(done.stdout, end="")
        return SKIPPED
    costs, count = costs_of(done.stdout.splitlines(), name_in(dumps))
    table = read_table(TABLE.read_text())
    if option == "--write":
        table = {key: limit for key, limit in table.items() if key[0] != chip}
        table.update({(chip, shader): (int(size * ROOM), spills)
                      for shader, (size, spills) in costs.items()})
        write_table(table)
    faults = faults_of(chip, costs, table)
    if option != "--part":
        faults += absent_of(chip, costs, table)
    if done.returncode != 0:
        faults.append(f"{chip}: not every program links: {done.stderr[-1000:]}")
    if not costs:
        faults.append(f"{chip}: the driver said nothing of any program")
    print("\n".join([f"{chip}: {count} programs, {len(faults)} faults"] + faults))
    return 1 if faults else 0


def check_glslang(validator, dumps):
    programs = collections.defaultdict(list)
    for path in sorted(pathlib.Path(dumps).glob("*.glsl")):
        programs[path.name[:16]].append(path)
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        for key, paths in programs.items():
            stages = []  # the validator tells a stage by the end of its name
            for path in paths:
                stage = pathlib.Path(folder) / path.name.removesuffix(".glsl")
                stage.write_text(path.read_text())
                stages.append(str(stage))
            done = subprocess.run([validator, "-l", *stages], text=True, capture_output=True,
                                  check=False)
            text, alike = ALIKE.subn("", done.stdout)
            told = [line for line in text.splitlines() if "ERROR" in line][:3]
            if told or (done.returncode != 0 and not alike):
                faults.append(f"{key} {paths[-1].name[17:]}: {' '.join(told)}")
    print("\n".join([f"glslang: {len(programs)} programs, {len(faults)} faults"] + faults))
    return 1 if faults or not programs else 0


def main(arguments):
    if arguments[:1] == ["--glslang"] and len(arguments) == 3:
        return check_glslang(*arguments[1:])
    if len(arguments) in (3, 4) and arguments[3:] in ([], ["--write"], ["--part"]):
        return check_chip(*arguments[:3], "".join(arguments[3:]))
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
