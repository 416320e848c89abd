/* SPDX-License-Identifier: MIT */
/* Plans as JSON, text, DOT and SVG. */
#include "protocol/plan_document.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_write.h"

static const struct {
    const char *name, *media_type;
} formats[] = {
    [PLAN_FORMAT_JSON] = {"json", "application/json"},
    [PLAN_FORMAT_TEXT] = {"text", "text/plain; charset=utf-8"},
    [PLAN_FORMAT_DOT] = {"dot", "text/vnd.graphviz"},
    [PLAN_FORMAT_SVG] = {"svg", "image/svg+xml"},
    [PLAN_FORMAT_GLSL] = {"glsl", "text/plain; charset=utf-8"},
};
enum { FORMATS = sizeof formats / sizeof *formats };

const char *plan_format_name(int format)
{
    return format >= 0 && format < FORMATS ? formats[format].name : NULL;
}

const char *plan_format_media_type(int format)
{
    return format >= 0 && format < FORMATS ? formats[format].media_type : NULL;
}

/* ---- programs ---- */

static const struct {
    const char *name, *text;
} places[PLAN_DOCUMENT_PLACE_COUNT] = {
    [PLAN_DOCUMENT_ABSENT] = {"absent", "to compile"},
    [PLAN_DOCUMENT_IN_MEMORY] = {"memory", "in memory"},
    [PLAN_DOCUMENT_ON_DISK] = {"disk", "on disk"},
};

/* Passes may share one. */
static bool is_first(const struct plan_document *document, size_t program)
{
    for (size_t i = 0; i < program; i++)
        if (!strcmp(document->programs[i].id, document->programs[program].id))
            return false;
    return true;
}

struct program_totals {
    size_t all, at[PLAN_DOCUMENT_PLACE_COUNT];
};

/* Different ones of a pass, or of all with -1. */
static struct program_totals count_programs(const struct plan_document *document, int pass)
{
    struct program_totals totals = {0};
    for (size_t i = 0; i < document->program_count; i++) {
        const struct plan_document_program *program = &document->programs[i];
        if (pass >= 0 ? program->pass != pass : !is_first(document, i))
            continue;
        totals.all++;
        totals.at[program->place]++;
    }
    return totals;
}

enum { PLAN_DOCUMENT_FILES_BYTES = PLAN_DOCUMENT_STAGES * (PLAN_DOCUMENT_NAME_BYTES + 3) };

/* "geometry.vert + gbuffer.frag" */
static void format_files(const struct plan_document_program *program,
                         char out[PLAN_DOCUMENT_FILES_BYTES])
{
    static const char suffix[] = ".glsl";
    size_t used = 0;
    for (int i = 0; i < PLAN_DOCUMENT_STAGES && program->files[i][0]; i++) {
        const char *name = program->files[i], *end = strstr(name, suffix);
        used +=
            (size_t)snprintf(out + used, PLAN_DOCUMENT_FILES_BYTES - used, "%s%.*s", i ? " + " : "",
                             (int)(end ? (size_t)(end - name) : strlen(name)), name);
    }
}

/* ---- JSON ---- */

