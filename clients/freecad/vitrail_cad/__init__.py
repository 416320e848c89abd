# SPDX-License-Identifier: MIT
"""Documents of FreeCAD on a server of Vitrail: what is sent once, and what is patched after that.

space     coordinates: FreeCAD's millimetres with Z up, the server's metres with Y up
meshes    triangles of shapes, by FreeCAD's own tessellation, with normals of their surfaces
looks     colours and transparency of objects, and the materials that are made of them
tree      the objects of a document as nodes, with links as instances of one mesh
glb_file  nodes, meshes and materials as a binary glTF
session   one document on one server: sent once, then edited
dock      the picture in a dock of FreeCAD; the only module that needs its window

The client of the server is the package vitrail: that of this source tree where there is one, else
the one that is installed.
"""
import os
import sys

_CLIENT = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "python")
if os.path.isdir(os.path.join(_CLIENT, "vitrail")):
    sys.path.insert(0, os.path.normpath(_CLIENT))
