# SPDX-License-Identifier: MIT
"""The objects of a document as nodes: groups with what is in them, links as instances of a mesh.

To be called where FreeCAD may be asked: with a window, on the thread of the window.
"""
from . import looks, meshes, space

DEPTH = 64
UNSEEN = ("App::Origin", "App::OriginFeature", "App::LinkElement")
GROUPS = ("App::DocumentObjectGroup", "App::Part")


class Node:
    """One object at one place of the tree.

    key: the names of the objects on the way to it, which it keeps while the document lives.
    shown: whether it and all above it are visible. shape: with the placement taken out, or None.
    """

    def __init__(self, key, thing, matrix, visible, parent):
        self.key, self.label, self.parent = key, thing.Label, parent.key if parent else None
        self.matrix = matrix
        self.visible = visible
        self.shown = visible and (parent.shown if parent else True)
        self.thing = self.shape = self.looks = self.mesh = None


def _matrix(placement, scale=None):
    rows = placement.toMatrix()
    if scale is not None and tuple(scale) != (1.0, 1.0, 1.0):
        rows = rows.multiply(_scaling(scale))
    return space.matrix(rows.A)


def _scaling(scale):
    import FreeCAD  # only FreeCAD has its matrices
    made = FreeCAD.Matrix()
    made.A11, made.A22, made.A33 = scale
    return made


def _shape_of(thing):
    """What an object shows, without its placement: a shape with faces, a mesh, or None."""
    shape = getattr(thing, "Shape", None)
    if shape is not None and hasattr(shape, "Faces"):
        if shape.isNull() or not shape.Faces:
            return None
        return shape.transformed(thing.Placement.inverse().toMatrix())
    mesh = getattr(thing, "Mesh", None)
    if mesh is not None and getattr(mesh, "CountFacets", 0):
        mesh = mesh.copy()
        mesh.Placement = type(thing.Placement)()
        return mesh
    return None


class _Walk:
    def __init__(self):
        self.nodes = []

    def visit(self, thing, parent):
        if thing.TypeId in UNSEEN or (parent and len(parent.key) >= DEPTH):
            return
        if thing.isDerivedFrom("App::Link"):
            self.visit_link(thing, parent)
            return
        is_group = self.is_group(thing)
        shape = None if is_group else _shape_of(thing)
        if not is_group and shape is None:
            return
        placed = not thing.isDerivedFrom("App::DocumentObjectGroup")
        matrix = _matrix(thing.Placement) if placed else list(space.IDENTITY)
        node = self.add(thing, matrix, thing.Visibility, parent)
        self.fill(node, thing, shape, None)

    @staticmethod
    def is_group(thing):
        return any(thing.isDerivedFrom(kind) for kind in (*GROUPS, "App::LinkGroup"))

    def add(self, thing, matrix, visible, parent, name=None):
        key = (parent.key if parent else ()) + (name or thing.Name,)
        node = Node(key, thing, matrix, bool(visible), parent)
        self.nodes.append(node)
        return node

    def fill(self, node, thing, shape, cover):
        """What is in or on a node. cover: the looks that a link gives, or None."""
        node.thing = thing
        if self.is_group(thing):
            for child in self.members(thing):
                self.visit(child, node)
            return
        node.shape = shape
        if shape is not None:
            node.looks = cover or looks.of_object(thing, len(getattr(shape, "Faces", [0])))

    @staticmethod
    def members(group):
        return group.ElementList if group.isDerivedFrom("App::LinkGroup") else group.Group

    def visit_link(self, link, parent):
        target = self.target_of(link)
        if target is None or target is link or target.TypeId in UNSEEN:
            return
        shape = None if self.is_group(target) else _shape_of(target)
        if not self.is_group(target) and shape is None:
            return
        within = parent
        while within is not None:  # a group that holds a link to itself
            if within.thing is target:
                return
            within = self.named(within.parent)
        node = self.add(link, _matrix(link.Placement, link.ScaleVector), link.Visibility, parent)
        cover = looks.of_link(link)
        own = target.Placement if link.LinkTransform and hasattr(target, "Placement") else None
        if link.ElementCount:
            node.thing = link
            self.visit_elements(link, node, target, shape, cover, own)
            return
        if own is not None:
            node.matrix = _matrix(link.Placement.multiply(own), link.ScaleVector)
        self.fill(node, target, shape, cover)

    @staticmethod
    def target_of(link):
        """What a link shows at the end of a chain of links; of an array, what its elements show."""
        target = link.LinkedObject
        if isinstance(target, tuple):  # an object within another one
            target = target[0].getSubObject(target[1], retType=1)
        return target.getLinkedObject(True) if target is not None else None

    def visit_elements(self, link, node, target, shape, cover, own):
        """A link may be an array, whose elements have placements of their own."""
        placements, shown = list(link.PlacementList), list(link.VisibilityList)
        for index in range(link.ElementCount):
            placement = placements[index] if index < len(placements) else None
            placement = placement or type(link.Placement)()
            if own is not None:
                placement = placement.multiply(own)
            visible = shown[index] if index < len(shown) else True
            element = self.add(link, _matrix(placement), visible, node, f"#{index}")
            element.label = f"{link.Label} {index}"
            self.fill(element, target, shape, cover)

    def named(self, key):
        return next((node for node in self.nodes if node.key == key), None)


def _roots(document):
    held = {member.Name for thing in document.Objects if thing.isDerivedFrom("App::LinkGroup")
            for member in thing.ElementList}
    return [thing for thing in document.Objects if thing.Name not in held
            and thing.getParentGroup() is None and thing.getParentGeoFeatureGroup() is None]


def nodes_of(document):
    """Parents before their children; groups that have nothing to show are left out."""
    walk = _Walk()
    for thing in _roots(document):
        walk.visit(thing, None)
    needed = set()
    for node in reversed(walk.nodes):
        if node.shape is not None or node.key in needed:
            needed.update((node.key, node.parent))
    return [node for node in walk.nodes if node.key in needed]


class Meshes:
    """The meshes of objects, made once for all links to one and kept while its shape stands."""

    def __init__(self, deflection):
        self.deflection = deflection
        self.known = {}  # by document and object: shape and mesh

    def of(self, node):
        shape = node.shape
        if hasattr(shape, "CountFacets"):
            return meshes.of_facets(*shape.Topology)
        key = (node.thing.Document.Name, node.thing.Name)
        known = self.known.get(key)
        if known is None or not known[0].isPartner(shape):
            self.known[key] = known = (shape, meshes.of_shape(shape, self.deflection))
        return known[1]

    def forget_unused(self, nodes):
        used = {(node.thing.Document.Name, node.thing.Name) for node in nodes}
        self.known = {key: known for key, known in self.known.items() if key in used}
