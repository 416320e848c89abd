/* SPDX-License-Identifier: MIT */
/* Skins are not evaluated, so that what is wrong with one changes no picture: a warning tells it.
 * glTF 2.0, section 5.28. */
#include <stdio.h>
#include <stdlib.h>

#include "renderer/import/importer.h"

enum { DEPTH = 8 /* of what is passed over, from the root of the document */ };

struct skins {
    struct importer *importer;
    size_t seen, broken; /* skins so far */
    char reason[120];    /* what is wrong with the first broken one */
};

struct skin {
    size_t node_count; /* of the document */
    size_t joint_count;
    int64_t bad_joint;          /* the first that is no node; -1 */
    int64_t matrices, skeleton; /* an accessor, a node; -1 when absent */
};

static bool scan_index(struct scanner *s, int64_t *index)
{
    uint64_t number;
    if (!scanner_unsigned(s, &number))
        return false;
    *index = number > INT32_MAX ? INT32_MAX : (int64_t)number;
    return true;
}

static bool scan_joint(struct scanner *s, void *list)
{
    struct skin *skin = list;
    int64_t joint;
    if (!scan_index(s, &joint))
        return false;
    skin->joint_count++;
    if (joint >= (int64_t)skin->node_count && skin->bad_joint < 0)
        skin->bad_joint = joint;
    return true;
}

static bool scan_skin_member(struct scanner *s, struct span key, void *object)
{
    struct skin *skin = object;
    if (span_is(key, "joints"))
        return scanner_array(s, scan_joint, skin);
    if (span_is(key, "inverseBindMatrices"))
        return scan_index(s, &skin->matrices);
    if (span_is(key, "skeleton"))
        return scan_index(s, &skin->skeleton);
    return scanner_skip(s, DEPTH);
}

/* Says what is wrong with the skin; false where nothing is. */
static bool is_broken(const struct skin *skin, const struct gltf_document *document, char *reason,
                      size_t capacity)
{
    if (skin->joint_count == 0)
        return snprintf(reason, capacity, "has no joints");
    if (skin->bad_joint >= 0)
        return snprintf(reason, capacity, "has the joint %lld, but there is no such node",
                        (long long)skin->bad_joint);
    if (skin->skeleton >= (int64_t)document->node_count)
        return snprintf(reason, capacity, "has the skeleton %lld, but there is no such node",
                        (long long)skin->skeleton);
    if (skin->matrices < 0)
        return false;
    if (skin->matrices >= (int64_t)document->accessor_count)
        return snprintf(reason, capacity, "has no accessor %lld for its inverse bind matrices",
                        (long long)skin->matrices);
    uint64_t count = document->accessors[skin->matrices].count;
    return count < skin->joint_count &&
           snprintf(reason, capacity, "has %zu joints, but inverse bind matrices for %llu",
                    skin->joint_count, (unsigned long long)count);
}

static bool scan_skin(struct scanner *s, void *list)
{
    struct skins *skins = list;
    const struct gltf_document *document = skins->importer->document;
    struct skin skin = {
        .node_count = document->node_count, .bad_joint = -1, .matrices = -1, .skeleton = -1};
    char reason[sizeof skins->reason - 32];
    if (!scanner_object(s, scan_skin_member, &skin))
        return false;
    if (is_broken(&skin, document, reason, sizeof reason) && skins->broken++ == 0)
        snprintf(skins->reason, sizeof skins->reason, "skin %zu %s", skins->seen, reason);
    skins->seen++;
    return true;
}

/* The first node that names a skin which is not there. */
static bool find_lost_node(const struct importer *importer, size_t *node)
{
    const struct gltf_document *document = importer->document;
    for (*node = 0; *node < document->node_count; ++*node)
        if (document->nodes[*node].skin >= (int64_t)importer->json.skin_count)
            return true;
    return false;
}

bool import_skins(struct importer *importer, struct error *err)
{
    struct span text = importer->json.skins;
    struct scanner s = {.text = text.begin, .at = text.begin, .end = text.end, .err = err};
    struct skins skins = {.importer = importer};
    size_t node;
    if (text.begin && !scanner_array(&s, scan_skin, &skins))
        return error_wrap(err, "skins");
    if (skins.broken > 0 &&
        !importer_warn(importer, err, "%zu %s broken: %s", skins.broken,
                       skins.broken == 1 ? "skin is" : "skins are", skins.reason))
        return false;
    return !find_lost_node(importer, &node) ||
           importer_warn(importer, err, "node %zu has the skin %d, but there is no such skin", node,
                         importer->document->nodes[node].skin);
}
