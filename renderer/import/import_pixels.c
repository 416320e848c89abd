/* SPDX-License-Identifier: MIT */
/* The pixels of images and their levels, on a thread for each processor. Images are begun in their
 * order, so that the problem of the first bad one is told whichever thread is ahead. All threads
 * but the caller's begin while the rest of the file is read: what is decoded before the layout of
 * the blob is known waits in memory. */
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/processors.h"
#include "renderer/image/image.h"
#include "renderer/import/importer.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/texture_levels.h"

enum { THREADS_MAX = 8 };

/* Of images that are decoded and not written, but for a single one that is larger: memory is
 * limited. */
#define PIXELS_AT_ONCE (32ull << 20)
#define PIXELS_AHEAD (8ull << 20) /* while the blob has no room for them yet */

struct pixel_image {
    struct scene_image record; /* as in the blob */
    struct image pixels;
    uint8_t *levels[2]; /* linear and sRGB, each owned; NULL where materials do not sample so */
};

struct pixel_job {
    const struct importer *importer;
    const struct scene_import_desc *desc;
    struct texture_tables *tables;
    struct pixel_image *images;
    uint64_t image_count;
    pthread_t threads[THREADS_MAX];
    uint64_t thread_count;

    pthread_mutex_t mutex; /* guards the rest, and desc->advance once there is a blob */
    pthread_cond_t changed;
    void *blob;          /* NULL until it has room for pixels */
    uint64_t first_byte; /* of the pixels, in the blob */
    uint64_t *decoded;   /* images that are to be written, decoded_count of them */
    uint64_t decoded_count, next, done, pixels_at_once, bad_image;
    bool is_abandoned, has_failed;
    struct error problem; /* of bad_image */
};

static uint64_t pixels_of(const struct scene_image *image)
{
    return (uint64_t)image->width_px * image->height_px;
}

static uint64_t levels_size(const struct scene_image *image)
{
    return texture_levels_bytes(image->width_px, image->height_px, 1);
}

/* Two texels at a time: most images are. */
static bool is_opaque(const uint8_t *pixels, size_t count)
{
    uint64_t all = UINT64_MAX, two;
    for (size_t i = 0; i + 1 < count; i += 2) {
        memcpy(&two, pixels + 4 * i, sizeof two);
        all &= two;
    }
    uint8_t bytes[sizeof all];
    memcpy(bytes, &all, sizeof all);
    return (bytes[3] & bytes[7] & (count > 0 ? pixels[4 * count - 1] : 255)) == 255;
}

static uint32_t least_alpha(const struct image *image)
{
    const uint8_t *pixels = image->pixels;
    size_t count = (size_t)image->width_px * (size_t)image->height_px;
    uint8_t least = 255;
    if (is_opaque(pixels, count))
        return least;
    for (size_t i = 0; i < count && least > 0; i++)
        least = pixels[4 * i + 3] < least ? pixels[4 * i + 3] : least;
    return least;
}

static bool build_levels(const struct texture_tables *tables, struct pixel_image *image,
                         struct error *err)
{
    const struct scene_image *record = &image->record;
    size_t size = levels_size(record);
    struct texture_levels_desc desc = {.tables = tables,
                                       .pixels = image->pixels.pixels,
                                       .width_px = record->width_px,
                                       .height_px = record->height_px};
    for (int i = 0; i < 2; i++) {
        if (!record->levels_offset_bytes[i])
            continue;
        image->levels[i] = malloc(size + 1);
        if (!image->levels[i])
            return error_set(err, ERROR_NO_MEMORY, "levels of %zu bytes", size);
        desc.is_srgb = i == 1;
        texture_levels_build(&desc, image->levels[i]);
    }
    return true;
}

static bool decode(const struct pixel_job *job, uint64_t i, struct error *err)
{
    struct pixel_image *image = &job->images[i];
    struct gltf_bytes bytes;
    struct image_decode_desc desc = {.max_pixels = job->importer->max_image_pixels,
                                     .takes_old = job->importer->takes_old_images};
    bool is_done = import_open_image(job->importer, job->importer->image_source[i], &bytes, err) &&
                   image_decode(bytes.bytes, bytes.size_bytes, &desc, &image->pixels, err) &&
                   build_levels(job->tables, image, err);
    free(bytes.owned);
    if (is_done)
        image->record.least_alpha = least_alpha(&image->pixels);
    return is_done;
}

static bool write_bytes(const struct pixel_job *job, uint64_t offset, const void *bytes,
                        size_t size, struct error *err)
{
    offset += job->first_byte;
    if (job->desc->write)
        return job->desc->write(job->desc->context, offset, bytes, size, err);
    memcpy((char *)job->blob + offset, bytes, size);
    return true;
}

static bool write_image(const struct pixel_job *job, const struct pixel_image *image,
                        struct error *err)
{
    const struct scene_image *record = &image->record;
    bool is_done = write_bytes(job, record->offset_bytes, image->pixels.pixels,
                               image_size_bytes(&image->pixels), err);
    for (int i = 0; i < 2 && is_done; i++)
        is_done = !image->levels[i] || write_bytes(job, record->levels_offset_bytes[i],
                                                   image->levels[i], levels_size(record), err);
    return is_done;
}

static void free_pixels(struct pixel_image *image)
{
    image_finish(&image->pixels);
    for (int i = 0; i < 2; i++) {
        free(image->levels[i]);
        image->levels[i] = NULL;
    }
}

/* The first bad image is the one that is told. The caller holds the mutex. */
static void keep_problem(struct pixel_job *job, uint64_t image, const struct error *problem)
{
    if (job->has_failed && job->bad_image < image)
        return;
    job->problem = *problem;
    job->bad_image = image;
    job->has_failed = true;
}

