/* SPDX-License-Identifier: MIT */
/* What layers of every method have in common. */
#include "renderer/transparency/layers.h"

#include "renderer/transparency/method.h"

bool layers_change_method(struct layers *layers, const struct transparency_method *method)
{
    uint64_t most_bytes = layers->most_bytes;
    if (layers->method == method)
        return false;
    layers_finish(layers);
    *layers = (struct layers){.method = method, .most_bytes = most_bytes};
    return true;
}

void layers_set_budget(struct layers *layers, uint64_t bytes)
{
    layers->most_bytes = bytes ? bytes : 1;
}

void layers_clear(struct layers *layers)
{
    layers->layer_count = layers->longest = layers->missing_bytes = 0;
    layers->has_media = layers->may_surround = layers->is_guessed = layers->is_counted = false;
    if (layers->method)
        layers->method->clear(layers);
}

void layers_finish(struct layers *layers)
{
    if (layers->method)
        layers->method->finish(layers);
    *layers = (struct layers){.method = layers->method};
}

uint64_t layers_size_bytes(const struct layers *layers)
{
    return layers->method ? layers->method->size_bytes(layers) : 0;
}