static json_t *requirements_to_json(const struct plan_document *document)
{
    json_t *list = json_array();
    bool has_failed = !list;
    for (int i = 0; i < document->requirement_count; i++) {
        const struct plan_document_requirement *r = &document->requirements[i];
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "name", r->name);
        json_put_bool(&writer, "is_met", r->is_met);
        json_put_text(&writer, "because", r->because);
        json_append(list, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(list, has_failed);
}

static json_t *defines_to_json(const char *defines)
{
    json_t *list = json_array();
    bool has_failed = !list;
    for (size_t length; *defines; defines += length) {
        defines += strspn(defines, " ");
        length = strcspn(defines, " ");
        if (length)
            json_append(list, json_stringn(defines, length), &has_failed);
    }
    return json_take_unless(list, has_failed);
}

static json_t *files_to_json(const struct plan_document_program *program)
{
    json_t *list = json_array();
    bool has_failed = !list;
    for (int i = 0; i < PLAN_DOCUMENT_STAGES && program->files[i][0]; i++)
        json_append(list, json_string(program->files[i]), &has_failed);
    return json_take_unless(list, has_failed);
}

static json_t *programs_to_json(const struct plan_document *document, int pass)
{
    json_t *list = json_array();
    bool has_failed = !list;
    for (size_t i = 0; i < document->program_count; i++) {
        const struct plan_document_program *program = &document->programs[i];
        if (program->pass != pass)
            continue;
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "id", program->id);
        json_put(&writer, "files", files_to_json(program));
        json_put(&writer, "defines", defines_to_json(program->defines));
        json_put_text(&writer, "place", places[program->place].name);
        json_put_bool(&writer, "is_conditional", program->is_conditional);
        json_append(list, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(list, has_failed);
}

static json_t *passes_to_json(const struct plan_document *document)
{
    json_t *list = json_array();
    bool has_failed = !list;
    for (int i = 0; i < document->pass_count; i++) {
        const struct plan_document_pass *pass = &document->passes[i];
        const struct plan_document_requirement *why = &document->requirements[pass->requirement];
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "pass", pass->pass);
        json_put_text_or_null(&writer, "technique", pass->technique);
        json_put_text(&writer, "requirement", why->name);
        json_put_text(&writer, "because", why->because);
        json_put_bool(&writer, "is_conditional", pass->is_conditional);
        if (pass->bytes)
            json_put_integer(&writer, "bytes", pass->bytes);
        else
            json_put(&writer, "bytes", json_null());
        json_put(&writer, "programs", programs_to_json(document, i));
        json_append(list, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(list, has_failed);
}

/* Those that have any. */
static json_t *lights_to_json(const uint64_t lights[SHADOWS_COUNT])
{
    struct json_writer writer = json_writer_begin();
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (lights[i])
            json_put_integer(&writer, shadow_technique_name(i), lights[i]);
    return json_writer_take(&writer);
}

/* Three techniques have counters from before lights_by_technique, which has all of them. */
static json_t *counts_to_json(const struct plan_document *document)
{
    const uint64_t *lights = document->counts.lights_by_technique;
    const struct program_totals programs = count_programs(document, -1);
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "opaque_items", document->counts.opaque_items);
    json_put_integer(&writer, "transparent_items", document->counts.transparent_items);
    json_put_integer(&writer, "map_lights", lights[SHADOWS_MAP]);
    json_put_integer(&writer, "deep_lights", lights[SHADOWS_DEEP]);
    json_put_integer(&writer, "linked_lights", lights[SHADOWS_DEEP_LINKED]);
    json_put_integer(&writer, "unshadowed_lights", document->counts.unshadowed_lights);
    json_put_integer(&writer, "unseen_lights", document->counts.unseen_lights);
    json_put_integer(&writer, "shadow_texels", document->counts.shadow_texels);
    json_put_integer(&writer, "light_batches", document->counts.light_batches);
    json_put_integer(&writer, "programs", programs.all);
    json_put_integer(&writer, "programs_in_memory", programs.at[PLAN_DOCUMENT_IN_MEMORY]);
    json_put_integer(&writer, "programs_on_disk", programs.at[PLAN_DOCUMENT_ON_DISK]);
    return json_writer_take(&writer);
}

static char *write_json(const struct plan_document *document)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "scene", document->scene);
    json_put_text(&writer, "device", document->device);
    json_put_integer(&writer, "width", (uint64_t)document->width);
    json_put_integer(&writer, "height", (uint64_t)document->height);
    json_put_integer(&writer, "samples", (uint64_t)document->samples);
    json_put(&writer, "requirements", requirements_to_json(document));
    json_put(&writer, "passes", passes_to_json(document));
    json_put(
        &writer, "warnings",
        json_texts(document->warnings[0], sizeof document->warnings[0], document->warning_count));
    json_put(&writer, "counts", counts_to_json(document));
    json_put(&writer, "lights_by_technique", lights_to_json(document->counts.lights_by_technique));
    return json_take_dump(json_writer_take(&writer), JSON_COMPACT);
}

/* ---- text ---- */

static void format_bytes(uint64_t bytes, char out[32])
{
    if (bytes)
        snprintf(out, 32, "%.1f MiB", (double)bytes / (1 << 20));
    else
        snprintf(out, 32, "%s", "");
}

static void write_lights(const uint64_t lights[SHADOWS_COUNT], FILE *out)
{
    fputs("\nShadows: ", out);
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (lights[i])
            fprintf(out, "%" PRIu64 " %s, ", lights[i], shadow_technique_name(i));
}

