# SPDX-License-Identifier: MIT
"""OpenEXR files of one part in scanlines, flat and deep, of channels of 32-bit floats, uncompressed
or by ZIP (OpenEXR File Layout; predictor and order of bytes are those of its ZIP compressor)."""
import struct
import zlib

LINES = {0: 1, 2: 1, 3: 16}  # of a block, by compression: none, ZIPS, ZIP
DEEP = 0x800  # of the version field


def unzip(data, size):
    if len(data) == size:
        return data
    plain = bytearray(zlib.decompress(data))
    for i in range(1, len(plain)):
        plain[i] = (plain[i - 1] + plain[i] - 128) & 255
    half = (len(plain) + 1) // 2
    result = bytearray(len(plain))
    result[0::2], result[1::2] = plain[:half], plain[half:]
    return bytes(result)


def text_at(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


class Exr:
    """attributes: their bytes by name. pixels: of flat files {channel: value}, of deep ones a list
    of such samples, row by row."""

    def __init__(self, data):
        magic, version = struct.unpack_from("<II", data)
        assert magic == 20000630, magic
        self.is_deep, self.attributes, at = bool(version & DEEP), {}, 8
        while data[at]:
            name, at = text_at(data, at)
            _, at = text_at(data, at)
            size, = struct.unpack_from("<I", data, at)
            self.attributes[name] = data[at + 4:at + 4 + size]
            at += 4 + size
        self.channels, place, table = [], 0, self.attributes["channels"]
        while table[place]:
            name, place = text_at(table, place)
            assert struct.unpack_from("<I", table, place) == (2,), name  # floats
            self.channels.append(name)
            place += 16
        window = struct.unpack("<4i", self.attributes["dataWindow"])
        self.width, self.height = window[2] - window[0] + 1, window[3] - window[1] + 1
        lines = LINES[self.attributes["compression"][0]]
        blocks = -(-self.height // lines)
        offsets = struct.unpack_from(f"<{blocks}Q", data, at + 1)
        read = self.deep_line if self.is_deep else self.flat_lines
        self.pixels = []
        for i, offset in enumerate(offsets):
            self.pixels += read(data, offset, min(lines, self.height - i * lines))

    def floats(self, data, count):
        values = struct.unpack(f"<{len(data) // 4}f", data)
        return {name: values[i * count:(i + 1) * count] for i, name in enumerate(self.channels)}

    def deep_line(self, data, at, _):
        table_bytes, sample_bytes, plain_bytes = struct.unpack_from("<3Q", data, at + 4)
        at += 28
        table = unzip(data[at:at + table_bytes], 4 * self.width)
        ends = struct.unpack(f"<{self.width}i", table)
        at += table_bytes
        values = self.floats(unzip(data[at:at + sample_bytes], plain_bytes), ends[-1])
        firsts = (0, *ends[:-1])
        return [[{name: values[name][i] for name in self.channels} for i in range(first, end)]
                for first, end in zip(firsts, ends)]

    def flat_lines(self, data, at, lines):
        size, = struct.unpack_from("<I", data, at + 4)
        row = 4 * self.width * len(self.channels)
        plain = unzip(data[at + 8:at + 8 + size], row * lines)
        found = []
        for y in range(lines):
            values = self.floats(plain[y * row:(y + 1) * row], self.width)
            found += [{name: values[name][x] for name in self.channels} for x in range(self.width)]
        return found


def flattened(samples):
    """What the samples of a deep pixel come to over one another, each channel by itself."""
    pixel = {"A": 0}
    for channel in "RGB":
        light, share = 0, 1
        for sample in samples:
            light += share * sample[channel]
            share *= 1 - sample["A" + channel]
        pixel[channel] = light
        pixel["A"] += (1 - share) / 3
    return pixel
