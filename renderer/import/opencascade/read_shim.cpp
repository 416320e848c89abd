// SPDX-License-Identifier: MIT
// STEP and IGES files in memory into documents of OpenCASCADE, in millimetres.
#include "renderer/import/opencascade/cad_model.h"

#include <cctype>
#include <cstdio>
#include <cstring>
#include <istream>
#include <streambuf>
#include <string_view>
#include <strings.h>
#include <unordered_set>

#include <IGESCAFControl_Reader.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <XCAFDoc_DocumentTool.hxx>

namespace
{

// The IGES reader takes the name of a file alone, and opens it by OSD_OpenFile: for this name, and
// while it reads, it gets the bytes of the upload.
const char UPLOAD[] = "vitrail-upload.igs";
const struct scene_file *open_upload;

} // namespace

// In place of that of the library, which would open a file: this module comes first where names
// that the libraries behind it ask for are looked up.
extern "C" __attribute__((visibility("default"))) FILE *OSD_OpenFile(const char *name,
                                                                     const char *mode)
{
    if (!open_upload || strcmp(name, UPLOAD) != 0 || strchr(mode, 'w'))
        return nullptr;
    return fmemopen(const_cast<void *>(open_upload->bytes), open_upload->size_bytes, "r");
}

namespace vitrail
{

namespace
{

class memory_buffer : public std::streambuf
{
  public:
    explicit memory_buffer(const struct scene_file &file)
    {
        char *bytes = static_cast<char *>(const_cast<void *>(file.bytes));
        setg(bytes, bytes, bytes + file.size_bytes); // which is only read
    }
};

Handle(TDocStd_Document) new_document()
{
    Handle(TDocStd_Document) document = new TDocStd_Document("BinXCAF");
    XCAFDoc_DocumentTool::Set(document->Main(), false);
    return document;
}

// Without what is around it that has no meaning; IGES has blanks at the begin of lines.
std::string_view trimmed(const struct scene_file &file, const char *before)
{
    std::string_view bytes(static_cast<const char *>(file.bytes), file.size_bytes);
    size_t first = bytes.find_first_not_of(before);
    size_t last = bytes.find_last_not_of(" \t\r\n\x1a\0");
    return first == bytes.npos ? std::string_view() : bytes.substr(first, last + 1 - first);
}

// The number behind a '#'; 0: there is none.
unsigned long entity_number(std::string_view bytes, size_t at, size_t *end)
{
    unsigned long number = 0;
    for (*end = at + 1; *end < bytes.size() && isdigit(static_cast<unsigned char>(bytes[*end]));
         ++*end)
        number = number > 100000000 ? number : number * 10 + unsigned(bytes[*end] - '0');
    return number;
}

// The library goes on without entities that are not there, with a part of the picture.
void check_references(std::string_view bytes)
{
    std::unordered_set<unsigned long> defined, named;
    bool is_text = false;
    for (size_t at = 0; at < bytes.size(); at++) {
        is_text = is_text != (bytes[at] == '\'');
        if (is_text || bytes[at] != '#')
            continue;
        size_t end = 0;
        unsigned long number = entity_number(bytes, at, &end);
        size_t next = bytes.find_first_not_of(" \t\r\n", end);
        bool is_definition = next != bytes.npos && bytes[next] == '=';
        if (number > 0)
            (is_definition ? defined : named).insert(number);
        at = end - 1;
    }
    for (unsigned long number : named)
        if (!defined.count(number))
            refuse("entity #%lu is named, and is not there", number);
}

void check_step(const struct scene_file &file)
{
    static const char begin[] = "ISO-10303-21;", end[] = "END-ISO-10303-21;";
    std::string_view bytes = trimmed(file, " \t\r\n");
    if (bytes.substr(0, sizeof begin - 1) != begin)
        refuse("it does not begin with %s", begin);
    if (bytes.size() < sizeof end || bytes.substr(bytes.size() - sizeof end + 1) != end)
        refuse("it does not end with %s: the file is cut", end);
    check_references(bytes);
}

// Lines of 80 columns, with the letter of their section in column 73 (IGES 5.3, section 2.2.4.1).
void check_iges(const struct scene_file &file)
{
    constexpr size_t SECTION_COLUMN = 72;
    std::string_view bytes = trimmed(file, "\r\n");
    size_t first_end = bytes.find_first_of("\r\n"), last = bytes.find_last_of("\r\n");
    if (first_end == bytes.npos || first_end <= SECTION_COLUMN ||
        !strchr("SBC", bytes[SECTION_COLUMN]))
        refuse("its first line is not one of an IGES file");
    if (bytes[SECTION_COLUMN] != 'S')
        refuse("its compressed or binary form is not read");
    std::string_view line = bytes.substr(last + 1);
    if (line.size() <= SECTION_COLUMN || line[SECTION_COLUMN] != 'T')
        refuse("its last line is not that of the terminate section: the file is cut");
}

struct named_unit {
    const char *name;
    double unit_m;
};

double find_unit(const char *name)
{
    static const named_unit units[] = {{"millimetre", 0.001}, {"millimeter", 0.001},
                                       {"mm", 0.001},         {"centimetre", 0.01},
                                       {"centimeter", 0.01},  {"cm", 0.01},
                                       {"decimetre", 0.1},    {"metre", 1},
                                       {"meter", 1},          {"m", 1},
                                       {"kilometre", 1000},   {"micrometre", 1e-6},
                                       {"inch", 0.0254},      {"in", 0.0254},
                                       {"foot", 0.3048},      {"ft", 0.3048},
                                       {"mile", 1609.344},    {"mil", 2.54e-5}};
    for (const named_unit &unit : units)
        if (strcasecmp(unit.name, name) == 0)
            return unit.unit_m;
    return 0;
}

} // namespace

Handle(TDocStd_Document) read_step(const struct scene_file &file, double *unit_m)
{
    check_step(file);
    memory_buffer buffer(file);
    std::istream stream(&buffer);
    STEPCAFControl_Reader reader;
    reader.SetColorMode(true);
    reader.SetNameMode(true);
    if (reader.ChangeReader().ReadStream("scene.step", stream) != IFSelect_RetDone)
        refuse("it cannot be parsed");
    if (reader.NbRootsForTransfer() == 0)
        refuse("it holds no product with a shape");
    TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles);
    *unit_m = lengths.IsEmpty() ? 0 : find_unit(lengths.First().ToCString());
    Handle(TDocStd_Document) document = new_document();
    if (!reader.Transfer(document))
        refuse("none of its shapes can be read");
    return document;
}

Handle(TDocStd_Document) read_iges(const struct scene_file &file, double *unit_m)
{
    static const double units_m[] = {0, 0.0254, 0.001,   0,    0.3048, 1609.344,
                                     1, 1000,   2.54e-5, 1e-6, 0.01,   2.54e-8};
    check_iges(file);
    IGESCAFControl_Reader reader;
    open_upload = &file;
    IFSelect_ReturnStatus status = reader.ReadFile(UPLOAD);
    open_upload = nullptr;
    if (status != IFSelect_RetDone)
        refuse("it cannot be parsed");
    const IGESData_GlobalSection &global = reader.IGESModel()->GlobalSection();
    int flag = global.UnitFlag(); // 3: the name tells
    if (flag > 0 && size_t(flag) < sizeof units_m / sizeof *units_m)
        *unit_m = units_m[flag];
    if (flag == 3 && !global.UnitName().IsNull())
        *unit_m = find_unit(global.UnitName()->ToCString());
    Handle(TDocStd_Document) document = new_document();
    if (!reader.Transfer(document))
        refuse("none of its shapes can be read");
    return document;
}

} // namespace vitrail
