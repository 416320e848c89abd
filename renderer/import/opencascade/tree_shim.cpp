// SPDX-License-Identifier: MIT
// The assembly of a document as glTF: components as nodes, parts as meshes that they share.
#include "renderer/import/opencascade/cad_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include <TCollection_AsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDF_Tool.hxx>
#include <TDataStd_Name.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <gp_Trsf.hxx>

namespace vitrail
{

namespace
{

constexpr int DEPTH_MAX = 64;          // of assemblies in each other
constexpr size_t NODES_MAX = 1u << 20; // chosen: an assembly of doublings names more than it holds
constexpr double ROUGHNESS = 0.5;      // of a surface without a material, as in all formats
constexpr int FLOAT_TYPE = 5126, UINT_TYPE = 5125;

std::string number(double value)
{
    char written[40];
    snprintf(written, sizeof written, "%.9g", value);
    return written;
}

std::string joined(const std::vector<std::string> &elements)
{
    std::string out;
    for (const std::string &element : elements)
        out += (out.empty() ? "" : ",") + element;
    return "[" + out + "]";
}

std::string name_of(const TDF_Label &label)
{
    Handle(TDataStd_Name) name;
    if (!label.FindAttribute(TDataStd_Name::GetID(), name))
        return "";
    return TCollection_AsciiString(name->Get()).ToCString(); // in UTF-8
}

// Column by column; "" of the identity.
std::string matrix_of(const TopLoc_Location &place)
{
    if (place.IsIdentity())
        return "";
    const gp_Trsf &moved = place.Transformation();
    std::vector<std::string> numbers;
    for (int column = 1; column <= 4; column++) {
        for (int row = 1; row <= 3; row++)
            numbers.push_back(number(moved.Value(row, column)));
        numbers.emplace_back(column == 4 ? "1" : "0");
    }
    return ",\"matrix\":" + joined(numbers);
}

class tree_writer
{
  public:
    tree_writer(const Handle(TDocStd_Document) & document, double mm)
        : colors{document}, shapes(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
          deflection_mm(mm)
    {
    }

    cad_gltf write(double unit_m, char up)
    {
        TDF_LabelSequence free;
        shapes->GetFreeShapes(free);
        std::vector<std::string> roots;
        for (int i = 1; i <= free.Length(); i++)
            roots.push_back(std::to_string(write_node(free.Value(i), nullptr, 0)));
        if (unit_m != 1 || up != 'y')
            roots = {std::to_string(write_origin(unit_m, up, roots))};
        out.json = document(roots);
        return std::move(out);
    }

  private:
    color_source colors;
    Handle(XCAFDoc_ShapeTool) shapes;
    double deflection_mm; // 0: in proportion to the parts
    cad_gltf out = {};
    std::vector<std::string> nodes, meshes, materials, accessors, views;
    std::map<look, size_t> material_index;
    std::map<std::pair<std::string, std::string>, int> mesh_index; // by label and inherited colour

    // Returns the index of the node. inherited: of what is around it, or NULL.
    size_t write_node(const TDF_Label &label, const Quantity_ColorRGBA *inherited, int depth)
    {
        if (depth > DEPTH_MAX)
            refuse("assemblies are nested more than %d deep", DEPTH_MAX);
        if (nodes.size() >= NODES_MAX)
            refuse("its assembly has more than %zu components", NODES_MAX);
        size_t index = nodes.size();
        nodes.emplace_back();
        TDF_Label referred = label;
        TopLoc_Location place;
        if (XCAFDoc_ShapeTool::IsReference(label)) {
            XCAFDoc_ShapeTool::GetReferredShape(label, referred);
            place = XCAFDoc_ShapeTool::GetLocation(label);
        }
        Quantity_ColorRGBA own;
        if (colors.find(label, &own) || colors.find(referred, &own))
            inherited = &own;
        std::string name = name_of(label), content = content_of(referred, inherited, depth);
        if (name.empty() || name[0] == '=' || name.rfind("NAUO", 0) == 0) // names by number alone
            name = name_of(referred).empty() ? name : name_of(referred);
        nodes[index] = "{\"name\":" + json_string(name) + matrix_of(place) + content + "}";
        return index;
    }

    std::string content_of(const TDF_Label &label, const Quantity_ColorRGBA *inherited, int depth)
    {
        if (!XCAFDoc_ShapeTool::IsAssembly(label)) {
            int mesh = mesh_of(label, inherited);
            return mesh < 0 ? "" : ",\"mesh\":" + std::to_string(mesh);
        }
        TDF_LabelSequence components;
        XCAFDoc_ShapeTool::GetComponents(label, components);
        std::vector<std::string> children;
        for (int i = 1; i <= components.Length(); i++)
            children.push_back(
                std::to_string(write_node(components.Value(i), inherited, depth + 1)));
        return children.empty() ? "" : ",\"children\":" + joined(children);
    }

    // -1: there is nothing to show.
    int mesh_of(const TDF_Label &label, const Quantity_ColorRGBA *inherited)
    {
        TCollection_AsciiString entry;
        TDF_Tool::Entry(label, entry);
        std::string color;
        if (inherited)
            color = number(double(inherited->GetRGB().Red())) + " " +
                    number(double(inherited->GetRGB().Green())) + " " +
                    number(double(inherited->GetRGB().Blue())) + " " +
                    number(double(inherited->Alpha()));
        auto known = mesh_index.find({entry.ToCString(), color});
        if (known != mesh_index.end())
            return known->second;
        part_mesh mesh = make_part_mesh(XCAFDoc_ShapeTool::GetShape(label), deflection_mm, colors,
                                        inherited, &out.lost_faces);
        int index = mesh.empty() ? -1 : int(meshes.size());
        if (index >= 0)
            write_mesh(name_of(label), mesh);
        mesh_index[{entry.ToCString(), color}] = index;
        return index;
    }

    void write_mesh(const std::string &name, const part_mesh &mesh)
    {
        std::vector<std::string> primitives;
        for (const auto &[shown, part] : mesh) {
            out.triangles += part.indices.size() / 3;
            std::string position = accessor(part.positions.data(), part.positions.size(), true);
            std::string normal = accessor(part.normals.data(), part.normals.size(), false);
            std::string corners = index_accessor(part.indices);
            std::string primitive = "{\"attributes\":{\"POSITION\":";
            primitive += position;
            primitive += ",\"NORMAL\":";
            primitive += normal;
            primitive += "},\"indices\":";
            primitive += corners;
            primitive += ",\"material\":" + std::to_string(material_of(shown)) + "}";
            primitives.push_back(primitive);
        }
        meshes.push_back("{\"name\":" + json_string(name) +
                         ",\"primitives\":" + joined(primitives) + "}");
    }

    // Called by the colour as a screen shows it, since neither format names materials.
    size_t material_of(const look &shown)
    {
        auto known = material_index.find(shown);
        if (known != material_index.end())
            return known->second;
        std::vector<std::string> factors;
        for (float value : shown.color)
            factors.push_back(number(double(value)));
        Quantity_Color color(shown.color[0], shown.color[1], shown.color[2], Quantity_TOC_RGB);
        std::string name = "default";
        if (shown.has_color)
            name = std::string("color ") + (Quantity_Color::ColorToHex(color).ToCString() + 1);
        if (shown.color[3] < 1)
            name += " " + number(std::round(double(shown.color[3]) * 100)) + " %";
        materials.push_back("{\"name\":" + json_string(name) +
                            ",\"doubleSided\":" + (shown.is_double_sided ? "true" : "false") +
                            ",\"alphaMode\":" + (shown.color[3] < 1 ? "\"BLEND\"" : "\"OPAQUE\"") +
                            ",\"pbrMetallicRoughness\":{\"baseColorFactor\":" + joined(factors) +
                            ",\"metallicFactor\":0,\"roughnessFactor\":" + number(ROUGHNESS) +
                            "}}");
        return material_index[shown] = materials.size() - 1;
    }

    std::string accessor(const float *values, size_t count, bool has_bounds)
    {
        std::string bounds;
        for (int is_max = 0; has_bounds && is_max < 2; is_max++) {
            std::vector<std::string> numbers;
            for (size_t axis = 0; axis < 3; axis++) {
                float bound = values[axis];
                for (size_t i = axis; i < count; i += 3)
                    bound = is_max ? std::max(bound, values[i]) : std::min(bound, values[i]);
                numbers.push_back(number(double(bound)));
            }
            bounds += std::string(is_max ? ",\"max\":" : ",\"min\":") + joined(numbers);
        }
        return view(values, count * sizeof *values, FLOAT_TYPE, count / 3,
                    ",\"type\":\"VEC3\"" + bounds);
    }

    std::string index_accessor(const std::vector<uint32_t> &indices)
    {
        return view(indices.data(), indices.size() * sizeof(uint32_t), UINT_TYPE, indices.size(),
                    ",\"type\":\"SCALAR\"");
    }

    std::string view(const void *bytes, size_t size_bytes, int type, size_t count,
                     const std::string &more)
    {
        const auto *first = static_cast<const unsigned char *>(bytes);
        views.push_back("{\"buffer\":0,\"byteOffset\":" + std::to_string(out.buffer.size()) +
                        ",\"byteLength\":" + std::to_string(size_bytes) + "}");
        out.buffer.insert(out.buffer.end(), first, first + size_bytes);
        accessors.push_back("{\"bufferView\":" + std::to_string(views.size() - 1) +
                            ",\"componentType\":" + std::to_string(type) +
                            ",\"count\":" + std::to_string(count) + more + "}");
        return std::to_string(accessors.size() - 1);
    }

    size_t write_origin(double unit_m, char up, const std::vector<std::string> &children)
    {
        std::string u = number(unit_m), matrix = "[" + u + ",0,0,0,";
        matrix +=
            up == 'z' ? "0,0,-" + u + ",0,0," + u + ",0,0," : "0," + u + ",0,0,0,0," + u + ",0,";
        nodes.push_back("{\"name\":\"unit and axis of the file\",\"matrix\":" + matrix +
                        "0,0,0,1],\"children\":" + joined(children) + "}");
        return nodes.size() - 1;
    }

    std::string document(const std::vector<std::string> &roots) const
    {
        return "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":" +
               joined(roots) + "}],\"nodes\":" + joined(nodes) + ",\"meshes\":" + joined(meshes) +
               ",\"materials\":" + joined(materials) + ",\"accessors\":" + joined(accessors) +
               ",\"bufferViews\":" + joined(views) +
               ",\"buffers\":[{\"byteLength\":" + std::to_string(out.buffer.size()) + "}]}";
    }
};

} // namespace

cad_gltf write_cad_gltf(const Handle(TDocStd_Document) & document, double unit_m, char up,
                        double deflection_mm)
{
    return tree_writer(document, deflection_mm).write(unit_m, up);
}

} // namespace vitrail
