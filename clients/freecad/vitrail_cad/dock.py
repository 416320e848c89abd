# SPDX-License-Identifier: MIT
"""The picture in a dock of FreeCAD: follows the document, the camera and a section plane."""
import os

import FreeCAD
import FreeCADGui
from PySide import QtCore, QtGui

import vitrail

from . import session, space, worker

SYNC_MS, CAMERA_MS = 300, 80
PARAMETERS = "User parameter:BaseApp/Preferences/Mod/Vitrail"
BACKGROUND = [0.02, 0.02, 0.025]
LIGHTS = {  # name: members of the view
    "Studio": {"environment": {"image": "studio"}, "lights": None},
    "Studio and sun": {"environment": {"image": "studio", "intensity": 0.5}, "lights": [
        {"type": "directional", "direction": [-0.5, -1, -0.7], "intensity": 4}]},
    "Default": {"environment": None, "lights": None},
}
PLANES = {"No section": None, "Across X": (1, 0, 0), "Across Y": (0, 1, 0), "Across Z": (0, 0, 1),
          "Selected face or plane": "selection"}


def vector(x, y, z):
    return FreeCAD.Vector(x, y, z)


def plane_of(selected):
    """(point, normal) of a selected plane face, datum plane or section plane; None of others."""
    for item in selected:
        for face in item.SubObjects:
            if getattr(getattr(face, "Surface", None), "TypeId", "") == "Part::GeomPlane":
                return face.CenterOfMass, face.normalAt(0, 0).negative()
        if item.Object.isDerivedFrom("PartDesign::Plane") or "SectionPlane" in item.Object.Name:
            placement = item.Object.Placement
            return placement.Base, placement.Rotation.multVec(vector(0, 0, -1))
    return None


def extent_along(document, normal):
    """Least and greatest coordinate along a normal of what is visible."""
    low, high = [], []
    for thing in document.Objects:
        box = getattr(getattr(thing, "Shape", None), "BoundBox", None)
        if box is None or not box.isValid() or not thing.Visibility:
            continue
        along = [vector(*corner).dot(normal) for corner in (
            (x, y, z) for x in (box.XMin, box.XMax) for y in (box.YMin, box.YMax)
            for z in (box.ZMin, box.ZMax))]
        low.append(min(along))
        high.append(max(along))
    return (min(low), max(high)) if low else (0.0, 1.0)


class Picture(QtGui.QLabel):
    """Shows the newest frame, fitted into its place; a click asks what is there."""

    clicked = QtCore.Signal(float, float)
    resized = QtCore.Signal()

    def __init__(self):
        super().__init__()
        self.setAlignment(QtCore.Qt.AlignCenter)
        self.setMinimumSize(160, 120)
        self.setStyleSheet("background: #202226")
        self.image = None

    def show_bytes(self, content):
        image = QtGui.QImage.fromData(content)
        if not image.isNull():
            self.image = image
            self.fit()

    def fit(self):
        if self.image is not None:
            self.setPixmap(QtGui.QPixmap.fromImage(self.image).scaled(
                self.size(), QtCore.Qt.KeepAspectRatio, QtCore.Qt.SmoothTransformation))

    def resizeEvent(self, event):
        super().resizeEvent(event)
        self.fit()
        self.resized.emit()

    def mousePressEvent(self, event):
        shown = self.pixmap()
        if shown is None or shown.isNull():
            return
        x = (event.pos().x() - (self.width() - shown.width()) / 2) / shown.width()
        y = (event.pos().y() - (self.height() - shown.height()) / 2) / shown.height()
        if 0 <= x < 1 and 0 <= y < 1:
            self.clicked.emit(x, y)


class Observer:
    """Of documents and of their view providers: both call slotChangedObject."""

    def __init__(self, changed, closed):
        self.changed, self.closed = changed, closed

    def slotChangedObject(self, _thing, _name):
        self.changed()

    slotCreatedObject = slotDeletedObject = lambda self, _thing: self.changed()
    slotActivateDocument = slotRecomputedDocument = lambda self, _document: self.changed()

    def slotDeletedDocument(self, document):
        self.closed(document)


