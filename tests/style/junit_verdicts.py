# SPDX-License-Identifier: MIT
"""Prints what ctest says of each test: passed, skipped or failed, a tab, its name and why."""

import sys
import xml.etree.ElementTree

EXIT_CODE_SKIP = "SKIP_RETURN_CODE"


def reason(output):
    """The line of a skipped test that says why."""
    lines = [line.strip() for line in (output or "").splitlines() if line.strip()]
    telling = [line for line in lines if "skip" in line.lower()]
    return (telling or lines or ["no reason given"])[-1][:160]


def verdict(case):
    if case.get("status") == "run":
        return "passed", ""
    skip = case.find("skipped")
    if skip is not None and EXIT_CODE_SKIP in skip.get("message", ""):
        return "skipped", ": " + reason(case.findtext("system-out"))
    why = skip if skip is not None else case.find("failure")
    return "failed", "" if why is None else ": " + why.get("message", "")


for test in xml.etree.ElementTree.parse(sys.argv[1]).iter("testcase"):
    word, text = verdict(test)
    print(f"{word}\t{test.get('name')}{text}")