static bool has_room(const struct pixel_job *job)
{
    uint64_t room = job->blob ? PIXELS_AT_ONCE : PIXELS_AHEAD;
    return job->pixels_at_once == 0 ||
           job->pixels_at_once + pixels_of(&job->images[job->next].record) <= room;
}

/* Waits for what can be done: an image that is decoded is to be written, or the next one has room.
 * False: nothing is left to begin. The caller holds the mutex. */
static bool take(struct pixel_job *job, uint64_t *image, bool *is_decoded)
{
    while (!job->has_failed && !job->is_abandoned) {
        bool is_last_begun = job->next == job->image_count;
        *is_decoded = job->blob && job->decoded_count > 0;
        if (*is_decoded) {
            *image = job->decoded[--job->decoded_count];
            return true;
        }
        if (!is_last_begun && has_room(job)) {
            *image = job->next++;
            job->pixels_at_once += pixels_of(&job->images[*image].record);
            return true;
        }
        if (is_last_begun && job->blob)
            return false;
        pthread_cond_wait(&job->changed, &job->mutex);
    }
    return false;
}

/* The caller holds the mutex. */
static void put_back(struct pixel_job *job, uint64_t image, bool is_written)
{
    if (is_written) {
        job->pixels_at_once -= pixels_of(&job->images[image].record);
        importer_advance(job->importer, SCENE_IMPORT_IMAGES, ++job->done, job->image_count);
    } else {
        job->decoded[job->decoded_count++] = image;
    }
}

static void *run(void *argument)
{
    struct pixel_job *job = argument;
    uint64_t image;
    bool is_decoded;
    pthread_mutex_lock(&job->mutex);
    while (take(job, &image, &is_decoded)) {
        struct error problem = {0};
        pthread_mutex_unlock(&job->mutex);
        bool is_good = is_decoded ? write_image(job, &job->images[image], &problem)
                                  : decode(job, image, &problem);
        if (is_decoded)
            free_pixels(&job->images[image]);
        pthread_mutex_lock(&job->mutex);
        if (is_good)
            put_back(job, image, is_decoded);
        else
            keep_problem(job, image, &problem);
        pthread_cond_broadcast(&job->changed);
    }
    pthread_mutex_unlock(&job->mutex);
    return NULL;
}

static bool job_init(struct pixel_job *job, const struct importer *importer, struct error *err)
{
    const struct blob_section *images = &importer->writer.sections[SCENE_IMAGES];
    *job = (struct pixel_job){.importer = importer,
                              .desc = importer->desc,
                              .tables = texture_tables_create(err),
                              .images = calloc(images->count, sizeof *job->images),
                              .image_count = images->count,
                              .decoded = calloc(images->count, sizeof *job->decoded)};
    if (!job->tables)
        return false;
    if (!job->images || !job->decoded)
        return error_set(err, ERROR_NO_MEMORY, "%zu images", (size_t)images->count);
    const struct scene_image *records = images->records;
    for (uint64_t i = 0; i < images->count; i++)
        job->images[i].record = records[i];
    return true;
}

struct pixel_job *import_pixels_begin(const struct importer *importer, struct error *err)
{
    struct pixel_job *job = malloc(sizeof *job);
    if (!job) {
        error_set(err, ERROR_NO_MEMORY, "images");
        return NULL;
    }
    bool is_ready = job_init(job, importer, err);
    pthread_mutex_init(&job->mutex, NULL);
    pthread_cond_init(&job->changed, NULL);
    if (!is_ready) {
        import_pixels_destroy(job);
        return NULL;
    }
    uint64_t wanted = (uint64_t)processors_usable();
    wanted = wanted < job->image_count ? wanted : job->image_count;
    wanted = wanted < THREADS_MAX ? wanted : THREADS_MAX;
    while (job->thread_count + 1 < wanted &&
           pthread_create(&job->threads[job->thread_count], NULL, run, job) == 0)
        job->thread_count++;
    return job;
}

static void join(struct pixel_job *job)
{
    for (uint64_t i = 0; i < job->thread_count; i++)
        pthread_join(job->threads[i], NULL);
    job->thread_count = 0;
}

bool import_pixels_end(struct pixel_job *job, void *blob, struct error *err)
{
    const struct scene_header *header = blob;
    struct scene_image *records = (void *)((char *)blob + header->sections[SCENE_IMAGES].offset);
    pthread_mutex_lock(&job->mutex);
    job->blob = blob;
    job->first_byte = header->sections[SCENE_PIXELS].offset;
    pthread_cond_broadcast(&job->changed);
    pthread_mutex_unlock(&job->mutex);
    run(job); /* does it alone where no thread can be had */
    join(job);
    for (uint64_t i = 0; i < job->image_count; i++)
        records[i].least_alpha = job->images[i].record.least_alpha;
    if (!job->has_failed)
        return true;
    const char *strings = (const char *)blob + header->sections[SCENE_STRINGS].offset;
    error_wrap(&job->problem, "image %u '%s'", job->importer->image_source[job->bad_image],
               strings + records[job->bad_image].name);
    return error_pass(err, &job->problem);
}

void import_pixels_destroy(struct pixel_job *job)
{
    if (!job)
        return;
    pthread_mutex_lock(&job->mutex);
    job->is_abandoned = true;
    pthread_cond_broadcast(&job->changed);
    pthread_mutex_unlock(&job->mutex);
    join(job);
    for (uint64_t i = 0; job->images && i < job->image_count; i++)
        free_pixels(&job->images[i]);
    pthread_cond_destroy(&job->changed);
    pthread_mutex_destroy(&job->mutex);
    texture_tables_destroy(job->tables);
    free(job->images);
    free(job->decoded);
    free(job);
}
