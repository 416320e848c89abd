// SPDX-License-Identifier: MIT
// From the nodes of an Inventor file to a scene of assimp, by Inventor's rules of state: a property
// holds for what follows it within its separator (Wernecke 1994, "The Inventor Mentor", chapters 3
// to 5).
#include "renderer/import/assimp/inventor.h"
#include "renderer/import/assimp/conversion.h"

#include <cmath>
#include <cstdlib>
#include <set>

#include <assimp/BaseImporter.h>
#include <assimp/importerdesc.h>
#include <assimp/material.h>
#include <assimp/scene.h>

namespace vitrail
{

namespace
{

constexpr size_t VISITS_MAX = 1000000; // of nodes: USE can repeat them without end
constexpr int ROUND = 32;              // chosen: edges of 11 degrees are smooth
constexpr int HALF_ROUND = ROUND / 2;
constexpr float INDEX_MAX = 16777215; // whole numbers are exact up to there
constexpr double PI = 3.14159265358979323846;

using numbers = std::vector<float>;

struct look {
    numbers diffuse = {0.8f, 0.8f, 0.8f}, specular = {0, 0, 0}, emissive = {0, 0, 0};
    float shininess = 0.2f, transparency = 0;
    bool operator<(const look &o) const
    {
        return std::tie(diffuse, specular, emissive, shininess, transparency) <
               std::tie(o.diffuse, o.specular, o.emissive, o.shininess, o.transparency);
    }
};

// What holds for the nodes that follow.
struct traversal {
    aiMatrix4x4 matrix;
    std::vector<aiVector3D> places;
    look material;
    bool is_clockwise = false;
    double unit_m = 1;
};

numbers numbers_of(const inventor_node &node, const char *field, numbers otherwise)
{
    auto found = node.fields.find(field);
    if (found == node.fields.end())
        return otherwise;
    numbers out;
    for (const std::string &word : found->second) {
        char *end = nullptr;
        float number = strtof(word.c_str(), &end);
        if (*end || !std::isfinite(number))
            refuse("%s of a node %s has the value '%.40s'", field, node.type.c_str(), word.c_str());
        out.push_back(number);
    }
    return out.size() < otherwise.size() ? otherwise : out;
}

float number_of(const inventor_node &node, const char *field, float otherwise)
{
    return numbers_of(node, field, {otherwise})[0];
}

aiVector3D vector_of(const inventor_node &node, const char *field, const aiVector3D &otherwise)
{
    numbers at = numbers_of(node, field, {otherwise.x, otherwise.y, otherwise.z});
    return aiVector3D(at[0], at[1], at[2]);
}

std::string word_of(const inventor_node &node, const char *field)
{
    auto found = node.fields.find(field);
    return found == node.fields.end() || found->second.empty() ? "" : found->second[0];
}

// An axis and an angle.
aiMatrix4x4 rotation_of(const inventor_node &node, const char *field)
{
    numbers turn = numbers_of(node, field, {0, 0, 1, 0});
    aiVector3D axis(turn[0], turn[1], turn[2]);
    aiMatrix4x4 out;
    if (axis.SquareLength() > 0)
        aiMatrix4x4::Rotation(turn[3], axis.Normalize(), out);
    return out;
}

aiMatrix4x4 moved(const aiVector3D &by)
{
    aiMatrix4x4 out;
    return aiMatrix4x4::Translation(by, out);
}

aiMatrix4x4 scaled(const aiVector3D &by)
{
    aiMatrix4x4 out;
    return aiMatrix4x4::Scaling(by, out);
}

class inventor_builder
{
  public:
    explicit inventor_builder(conversion_state &conversion) : state_(conversion) {}
    inventor_builder(const inventor_builder &) = delete;
    inventor_builder &operator=(const inventor_builder &) = delete;
    ~inventor_builder();
    void build(const inventor_node &root, aiScene *scene);

