# SPDX-License-Identifier: MIT
"""Builds the wheel for pip (PEP 517, PEP 427) with the standard library: no network is needed."""
import base64
import hashlib
import pathlib
import re
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
NAME = "vitrail"


def _project(member):
    """A text of the [project] table; tomllib is younger than Python 3.9."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    return re.search(rf'^{re.escape(member)} = "([^"]*)"$', text, re.MULTILINE)[1]


def _metadata():
    lines = ["Metadata-Version: 2.1", f"Name: {NAME}", f"Version: {_project('version')}",
             f"Summary: {_project('description')}",
             f"Requires-Python: {_project('requires-python')}", "License: MIT",
             "Description-Content-Type: text/markdown", ""]
    return "\n".join(lines) + "\n" + (ROOT / "README.md").read_text(encoding="utf-8")


def _files(version):
    """(name in the wheel, bytes) of everything but the record."""
    info = f"{NAME}-{version}.dist-info"
    for path in sorted((ROOT / NAME).iterdir()):
        if path.suffix == ".py" or path.name == "py.typed":
            yield f"{NAME}/{path.name}", path.read_bytes()
    yield f"{info}/METADATA", _metadata().encode()
    wheel = "Wheel-Version: 1.0\nGenerator: vitrail\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    yield f"{info}/WHEEL", wheel.encode()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    version = _project("version")
    name = f"{NAME}-{version}-py3-none-any.whl"
    record = []
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in _files(version):
            wheel.writestr(path, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=")
            record.append(f"{path},sha256={digest.decode()},{len(content)}\n")
        path = f"{NAME}-{version}.dist-info/RECORD"
        wheel.writestr(path, "".join(record) + f"{path},,\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("the sources are the repository")
