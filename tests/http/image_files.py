# SPDX-License-Identifier: MIT
"""Writes and reads small images without a library: PNG of 8 bits, and OpenEXR of floats."""
import struct
import zlib


def png_chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png_bytes(width, height, pixels, bits=8):
    """pixels: bytes of 1 (grey), 2 (with alpha), 3 (RGB) or 4 (RGBA) channels, first row on top;
    of 16 bits each two, the greater first."""
    stride = len(pixels) // height
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[stride * 8 // (width * bits)]
    rows = b"".join(b"\0" + pixels[y * stride:(y + 1) * stride] for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", head) +
            png_chunk(b"IDAT", zlib.compress(rows)) + png_chunk(b"IEND", b""))


def unfilter(kind, row, above, step):
    """One row of PNG's filters 0 to 4 (PNG specification, section 9)."""
    for i, value in enumerate(row):
        left = row[i - step] if i >= step else 0
        corner = above[i - step] if i >= step else 0
        up = above[i]
        guess = 0
        if kind == 1:
            guess = left
        elif kind == 2:
            guess = up
        elif kind == 3:
            guess = (left + up) // 2
        elif kind == 4:
            near = min((abs(up - corner), 0, left), (abs(left - corner), 1, up),
                       (abs(left + up - 2 * corner), 2, corner))
            guess = near[2]
        row[i] = (value + guess) & 255
    return row


def read_png(data):
    """(width, height, channels, bytes) of an 8-bit PNG that is not interlaced."""
    place, body, head = 8, b"", None
    while place < len(data):
        size, kind = struct.unpack_from(">I4s", data, place)
        chunk = data[place + 8:place + 8 + size]
        head = chunk if kind == b"IHDR" else head
        body += chunk if kind == b"IDAT" else b""
        place += size + 12
    width, height, bits, kind, _, _, interlace = struct.unpack(">IIBBBBB", head)
    assert (bits, interlace) == (8, 0)
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[kind]
    raw, stride = zlib.decompress(body), width * channels
    above, pixels = bytearray(stride), bytearray()
    for y in range(height):
        start = y * (stride + 1)
        row = bytearray(raw[start + 1:start + 1 + stride])
        above = unfilter(raw[start], row, above, channels)
        pixels += above
    return width, height, channels, bytes(pixels)


def exr_attribute(name, kind, body):
    return name + b"\0" + kind + b"\0" + struct.pack("<I", len(body)) + body


def exr_bytes(width, height, channels):
    """channels: name -> width * height numbers; floats, one part, scan lines, no compression
    (OpenEXR File Layout)."""
    names = sorted(channels)
    table = b"".join(name.encode() + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in names)
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    head = struct.pack("<II", 20000630, 2)
    head += exr_attribute(b"channels", b"chlist", table + b"\0")
    head += exr_attribute(b"compression", b"compression", b"\0")
    head += exr_attribute(b"dataWindow", b"box2i", window)
    head += exr_attribute(b"displayWindow", b"box2i", window)
    head += exr_attribute(b"lineOrder", b"lineOrder", b"\0")
    head += exr_attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    head += exr_attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0))
    head += exr_attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    line_bytes = 4 * width * len(names)
    first = len(head) + 8 * height
    offsets = b"".join(struct.pack("<Q", first + y * (8 + line_bytes)) for y in range(height))
    lines = b""
    for y in range(height):
        lines += struct.pack("<ii", y, line_bytes)
        for name in names:
            lines += struct.pack(f"<{width}f", *channels[name][y * width:(y + 1) * width])
    return head + offsets + lines


def exr_color(width, height, pixel, alpha=False):
    """From a function of (x, y) that returns R, G, B (and A)."""
    names = "RGBA" if alpha else "RGB"
    values = [pixel(x, y) for y in range(height) for x in range(width)]
    return exr_bytes(width, height, {name: [value[i] for value in values]
                                     for i, name in enumerate(names)})