  private:
    void visit(const inventor_node &node, traversal &now);
    void visit_children(const inventor_node &node, traversal &now);
    bool visit_property(const inventor_node &node, traversal &now);
    bool visit_transform(const inventor_node &node, traversal &now);
    bool visit_shape(const inventor_node &node, traversal &now);
    bool visit_placed(const inventor_node &node, traversal &now);
    void add_faces(const inventor_node &node, const traversal &now,
                   const std::vector<aiVector3D> &places,
                   const std::vector<std::vector<unsigned>> &faces, bool is_turned);
    void add_indexed(const inventor_node &node, const traversal &now, bool is_strip);
    void add_counted(const inventor_node &node, const traversal &now, bool is_strip);
    void add_cube(const inventor_node &node, const traversal &now);
    void add_round(const inventor_node &node, const traversal &now,
                   const std::vector<std::pair<float, float>> &outline);
    unsigned material_of(const look &wanted);
    aiNode *add_node(const std::string &name, const aiMatrix4x4 &matrix);

    conversion_state &state_;
    size_t visits_ = 0;
    std::vector<aiNode *> nodes_;
    std::vector<aiMesh *> meshes_;
    std::vector<aiMaterial *> materials_;
    std::vector<aiLight *> lights_;
    std::vector<aiCamera *> cameras_;
    std::map<look, unsigned> known_;
};

// What a scene did not take.
inventor_builder::~inventor_builder()
{
    for (aiNode *node : nodes_)
        delete node;
    for (aiMesh *mesh : meshes_)
        delete mesh;
    for (aiMaterial *material : materials_)
        delete material;
    for (aiLight *light : lights_)
        delete light;
    for (aiCamera *camera : cameras_)
        delete camera;
}

aiNode *inventor_builder::add_node(const std::string &name, const aiMatrix4x4 &matrix)
{
    aiNode *made = new aiNode(name);
    made->mTransformation = matrix;
    nodes_.push_back(made);
    return made;
}

unsigned inventor_builder::material_of(const look &wanted)
{
    auto found = known_.find(wanted);
    if (found != known_.end())
        return found->second;
    aiMaterial *made = new aiMaterial;
    materials_.push_back(made);
    aiString name(text("material %zu", materials_.size() - 1));
    const auto color = [](const numbers &from) { return aiColor3D(from[0], from[1], from[2]); };
    aiColor3D diffuse = color(wanted.diffuse), specular = color(wanted.specular),
              emissive = color(wanted.emissive);
    float opacity = 1 - wanted.transparency, exponent = wanted.shininess * 128;
    made->AddProperty(&name, AI_MATKEY_NAME);
    made->AddProperty(&diffuse, 1, AI_MATKEY_COLOR_DIFFUSE);
    made->AddProperty(&specular, 1, AI_MATKEY_COLOR_SPECULAR);
    made->AddProperty(&emissive, 1, AI_MATKEY_COLOR_EMISSIVE);
    made->AddProperty(&opacity, 1, AI_MATKEY_OPACITY);
    made->AddProperty(&exponent, 1, AI_MATKEY_SHININESS);
    return known_[wanted] = unsigned(materials_.size() - 1);
}

// Faces of two corners are lines. Each keeps vertices of its own; equal ones are joined later.
void inventor_builder::add_faces(const inventor_node &node, const traversal &now,
                                 const std::vector<aiVector3D> &places,
                                 const std::vector<std::vector<unsigned>> &faces, bool is_turned)
{
    size_t corners = 0;
    for (const auto &face : faces) {
        corners += face.size();
        for (unsigned index : face)
            if (index >= places.size())
                refuse("a node %s names vertex %u of %zu", node.type.c_str(), index, places.size());
    }
    if (faces.empty())
        return;
    aiMesh *mesh = new aiMesh;
    meshes_.push_back(mesh);
    mesh->mName = node.name.empty() ? node.type : node.name;
    mesh->mMaterialIndex = material_of(now.material);
    mesh->mVertices = new aiVector3D[corners];
    mesh->mNumVertices = unsigned(corners);
    mesh->mFaces = new aiFace[faces.size()];
    mesh->mNumFaces = unsigned(faces.size());
    unsigned at = 0;
    for (size_t f = 0; f < faces.size(); f++) {
        aiFace &face = mesh->mFaces[f];
        size_t count = faces[f].size();
        face.mNumIndices = unsigned(count);
        face.mIndices = new unsigned[count];
        for (size_t i = 0; i < count; i++) {
            mesh->mVertices[at] = places[faces[f][is_turned ? count - 1 - i : i]];
            face.mIndices[i] = at++;
        }
        mesh->mPrimitiveTypes |= count > 3    ? aiPrimitiveType_POLYGON
                                 : count == 3 ? aiPrimitiveType_TRIANGLE
                                              : aiPrimitiveType_LINE;
    }
    aiNode *made = add_node(mesh->mName.C_Str(), now.matrix);
    made->mMeshes = new unsigned[1]{unsigned(meshes_.size() - 1)};
    made->mNumMeshes = 1;
}

void add_strip(const std::vector<unsigned> &strip, std::vector<std::vector<unsigned>> &faces)
{
    for (size_t i = 2; i < strip.size(); i++)
        faces.push_back(i % 2 ? std::vector<unsigned>{strip[i - 1], strip[i - 2], strip[i]}
                              : std::vector<unsigned>{strip[i - 2], strip[i - 1], strip[i]});
}

void add_run(const inventor_node &node, std::vector<unsigned> &run, bool is_strip,
             std::vector<std::vector<unsigned>> &faces)
{
    if (node.type.find("LineSet") != std::string::npos) {
        for (size_t i = 1; i < run.size(); i++)
            faces.push_back({run[i - 1], run[i]});
    } else if (is_strip) {
        add_strip(run, faces);
    } else if (run.size() >= 3) {
        faces.push_back(run);
    } else if (!run.empty()) {
        refuse("a node %s has a face of %zu corners", node.type.c_str(), run.size());
    }
    run.clear();
}

void inventor_builder::add_indexed(const inventor_node &node, const traversal &now, bool is_strip)
{
    std::vector<std::vector<unsigned>> faces;
    std::vector<unsigned> run;
    for (float index : numbers_of(node, "coordIndex", {})) {
        if (index > INDEX_MAX)
            refuse("a node %s names a vertex above %g", node.type.c_str(), double(INDEX_MAX));
        if (index < 0)
            add_run(node, run, is_strip, faces);
        else
            run.push_back(unsigned(index));
    }
    add_run(node, run, is_strip, faces);
    add_faces(node, now, now.places, faces, now.is_clockwise);
}

void inventor_builder::add_counted(const inventor_node &node, const traversal &now, bool is_strip)
{
    std::vector<std::vector<unsigned>> faces;
    std::vector<unsigned> run;
    unsigned at = unsigned(std::max(0.0f, number_of(node, "startIndex", 0)));
    for (float count : numbers_of(node, "numVertices", {-1})) {
        size_t end = count < 0 ? now.places.size() : at + size_t(count);
        if (end > now.places.size())
            refuse("a node %s takes %zu vertices of %zu", node.type.c_str(), end,
                   now.places.size());
        while (at < end)
            run.push_back(at++);
        add_run(node, run, is_strip, faces);
    }
    add_faces(node, now, now.places, faces, now.is_clockwise);
}

void inventor_builder::add_cube(const inventor_node &node, const traversal &now)
{
    float x = number_of(node, "width", 2) / 2, y = number_of(node, "height", 2) / 2,
          z = number_of(node, "depth", 2) / 2;
    std::vector<aiVector3D> places;
    places.reserve(8);
    for (int i = 0; i < 8; i++)
        places.emplace_back(i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z);
    add_faces(node, now, places,
              {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}},
              false);
}

// A body around the y axis, of (radius, height) from its top down; both ends lie on the axis.
void inventor_builder::add_round(const inventor_node &node, const traversal &now,
                                 const std::vector<std::pair<float, float>> &outline)
{
    std::vector<aiVector3D> places;
    std::vector<std::vector<unsigned>> faces;
    for (const auto &ring : outline)
        for (int i = 0; i < ROUND; i++) {
            double angle = 2 * PI * i / ROUND;
            places.emplace_back(ring.first * float(std::sin(angle)), ring.second,
                                ring.first * float(std::cos(angle)));
        }
    for (unsigned k = 0; k + 1 < outline.size(); k++)
        for (unsigned i = 0; i < unsigned(ROUND); i++) {
            unsigned next = (i + 1) % unsigned(ROUND), a = k * ROUND, b = a + ROUND;
            if (outline[k].first <= 0)
                faces.push_back({a, b + i, b + next});
            else if (outline[k + 1].first <= 0)
                faces.push_back({a + i, b, a + next});
            else
                faces.push_back({a + i, b + i, b + next, a + next});
        }
    add_faces(node, now, places, faces, false);
}

bool inventor_builder::visit_shape(const inventor_node &node, traversal &now)
{
    const std::string &type = node.type;
    float radius = number_of(node, "radius", 1), half = number_of(node, "height", 2) / 2;
    if (type == "IndexedFaceSet" || type == "IndexedLineSet") {
        add_indexed(node, now, false);
    } else if (type == "IndexedTriangleStripSet") {
        add_indexed(node, now, true);
    } else if (type == "FaceSet" || type == "LineSet") {
        add_counted(node, now, false);
    } else if (type == "TriangleStripSet") {
        add_counted(node, now, true);
    } else if (type == "Cube") {
        add_cube(node, now);
    } else if (type == "Sphere") {
        std::vector<std::pair<float, float>> outline = {{0.0f, radius}};
        for (int i = 1; i < HALF_ROUND; i++)
            outline.emplace_back(radius * float(std::sin(PI * i / HALF_ROUND)),
                                 radius * float(std::cos(PI * i / HALF_ROUND)));
        outline.emplace_back(0.0f, -radius);
        add_round(node, now, outline);
    } else if (type == "Cylinder") {
        add_round(node, now, {{0, half}, {radius, half}, {radius, -half}, {0, -half}});
    } else if (type == "Cone") {
        float bottom = number_of(node, "bottomRadius", 1);
        add_round(node, now, {{0, half}, {bottom, -half}, {0, -half}});
    } else {
        return false;
    }
    return true;
}

bool inventor_builder::visit_transform(const inventor_node &node, traversal &now)
{
    const std::string &type = node.type;
    const aiVector3D none(0, 0, 0), ones(1, 1, 1);
    if (type == "Transform") {
        aiVector3D center = vector_of(node, "center", none);
        aiMatrix4x4 turn = rotation_of(node, "rotation"),
                    lean = rotation_of(node, "scaleOrientation");
        aiMatrix4x4 back = lean;
        now.matrix = now.matrix * moved(vector_of(node, "translation", none)) * moved(center) *
                     turn * lean * scaled(vector_of(node, "scaleFactor", ones)) * back.Transpose() *
                     moved(-center);
    } else if (type == "Translation") {
        now.matrix = now.matrix * moved(vector_of(node, "translation", none));
    } else if (type == "Rotation") {
        now.matrix = now.matrix * rotation_of(node, "rotation");
    } else if (type == "RotationXYZ") {
        std::string axis = word_of(node, "axis");
        aiMatrix4x4 turn;
        aiMatrix4x4::Rotation(number_of(node, "angle", 0),
                              aiVector3D(axis == "X" || axis.empty(), axis == "Y", axis == "Z"),
                              turn);
        now.matrix = now.matrix * turn;
    } else if (type == "Scale") {
        now.matrix = now.matrix * scaled(vector_of(node, "scaleFactor", ones));
    } else if (type == "MatrixTransform") {
        numbers m = numbers_of(node, "matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
        aiMatrix4x4 rows(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11],
                         m[12], m[13], m[14], m[15]); // of row vectors
        now.matrix = now.matrix * rows.Transpose();
    } else if (type == "ResetTransform") {
        now.matrix = aiMatrix4x4();
    } else {
        return false;
    }
    return true;
}

double unit_of(const inventor_node &node)
{
    static const std::map<std::string, double> units = {
        {"METERS", 1},        {"CENTIMETERS", 0.01}, {"MILLIMETERS", 0.001}, {"MICROMETERS", 1e-6},
        {"NANOMETERS", 1e-9}, {"KILOMETERS", 1000},  {"FEET", 0.3048},       {"INCHES", 0.0254},
        {"YARDS", 0.9144},    {"MILES", 1609.344}};
    std::string name = word_of(node, "units");
    auto found = units.find(name.empty() ? "METERS" : name);
    if (found == units.end())
        refuse("a node Units has the unit '%.40s'", name.c_str());
    return found->second;
}

bool inventor_builder::visit_property(const inventor_node &node, traversal &now)
{
    const std::string &type = node.type;
    if (type == "Material") {
        now.material.diffuse = numbers_of(node, "diffuseColor", {0.8f, 0.8f, 0.8f});
        if (now.material.diffuse.size() > 3)
            state_.warn("of a Material with several colours the first is shown");
        now.material.diffuse.resize(3);
        now.material.specular = numbers_of(node, "specularColor", {0, 0, 0});
        now.material.specular.resize(3);
        now.material.emissive = numbers_of(node, "emissiveColor", {0, 0, 0});
        now.material.emissive.resize(3);
        now.material.shininess = number_of(node, "shininess", 0.2f);
        now.material.transparency = number_of(node, "transparency", 0);
    } else if (type == "BaseColor") {
        now.material.diffuse = numbers_of(node, "rgb", {0.8f, 0.8f, 0.8f});
        now.material.diffuse.resize(3);
    } else if (type == "Coordinate3") {
        numbers point = numbers_of(node, "point", {});
        now.places.clear();
        for (size_t i = 0; i + 2 < point.size(); i += 3)
            now.places.emplace_back(point[i], point[i + 1], point[i + 2]);
    } else if (type == "ShapeHints") {
        now.is_clockwise = word_of(node, "vertexOrdering") == "CLOCKWISE";
    } else if (type == "Units") {
        double unit_m = unit_of(node);
        now.matrix = now.matrix * scaled(aiVector3D(float(unit_m / now.unit_m)));
        now.unit_m = unit_m;
    } else {
        return false;
    }
    return true;
}

// Each is a node with a name of its own, by which it is found.
bool inventor_builder::visit_placed(const inventor_node &node, traversal &now)
{
    const std::string &type = node.type;
    bool is_light = type == "DirectionalLight" || type == "PointLight" || type == "SpotLight";
    if (!is_light && type != "PerspectiveCamera")
        return false;
    std::string name = node.name.empty() ? text("%s %zu", type.c_str(), nodes_.size()) : node.name;
    add_node(name, now.matrix);
    if (!is_light) {
        aiCamera *camera = new aiCamera;
        cameras_.push_back(camera);
        aiMatrix3x3 turn(rotation_of(node, "orientation"));
        camera->mName = name;
        camera->mPosition = vector_of(node, "position", aiVector3D(0, 0, 1));
        camera->mLookAt = turn * aiVector3D(0, 0, -1);
        camera->mUp = turn * aiVector3D(0, 1, 0);
        camera->mHorizontalFOV = number_of(node, "heightAngle", 0.785398f); // of aspect 1
        camera->mClipPlaneNear = number_of(node, "nearDistance", 0.01f);
        camera->mClipPlaneFar = number_of(node, "farDistance", 1000);
        return true;
    }
    aiLight *light = new aiLight;
    lights_.push_back(light);
    aiVector3D color =
        vector_of(node, "color", aiVector3D(1, 1, 1)) * number_of(node, "intensity", 1);
    light->mName = name;
    light->mType = type == "PointLight"  ? aiLightSource_POINT
                   : type == "SpotLight" ? aiLightSource_SPOT
                                         : aiLightSource_DIRECTIONAL;
    light->mColorDiffuse = aiColor3D(color.x, color.y, color.z);
    light->mPosition = vector_of(node, "location", aiVector3D(0, 0, 0));
    light->mDirection = vector_of(node, "direction", aiVector3D(0, 0, -1));
    light->mAngleInnerCone = light->mAngleOuterCone = 2 * number_of(node, "cutOffAngle", 0.785398f);
    return true;
}

void inventor_builder::visit_children(const inventor_node &node, traversal &now)
{
    for (const auto &child : node.children)
        visit(*child, now);
}

void inventor_builder::visit(const inventor_node &node, traversal &now)
{
    static const std::set<std::string> separators = {"Separator", "Annotation", "Selection",
                                                     "WWWAnchor"};
    static const std::set<std::string> groups = {"Group", "LOD", "LevelOfDetail"};
    static const std::set<std::string> without_effect = {
        "Info",        "Label",           "Complexity",        "DrawStyle",         "LightModel",
        "Environment", "MaterialBinding", "NormalBinding",     "PickStyle",         "Normal",
        "Font",        "Packages",        "Texture2Transform", "TextureCoordinate2"};
    const std::string &type = node.type;
    if (++visits_ > VISITS_MAX)
        refuse("with what USE repeats it has more than %zu nodes", VISITS_MAX);
    if (separators.count(type)) {
        traversal own = now;
        visit_children(node, own);
    } else if (type == "TransformSeparator") {
        aiMatrix4x4 before = now.matrix;
        visit_children(node, now);
        now.matrix = before;
    } else if (type == "Switch") {
        float which = number_of(node, "whichChild", -1);
        if (which <= -3)
            visit_children(node, now);
        else if (which >= 0 && size_t(which) < node.children.size())
            visit(*node.children[size_t(which)], now);
    } else if (groups.count(type)) {
        bool is_choice = type != "Group"; // the finest
        if (is_choice && !node.children.empty())
            visit(*node.children[0], now);
        else
            visit_children(node, now);
    } else if (!visit_transform(node, now) && !visit_property(node, now) &&
               !visit_shape(node, now) && !visit_placed(node, now) && !without_effect.count(type)) {
        state_.warn(text("nodes of type %.80s are left out", type.c_str()));
    }
}

template <class T> T **take(std::vector<T *> &from, unsigned *count)
{
    if (from.empty())
        return nullptr;
    T **list = new T *[from.size()];
    for (size_t i = 0; i < from.size(); i++)
        list[i] = from[i];
    *count = unsigned(from.size());
    from.clear();
    return list;
}

void inventor_builder::build(const inventor_node &root, aiScene *scene)
{
    traversal now;
    visit(root, now);
    if (meshes_.empty())
        refuse("it has no shape that is read");
    scene->mRootNode = new aiNode("Inventor");
    for (aiNode *child : nodes_)
        child->mParent = scene->mRootNode;
    scene->mRootNode->mChildren = take(nodes_, &scene->mRootNode->mNumChildren);
    scene->mMeshes = take(meshes_, &scene->mNumMeshes);
    scene->mMaterials = take(materials_, &scene->mNumMaterials);
    scene->mLights = take(lights_, &scene->mNumLights);
    scene->mCameras = take(cameras_, &scene->mNumCameras);
}

class reader : public Assimp::BaseImporter
{
  public:
    explicit reader(conversion_state &conversion) : state_(conversion) {}
    bool CanRead(const std::string &, Assimp::IOSystem *, bool) const override
    {
        return true;
    }

  protected:
    const aiImporterDesc *GetInfo() const override
    {
        static const aiImporterDesc info = {
            "Open Inventor", "", "", "", aiImporterFlags_SupportTextFlavour, 0, 0, 0, 0, "iv"};
        return &info;
    }
    void InternReadFile(const std::string &, aiScene *scene, Assimp::IOSystem *) override
    {
        const struct scene_file &file = *state_.input->root;
        auto root = parse_inventor({static_cast<const char *>(file.bytes), file.size_bytes});
        inventor_builder(state_).build(*root, scene);
    }

  private:
    conversion_state &state_;
};

} // namespace

Assimp::BaseImporter *inventor_reader(conversion_state &state)
{
    return new reader(state);
}

} // namespace vitrail
