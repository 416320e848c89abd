/* SPDX-License-Identifier: MIT */
/* Questions as JSON. */
#include "server/mapping/questions.h"

#include <string.h>

json_t *pick_make_step(const struct pick_desc *desc)
{
    return json_pack("{s:s,s:f,s:f,s:i,s:i,s:b}", "step", "pick", "x", desc->x, "y", desc->y,
                     "width", desc->width, "height", desc->height, "through", desc->is_through);
}

bool pick_is_step(const json_t *step)
{
    const char *name = json_string_value(json_object_get(step, "step"));
    return name && strcmp(name, "pick") == 0;
}

void pick_read_step(const json_t *step, struct pick_desc *desc)
{
    *desc = (struct pick_desc){
        .x = json_number_value(json_object_get(step, "x")),
        .y = json_number_value(json_object_get(step, "y")),
        .width = (int)json_integer_value(json_object_get(step, "width")),
        .height = (int)json_integer_value(json_object_get(step, "height")),
        .is_through = json_is_true(json_object_get(step, "through")),
    };
}

bool warm_up_is_step(const json_t *question)
{
    return json_object_get(question, "warm_up") != NULL;
}

const char *warm_up_asked(const json_t *question)
{
    const char *what = json_string_value(json_object_get(question, "warm_up"));
    return what ? what : "";
}
