/* SPDX-License-Identifier: MIT */
/* Composition of all stages of a program. */
#include "renderer/gl/program_source.h"

#include <inttypes.h>
#include <stdio.h>

bool program_source_init(struct program_source *source, const struct program_desc *desc,
                         const char *device_defines, struct error *err)
{
    *source = (struct program_source){
        .files = {desc->vertex, desc->tessellation[0], desc->tessellation[1], desc->geometry,
                  desc->fragment, desc->compute},
        .key = content_key_begin(),
    };
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        if (source->files[i] && !composition_init(&source->stages[i], source->files[i],
                                                  device_defines, desc->defines, err)) {
            program_source_finish(source);
            return false;
        }
        content_key_add_text(&source->key, source->stages[i].text);
    }
    snprintf(source->id, sizeof source->id, "%016" PRIx64, source->key.words[0]);
    return true;
}

void program_source_finish(struct program_source *source)
{
    for (int i = 0; i < PROGRAM_STAGES; i++)
        composition_finish(&source->stages[i]);
    *source = (struct program_source){0};
}

void program_source_file_name(const struct program_source *source, int stage,
                              char name[PROGRAM_FILE_NAME_BYTES])
{
    snprintf(name, PROGRAM_FILE_NAME_BYTES, "%s-%s", source->id, source->files[stage]);
}
