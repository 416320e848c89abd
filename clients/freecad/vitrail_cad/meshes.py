# SPDX-License-Identifier: MIT
"""Triangles of shapes and meshes, in the coordinates of the server, face by face."""
import array
import hashlib
import math

from . import space

ELEMENTARY = ("Part::GeomCylinder", "Part::GeomCone", "Part::GeomSphere", "Part::GeomToroid")


class Mesh:
    """Faces, each a list of corners: (positions, normals, indices); normals may be None."""

    def __init__(self, faces):
        self.faces = faces
        content = hashlib.sha256()
        for positions, normals, indices in faces:
            for part in (positions, normals, indices):
                content.update(part.tobytes() if part else b"-")
        self.digest = content.hexdigest()

    def triangle_count(self):
        return sum(len(indices) // 3 for _, _, indices in self.faces)


def of_shape(shape, deflection):
    """The mesh of a shape; deflection: how far triangles may be off, as a share of its diagonal."""
    box = shape.BoundBox
    tolerance = max(deflection * box.DiagonalLength, 1e-6)
    points, facets = shape.tessellate(tolerance)
    faces = shape.Faces
    own = [face.tessellate(tolerance) for face in faces]  # found, not made: the shape keeps them
    if sum(len(triangles) for _, triangles in own) != len(facets):
        return Mesh([_face(face, *one) for face, one in zip(faces, own)])
    # Of the whole shape, neighbouring faces have their corners in common, so that cuts have caps.
    built, first = [], 0
    for face, (_, triangles) in zip(faces, own):
        built.append(_face(face, points, facets[first:first + len(triangles)]))
        first += len(triangles)
    return Mesh(built)


def _face(face, points, facets):
    used = sorted({index for facet in facets for index in facet})
    place = {index: position for position, index in enumerate(used)}
    corners = [points[index] for index in used]
    facets = [[place[index] for index in facet] for facet in facets]
    normals = _normals(face, corners, facets)
    return (array.array("f", [value for corner in corners for value in space.point(*corner)]),
            array.array("f", [value for normal in normals for value in space.direction(*normal)]),
            array.array("I", [index for facet in facets for index in facet]))


def _of_facets(corners, facets):
    """Sums of the facets around each corner, weighted by their areas, and that of the first."""
    sums = [[0.0, 0.0, 0.0] for _ in corners]
    for a, b, c in facets:
        across = (corners[b] - corners[a]).cross(corners[c] - corners[a])
        for index in (a, b, c):
            for axis in range(3):
                sums[index][axis] += across[axis]
    return sums


def _unit(vector, fallback):
    length = math.sqrt(sum(value * value for value in vector))
    return [value / length for value in vector] if length > 1e-300 else fallback


def _normals(face, corners, facets):
    """Those of the surface; where it has none to ask for quickly, those of the triangles."""
    if not facets:
        return []
    flat = _of_facets(corners, facets)
    kind = getattr(face.Surface, "TypeId", "")
    ahead = [_unit(normal, (0.0, 0.0, 1.0)) for normal in flat]
    if kind == "Part::GeomPlane":
        whole = _unit([sum(normal[axis] for normal in flat) for axis in range(3)], ahead[0])
        return [whole] * len(corners)
    if kind not in ELEMENTARY:
        return ahead
    exact = []
    for corner, near in zip(corners, ahead):
        normal = face.normalAt(*face.Surface.parameter(corner))
        agrees = sum(a * b for a, b in zip(normal, near))
        # At the tip of a cone and the poles of a sphere the surface may have no normal.
        exact.append(tuple(normal) if agrees > 0.5 else
                     tuple(-value for value in normal) if agrees < -0.5 else near)
    return exact


def of_facets(points, facets):
    """Of a mesh that is one already: its own triangles, without normals."""
    return Mesh([(array.array("f", [value for one in points for value in space.point(*one)]), None,
                  array.array("I", [index for facet in facets for index in facet]))])
