/* SPDX-License-Identifier: MIT */
/* KHR_materials_variants: the names of the variants, and the material that each gives to a
 * primitive. */
#include "renderer/import/importer.h"

bool import_variants(struct importer *importer, struct error *err)
{
    const struct gltf_document *document = importer->document;
    for (size_t i = 0; i < document->variant_count; i++)
        if (!blob_writer_add_line(&importer->writer, SCENE_VARIANTS, document->variants[i], err))
            return false;
    return true;
}

/* A variant has one material at most; records since `first` are those of the primitive. */
static bool add(struct importer *importer, int variant, int material, uint64_t first,
                struct error *err)
{
    const struct gltf_document *document = importer->document;
    const struct blob_section *section = &importer->writer.sections[SCENE_VARIANT_MATERIALS];
    const struct scene_variant_material *records = section->records;
    if (variant < 0 || (size_t)variant >= document->variant_count)
        return error_set(err, ERROR_INVALID_SCENE, "KHR_materials_variants: there is no variant %d",
                         variant);
    for (uint64_t i = first; i < section->count; i++)
        if (records[i].variant == (uint32_t)variant)
            return error_set(err, ERROR_INVALID_SCENE,
                             "KHR_materials_variants: variant %d has two materials", variant);
    struct scene_variant_material *record =
        blob_writer_append(&importer->writer, SCENE_VARIANT_MATERIALS, 1, err);
    if (!record)
        return false;
    *record = (struct scene_variant_material){
        .variant = (uint32_t)variant,
        .primitive = (uint32_t)importer->writer.sections[SCENE_PRIMITIVES].count - 1,
        .material = (uint32_t)material,
    };
    return true;
}

bool import_variant_materials(struct importer *importer, const struct gltf_primitive *from,
                              struct error *err)
{
    const uint64_t first = importer->writer.sections[SCENE_VARIANT_MATERIALS].count;
    for (size_t i = 0; i < from->mapping_count; i++) {
        const struct gltf_variant_mapping *mapping = &from->mappings[i];
        if (mapping->material < 0 ||
            (size_t)mapping->material >= importer->document->material_count)
            return error_set(err, ERROR_INVALID_SCENE,
                             "KHR_materials_variants: there is no material %d", mapping->material);
        for (size_t k = 0; k < mapping->variants.count; k++)
            if (!add(importer, mapping->variants.values[k], mapping->material, first, err))
                return false;
    }
    return true;
}