static void write_programs(const struct plan_document *document, FILE *out)
{
    const struct program_totals totals = count_programs(document, -1);
    int pass = -1;
    if (!totals.all)
        return;
    fprintf(out, "\nPrograms: %zu in all", totals.all);
    for (int i = 0; i < PLAN_DOCUMENT_PLACE_COUNT; i++)
        if (totals.at[i])
            fprintf(out, ", %zu %s", totals.at[i], places[i].text);
    fputs("\n", out);
    for (size_t i = 0; i < document->program_count; i++) {
        const struct plan_document_program *program = &document->programs[i];
        const char *defines = program->defines + strspn(program->defines, " ");
        char files[PLAN_DOCUMENT_FILES_BYTES];
        if (program->pass != pass)
            fprintf(out, "  %s\n", document->passes[program->pass].pass);
        pass = program->pass;
        format_files(program, files);
        fprintf(out, "      %s  %-36s %-10s%s%s%s\n", program->id, files,
                places[program->place].text, program->is_conditional ? "  if needed" : "",
                *defines ? "  " : "", defines);
    }
}

static void write_text(const struct plan_document *document, FILE *out)
{
    fprintf(out, "A frame of %dx%d pixels, %d sample%s each, on %s\n\nRequired:\n", document->width,
            document->height, document->samples, document->samples == 1 ? "" : "s",
            document->device);
    for (int met = 1; met >= 0; met--) {
        if (!met)
            fprintf(out, "\nNot required:\n");
        for (int i = 0; i < document->requirement_count; i++)
            if (document->requirements[i].is_met == met)
                fprintf(out, "  %-18s %s\n", document->requirements[i].name,
                        document->requirements[i].because);
    }
    fprintf(out, "\nPasses, in order:\n");
    for (int i = 0; i < document->pass_count; i++) {
        const struct plan_document_pass *pass = &document->passes[i];
        char bytes[32];
        format_bytes(pass->bytes, bytes);
        fprintf(out, "  %2d  %-21s %-12s for %-18s %10s%s\n", i + 1, pass->pass, pass->technique,
                document->requirements[pass->requirement].name, bytes,
                pass->is_conditional ? "  if the count finds any" : "");
    }
    write_lights(document->counts.lights_by_technique, out);
    fprintf(out, "%" PRIu64 " lights without, %" PRIu64 " out of view; %" PRIu64 " texels\n",
            document->counts.unshadowed_lights, document->counts.unseen_lights,
            document->counts.shadow_texels);
    if (document->counts.light_batches > 1)
        fprintf(out, "in at least %" PRIu64 " batches: they exceed their budget together\n",
                document->counts.light_batches);
    if (document->warning_count)
        fputs("\nWarnings:\n", out);
    for (int i = 0; i < document->warning_count; i++)
        fprintf(out, "  %s\n", document->warnings[i]);
    write_programs(document, out);
}

/* ---- drawings ---- */

/* Text inside of a quoted DOT string, or of XML. */
static void put_escaped(FILE *out, const char *text, bool is_xml)
{
    for (; *text; text++) {
        if (is_xml && *text == '<')
            fputs("&lt;", out);
        else if (is_xml && *text == '&')
            fputs("&amp;", out);
        else if (is_xml && *text == '"')
            fputs("&quot;", out);
        else if (!is_xml && (*text == '"' || *text == '\\'))
            fprintf(out, "\\%c", *text);
        else
            fputc(*text, out);
    }
}

/* "2 programs, 1 to compile"; empty without any. */
static void format_totals(const struct plan_document *document, int pass, char out[96])
{
    const struct program_totals totals = count_programs(document, pass);
    int used = 0;
    out[0] = 0;
    if (totals.all)
        used = snprintf(out, 96, "%zu program%s", totals.all, totals.all == 1 ? "" : "s");
    for (int i = 0; totals.all && i < PLAN_DOCUMENT_PLACE_COUNT; i++)
        if (totals.at[i])
            used +=
                snprintf(out + used, 96 - (size_t)used, ", %zu %s", totals.at[i], places[i].text);
}

/* One line for each program of the pass, with what parts lines in between. */
static void put_programs(const struct plan_document *document, int pass, const char *between,
                         FILE *out)
{
    for (size_t i = 0; i < document->program_count; i++) {
        const struct plan_document_program *program = &document->programs[i];
        char files[PLAN_DOCUMENT_FILES_BYTES];
        if (program->pass != pass)
            continue;
        format_files(program, files);
        fprintf(out, "%s%s %s, %s%s", between, program->id, files, places[program->place].text,
                *program->defines ? ": " : "");
        put_escaped(out, program->defines + strspn(program->defines, " "), true);
    }
}

