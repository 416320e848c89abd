// SPDX-License-Identifier: MIT
// The only user of assimp (5.2 to 6): from the files of an upload in memory to glTF. No exception
// leaves this file, and no file but those of the upload is seen.
#include "renderer/import/assimp/conversion.h"
#include "renderer/import/assimp/inventor.h"
#include "renderer/import/assimp/moving.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>

#include <assimp/BaseImporter.h>
#include <assimp/DefaultLogger.hpp>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/Logger.hpp>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

namespace vitrail
{

namespace
{

constexpr int WARNINGS_MAX = 64;       // chosen: more lines help nobody
constexpr float CREASE_ANGLE_DEG = 30; // chosen: below it an edge between facets is smoothed
constexpr size_t SHOWN_MAX = 160;      // of a text of the file in a message
const unsigned STEPS = aiProcess_Triangulate | aiProcess_GenSmoothNormals |
                       aiProcess_JoinIdenticalVertices | aiProcess_SortByPType;

class memory_stream : public Assimp::IOStream
{
  public:
    explicit memory_stream(const struct scene_file &opened) : file(opened) {}
    size_t Read(void *buffer, size_t size, size_t count) override
    {
        size_t whole = size ? std::min(count, (file.size_bytes - at) / size) : 0;
        if (whole > 0)
            memcpy(buffer, static_cast<const char *>(file.bytes) + at, whole * size);
        at += whole * size;
        return whole;
    }
    size_t Write(const void *, size_t, size_t) override
    {
        return 0;
    }
    aiReturn Seek(size_t offset, aiOrigin origin) override
    {
        // offsets back from the current place come as huge numbers, whose sum wraps
        size_t from = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at : file.size_bytes;
        size_t to = origin == aiOrigin_END ? from - offset : from + offset;
        if (to > file.size_bytes)
            return aiReturn_FAILURE;
        at = to;
        return aiReturn_SUCCESS;
    }
    size_t Tell() const override
    {
        return at;
    }
    size_t FileSize() const override
    {
        return file.size_bytes;
    }
    void Flush() override {}

  private:
    const struct scene_file &file;
    size_t at = 0;
};

// Sees the upload and nothing else. Assimp knows the scene by its name without folders, or by one
// of our own where that has not the suffix of the format.
class upload_files : public Assimp::IOSystem
{
  public:
    explicit upload_files(conversion_state &conversion)
        : state(conversion), root_name(name_of(*conversion.input)), root(*conversion.input->root)
    {
        if (conversion.input->format != SCENE_FORMAT_COLLADA)
            return;
        prepared = prepare_collada(state, {static_cast<const char *>(root.bytes), root.size_bytes});
        root.bytes = prepared.data();
        root.size_bytes = prepared.size();
    }
    static const char *suffix(enum scene_format format)
    {
        return scene_format_describe(format)->suffixes + 1;
    }
    static std::string name_of(const struct converter_input &input)
    {
        enum scene_format format;
        const char *name = input.root->name, *slash = strrchr(name, '/');
        bool is_known = scene_format_of_file(name, &format) && format == input.format;
        return is_known ? slash ? slash + 1 : name : std::string("scene.") + suffix(input.format);
    }
    bool Exists(const char *name) const override
    {
        return find(name) != nullptr;
    }
    char getOsSeparator() const override
    {
        return '/';
    }
    Assimp::IOStream *Open(const char *name, const char *mode) override
    {
        const struct scene_file *file = strchr(mode, 'w') ? nullptr : find(name);
        if (!file)
            state.missing.insert(name);
        else if (file != &root && file != state.input->root &&
                 state.input->format == SCENE_FORMAT_OBJ)
            check_mtl(*file);
        return file ? new memory_stream(*file) : nullptr;
    }
    void Close(Assimp::IOStream *stream) override
    {
        delete stream;
    }
    bool ComparePaths(const char *one, const char *other) const override
    {
        return strcmp(one, other) == 0;
    }

    conversion_state &state;
    const std::string root_name;

  private:
    const struct scene_file *find(const char *name) const
    {
        return name == root_name ? &root : state.find(name);
    }
    std::string prepared; // the bytes of root, where assimp is not to see those of the upload
    struct scene_file root;
};

// Lines of assimp's log by which it goes on with something made up: the file is broken.
const char *const BROKEN[] = {
    "Unable to parse property instance",        // PLY
    "Unable to parse binary property instance", // PLY
    "Skipping this element instance",           // PLY
    "'endsolid' keyword was expected",          // STL
    "A new facet begins but the old",           // STL
    "a facet normal vector was expected",       // STL
    "a facet with more than 3 vertices",        // STL
    "mesh is empty or invalid",                 // STL
    "Not supported token in face description",  // OBJ
    "Ignoring empty face",                      // OBJ
};
// Lines about what a warning of our own says better, or about what has no meaning here.
const char *const SAID_ELSEWHERE[] = {
    "unexpected illumination model",
    "Unable to locate material file",
    "Unable to locate fallback material file",
    "creating new material",
    "No object detected to attach", // OBJ: materials that are named before the first object
    "Validation",
    "found degenerated primitive",
    "Ignored file of un",                     // 3MF: the parts that every package has
    "newer format version",                   // FBX: what all programs write now
    "failed to resolve vertex layer element", // FBX: there are none
};

class log_reader : public Assimp::Logger
{
  public:
    explicit log_reader(conversion_state &conversion) : state(conversion) {}
    bool attachStream(Assimp::LogStream *, unsigned) override
    {
        return false;
    }
    bool detachStream(Assimp::LogStream *, unsigned) override
    {
        return false;
    }

