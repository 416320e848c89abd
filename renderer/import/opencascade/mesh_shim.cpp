// SPDX-License-Identifier: MIT
// Triangles of a part by OpenCASCADE's mesher, with normals of its surfaces and a look per face.
#include "renderer/import/opencascade/cad_model.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GeomLProp_SLProps.hxx>
#include <Geom_Surface.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <gp_Pnt2d.hxx>

namespace vitrail
{

namespace
{

constexpr double DEFLECTION = 0.001; // chosen: of the diagonal; a circle has some fifty corners
constexpr double DEFLECTION_LEAST_MM = 1e-6; // ten times the library's own tolerance
constexpr double ANGLE_RAD = 0.35;      // chosen: 20 degrees between neighbours, for small fillets
constexpr double NORMAL_EPSILON = 1e-9; // of derivatives that are taken as zero
constexpr float GREY = 0.8f;            // of what has no colour, as in all formats

const XCAFDoc_ColorType KINDS[] = {XCAFDoc_ColorSurf, XCAFDoc_ColorGen};

double deflection_of(const TopoDS_Shape &shape)
{
    Bnd_Box box;
    BRepBndLib::Add(shape, box, false);
    if (box.IsVoid() || box.IsOpen())
        return 1;
    double diagonal = std::sqrt(box.SquareExtent());
    if (!std::isfinite(diagonal))
        refuse("a part has no finite extent");
    return DEFLECTION * diagonal;
}

struct face_writer {
    const TopoDS_Face &face;
    Handle(Poly_Triangulation) triangles;
    TopLoc_Location place;
    surface &out;
    bool is_reversed, is_mirrored;

    void write()
    {
        auto first = uint32_t(out.positions.size() / 3);
        for (int i = 1; i <= triangles->NbNodes(); i++) {
            gp_Pnt at = triangles->Node(i).Transformed(place.Transformation());
            for (double value : {at.X(), at.Y(), at.Z()})
                out.positions.push_back(float(value));
        }
        out.normals.resize(out.positions.size());
        write_triangles(first);
        write_normals(first);
    }

  private:
    void write_triangles(uint32_t first)
    {
        for (int i = 1; i <= triangles->NbTriangles(); i++) {
            int a = 0, b = 0, c = 0;
            triangles->Triangle(i).Get(a, b, c);
            if (is_reversed != is_mirrored)
                std::swap(b, c);
            uint32_t corners[3] = {first + uint32_t(a) - 1, first + uint32_t(b) - 1,
                                   first + uint32_t(c) - 1};
            out.indices.insert(out.indices.end(), corners, corners + 3);
            add_facet_normal(corners);
        }
    }

    // Sums over the facets of a corner, by area: what is left where the surface has no normal.
    void add_facet_normal(const uint32_t corners[3])
    {
        const float *p[3];
        for (int k = 0; k < 3; k++)
            p[k] = &out.positions[3 * size_t(corners[k])];
        double u[3], v[3];
        for (int k = 0; k < 3; k++) {
            u[k] = double(p[1][k]) - double(p[0][k]);
            v[k] = double(p[2][k]) - double(p[0][k]);
        }
        const double across[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                  u[0] * v[1] - u[1] * v[0]};
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                out.normals[3 * size_t(corners[c]) + size_t(k)] += float(across[k]);
    }

    bool surface_normal(const Handle(Geom_Surface) & geometry, int node, double normal[3]) const
    {
        if (geometry.IsNull() || !triangles->HasUVNodes())
            return false;
        gp_Pnt2d uv = triangles->UVNode(node);
        GeomLProp_SLProps properties(geometry, uv.X(), uv.Y(), 1, NORMAL_EPSILON);
        if (!properties.IsNormalDefined())
            return false;
        gp_Dir found = properties.Normal().Transformed(place.Transformation());
        double sign = is_reversed ? -1 : 1;
        normal[0] = sign * found.X(), normal[1] = sign * found.Y(), normal[2] = sign * found.Z();
        return true;
    }

