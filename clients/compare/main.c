/* SPDX-License-Identifier: MIT */
/* vitrail-compare: what `vitrail compare` runs. Reads two images, prints metrics, draws the
 * difference, and exits by the verdict. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/compare/print.h"
#include "clients/vitrail/json_text.h"
#include "clients/vitrail/output_file.h"
#include "renderer/accuracy/difference_map.h"

/* Format by the extension of the picture's name; stdout gets PNG. */
static bool picture_format(const char *file, enum image_format *format, struct failure *failure)
{
    const char *dot = strrchr(file, '.'), *slash = strrchr(file, '/');
    *format = IMAGE_FORMAT_PNG;
    if (!strcmp(file, "-"))
        return true;
    if (!dot || (slash && dot < slash) || !image_format_from_name(dot + 1, format) ||
        *format == IMAGE_FORMAT_EXR)
        return fail(failure, EXIT_CODE_USAGE, "'%s': the picture is .png, .jpg or .webp", file);
    return true;
}

static bool encode_picture(const struct comparison *c, const struct compare_options *options,
                           enum image_format format, struct compare_picture *drawn,
                           struct output_file *file, struct failure *failure)
{
    struct error err = {0};
    struct image picture = {0};
    void *bytes = NULL;
    size_t size_bytes = 0;
    enum difference_map_kind kind = !strcmp(drawn->map, "signed")     ? DIFFERENCE_MAP_SIGNED
                                    : !strcmp(drawn->map, "absolute") ? DIFFERENCE_MAP_ABSOLUTE
                                                                      : DIFFERENCE_MAP_FLIP;
    if (kind == DIFFERENCE_MAP_FLIP && !c->has_flip)
        return fail(failure, EXIT_CODE_REFUSED,
                    "'%s' is no color: choose --map absolute or --map signed", c->image.layer);
    struct difference_map_desc desc = {.kind = kind,
                                       .image = &c->image.image,
                                       .reference = &c->reference.image,
                                       .flip = &c->flip_map,
                                       .channels = c->color_channels,
                                       .scale = options->scale.value};
    bool is_ok = difference_map_draw(&desc, &picture, &drawn->scale, &err) &&
                 image_encode(&picture, &(struct image_encode_desc){.format = format}, &bytes,
                              &size_bytes, &err);
    if (!is_ok)
        fail(failure, err.code == ERROR_NO_MEMORY ? EXIT_CODE_OS_ERROR : EXIT_CODE_REFUSED,
             "the picture: %s", err.message);
    is_ok = is_ok && output_file_write(file, bytes, size_bytes, failure);
    free(bytes);
    image_finish(&picture);
    return is_ok;
}

static bool print_results(const struct comparison *c, const struct compare_options *options,
                          const struct compare_picture *drawn, struct failure *failure)
{
    bool is_stdout_taken = drawn->file && !strcmp(drawn->file, "-");
    if (options->common.quiet || is_stdout_taken)
        return true;
    if (!options->common.json) {
        comparison_print(c, options, drawn);
        return true;
    }
    json_t *json = comparison_json(c, options, drawn);
    if (!json)
        return fail_no_memory(failure);
    json_print(json, true);
    json_decref(json);
    return true;
}

/* Files are opened before anything is computed, and the picture appears when all went well. */
static bool compare_files(const struct compare_options *options, const char *const *files,
                          struct comparison *c, struct output_file *file, struct failure *failure)
{
    struct compare_picture drawn = {.file = options->output_file,
                                    .map = options->map ? options->map : "flip"};
    enum image_format format;
    if (drawn.file && (!picture_format(drawn.file, &format, failure) ||
                       !output_file_open(file, drawn.file, failure)))
        return false;
    if (!compare_input_load(&c->image, files[0], options->layer, failure) ||
        !compare_input_load(&c->reference, files[1], options->layer, failure) ||
        !comparison_measure(c, options, failure))
        return false;
    if (drawn.file && (!encode_picture(c, options, format, &drawn, file, failure) ||
                       !output_file_commit(file, failure)))
        return false;
    return print_results(c, options, &drawn, failure);
}

static bool compare_run(void *context, const struct text_list *operands, struct failure *failure)
{
    const struct compare_options *options = context;
    struct output_file file = {0};
    if (!strcmp(operands->items[0], "-") && !strcmp(operands->items[1], "-"))
        return fail(failure, EXIT_CODE_USAGE, "only one of the images can be stdin");
    if (!compare_options_check(options, failure))
        return false;
    struct comparison *c = calloc(1, sizeof *c);
    if (!c)
        return fail_no_memory(failure);
    bool is_ok = compare_files(options, operands->items, c, &file, failure);
    if (is_ok && !comparison_passes(c, options))
        failure->exit_code = EXIT_CODE_DIFFERENT; /* said on stdout; it is no error */
    output_file_finish(&file);
    comparison_finish(c);
    free(c);
    return is_ok;
}

static const struct command COMMAND = {COMPARE_COMMAND, .run = compare_run};

int main(int argc, char **argv)
{
    struct compare_options options = {0};
    struct text_list operands = {0};
    struct failure failure = {0};
    if (options_parse(&COMMAND, argc, argv, &options, &operands, &failure)) {
        if (options.common.help)
            options_print_help(&COMMAND);
        else
            compare_run(&options, &operands, &failure);
    }
    text_list_finish(&operands);
    options_finish(&COMMAND, &options);
    if (fflush(stdout) != 0 || ferror(stdout))
        fail(&failure, EXIT_CODE_CANT_CREATE, "cannot write to stdout");
    if (failure.exit_code && failure.message[0])
        failure_print(&failure, options.common.json);
    return failure.exit_code;
}