static void write_dot(const struct plan_document *document, FILE *out)
{
    fputs("digraph plan {\n  rankdir=LR;\n  node [shape=box, fontname=\"sans-serif\"];\n", out);
    for (int i = 0; i < document->requirement_count; i++) {
        const struct plan_document_requirement *r = &document->requirements[i];
        fprintf(out, "  r%d [label=\"", i);
        put_escaped(out, r->name, false);
        fputs("\\n", out);
        put_escaped(out, r->because, false);
        fprintf(out, "\"%s];\n",
                r->is_met ? ", style=rounded"
                          : ", style=dashed, color=gray60, "
                            "fontcolor=gray60");
    }
    for (int i = 0; i < document->pass_count; i++) {
        const struct plan_document_pass *pass = &document->passes[i];
        char totals[96];
        fprintf(out, "  p%d [label=\"%d. ", i, i + 1);
        put_escaped(out, pass->pass, false);
        format_totals(document, i, totals);
        fprintf(out, "%s%s%s%s\"", pass->technique[0] ? "\\n" : "", pass->technique,
                totals[0] ? "\\n" : "", totals);
        if (totals[0]) {
            fprintf(out, ", tooltip=\"%s", totals);
            put_programs(document, i, "\\n", out);
            fputs("\"", out);
        }
        fprintf(out, "%s];\n  r%d -> p%d;\n", pass->is_conditional ? ", style=dashed" : "",
                pass->requirement, i);
        if (i > 0)
            fprintf(out, "  p%d -> p%d [style=bold, constraint=false];\n", i - 1, i);
    }
    fputs("}\n", out);
}

enum {
    SVG_MARGIN = 24,
    SVG_LEFT_WIDTH = 460,
    SVG_GAP = 150,
    SVG_RIGHT_WIDTH = 330,
    SVG_ROW = 72,
    SVG_BOX = 60,
    SVG_TOP = 84,
    SVG_LINE_CHARACTERS = 66, /* of a reason, at the size of small text */
};

static void svg_text(FILE *out, const char *class_, int x, int y, const char *text, int most)
{
    char cut[PLAN_DOCUMENT_TEXT_BYTES + 4];
    int length = (int)strlen(text);
    bool is_long = length > most;
    if (is_long) {
        length = most - 1;
        while (length > 0 && ((unsigned char)text[length] & 0xc0) == 0x80)
            length--; /* not inside of a character */
    }
    snprintf(cut, sizeof cut, "%.*s%s", length, text, is_long ? "\xe2\x80\xa6" : "");
    fprintf(out, "<text class=\"%s\" x=\"%d\" y=\"%d\">", class_, x, y);
    put_escaped(out, cut, true);
    fputs("<title>", out);
    put_escaped(out, text, true);
    fputs("</title></text>\n", out);
}

static void svg_box(FILE *out, const char *class_, int x, int y, int width)
{
    fprintf(out, "<rect class=\"%s\" x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" rx=\"5\"/>\n",
            class_, x, y, width, SVG_BOX);
}

static void svg_requirement(FILE *out, const struct plan_document_requirement *r, int row)
{
    int y = SVG_TOP + row * SVG_ROW;
    const char *suffix = r->is_met ? "" : " off";
    char class_[32];
    snprintf(class_, sizeof class_, "need%s", suffix);
    svg_box(out, class_, SVG_MARGIN, y, SVG_LEFT_WIDTH);
    snprintf(class_, sizeof class_, "name%s", suffix);
    svg_text(out, class_, SVG_MARGIN + 12, y + 18, r->name, SVG_LINE_CHARACTERS);
    snprintf(class_, sizeof class_, "small%s", suffix);
    svg_text(out, class_, SVG_MARGIN + 12, y + 35, r->because, SVG_LINE_CHARACTERS);
}

/* How many programs, and on their tooltip which. */
static void svg_programs(FILE *out, const struct plan_document *document, int pass, int x, int y)
{
    char totals[96];
    format_totals(document, pass, totals);
    if (!totals[0])
        return;
    fprintf(out, "<text class=\"small\" x=\"%d\" y=\"%d\">%s<title>%s", x, y, totals, totals);
    put_programs(document, pass, "\n", out);
    fputs("</title></text>\n", out);
}

