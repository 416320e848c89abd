// SPDX-License-Identifier: MIT
// Faults, text and the hand-over of scenes in modules of converters. No exception leaves `guarded`.
#include "renderer/import/module/module.h"

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace vitrail
{

std::string text(const char *format, ...)
{
    char line[400];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    return line;
}

void refuse(const char *format, ...)
{
    char line[200];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    throw fault(line);
}

std::string json_string(const std::string &utf8)
{
    std::string out = "\"";
    for (size_t i = 0; i < utf8.size();) {
        unsigned char c = static_cast<unsigned char>(utf8[i]);
        size_t length = c < 0x80                ? 1
                        : c >= 0xC2 && c < 0xE0 ? 2
                        : c >= 0xE0 && c < 0xF0 ? 3
                        : c >= 0xF0 && c < 0xF5 ? 4
                                                : 0;
        bool is_whole = length > 0 && i + length <= utf8.size();
        for (size_t k = 1; is_whole && k < length; k++)
            is_whole = (static_cast<unsigned char>(utf8[i + k]) & 0xC0) == 0x80;
        if (!is_whole || length == 1) {
            bool is_plain = c >= 0x20 && c < 0x7F && c != '"' && c != '\\';
            out += is_plain ? std::string(1, char(c)) : text("\\u%04x", c);
            i++;
        } else {
            out += utf8.substr(i, length);
            i += length;
        }
    }
    return out + "\"";
}

namespace
{

char *copy(const void *bytes, size_t size_bytes)
{
    char *out = static_cast<char *>(malloc(size_bytes + 1));
    if (!out)
        throw std::bad_alloc();
    if (size_bytes > 0)
        memcpy(out, bytes, size_bytes);
    out[size_bytes] = '\0';
    return out;
}

} // namespace

void give(struct converter_output *output, const std::string &json,
          const std::vector<unsigned char> &buffer, const std::string &warnings)
{
    output->warnings = copy(warnings.data(), warnings.size());
    output->json_bytes = json.size();
    output->json = copy(json.data(), json.size());
    output->buffer_bytes = buffer.size();
    output->buffer = copy(buffer.data(), buffer.size());
}

bool guarded(const char *library, const std::function<void()> &convert, struct error *err)
{
    try {
        convert();
        return true;
    } catch (const std::bad_alloc &) {
        return error_set(err, ERROR_NO_MEMORY, "reading it");
    } catch (const std::length_error &) { // a count that no container takes
        return error_set(err, ERROR_NO_MEMORY, "a count in it is too large");
    } catch (const std::exception &problem) {
        return error_set(err, ERROR_INVALID_SCENE, "%s", problem.what());
    } catch (...) {
        return error_set(err, ERROR_INVALID_SCENE, "%s gave up without a word", library);
    }
}

} // namespace vitrail
