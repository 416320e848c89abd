# SPDX-License-Identifier: MIT
"""One document on one server: sent once, then edited by patches of a view.

prepare() asks FreeCAD and belongs on the thread of its window; apply() speaks with the server and
may run on another one, one call at a time. sync() is both.
"""
import itertools

import vitrail

from . import glb_file, looks, tree

DEFLECTION = 0.0005  # of a shape's diagonal: a circle has some sixty corners
PART_SCENES = 16  # LIMIT_PART_SCENES of the server


class EmptyDocument(ValueError):
    """There is nothing to show: no visible object has faces."""


class Sent:
    """What the server has of a node. address: of the node; part: the part that it is the top of."""

    def __init__(self, node, address, materials, part=None):
        self.address, self.materials, self.part = address, materials, part
        self.label = node.label
        self.matrix, self.visible, self.parent = node.matrix, node.visible, node.parent
        self.digest = node.mesh.digest if node.mesh else None
        self.looks = node.looks if node.mesh else None


class Edit:
    """What is to be done. whole: a scene that starts a new view; parts: scenes by their parts."""

    def __init__(self):
        self.whole, self.parts, self.patch, self.name = None, {}, {}, None

    def is_empty(self):
        return self.whole is None and not self.patch

    def bytes(self):
        return len(self.whole or b"") + sum(map(len, self.parts.values()))

    def node(self, address, **members):
        self._of("nodes", address).update(members)

    def material(self, address, members):
        self._of("materials", address).update(members)

    def _of(self, kind, address):
        return self.patch.setdefault("overrides", {}).setdefault(kind, {}).setdefault(address, {})

    def part(self, name, members):
        self.patch.setdefault("parts", {})[name] = members