class Dock(QtGui.QDockWidget):
    told = QtCore.Signal(str, object)  # from threads of the worker to that of the window

    def __init__(self, parent):
        super().__init__("Vitrail", parent)
        self.setObjectName("VitrailDock")
        self.session = self.document = None
        self.camera_text = self.worker = None
        self.build()
        self.told.connect(self.heard)
        self.dirty, self.sync_timer = False, self.timer(SYNC_MS, self.sync)
        self.camera_timer = self.timer(CAMERA_MS, self.follow)
        self.observer = Observer(self.touch, self.closed)
        FreeCAD.addDocumentObserver(self.observer)
        FreeCADGui.addDocumentObserver(self.observer)

    def timer(self, interval_ms, call):
        made = QtCore.QTimer(self)
        made.timeout.connect(call)
        made.setInterval(interval_ms)
        return made

    # ---- widgets ----

    def build(self):
        self.url = QtGui.QLineEdit(FreeCAD.ParamGet(PARAMETERS).GetString(
            "Url", os.environ.get("VITRAIL_URL", "http://127.0.0.1:8090")))
        self.button = QtGui.QPushButton("Send")
        self.button.clicked.connect(self.start)
        self.url.returnPressed.connect(self.start)
        self.light = self.choice(LIGHTS, self.relight)
        self.glass = self.check("Transparent is glass", True, self.start)
        self.orbit = self.check("Follow camera", True, self.follow)
        self.plane = self.choice(PLANES, self.section_chosen)
        self.offset = QtGui.QSlider(QtCore.Qt.Horizontal)
        self.offset.setRange(0, 1000)
        self.offset.setValue(500)
        self.offset.valueChanged.connect(self.section)
        self.flip = self.check("Flip", False, self.section)
        self.picture = Picture()
        self.picture.clicked.connect(self.pick)
        self.picture.resized.connect(self.resize_view)
        self.status = QtGui.QLabel("Send the document to see it lit.")
        self.status.setWordWrap(True)
        inside = QtGui.QWidget()
        rows = QtGui.QVBoxLayout(inside)
        rows.setContentsMargins(4, 4, 4, 4)
        for widgets in ((self.url, self.button), (self.light, self.glass, self.orbit),
                        (self.plane, self.offset, self.flip)):
            row = QtGui.QHBoxLayout()
            for widget in widgets:
                row.addWidget(widget)
            rows.addLayout(row)
        rows.addWidget(self.picture, 1)
        rows.addWidget(self.status)
        self.setWidget(inside)

    @staticmethod
    def choice(names, call):
        made = QtGui.QComboBox()
        made.addItems(list(names))
        made.currentIndexChanged.connect(lambda _index: call())
        return made

    @staticmethod
    def check(text, is_on, call):
        made = QtGui.QCheckBox(text)
        made.setChecked(is_on)
        made.stateChanged.connect(lambda _state: call())
        return made

    def say(self, text, is_problem=False):
        self.status.setText(text)
        self.status.setStyleSheet("color: #d03030" if is_problem else "")

    # ---- the document ----

    def start(self):
        """Sends the active document; what is edited from then on goes as patches."""
        self.stop()
        self.document = FreeCAD.ActiveDocument
        if self.document is None:
            self.say("No document is open.", True)
            return
        FreeCAD.ParamGet(PARAMETERS).SetString("Url", self.url.text())
        try:
            client = vitrail.Client(self.url.text().strip(), timeout_s=60)
        except ValueError as problem:
            self.say(str(problem), True)
            return
        self.session = session.Session(client, glass=self.glass.isChecked(), **self.size_members(),
                                       background=BACKGROUND, **LIGHTS[self.light.currentText()])
        self.worker = worker.Worker(self.told.emit)
        self.camera_text, self.dirty = None, True
        self.say("Sending ...")
        self.section()
        self.sync()
        self.sync_timer.start()
        self.camera_timer.start()

    def stop(self):
        self.sync_timer.stop()
        self.camera_timer.stop()
        if self.worker is not None:
            self.worker.end()
        if self.session is not None and self.session.view is not None:
            self.session.close()
        self.session = self.worker = self.document = None

    def touch(self):
        self.dirty = True

    def closed(self, document):
        if self.session is not None and document == self.document:
            self.stop()
            self.picture.clear()
            self.picture.image = None
            self.say("The document was closed.")

    def sync(self):
        """Once the last edit is with the server, and nothing is recomputed."""
        if not self.dirty or self.session is None or not self.worker.is_idle():
            return
        self.dirty = False
        current = self.session
        try:
            edit = current.prepare(self.document)
        except session.EmptyDocument as problem:
            self.say(str(problem), True)
            return
        if not edit.is_empty():
            self.worker.do("sync", lambda: self.apply(current, edit))

    def apply(self, current, edit):
        """On a thread of the worker."""
        current.apply(edit)
        if edit.whole is not None:
            self.told.emit("view", current.view)
        self.told.emit("sent", f"{edit.bytes() / 1024:.0f} KiB of geometry sent")

    def heard(self, kind, value):
        if self.session is None:
            return
        if kind == "frame":
            self.picture.show_bytes(value.data)
            if value.exact:
                self.say(f"Revision {value.revision}, in full quality.")
        elif kind == "view":
            self.worker.watch(value)
        elif kind == "sent":
            self.say(value)
        elif kind == "picked":
            FreeCADGui.Selection.clearSelection()
            if value is not None:
                below = "".join(name.lstrip("#") + "." for name in value[1:])
                FreeCADGui.Selection.addSelection(self.document.Name, value[0], below)
        elif kind == "problem":
            self.sync_timer.stop()
            self.camera_timer.stop()
            self.worker.watch(None)
            self.say(f"{value} Press Send to try again.", True)

    # ---- how it is looked at ----

    def show(self, **members):
        if self.session is not None:
            current = self.session
            self.worker.do("+".join(members), lambda: current.show(**members))

    def size_members(self):
        size = self.picture.size()
        return {"width": max(size.width(), 16), "height": max(size.height(), 16)}

    def resize_view(self):
        self.show(**self.size_members())

    def relight(self):
        self.show(**LIGHTS[self.light.currentText()])

    def follow(self):
        if self.session is None or not self.orbit.isChecked():
            return
        shown = FreeCADGui.getDocument(self.document.Name).activeView()
        if shown is None or not hasattr(shown, "getCamera"):
            return
        text = shown.getCamera()
        if text != self.camera_text:
            self.camera_text = text
            width, height = shown.getSize()
            self.show(camera=space.camera(text, width / max(height, 1)))

    def section_chosen(self):
        self.chosen = None
        if PLANES[self.plane.currentText()] == "selection":
            self.chosen = plane_of(FreeCADGui.Selection.getSelectionEx())
            if self.chosen is None:
                self.say("Select a plane face or a datum plane first.", True)
        self.section()

    chosen = None

    def section(self):
        """The slider moves the plane along its normal through all that is visible."""
        if self.session is None:
            return
        kind = PLANES[self.plane.currentText()]
        base, normal = self.chosen or (vector(0, 0, 0), kind)
        if kind is None or normal == "selection":
            self.show(clip_planes=None)
            return
        normal = vector(*normal)
        low, high = extent_along(self.document, normal)
        share = self.offset.value() / 1000
        if self.chosen:  # about the plane that was selected
            base = base + normal * ((share - 0.5) * (high - low))
        else:
            base = normal * (low + share * (high - low))
        if self.flip.isChecked():
            normal = normal.negative()
        self.show(clip_planes=[space.clip_plane(base, normal)])

    # ---- what is under a point ----

    def pick(self, x, y):
        if self.session is None or self.session.view is None:
            return
        current, look = self.session, self.session.look
        self.worker.do("pick", lambda: self.picked(current, current.view.pick(
            x * look["width"], y * look["height"])))

    def picked(self, current, hit):
        """On a thread of the worker."""
        self.told.emit("picked", current.key_of(hit["node"]) if hit else None)

    def closeEvent(self, event):
        self.stop()
        super().closeEvent(event)


def show():
    """The one dock of the window, made when it is first asked for."""
    window = FreeCADGui.getMainWindow()
    found = window.findChild(QtGui.QDockWidget, "VitrailDock")
    if found is None:
        found = Dock(window)
        window.addDockWidget(QtCore.Qt.RightDockWidgetArea, found)
    found.show()
    return found
