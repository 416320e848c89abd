# SPDX-License-Identifier: MIT
"""Reads the colours of an OpenEXR file without a library, and how far two of them are apart."""
import math
import struct
import zlib

TYPES = {1: ("e", 2), 2: ("f", 4)}  # half, float
LINES = {0: 1, 2: 1, 3: 16}  # of a block: no compression, ZIPS, ZIP


def read_text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def read_head(data):
    """({name: value as bytes}, where the table of offsets begins)"""
    assert struct.unpack_from("<II", data) == (20000630, 2)  # one part, scan lines
    head, at = {}, 8
    while data[at]:
        name, at = read_text(data, at)
        _, at = read_text(data, at)
        size = struct.unpack_from("<I", data, at)[0]
        head[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return head, at + 1


def read_channels(table):
    """[(name, format, bytes)] in the order of the file."""
    channels, at = [], 0
    while table[at]:
        name, at = read_text(table, at)
        channels.append((name, *TYPES[struct.unpack_from("<i", table, at)[0]]))
        at += 16
    return channels


def inflate(block, size):
    """Undoes ZIP: deflate, differences of neighbours, and even bytes before odd ones (OpenEXR,
    "Technical Introduction")."""
    if len(block) == size:
        return block
    mixed = bytearray(zlib.decompress(block))
    for i in range(1, size):
        mixed[i] = (mixed[i - 1] + mixed[i] - 128) & 255
    half = (size + 1) // 2
    whole = bytearray(size)
    whole[0::2] = mixed[:half]
    whole[1::2] = mixed[half:]
    return bytes(whole)


def read_color(data):
    """[R, G, B, R, G, B, ...] of all pixels, first row on top."""
    head, at = read_head(data)
    left, top, right, bottom = struct.unpack("<iiii", head["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    compression = head["compression"][0]
    channels, lines = read_channels(head["channels"]), LINES[compression]
    row_bytes = sum(width * size for _, _, size in channels)
    pixels = [0.0] * (3 * width * height)
    for (place,) in struct.iter_unpack("<Q", data[at:at + 8 * -(-height // lines)]):
        first, stored = struct.unpack_from("<ii", data, place)
        rows = min(lines, bottom + 1 - first)
        block = data[place + 8:place + 8 + stored]
        raw, where = inflate(block, rows * row_bytes) if compression else block, 0
        for y in range(first - top, first - top + rows):
            for name, code, size in channels:
                if name in "RGB":
                    start = 3 * width * y + "RGB".index(name)
                    pixels[start:start + 3 * width:3] = struct.unpack_from(
                        f"<{width}{code}", raw, where)
                where += width * size
    return pixels


def rmse(image, reference):
    """Of colours cut to [0, 1], as `max_error` is defined (docs/reference/tradeoffs.md)."""
    def cut(value):
        return min(max(value, 0.0), 1.0)

    return math.sqrt(sum((cut(a) - cut(b)) ** 2 for a, b in zip(image, reference)) / len(image))
