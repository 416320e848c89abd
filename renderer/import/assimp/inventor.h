// SPDX-License-Identifier: MIT
// Open Inventor files (V2, and VRML 1.0) in their ASCII form, as trees of nodes. C++, private to
// the module. Faults are thrown as `fault`, with their line.
#ifndef VITRAIL_RENDERER_IMPORT_ASSIMP_INVENTOR_H
#define VITRAIL_RENDERER_IMPORT_ASSIMP_INVENTOR_H

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace Assimp
{
class BaseImporter;
}

namespace vitrail
{

struct conversion_state;

struct inventor_node {
    std::string type, name;                                 // name: by DEF, "" without
    std::map<std::string, std::vector<std::string>> fields; // the words of their values
    std::vector<std::shared_ptr<inventor_node>> children;
};

// The nodes at the top of the file, below one node of type Separator.
std::shared_ptr<inventor_node> parse_inventor(std::string_view text);

// For Assimp::Importer::RegisterLoader, which takes it. Warns in the state.
Assimp::BaseImporter *inventor_reader(conversion_state &state);

} // namespace vitrail

#endif