class Session:
    """look: members of the view beside the scene: camera, clip_planes, environment, ..."""

    def __init__(self, client, *, glass=True, deflection=DEFLECTION, **look):
        self.client, self.glass = client, glass
        self.meshes = tree.Meshes(deflection)
        self.look = {"width": 640, "height": 480, "exposure_ev": "auto",
                     "camera": {"fit": "three-quarter"}, **look}
        self.view = None
        self._forget()

    def _forget(self):
        self.sent, self.colors = {}, {}  # by key; looks by the addresses of materials
        self.uses = {}  # parts by the scene that they show
        self.numbers = itertools.count(1)

    # ---- what FreeCAD has ----

    def prepare(self, document):
        """The edit that brings the server to the state of the document."""
        nodes = tree.nodes_of(document)
        for node in nodes:
            if node.shape is not None and node.shown:
                node.mesh = self.meshes.of(node)
        self.meshes.forget_unused(nodes)
        if self.view is None or not self.sent:
            return self._whole(document, nodes)
        edit = self._difference({node.key: node for node in nodes})
        return edit if edit is not None else self._whole(document, nodes)

    def _whole(self, document, nodes):
        shown = [node for node in nodes if node.shown]
        if not any(node.mesh for node in shown):
            raise EmptyDocument("the document has nothing to show: no visible object has faces")
        self._forget()
        edit = Edit()
        edit.whole, edit.name = self._scene(shown, ""), document.Label
        return edit

    def _scene(self, nodes, prefix, part=None):
        """A file of nodes, whose addresses begin with the prefix; they become known as sent."""
        writer, indices = glb_file.Writer(self.glass), {}
        for node in nodes:
            index, materials = writer.add(node, indices.get(node.parent))
            is_top = node.parent not in indices
            indices[node.key] = index
            self.sent[node.key] = Sent(node, f"{prefix}#{index}",
                                       [f"{prefix}#{one}" for one in materials],
                                       part if is_top else None)
            if node.mesh is not None:
                self.colors.update(zip(self.sent[node.key].materials, looks.kinds(node.looks)))
        return writer.bytes()

    # ---- what is different ----

    def _difference(self, nodes):
        """None where the document is better sent anew."""
        edit, tops, wanted = Edit(), [], {}
        for key, sent in self.sent.items():
            if key not in nodes:
                self._hide(edit, sent)
        for node in nodes.values():
            sent = self.sent.get(node.key)
            is_new = (sent is None or (node.shape is None) != (sent.digest is None)
                      or (node.mesh and not self._recolor(node, sent, wanted)))
            if not is_new:
                self._move(edit, node, sent)
            elif node.shown and not any(node.key[:len(top.key)] == top.key for top in tops):
                tops.append(node)
        for address, look in wanted.items():
            if self.colors[address] != look:
                edit.material(address, looks.override(look, self.glass))
                self.colors[address] = look
        for top in tops:
            self._put(edit, top, nodes)
        scenes = [parts for parts in self.uses.values() if parts]
        return edit if len(scenes) <= PART_SCENES else None

    @staticmethod
    def _hide(edit, sent):
        if sent.visible:
            edit.node(sent.address, visible=False)
            sent.visible = False

    @staticmethod
    def _move(edit, node, sent):
        if node.matrix != sent.matrix:
            edit.node(sent.address, matrix=node.matrix)
        if node.visible != sent.visible:
            edit.node(sent.address, visible=node.visible)
        sent.matrix, sent.visible = node.matrix, node.visible

    @staticmethod
    def _recolor(node, sent, wanted):
        """Notes which materials are to look how. False where the node must be sent again: it has
        another shape, or looks that its materials, which others may have as well, cannot show."""
        if node.mesh.digest != sent.digest:
            return False
        became = looks.recolored(sent.looks, node.looks)
        if became is None or any(wanted.get(address, look) != look
                                 for address, look in zip(sent.materials, became)):
            return False
        wanted.update(zip(sent.materials, became))
        return True

    def _put(self, edit, top, nodes):
        """A subtree that is new, or has a new shape, as a part of its parent."""
        old = self.sent.get(top.key)
        if old is not None:
            self._take_out(edit, old)
        name = f"part-{next(self.numbers):04d}"
        below = [node for key, node in nodes.items()
                 if key[:len(top.key)] == top.key and node.shown]
        content = self._scene(below, f"{name}/", part=name)
        parent = self.sent[top.parent].address if top.parent else None
        edit.part(name, {"scene": vitrail.scene_id(content), "parent": parent})
        edit.parts[name] = content
        self.uses.setdefault(vitrail.scene_id(content), set()).add(name)

    def _take_out(self, edit, old):
        if old.part is None:
            edit.node(old.address, visible=False)
            return
        edit.part(old.part, None)
        for parts in self.uses.values():
            parts.discard(old.part)

    # ---- what the server is told ----

    def sync(self, document):
        """Brings the server to the state of the document; answers the edit that did it."""
        edit = self.prepare(document)
        try:
            self.apply(edit)
        except vitrail.VitrailError as problem:
            if problem.status != 404:
                raise
            edit = self.prepare(document)  # the view or its scene expired: all anew
            self.apply(edit)
        return edit

    def apply(self, edit):
        """After an error the document counts as not sent."""
        try:
            if edit.whole is not None:
                self._start(edit)
            elif edit.patch:
                for name, content in edit.parts.items():
                    self._bring(content, name)
                self.view.patch(edit.patch)
        except vitrail.VitrailError:
            self.view = None
            self._forget()
            raise

    def _bring(self, content, name):
        scene = vitrail.scene_id(content)
        if not self.client.has_scene(scene):
            self.client.post_scene(content, name=name)
        return scene

    def _start(self, edit):
        self.close()
        scene = self._bring(edit.whole, edit.name)
        self.view = self.client.create_view(scene, **self.look)

    def show(self, **members):
        """Members of the view beside the scene; None takes one back to its default."""
        for name, value in members.items():
            if value is None:
                self.look.pop(name, None)
            else:
                self.look[name] = value
        if self.view is not None:
            self.view.patch(members)

    def key_of(self, node):
        """The names of the objects that lead to a node of a pick, or None."""
        part, _, label = node["name"].partition("/")
        for key, sent in self.sent.items():
            if sent.address == f"#{node['index']}" and "/" not in node["name"]:
                return key
            if sent.address.startswith(part + "/") and sent.label == label:
                return key
        return None

    def close(self):
        """Deletes the view; harmless when it is gone."""
        view, self.view = self.view, None
        if view is not None:
            try:
                view.delete()
            except vitrail.VitrailError:
                pass  # nobody is there, or it expired
