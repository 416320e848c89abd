/* SPDX-License-Identifier: MIT */
/* vitrail demo-scene: writes the project's own chapel as a .glb. */
#include <stdio.h>
#include <stdlib.h>

#include "glb/demo_scene.h"
#include "clients/vitrail/commands.h"
#include "clients/vitrail/output_file.h"

struct demo_scene_options {
    struct common_options common;
    const char *output;
    struct option_number texture_size_px, light_factor;
    bool no_curtains;
};

static bool demo_scene_run(void *context, const struct text_list *operands, struct failure *failure)
{
    const struct demo_scene_options *options = context;
    double size_px = options->texture_size_px.value;
    struct output_file file = {0};
    struct error err = {0};
    void *glb = NULL;
    size_t size_bytes = 0;
    bool is_ok;

    (void)operands;
    if (!options->output)
        return fail(failure, EXIT_CODE_USAGE, "demo-scene needs an output: -o FILE.glb");
    if (size_px < 0 || size_px > 4096 || size_px != (double)(int)size_px)
        return fail(failure, EXIT_CODE_USAGE, "--texture-size: pixels, from 64 to 4096");
    is_ok = output_file_open(&file, options->output, failure);
    if (is_ok &&
        !demo_scene_build(&(struct demo_scene_desc){.texture_size_px = (int)size_px,
                                                    .light_factor = options->light_factor.value,
                                                    .has_no_curtains = options->no_curtains},
                          &glb, &size_bytes, &err))
        is_ok = fail(failure, err.code == ERROR_NO_MEMORY ? EXIT_CODE_OS_ERROR : EXIT_CODE_USAGE,
                     "the demo scene: %s", err.message);
    is_ok = is_ok && output_file_write(&file, glb, size_bytes, failure) &&
            output_file_commit(&file, failure);
    output_file_finish(&file);
    free(glb);
    return is_ok;
}

#define AT(member) offsetof(struct demo_scene_options, member)

static const struct option OPTIONS[] = {
    {OPTION_TEXT, "output-file", 'o', "FILE", "where the scene goes; - is stdout", AT(output)},
    {OPTION_NUMBER, "texture-size", 0, "N", "side of the rose window's texture; default 1024",
     AT(texture_size_px)},
    {OPTION_NUMBER, "light-factor", 0, "F", "on every light; default 1", AT(light_factor)},
    {OPTION_FLAG, "no-curtains", 0, NULL, "leave the coloured curtains out", AT(no_curtains)},
    {0},
};

const struct command COMMAND_DEMO_SCENE = {
    .name = "demo-scene",
    .synopsis = "-o FILE.glb",
    .summary = "Write the demo scene, a chapel with stained-glass windows, as a .glb",
    .details = "Needs no server. The same program always writes the same bytes.",
    .options = OPTIONS,
    .options_bytes = sizeof(struct demo_scene_options),
    .run = demo_scene_run,
};
