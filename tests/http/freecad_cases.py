# SPDX-License-Identifier: MIT
"""Cases of the workbench for FreeCAD. Run by freecadcmd, which has Python's FreeCAD and Part:

    VITRAIL_URL=http://127.0.0.1:8090 freecadcmd tests/http/freecad_cases.py

Pictures are left in the folder VITRAIL_PICTURES.
"""
import math
import os
import socket
import sys
import traceback
import unittest

import FreeCAD
import Part

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "../../clients/freecad"), HERE]

from vitrail_cad import looks, session, space
import vitrail
import image_files

V = FreeCAD.Vector
COLOR = "(0.1, 0.5, 0.9, 1.0)"


class CountingClient(vitrail.Client):
    """Counts the bytes of bodies that it sends, scenes apart."""

    def __init__(self, url=None):
        super().__init__(url)
        self.scene_bytes = self.patch_bytes = 0
        inner = self.connection.request

        def request(method, path, body=None, headers=None):
            if path.startswith("/v1/scenes"):
                self.scene_bytes += len(body or b"")
            else:
                self.patch_bytes += len(body or b"")
            return inner(method, path, body, headers)

        self.connection.request = request


def material_object(document, name, color, transparency):
    made = document.addObject("App::MaterialObjectPython", name)
    made.Material = {"DiffuseColor": color, "Transparency": str(transparency)}
    return made


def give(thing, material):
    thing.addProperty("App::PropertyLink", "Material")
    thing.Material = material


def lamp(document):
    """A base, a glass cylinder on it, and an assembly of a bolt with three links to it."""
    base = document.addObject("Part::Box", "Base")
    base.Length, base.Width, base.Height = 200, 120, 20
    glass = document.addObject("Part::Cylinder", "Glass")
    glass.Label, glass.Radius, glass.Height = "Glass tube", 30, 100
    glass.Placement.Base = V(100, 60, 20)
    give(glass, material_object(document, "Blue", COLOR, 70))
    assembly = document.addObject("App::Part", "Bolts")
    assembly.Placement.Base = V(0, 0, 20)
    bolt = document.addObject("Part::Cylinder", "Bolt")
    bolt.Radius, bolt.Height = 6, 15
    bolt.Placement.Base = V(15, 15, 0)
    give(bolt, material_object(document, "Red", "(0.8, 0.1, 0.1, 1.0)", 0))
    assembly.addObject(bolt)
    for number, (x, y) in enumerate(((185, 15), (15, 105), (185, 105)), 2):
        link = document.addObject("App::Link", f"Bolt{number}")
        link.LinkedObject, link.Label = bolt, f"Bolt {number}"
        link.Placement.Base = V(x, y, 0)
        assembly.addObject(link)
    document.recompute()
    return document


def pixels_of(image):
    return image_files.read_png(image.data)


def differing(one, other):
    """The share of pixels that differ by more than four of 255 in a channel."""
    width, height, channels, first = pixels_of(one)
    second = pixels_of(other)[3]
    count = sum(any(abs(first[i + c] - second[i + c]) > 4 for c in range(channels))
                for i in range(0, len(first), channels))
    return count / (width * height)


class Case(unittest.TestCase):
    def setUp(self):
        self.document = FreeCAD.newDocument("Lamp")
        self.addCleanup(lambda: FreeCAD.closeDocument(self.document.Name))
        self.client = CountingClient()
        self.session = session.Session(self.client, width=320, height=240)
        self.addCleanup(self.session.close)

    def send(self):
        self.session.sync(lamp(self.document))
        return self.client.scene(self.session.view.scene)

    def keep(self, name):
        image = self.session.view.image()
        image.save(os.path.join(os.environ.get("VITRAIL_PICTURES", "/tmp"), name + ".png"))
        return image

    def edit(self):
        """Syncs; answers the image and the edit. Scenes of parts that were sent are counted."""
        self.document.recompute()
        edit = self.session.sync(self.document)
        return self.session.view.image(), edit