static void svg_pass(FILE *out, const struct plan_document *document, int row)
{
    const struct plan_document_pass *pass = &document->passes[row];
    int x = SVG_MARGIN + SVG_LEFT_WIDTH + SVG_GAP, y = SVG_TOP + row * SVG_ROW;
    int from = SVG_TOP + pass->requirement * SVG_ROW + SVG_BOX / 2, to = y + SVG_BOX / 2;
    int left = SVG_MARGIN + SVG_LEFT_WIDTH, bend = SVG_GAP / 2;
    char line[3 * PLAN_DOCUMENT_NAME_BYTES], bytes[32];
    fprintf(out, "<path class=\"call\" d=\"M%d %dC%d %d %d %d %d %d\"/>\n", left, from, left + bend,
            from, x - bend, to, x, to);
    svg_box(out, pass->is_conditional ? "pass maybe" : "pass", x, y, SVG_RIGHT_WIDTH);
    snprintf(line, sizeof line, "%d. %s", row + 1, pass->pass);
    svg_text(out, "name", x + 12, y + 18, line, SVG_LINE_CHARACTERS);
    format_bytes(pass->bytes, bytes);
    snprintf(line, sizeof line, "%s%s%s%s%s", pass->technique,
             pass->technique[0] && bytes[0] ? ", " : "", bytes,
             (pass->technique[0] || bytes[0]) && pass->is_conditional ? ", " : "",
             pass->is_conditional ? "if the count finds any" : "");
    svg_text(out, "small", x + 12, y + 35, line, SVG_LINE_CHARACTERS);
    svg_programs(out, document, row, x + 12, y + 52);
}

static const char svg_style[] =
    ".paper{fill:#fff;stroke:none}.need,.pass{fill:#f4f6f9}.need{stroke:#2f6f4f}.pass{stroke:#"
    "3b5b92}"
    ".off{opacity:.45}.maybe{stroke-dasharray:5 3}.call{fill:none;stroke:#7f8ea3;stroke-width:1.5}"
    "text{fill:#1c2430;font-size:12px}.name{font-size:14px;font-weight:600}"
    ".head{font-size:16px;font-weight:600}"
    "@media(prefers-color-scheme:dark){.paper{fill:#14181f}.need,.pass{fill:#1f2630}"
    "text{fill:#e4e9f0}}";

static void write_svg(const struct plan_document *document, FILE *out)
{
    int rows = document->requirement_count > document->pass_count ? document->requirement_count
                                                                  : document->pass_count;
    int width = 2 * SVG_MARGIN + SVG_LEFT_WIDTH + SVG_GAP + SVG_RIGHT_WIDTH;
    int height = SVG_TOP + rows * SVG_ROW + SVG_MARGIN;
    char title[256];
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
            "viewBox=\"0 0 %d %d\" role=\"img\" font-family=\"system-ui, sans-serif\">\n"
            "<title>Plan of a frame</title>\n<style>%s</style>\n"
            "<rect class=\"paper\" width=\"%d\" height=\"%d\"/>\n",
            width, height, width, height, svg_style, width, height);
    snprintf(title, sizeof title, "A frame of %d\xc3\x97%d pixels, %d sample%s each, on %.120s",
             document->width, document->height, document->samples,
             document->samples == 1 ? "" : "s", document->device);
    svg_text(out, "head", SVG_MARGIN, 34, title, 110);
    svg_text(out, "name", SVG_MARGIN, 68, "What it requires (faded: not required)", 60);
    svg_text(out, "name", SVG_MARGIN + SVG_LEFT_WIDTH + SVG_GAP, 68, "Passes, in order", 60);
    for (int i = 0; i < document->pass_count; i++)
        svg_pass(out, document, i);
    for (int i = 0; i < document->requirement_count; i++)
        svg_requirement(out, &document->requirements[i], i);
    fputs("</svg>\n", out);
}

char *plan_document_write(const struct plan_document *document, enum plan_format format,
                          size_t *length)
{
    char *text = NULL;
    if (format == PLAN_FORMAT_JSON) {
        text = write_json(document);
        *length = text ? strlen(text) : 0;
        return text;
    }
    assert(format != PLAN_FORMAT_GLSL);
    FILE *out = open_memstream(&text, length);
    if (!out)
        return NULL;
    if (format == PLAN_FORMAT_TEXT)
        write_text(document, out);
    else if (format == PLAN_FORMAT_DOT)
        write_dot(document, out);
    else
        write_svg(document, out);
    bool has_failed = ferror(out) != 0;
    if (fclose(out) != 0 || has_failed) {
        free(text);
        text = NULL;
    }
    return text;
}
