# SPDX-License-Identifier: MIT
"""Scenes of smoke from arrays of numbers, without any library."""
import json
import struct
import sys
from array import array
from typing import Any, Dict, Iterable, Iterator, Mapping, Optional, Sequence, Tuple

_GLB_MAGIC, _JSON_CHUNK, _BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT = 5126


def _shape_of(values: Any) -> Tuple[int, ...]:
    """Of an array of numpy or of its like, or of lists in lists."""
    shape = getattr(values, "shape", None)
    if shape is not None:
        return tuple(int(count) for count in shape)
    counts = []
    while hasattr(values, "__len__") and not isinstance(values, (str, bytes)):
        counts.append(len(values))
        if not counts[-1]:
            break
        values = values[0]
    return tuple(counts)


def _numbers(values: Any, shape: Sequence[int]) -> Iterator[float]:
    if len(values) != shape[0]:
        raise ValueError(f"rows of {shape[0]} and of {len(values)} numbers in one array")
    for value in values:
        if len(shape) == 1:
            yield float(value)
        else:
            yield from _numbers(value, shape[1:])


def _floats(values: Any, shape: Sequence[int]) -> bytes:
    """Single precision, little-endian, the last index the fastest."""
    if hasattr(values, "astype"):  # numpy: no loop over numbers
        return bytes(values.astype("<f4").tobytes(order="C"))
    found = array("f", _numbers(values, shape))
    if sys.byteorder == "big":
        found.byteswap()
    return found.tobytes()


def density_grid(values: Any, low: Iterable[float], high: Iterable[float],
                 *, name: str = "smoke", density: float = 1.0,
                 color: Optional[Sequence[float]] = None,
                 extinction: Optional[Sequence[float]] = None,
                 anisotropy: float = 0.0) -> bytes:
    """The bytes of a .glb that shows one density grid, for post_scene or for a part.

    values: densities at the centres of voxels as values[z][y][x]: an array of numpy or of its
    like, or lists in lists; low, high: the corners of the box [m]; density: the extinction of a
    value of 1 [1/m]; color: the share that scatters, extinction: what each channel takes,
    per channel; anisotropy: of Henyey and Greenstein's phase function. ValueError: values have no
    three dimensions, or rows of several lengths."""
    shape = _shape_of(values)
    if len(shape) != 3 or 0 in shape:
        raise ValueError(f"a density grid has three dimensions, not the shape {shape}")
    blob = _floats(values, shape)
    count = shape[0] * shape[1] * shape[2]
    grid: Dict[str, Any] = {"name": name, "size": list(reversed(shape)), "values": 0,
                            "min": list(low), "max": list(high), "density": density,
                            "anisotropy": anisotropy}
    grid.update({key: list(given) for key, given in (("color", color), ("extinction", extinction))
                 if given is not None})
    return _glb({
        "asset": {"version": "2.0"}, "extensionsUsed": ["VITRAIL_density_grids"],
        "extensions": {"VITRAIL_density_grids": {"grids": [grid]}},
        "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "extensions": {"VITRAIL_density_grids": {"grid": 0}}}],
        "accessors": [{"bufferView": 0, "componentType": _FLOAT, "type": "SCALAR",
                       "count": count}],
        "bufferViews": [{"buffer": 0, "byteLength": len(blob)}],
        "buffers": [{"byteLength": len(blob)}]}, blob)


def _glb(document: Mapping[str, Any], blob: bytes) -> bytes:
    text = json.dumps(document, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join((struct.pack("<III", _GLB_MAGIC, 2, 28 + len(text) + len(blob)),
                     struct.pack("<II", len(text), _JSON_CHUNK), text,
                     struct.pack("<II", len(blob), _BINARY_CHUNK), blob))