class Sending(Case):
    def test_names_materials_and_bounds_arrive_in_metres_with_y_up(self):
        summary = self.send()
        outline = self.client.outline(summary["id"])
        names = [node["name"] for node in outline["nodes"]]
        self.assertEqual(["Base", "Glass tube", "Bolts", "Bolt", "Bolt 2", "Bolt 3", "Bolt 4"],
                         names)
        self.assertEqual([2] * 4, [node["parent"] for node in outline["nodes"][3:]])
        self.assertEqual({"Base", "Glass tube", "Bolt"},
                         {material["name"] for material in outline["materials"]})
        for wanted, told in zip(((0, 0, -0.12), (0.2, 0.12, 0)),
                                (summary["bounds"]["min"], summary["bounds"]["max"])):
            for a, b in zip(wanted, told):
                self.assertAlmostEqual(a, b, delta=1e-6)
        glass = next(one for one in outline["materials"] if one["name"] == "Glass tube")
        self.assertAlmostEqual(0.7, glass["transmission"], delta=1e-6)
        self.assertAlmostEqual(0.2140411, glass["base_color"][1], delta=1e-5)  # 0.5 of sRGB
        self.assertEqual("Lamp", summary["name"])
        self.keep("sent")

    def test_links_share_one_mesh(self):
        self.send()
        four = self.client.scene_bytes
        self.session.close()
        self.client.scene_bytes = 0
        for number in (3, 4):
            self.document.removeObject(f"Bolt{number}")
        self.edit()
        self.assertLess(four - self.client.scene_bytes, 500)  # two nodes of JSON, no geometry

    def test_the_tessellation_keeps_its_deflection_and_normals_are_those_of_surfaces(self):
        lamp(self.document)
        mesh = self.session.meshes
        from vitrail_cad import tree
        node = next(node for node in tree.nodes_of(self.document) if node.label == "Glass tube")
        found = mesh.of(node)
        self.assertEqual(3, len(found.faces))
        diagonal = node.shape.BoundBox.DiagonalLength
        side = max(found.faces, key=lambda face: len(face[2]))
        points, normals, indices = side
        for a, b in zip(indices[0::3], indices[1::3]):
            middle = [(points[3 * a + i] + points[3 * b + i]) / 2 / space.METRES for i in (0, 2)]
            self.assertLess(30 - math.hypot(*middle), session.DEFLECTION * diagonal * 1.01)
        for first in range(0, len(points), 3):
            outward = [points[first] / 0.03, 0, points[first + 2] / 0.03]
            for a, b in zip(outward, normals[first:first + 3]):
                self.assertAlmostEqual(a, b, delta=1e-5)

    def test_what_cannot_be_sent_is_told(self):
        with self.assertRaisesRegex(session.EmptyDocument, "no visible object has faces"):
            self.session.sync(self.document)
        lamp(self.document)
        for thing in self.document.Objects:
            thing.Visibility = False
        with self.assertRaises(session.EmptyDocument):
            self.session.sync(self.document)
        with socket.socket() as reserved:
            reserved.bind(("127.0.0.1", 0))
            url = f"http://127.0.0.1:{reserved.getsockname()[1]}"
            away = session.Session(vitrail.Client(url, timeout_s=5))
            self.document.Base.Visibility = True
            with self.assertRaises(vitrail.VitrailError) as caught:
                away.sync(self.document)
        self.assertEqual("no_reply", caught.exception.code)

    def test_a_view_that_expired_is_made_anew(self):
        self.send()
        first = self.session.view.id
        self.session.view.delete()
        self.document.Glass.Placement.Base = V(100, 60, 40)
        self.edit()
        self.assertNotEqual(first, self.session.view.id)


