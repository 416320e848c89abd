# SPDX-License-Identifier: MIT
"""Coordinates: FreeCAD has millimetres and Z up, the server metres and Y up; both right-handed.

A point (x, y, z) of FreeCAD is (x, z, -y) / 1000 here: the front view of FreeCAD, which looks along
+Y, is that of the server, which looks along -Z.
"""
import math
import re

METRES = 0.001  # of one unit of FreeCAD
IDENTITY = [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0]


def direction(x, y, z):
    return (x, z, -y)


def point(x, y, z):
    return (METRES * x, METRES * z, -METRES * y)


def matrix(rows):
    """16 numbers column by column, as the server wants them, of FreeCAD's 16 row by row."""
    # C M C^-1, where C takes FreeCAD's axes to the server's; row i of C has its one in column AXIS.
    axis, sign = (0, 2, 1), (1, 1, -1)
    columns = []
    for column in range(3):
        columns += [sign[row] * sign[column] * rows[4 * axis[row] + axis[column]]
                    for row in range(3)] + [0.0]
    columns += [METRES * sign[row] * rows[4 * axis[row] + 3] for row in range(3)] + [1.0]
    return [value + 0.0 for value in columns]  # no -0.0


def clip_plane(base, normal, cap=True):
    """A member of clip_planes: what is on the side of the normal stays. Vectors of FreeCAD."""
    length = math.sqrt(sum(value * value for value in normal))
    if length == 0:
        raise ValueError("the normal of a section plane is zero")
    a, b, c = direction(*(value / length for value in normal))
    x, y, z = point(*base)
    return {"plane": [a, b, c, -(a * x + b * y + c * z)], "cap": cap}


def _rotation(x, y, z, angle):
    """Rows of the rotation about an axis (Rodrigues)."""
    length = math.sqrt(x * x + y * y + z * z) or 1.0
    x, y, z, s, c = x / length, y / length, z / length, math.sin(angle), math.cos(angle)
    d = 1 - c
    return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s],
            [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d]]


def camera(text, aspect=1.0):
    """The camera of the server for one of FreeCAD's 3D views, whose getCamera() is the text.

    aspect: width by height of that view. Open Inventor widens what an upright window shows."""
    found = {name: [float(value) for value in values.split()] for name, values in re.findall(
        r"^\s*(position|orientation|height|heightAngle)\s+([-+.\deE ]+)$", text, re.M)}
    if "position" not in found or "orientation" not in found:
        raise ValueError("this is no camera of Open Inventor")
    rows = _rotation(*found["orientation"])
    columns = []
    for column in range(3):
        columns += [*direction(*(rows[row][column] for row in range(3))), 0.0]
    members = {"matrix": [value + 0.0 for value in (*columns, *point(*found["position"]), 1.0)]}
    widened = max(1.0, 1.0 / aspect)
    if "height" in found:
        members["ortho_height"] = METRES * found["height"][0] * widened
    else:
        angle = found.get("heightAngle", [math.pi / 4])[0]
        members["fov_y_deg"] = math.degrees(2 * math.atan(math.tan(angle / 2) * widened))
    return members
