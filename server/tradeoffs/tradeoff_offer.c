/* SPDX-License-Identifier: MIT */
/* Collects what the worker may choose from: rows measured for a view, for other views of its scene,
 * and counts for the models. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/mapping/choice_offer.h"
#include "server/tradeoffs/tradeoffs_internal.h"

/* Rows of other methods for transparent surfaces count for the view that was measured alone: their
 * error is one of order, which another camera sees otherwise. */
static void add_rows(struct choice_rows *rows, const struct tradeoff *document, bool is_of_view,
                     bool is_warm)
{
    for (int i = 0; i < document->row_count; i++) {
        const struct tradeoff_row *row = &document->rows[i];
        const struct tradeoff_times *times = is_warm ? &row->warm : &row->cold;
        if (times->count > 0 && (is_of_view || row->setting.transparency == TRANSPARENCY_AUTO))
            rows->rows[rows->count++] = (struct choice_row){
                .setting = row->setting,
                .ms = tradeoff_times_max(times),
                .error = row->rmse,
            };
    }
}

static bool has_times(const struct tradeoff *document)
{
    for (int i = 0; i < document->row_count; i++)
        if (document->rows[i].warm.count > 0)
            return true;
    return false;
}

/* The newest measurement of the view (key not NULL), or of the scene with the nearest size. */
static void find_measured(struct tradeoffs *tradeoffs, const struct tradeoff_view *view,
                          const char *key, bool is_warm, struct choice_rows *rows)
{
    char device[TRADEOFF_DEVICE_BYTES];
    const struct tradeoff *best = NULL;
    double pixels = (double)view->width_px * view->height_px, best_ratio = INFINITY;
    if (!tradeoffs_device_name(tradeoffs, device))
        return;
    pthread_mutex_lock(&tradeoffs->mutex);
    for (int i = tradeoffs->count; i-- > 0;) {
        const struct tradeoff *document = &tradeoffs->entries[i]->document;
        double ratio = fabs(log(pixels / ((double)document->width * document->height)));
        if (strcmp(document->scene, view->scene) != 0 || strcmp(document->device, device) != 0 ||
            !has_times(document) || (key && strcmp(document->view_key, key) != 0) ||
            ratio >= best_ratio)
            continue;
        best = document;
        best_ratio = ratio;
    }
    if (best)
        add_rows(rows, best, key != NULL, is_warm);
    for (size_t i = 0; best && i < rows->count; i++)
        rows->rows[i] = choice_scale(&rows->rows[i], (double)best->width * best->height, pixels);
    pthread_mutex_unlock(&tradeoffs->mutex);
}

static bool scene_has_grids(struct tradeoffs *tradeoffs, const char *scene)
{
    json_t *summary = resource_store_get_summary(tradeoffs->desc.resources->scenes, scene, NULL);
    bool has_grids = json_integer_value(json_object_get(summary, "density_grid_count")) > 0;
    json_decref(summary);
    return has_grids;
}

bool tradeoffs_has_grids(struct tradeoffs *tradeoffs, const char *scene,
                         const struct request_resources *resources)
{
    bool has_grids = scene_has_grids(tradeoffs, scene);
    for (int i = 0; i < resources->scene_count && !has_grids; i++)
        has_grids = scene_has_grids(tradeoffs, resources->scenes[i]);
    return has_grids;
}

static void add_counts(struct tradeoffs *tradeoffs, const struct tradeoff_view *view,
                       struct choice_offer *offer)
{
    const char *scene = view->scene;
    json_t *summary = resource_store_get_summary(tradeoffs->desc.resources->scenes, scene, NULL);
    offer->triangles = (uint64_t)json_integer_value(json_object_get(summary, "triangles"));
    offer->scene_lights = (uint64_t)json_integer_value(json_object_get(summary, "light_count"));
    json_decref(summary);
    offer->has_grids = tradeoffs_has_grids(tradeoffs, scene, view->resources);
}

/* Whether any measurement on this device is of the scene. */
static bool has_measured(struct tradeoffs *tradeoffs, const char *scene)
{
    bool is_found = false;
    pthread_mutex_lock(&tradeoffs->mutex);
    for (int i = 0; i < tradeoffs->count && !is_found; i++)
        is_found = strcmp(tradeoffs->entries[i]->document.scene, scene) == 0;
    pthread_mutex_unlock(&tradeoffs->mutex);
    return is_found;
}

bool tradeoffs_offer(struct tradeoffs *tradeoffs, const struct tradeoff_view *view, bool is_warm,
                     json_t **made, struct error *err)
{
    bool asks = request_quality_asks(view->quality);
    bool is_measured = has_measured(tradeoffs, view->scene);
    char key[65], *text = NULL;
    *made = NULL;
    if (view->quality->reference || (!asks && view->quality->shadows != SHADOWS_AUTO) ||
        (!asks && !is_measured))
        return true;
    struct choice_offer *offer = calloc(1, sizeof *offer);
    bool is_good = offer || error_set(err, ERROR_NO_MEMORY, "choice");
    if (is_good && is_measured) {
        text = view->reference_text(view->context);
        is_good = tradeoff_view_key(text, key, err);
        free(text);
    }
    if (is_good && is_measured)
        find_measured(tradeoffs, view, key, is_warm, &offer->view);
    if (is_good && asks) {
        find_measured(tradeoffs, view, NULL, is_warm, &offer->scene);
        add_counts(tradeoffs, view, offer);
    }
    if (is_good && (asks || offer->view.count > 0))
        is_good =
            (*made = choice_offer_to_json(offer)) || error_set(err, ERROR_NO_MEMORY, "choice");
    free(offer);
    return is_good;
}