  protected:
    void OnDebug(const char *) override {}
    void OnVerboseDebug(const char *) override {}
    void OnInfo(const char *) override {}
    void OnWarn(const char *message) override
    {
        take(message);
    }
    void OnError(const char *message) override
    {
        take(message);
    }

  private:
    void take(const char *message)
    {
        for (const char *part : BROKEN)
            if (strstr(message, part)) {
                if (state.broken.empty())
                    state.broken = message;
                return;
            }
        for (const char *part : SAID_ELSEWHERE)
            if (strstr(message, part))
                return;
        state.warn(std::string("assimp: ") + message);
    }
    conversion_state &state;
};

// Assimp's log is one of the process: one conversion at a time.
std::mutex conversion_mutex;
class log_scope
{
  public:
    explicit log_scope(conversion_state &conversion)
    {
        Assimp::DefaultLogger::set(new log_reader(conversion)); // which takes it
    } // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks)
    ~log_scope()
    {
        Assimp::DefaultLogger::set(nullptr);
    }
};

void drop(Assimp::Importer &importer, Assimp::BaseImporter *reader)
{
    importer.UnregisterLoader(reader); // which leaves it to us
    delete reader;
}

// All readers but that of the format are dropped: a file is what it is said to be.
void keep_only(Assimp::Importer &importer, const std::string &suffix)
{
    for (size_t i = importer.GetImporterCount(); i-- > 0;) {
        const aiImporterDesc *info = importer.GetImporterInfo(i);
        std::string suffixes = std::string(" ") + (info ? info->mFileExtensions : "") + " ";
        if (suffixes.find(" " + suffix + " ") == std::string::npos)
            drop(importer, importer.GetImporter(i));
    }
}

void check_vertices(const aiMesh &mesh, unsigned index)
{
    for (unsigned v = 0; v < mesh.mNumVertices; v++) {
        const aiVector3D &at = mesh.mVertices[v];
        if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z))
            refuse("mesh %u '%.80s': vertex %u is (%g, %g, %g)", index, mesh.mName.C_Str(), v,
                   double(at.x), double(at.y), double(at.z));
    }
}

// Says anew what kinds of faces there are: readers err, and assimp's steps rely on it.
void check_faces(aiMesh &mesh, unsigned index)
{
    static const unsigned kinds[] = {aiPrimitiveType_POINT, aiPrimitiveType_LINE,
                                     aiPrimitiveType_TRIANGLE, aiPrimitiveType_POLYGON};
    mesh.mPrimitiveTypes = 0;
    for (unsigned f = 0; f < mesh.mNumFaces; f++) {
        const aiFace &face = mesh.mFaces[f];
        if (face.mNumIndices == 0)
            refuse("mesh %u '%.80s': face %u has no corners", index, mesh.mName.C_Str(), f);
        mesh.mPrimitiveTypes |= kinds[std::min(face.mNumIndices, 4u) - 1];
        for (unsigned i = 0; i < face.mNumIndices; i++)
            if (face.mIndices[i] >= mesh.mNumVertices)
                refuse("mesh %u '%.80s': face %u names vertex %u of %u", index, mesh.mName.C_Str(),
                       f, face.mIndices[i], mesh.mNumVertices);
    }
}

// Before assimp's own steps work on them.
void prepare_meshes(const aiScene &scene)
{
    size_t faces = 0;
    for (unsigned m = 0; m < scene.mNumMeshes; m++) {
        faces += scene.mMeshes[m]->mNumFaces;
        check_vertices(*scene.mMeshes[m], m);
        check_faces(*scene.mMeshes[m], m);
        check_targets(*scene.mMeshes[m], m);
        keep_apart(*scene.mMeshes[m]);
    }
    if (scene.mNumMeshes > 0 && faces == 0)
        refuse("it has vertices, and no face");
}

// Those of STL are of its facets: angles alone decide what is round.
void drop_facet_normals(const aiScene &scene)
{
    for (unsigned m = 0; m < scene.mNumMeshes; m++) {
        delete[] scene.mMeshes[m]->mNormals;
        scene.mMeshes[m]->mNormals = nullptr;
    }
}

file_units find_units(const struct converter_input &input, const aiScene &scene)
{
    file_units units = read_units(input, scene);
    if (input.unit_m > 0) {
        units.origin.unit_m = input.unit_m;
        units.origin.unit_by = SCENE_WORD_REQUEST;
    }
    if (input.up) {
        units.origin.up = input.up;
        units.origin.up_by = SCENE_WORD_REQUEST;
    }
    return units;
}