class Edits(Case):
    def test_a_moved_object_is_a_patch_without_an_upload(self):
        self.send()
        before = self.session.view.image()
        uploaded, self.client.patch_bytes = self.client.scene_bytes, 0
        self.document.Glass.Placement = FreeCAD.Placement(
            V(50, 60, 60), FreeCAD.Rotation(V(0, 1, 0), 30))
        after, edit = self.edit()
        self.keep("moved")
        self.assertEqual(uploaded, self.client.scene_bytes)
        self.assertLess(self.client.patch_bytes, 600)
        self.assertEqual(["#1"], list(edit.patch["overrides"]["nodes"]))
        self.assertGreater(differing(before, after), 0.02)
        self.assertTrue(self.session.prepare(self.document).is_empty())
        self.document.Glass.Placement = FreeCAD.Placement(V(100, 60, 20), FreeCAD.Rotation())
        self.assertEqual(before.data, self.edit()[0].data)

    def test_the_edited_scene_is_that_which_would_be_sent(self):
        self.send()
        self.document.Glass.Placement.Base = V(60, 50, 20)
        self.document.Bolts.Placement.Base = V(0, 0, 30)
        self.document.Bolt3.Visibility = False
        self.document.Blue.Material = {"DiffuseColor": "(0.9, 0.7, 0.1, 1)", "Transparency": "40"}
        self.document.Base.Height = 25  # another shape
        edited, edit = self.edit()
        self.assertEqual(1, len(edit.parts))
        self.keep("edited")
        self.session.close()
        sent, edit = self.edit()
        self.keep("edited-sent-anew")
        self.assertIsNotNone(edit.whole)
        self.assertLess(differing(edited, sent), 0.002)

    def test_new_shapes_come_as_parts_and_go_again(self):
        self.send()
        before = self.session.view.image()
        uploaded = self.client.scene_bytes
        ball = self.document.addObject("Part::Sphere", "Ball")
        ball.Radius, ball.Placement.Base = 25, V(40, 40, 45)
        self.document.Bolts.addObject(ball)
        with_ball, edit = self.edit()
        self.keep("part")
        self.assertLess(len(edit.parts["part-0001"]), self.client.scene_bytes - uploaded + 1)
        self.assertEqual("#2", edit.patch["parts"]["part-0001"]["parent"])
        self.assertGreater(differing(before, with_ball), 0.01)
        self.assertTrue(self.session.prepare(self.document).is_empty())
        ball.Placement.Base = V(60, 40, 45)
        edit = self.edit()[1]
        self.assertEqual(["part-0001/#0"], list(edit.patch["overrides"]["nodes"]))
        ball.Radius = 15
        edit = self.edit()[1]
        self.assertEqual((None, ["part-0002"]),
                         (edit.patch["parts"]["part-0001"], list(edit.parts)))
        self.document.removeObject("Ball")
        self.assertEqual(before.data, self.edit()[0].data)

    def test_many_new_shapes_send_the_document_anew(self):
        self.send()
        for number in range(session.PART_SCENES + 1):
            box = self.document.addObject("Part::Box", "Box")
            box.Length = 5 + number
        edit = self.edit()[1]
        self.assertIsNotNone(edit.whole)
        self.assertEqual(7 + session.PART_SCENES + 1, len(self.session.sent))

    def test_hidden_objects_are_sent_when_they_are_shown(self):
        lamp(self.document).Glass.Visibility = False
        self.session.sync(self.document)
        self.assertNotIn(("Glass",), self.session.sent)
        self.document.Glass.Visibility = True
        edit = self.edit()[1]
        self.assertEqual(1, len(edit.parts))
        self.document.Glass.Visibility = False
        edit = self.edit()[1]
        self.assertEqual({"overrides": {"nodes": {"part-0001/#0": {"visible": False}}}}, edit.patch)

    def test_arrays_of_links_move_element_by_element(self):
        self.send()
        link = self.document.Bolt2
        link.ElementCount = 3
        link.ShowElement = False
        link.PlacementList = [FreeCAD.Placement(V(0, 20 * i, 0), FreeCAD.Rotation())
                              for i in range(3)]
        self.edit()
        self.assertIn(("Bolts", "Bolt2", "#2"), self.session.sent)
        placements = link.PlacementList
        placements[2] = FreeCAD.Placement(V(0, 60, 0), FreeCAD.Rotation())
        link.PlacementList = placements
        edit = self.edit()[1]
        (members,) = edit.patch["overrides"]["nodes"].values()
        self.assertAlmostEqual(-0.06, members["matrix"][14])


