// SPDX-License-Identifier: MIT
// What the modules of converters share (renderer/import/converter.h): faults, text, and how a scene
// is handed over. C++, linked into each module. Thread: any.
#ifndef VITRAIL_RENDERER_IMPORT_MODULE_MODULE_H
#define VITRAIL_RENDERER_IMPORT_MODULE_MODULE_H

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "renderer/import/converter.h"

namespace vitrail
{

// What is wrong with the file, for its sender.
struct fault : std::runtime_error {
    using std::runtime_error::runtime_error;
};
[[noreturn]] void refuse(const char *format, ...) __attribute__((format(printf, 1, 2)));
std::string text(const char *format, ...) __attribute__((format(printf, 1, 2)));

// As an element of JSON, with its quotes. Bytes that are no UTF-8 are taken for Latin-1, as old
// files keep it.
std::string json_string(const std::string &utf8);

// A scene as a module hands it over. warnings: lines, each ended by a line feed.
void give(struct converter_output *output, const std::string &json,
          const std::vector<unsigned char> &buffer, const std::string &warnings);

// Runs a conversion; what it throws becomes err. library: the name that a fault without words has.
bool guarded(const char *library, const std::function<void()> &convert, struct error *err);

} // namespace vitrail

#endif
