// SPDX-License-Identifier: MIT
// What the shims around OpenCASCADE share: a model that was read, and what is written of it. C++,
// private to the module. Faults of the file are thrown as `fault`; cad_shim.cpp catches everything.
#ifndef VITRAIL_RENDERER_IMPORT_OPENCASCADE_CAD_MODEL_H
#define VITRAIL_RENDERER_IMPORT_OPENCASCADE_CAD_MODEL_H

#include <array>
#include <map>
#include <string>
#include <vector>

#include <Quantity_ColorRGBA.hxx>
#include <TDF_Label.hxx>
#include <TDocStd_Document.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Shape.hxx>

#include "renderer/import/module/module.h"

namespace vitrail
{

// Reads a STEP or IGES file into a new document, in millimetres, and the unit that it tells, in
// metres; 0: it tells none. Checks by the bytes whether the file is whole.
Handle(TDocStd_Document) read_step(const struct scene_file &file, double *unit_m);
Handle(TDocStd_Document) read_iges(const struct scene_file &file, double *unit_m);

// How a surface looks: linear colour and opacity; has_color false: the file tells none.
struct look {
    std::array<float, 4> color;
    bool has_color, is_double_sided;
    bool operator<(const look &other) const;
};

// The triangles of one look, in millimetres.
struct surface {
    std::vector<float> positions, normals;
    std::vector<uint32_t> indices;
};
using part_mesh = std::map<look, surface>;

// The colour of a shape that a label stands for, or of one that is part of it.
struct color_source {
    Handle(TDocStd_Document) document;
    bool find(const TDF_Label &label, Quantity_ColorRGBA *color) const;
    bool find(const TopoDS_Shape &shape, Quantity_ColorRGBA *color) const;
};

// Triangles of a part, no farther from its surfaces than that deflection in millimetres; 0: than
// DEFLECTION of its diagonal. inherited: the colour of what the file gives none, or NULL. Adds
// faces that have no triangles to *lost.
part_mesh make_part_mesh(const TopoDS_Shape &shape, double deflection_mm,
                         const color_source &colors, const Quantity_ColorRGBA *inherited,
                         size_t *lost);

struct cad_gltf {
    std::string json;
    std::vector<unsigned char> buffer;
    size_t lost_faces, triangles;
};
// The assembly, its shared parts once, under a node that turns the unit and the axis into metres
// and +Y where that is needed. unit_m: of one millimetre of the document. deflection_mm: as of
// make_part_mesh.
cad_gltf write_cad_gltf(const Handle(TDocStd_Document) & document, double unit_m, char up,
                        double deflection_mm);

} // namespace vitrail

#endif