    void write_normals(uint32_t first)
    {
        TopLoc_Location ignored;
        Handle(Geom_Surface) geometry = BRep_Tool::Surface(face, ignored);
        for (int i = 1; i <= triangles->NbNodes(); i++) {
            float *own = &out.normals[3 * (size_t(first) + size_t(i) - 1)];
            double flat[3] = {double(own[0]), double(own[1]), double(own[2])}, found[3];
            double length = std::hypot(flat[0], flat[1], flat[2]);
            for (double &value : flat)
                value = length > 0 ? value / length : 0;
            if (!(length > 0))
                flat[2] = 1; // of no triangle with an area
            // at a pole or a tip the surface's is that of one direction
            bool is_exact = surface_normal(geometry, i, found) &&
                            found[0] * flat[0] + found[1] * flat[1] + found[2] * flat[2] > 0.5;
            for (int k = 0; k < 3; k++)
                own[k] = float(is_exact ? found[k] : flat[k]);
        }
    }
};

look look_of(const Quantity_ColorRGBA *color, bool is_solid)
{
    look found = {{GREY, GREY, GREY, 1}, color != nullptr, true};
    if (color) {
        const Quantity_Color &rgb = color->GetRGB();
        found.color = {float(rgb.Red()), float(rgb.Green()), float(rgb.Blue()), color->Alpha()};
    }
    // a closed body filters light on its near side only
    found.is_double_sided = !(is_solid && found.color[3] < 1);
    return found;
}

struct part_writer {
    const color_source &colors;
    part_mesh mesh;
    size_t *lost;

    void write_faces(const TopoDS_Shape &shape, TopAbs_ShapeEnum except,
                     const Quantity_ColorRGBA *inherited)
    {
        Quantity_ColorRGBA own;
        if (colors.find(shape, &own))
            inherited = &own;
        bool is_solid = except == TopAbs_SHAPE;
        for (TopExp_Explorer at(shape, TopAbs_FACE, except); at.More(); at.Next()) {
            Quantity_ColorRGBA of_face;
            const Quantity_ColorRGBA *color =
                colors.find(at.Current(), &of_face) ? &of_face : inherited;
            write_face(TopoDS::Face(at.Current()), look_of(color, is_solid));
        }
    }

  private:
    void write_face(const TopoDS_Face &face, const look &shown)
    {
        TopLoc_Location place;
        Handle(Poly_Triangulation) triangles = BRep_Tool::Triangulation(face, place);
        if (triangles.IsNull() || triangles->NbTriangles() == 0) {
            ++*lost;
            return;
        }
        bool is_mirrored = place.Transformation().IsNegative();
        face_writer{
            face, triangles, place, mesh[shown], face.Orientation() == TopAbs_REVERSED, is_mirrored}
            .write();
    }
};

// Of a label or a shape.
template <class Colored>
bool find_color(const Handle(TDocStd_Document) & document, const Colored &colored,
                Quantity_ColorRGBA *color)
{
    Handle(XCAFDoc_ColorTool) tool = XCAFDoc_DocumentTool::ColorTool(document->Main());
    for (XCAFDoc_ColorType kind : KINDS)
        if (tool->GetColor(colored, kind, *color))
            return true;
    return false;
}

} // namespace

bool look::operator<(const look &other) const
{
    return std::tie(color, has_color, is_double_sided) <
           std::tie(other.color, other.has_color, other.is_double_sided);
}

bool color_source::find(const TDF_Label &label, Quantity_ColorRGBA *color) const
{
    return find_color(document, label, color);
}

bool color_source::find(const TopoDS_Shape &shape, Quantity_ColorRGBA *color) const
{
    return find_color(document, shape, color);
}

part_mesh make_part_mesh(const TopoDS_Shape &shape, double deflection_mm,
                         const color_source &colors, const Quantity_ColorRGBA *inherited,
                         size_t *lost)
{
    BRepMesh_IncrementalMesh mesher(
        shape,
        std::max(deflection_mm > 0 ? deflection_mm : deflection_of(shape), DEFLECTION_LEAST_MM),
        false, ANGLE_RAD, false);
    part_writer writer{colors, {}, lost};
    for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More(); at.Next())
        writer.write_faces(at.Current(), TopAbs_SHAPE, inherited);
    writer.write_faces(shape, TopAbs_SOLID, inherited);
    return writer.mesh;
}

} // namespace vitrail