class Looking(Case):
    def test_a_section_opens_closed_shapes_and_caps_them(self):
        self.send()
        self.session.show(camera={"fit": "front"})
        before = self.session.view.image()
        self.session.show(clip_planes=[space.clip_plane(V(0, 60, 0), V(0, 1, 0), [0.9, 0.3, 0.1])])
        after = self.keep("section")
        self.assertGreater(differing(before, after), 0.05)
        stats = self.client.frame(after.frame)
        self.assertFalse([one for one in stats["warnings"] if "closed" in str(one)])
        hit = self.session.view.pick(160, 178)
        self.assertEqual("Base", hit["node"]["name"])
        self.assertAlmostEqual(-0.06, hit["position"][2], delta=1e-6)  # the cap lies in the plane
        self.session.show(clip_planes=None)
        self.assertEqual(before.data, self.session.view.image().data)

    def test_the_camera_of_freecad_sees_the_same(self):
        lamp(self.document)
        text = """#Inventor V2.1 ascii
            OrthographicCamera {
              viewportMapping ADJUST_CAMERA
              position 100 -500 70
              orientation 1 0 0  1.5707963
              nearDistance 1
              farDistance 900
              aspectRatio 1
              focalDistance 500
              height 300
            }"""
        members = space.camera(text)
        self.assertAlmostEqual(0.3, members["ortho_height"])
        for a, b in zip((1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.1, 0.07, 0.5, 1),
                        members["matrix"]):
            self.assertAlmostEqual(a, b, delta=1e-6)
        self.session.show(camera=members)
        self.session.sync(self.document)
        # 240 pixels for 300 mm: the foot of the tube's middle is 70 - 20 mm below the centre.
        hit = self.session.view.pick(160, 120 + 0.8 * 51)
        self.assertEqual("Base", hit["node"]["name"])
        self.assertEqual("Glass tube", self.session.view.pick(160, 120 + 0.8 * 49)["node"]["name"])
        perspective = space.camera("PerspectiveCamera {\n position 0 0 0\n orientation 0 0 1 0\n"
                                   " heightAngle 0.78539819\n}", aspect=0.5)
        self.assertAlmostEqual(2 * math.degrees(math.atan(2 * math.tan(math.pi / 8))),
                               perspective["fov_y_deg"], places=4)
        with self.assertRaises(ValueError):
            space.camera("Cube {}")

    def test_a_point_of_the_picture_finds_its_object(self):
        self.send()
        self.session.show(camera={"fit": "top"})
        hit = self.session.view.pick(160, 120)
        self.assertEqual(("Glass",), self.session.key_of(hit["node"]))
        ball = self.document.addObject("Part::Sphere", "Ball")
        ball.Radius, ball.Placement.Base = 35, V(100, 60, 130)
        self.edit()
        self.assertEqual(("Ball",), self.session.key_of(self.session.view.pick(160, 120)["node"]))
        self.assertIsNone(self.session.view.pick(1, 1))


class Looks(unittest.TestCase):
    def test_kinds_that_become_one_are_recolored_and_kinds_that_split_are_not(self):
        red, blue, green = (1, 0, 0, 0), (0, 0, 1, 0), (0, 1, 0, 0)
        self.assertEqual([green, green], looks.recolored((red, blue), (green,)))
        self.assertEqual([green, red], looks.recolored((red, blue, red), (green, red, green)))
        self.assertIsNone(looks.recolored((red, red), (red, blue)))

    def test_transparency_is_glass_or_coverage(self):
        look = (1.0, 1.0, 1.0, 0.6)
        self.assertEqual(("opaque", 0.6), tuple(looks.override(look)[name] for name in
                                                ("alpha_mode", "transmission")))
        plain = looks.override(look, glass=False)
        self.assertEqual(("blend", 0.4), (plain["alpha_mode"], plain["base_color"][3]))


def main():
    loader = unittest.TestLoader()
    kinds = (Sending, Edits, Looking, Looks)
    suite = unittest.TestSuite(loader.loadTestsFromTestCase(kind) for kind in kinds)
    result = unittest.TextTestRunner(stream=sys.stderr, verbosity=2).run(suite)
    if result.wasSuccessful() and result.testsRun:
        print(f"{result.testsRun} cases of the workbench passed")
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0 if result.wasSuccessful() else 1)  # freecadcmd would end with 0


try:
    main()
except Exception:  # pylint: disable=broad-except
    traceback.print_exc()
    os._exit(1)