void warn_of_origin(conversion_state &state, const struct scene_origin &origin)
{
    const char *title = scene_format_describe(origin.format)->title;
    if (origin.unit_by == SCENE_WORD_DEFAULT)
        state.warn(text("%s does not tell the unit of its coordinates: metres are assumed (?unit=)",
                        title));
}

// Assimp turns every exception into a text.
[[noreturn]] void refuse_by(const Assimp::Importer &importer)
{
    const char *reason = importer.GetErrorString();
    if (strstr(reason, "bad_alloc"))
        throw std::bad_alloc();
    refuse("%.*s", int(SHOWN_MAX), *reason ? reason : "assimp gave up without a word");
}

void read_scene(Assimp::Importer &importer, conversion_state &state, upload_files *files)
{
    importer.SetIOHandler(files); // which takes it
    keep_only(importer, upload_files::suffix(state.input->format));
    if (state.input->format == SCENE_FORMAT_INVENTOR)
        importer.RegisterLoader(inventor_reader(state)); // which takes it
    importer.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, CREASE_ANGLE_DEG);
    const aiScene *scene = importer.ReadFile(files->root_name, aiProcess_ValidateDataStructure);
    if (!scene)
        refuse_by(importer);
    if (!state.broken.empty())
        refuse("%.*s", int(SHOWN_MAX), state.broken.c_str());
    if (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE && scene->mNumMeshes == 0)
        refuse("it holds no mesh");
    prepare_meshes(*scene);
    if (state.input->format == SCENE_FORMAT_STL)
        drop_facet_normals(*scene);
    if (!importer.ApplyPostProcessing(STEPS))
        refuse_by(importer);
}

// Assimp tries a library with the name of the OBJ where the one that it names is not there.
void warn_of_missing(conversion_state &state)
{
    std::string own = upload_files::name_of(*state.input);
    own = own.substr(0, own.rfind('.')) + ".mtl";
    for (const std::string &name : state.missing)
        if (name != own || state.missing.size() == 1)
            state.warn(text("'%.200s' is not among the uploaded files", name.c_str()));
}

void convert_all(const struct converter_input *input, struct converter_output *output)
{
    std::lock_guard<std::mutex> lock(conversion_mutex);
    conversion_state state{input, {}, {}, ""};
    log_scope scope(state);
    check_source(*input);
    Assimp::Importer importer;
    read_scene(importer, state, new upload_files(state));
    warn_of_missing(state);
    file_units units = find_units(*input, *importer.GetScene());
    output->origin = units.origin;
    warn_of_origin(state, units.origin);
    gltf_text gltf = write_gltf(state, *importer.GetScene(), units);
    importer.FreeScene();
    std::string lines;
    for (const std::string &line : state.warnings)
        lines += line + "\n";
    give(output, gltf.json, gltf.buffer, lines);
}

bool convert(const struct converter_input *input, struct converter_output *output,
             struct error *err)
{
    *output = {};
    return guarded(
        "assimp", [&] { convert_all(input, output); }, err);
}

void warm_up()
{
    static const char triangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const struct scene_file file = {"scene.obj", triangle, sizeof triangle - 1};
    const struct converter_input input = {&file, 1, &file, SCENE_FORMAT_OBJ, 1, 'y', 0, nullptr};
    struct converter_output output;
    struct error ignored = {};
    if (!convert(&input, &output, &ignored))
        output = {};
    free(output.json);
    free(output.buffer);
    free(output.warnings);
}

} // namespace

void conversion_state::warn(const std::string &line)
{
    std::string whole;
    for (char c : line)
        whole += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    for (const std::string &known : warnings)
        if (known == whole)
            return;
    if (warnings.size() < WARNINGS_MAX)
        warnings.push_back(whole);
    else if (warnings.size() == WARNINGS_MAX)
        warnings.push_back("there are more warnings than are listed");
}

namespace
{

std::vector<std::string> segments_of(const std::string &path)
{
    std::vector<std::string> segments;
    std::string segment;
    for (size_t i = 0; i <= path.size(); i++) {
        if (i < path.size() && path[i] != '/' && path[i] != '\\') {
            segment += path[i];
            continue;
        }
        if (segment == ".." && !segments.empty())
            segments.pop_back();
        else if (!segment.empty() && segment != "." && segment != "..")
            segments.push_back(segment);
        segment.clear();
    }
    return segments;
}

} // namespace

const struct scene_file *conversion_state::find(const std::string &name) const
{
    std::vector<std::string> wanted = segments_of(input->root->name);
    if (wanted.empty() || segments_of(name).empty())
        return nullptr;
    wanted.pop_back();
    for (const std::string &segment : segments_of(name))
        wanted.push_back(segment);
    const struct scene_file *by_last = nullptr;
    for (size_t i = 0; i < input->file_count; i++) {
        std::vector<std::string> own = segments_of(input->files[i].name);
        if (own == wanted)
            return &input->files[i];
        if (!own.empty() && own.back() == wanted.back() && !by_last)
            by_last = &input->files[i];
    }
    return by_last;
}

} // namespace vitrail

extern "C" const struct converter_functions *converter_get_functions(void)
{
    static const struct converter_functions functions = {vitrail::warm_up, vitrail::convert};
    return &functions;
}
