/* SPDX-License-Identifier: MIT */
/* The list of what the access tracker lets pass. The tracker sees whole bindings: commands that
 * write to disjoint ranges of one buffer look to it as if they met. */
#include "tests/support/gl_access_allowed.h"

#include <fnmatch.h>
#include <stddef.h>

/* Names of programs are "label (defines)"; each text may have shell wildcards. A pair of dispatches
 * that is let pass here is still run in another order by gl_order.c, and must give the same. */
static const struct {
    const char *first, *second, *object, *reason;
} allowed[] = {
    {"selftest.raster*", "selftest.raster*", "selftest.results",
     "fragments are counted by atomic additions, and each pixel notes its own mask"},
    {"texture_speed*", "texture_speed*", "texture_speed*",
     "the sums are there so that no texture is left unread; nobody reads them"},
    {"shadow.caster*", "shadow.caster*", "shadow.*",
     "deep: fragments are counted, and take places of their own, by atomic additions; linked: a "
     "texel's list is locked while a node is inserted"},
    {"shadow.linked.walk*", "shadow.linked.walk*", "shadow.*.statistics",
     "lists are counted by atomic additions and maxima"},
    {"shadow.deep.scan*PASS 0*", "shadow.deep.scan*PASS 0*", "shadow.*",
     "each group of lights has heads, sums, statistics and lists of its own"},
    {"shadow.deep.scan*PASS 1*", "shadow.deep.scan*PASS 1*", "shadow.*", "likewise"},
    {"shadow.deep.scan*PASS 2*", "shadow.deep.scan*PASS 2*", "shadow.*", "likewise"},
    {"shadow.deep.sort*", "shadow.deep.sort*", "shadow.deep.events",
     "each light and each class of lengths has events of its own"},
    {"shadow.deep.sort*", "shadow.deep.sort*", "shadow.deep.keys", "likewise"},
    {"shadow.deep.sort*", "shadow.deep.sort*", "shadow.deep.media", "likewise"},
    {"shadow.deep.sort*", "shadow.deep.sort*", "shadow.deep.objects", "likewise"},
    {"shadow.deep.sort*", "shadow.deep.sort*", "shadow.deep.scratch*",
     "each class has lists of its own there, and a step of all classes ends with a barrier"},
    {"lights.linked.insert*", "lights.linked.insert*", "lights.linked.*",
     "a tile's list is locked while a light is inserted"},
    {"lists_count.frag.glsl*", "lists_count.frag.glsl*", "lists.left",
     "fragments are counted by atomic additions"},
    {"lists_scatter.frag.glsl*", "lists_scatter.frag.glsl*", "lists.*",
     "a fragment takes its place by an atomic addition, and writes there alone"},
    {"sorted_scatter.frag.glsl*", "sorted_scatter.frag.glsl*", "lists.*", "likewise"},
};

bool gl_access_is_allowed(const struct gl_pair *pair)
{
    for (size_t i = 0; i < sizeof allowed / sizeof *allowed; i++)
        if (!fnmatch(allowed[i].first, pair->first, 0) &&
            !fnmatch(allowed[i].second, pair->second, 0) &&
            !fnmatch(allowed[i].object, pair->object, 0))
            return true;
    return false;
}
