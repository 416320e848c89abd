/* SPDX-License-Identifier: MIT */
/* What is known of tiles lives as long as their frame is not done. */
#include "server/jobs/job_tiles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/front/state_dir.h"
#include "server/jobs/jobs_internal.h"

bool farm_job_has_tiles(const struct farm_job *job)
{
    return job->tiles.columns > 0;
}

static int tile_count(const struct farm_job *job)
{
    return picture_tiles_count(&job->tiles);
}

static struct farm_tile *tile_of(const struct farm_job *job, const struct farm_frame *frame,
                                 int output, int tile)
{
    return &frame->tiles[(size_t)output * (size_t)tile_count(job) + (size_t)tile];
}

static bool has_file(const struct farm_frame *frame, int output)
{
    return frame->files && frame->files[output].size_bytes > 0;
}

bool farm_tiles_find(const struct farm_job *job, const struct farm_frame *frame, bool may_assemble,
                     int *output, int *tile)
{
    for (*output = 0; *output < job->request.output_count; ++*output) {
        bool are_done = frame->tiles;
        if (has_file(frame, *output) || frame->in_flight & 1u << *output)
            continue;
        for (*tile = 0; *tile < tile_count(job); ++*tile) {
            enum farm_tile_state state =
                frame->tiles ? tile_of(job, frame, *output, *tile)->state : FARM_TILE_TO_DO;
            if (state == FARM_TILE_TO_DO)
                return true;
            are_done = are_done && state == FARM_TILE_DONE;
        }
        *tile = TILE_ASSEMBLY;
        if (are_done && may_assemble)
            return true;
    }
    return false;
}

static bool prepare(const struct farm_job *job, struct farm_frame *frame)
{
    size_t count = (size_t)job->request.output_count * (size_t)tile_count(job);
    if (!frame->tiles)
        frame->tiles = calloc(count, sizeof *frame->tiles);
    return frame->tiles;
}

bool farm_tiles_begin(struct farm_job *job, int position, int output, int tile)
{
    struct farm_frame *frame = &job->frames[position];
    if (!prepare(job, frame))
        return false;
    tile_of(job, frame, output, tile)->state = FARM_TILE_IN_FLIGHT;
    frame->tiles_in_flight++;
    return true;
}

static struct farm_tile *tile_of_piece(const struct job_piece *piece)
{
    return tile_of(piece->job, &piece->job->frames[piece->position], piece->output, piece->tile);
}

void farm_tiles_end(const struct job_piece *piece)
{
    piece->job->frames[piece->position].tiles_in_flight--;
    tile_of_piece(piece)->state = FARM_TILE_TO_DO;
}

void farm_tiles_note_done(const struct job_piece *piece)
{
    tile_of_piece(piece)->state = FARM_TILE_DONE;
    piece->job->tiles_done++;
    piece->job->tiles_ms += piece->ms;
}

int farm_tiles_note_failure(const struct job_piece *piece)
{
    return ++tile_of_piece(piece)->attempts;
}

void farm_tiles_forget_attempts(const struct farm_job *job, struct farm_frame *frame)
{
    size_t count = (size_t)job->request.output_count * (size_t)tile_count(job);
    for (size_t i = 0; frame->tiles && i < count; i++)
        frame->tiles[i].attempts = 0;
}

void farm_tiles_lose(const struct job_piece *piece)
{
    struct farm_job *job = piece->job;
    const struct farm_frame *frame = &job->frames[piece->position];
    for (int i = 0; frame->tiles && i < tile_count(job); i++) {
        struct farm_tile *tile = tile_of(job, frame, piece->output, i);
        job->tiles_done -= tile->state == FARM_TILE_DONE;
        tile->state = FARM_TILE_TO_DO;
    }
}

/* Of outputs whose file is there all are done, whatever became of the files of tiles. */
void farm_tiles_count(const struct farm_job *job, double *done, double *all)
{
    double each = tile_count(job), outputs = job->request.output_count;
    *all = each * outputs * (double)job->request.frames.count;
    *done = each * outputs * (job->done_count + job->failed_count);
    for (int i = job->next; i < (int)job->request.frames.count; i++) {
        const struct farm_frame *frame = &job->frames[i];
        bool has_ended = frame->state == FARM_FRAME_DONE || frame->state == FARM_FRAME_FAILED;
        for (int k = 0; k < job->request.output_count && !has_ended; k++) {
            if (has_file(frame, k))
                *done += each;
            for (int t = 0; frame->tiles && !has_file(frame, k) && t < tile_count(job); t++)
                *done += tile_of(job, frame, k, t)->state == FARM_TILE_DONE;
        }
    }
}

void farm_tiles_request(const struct farm_job *job, int tile, struct render_request *render)
{
    render->tile = picture_tiles_get(&job->tiles, tile);
    render->format = render->format == REQUEST_FORMAT_EXR ? REQUEST_FORMAT_EXR : REQUEST_FORMAT_PNG;
    render->quality_percent = 0;
}

/* ---- files ---- */

static struct job_place own_place(const struct farm_job *job)
{
    return (struct job_place){.id = job->record.id, .directory = ""};
}

void job_tile_prefix(const struct job_piece *piece, char name[TILE_NAME_BYTES])
{
    snprintf(name, TILE_NAME_BYTES, ".tile-%d-%d-", piece->position, piece->output);
}

bool farm_tiles_keep(struct jobs *jobs, const struct job_piece *piece, struct error *err)
{
    const struct job_place place = own_place(piece->job);
    char prefix[TILE_NAME_BYTES], name[TILE_NAME_BYTES + 16], digest[DIGEST_TEXT_BYTES];
    uint64_t size_bytes;
    job_tile_prefix(piece, prefix);
    snprintf(name, sizeof name, "%s%d", prefix, piece->tile);
    return job_results_put(jobs->results, &place, name, piece->image_fd, &size_bytes, digest, err);
}

void farm_tiles_remove(struct jobs *jobs, const struct job_piece *piece)
{
    const struct job_place place = own_place(piece->job);
    struct error ignored = {0};
    char prefix[TILE_NAME_BYTES], name[TILE_NAME_BYTES + 16];
    int folder_fd = job_results_folder(jobs->results, &place, &ignored);
    job_tile_prefix(piece, prefix);
    for (int i = 0; folder_fd >= 0 && i < tile_count(piece->job); i++) {
        snprintf(name, sizeof name, "%s%d", prefix, i);
        unlinkat(folder_fd, name, 0);
    }
    if (folder_fd >= 0)
        close(folder_fd);
}

struct loading {
    struct farm_job *job;
    int folder_fd;
    bool drops_all;
};

/* A tile that counts is noted; any other is removed. */
static void load_tile(void *context, const char *name)
{
    struct loading *loading = context;
    struct farm_job *job = loading->job;
    int position, output, tile, end = 0;
    if (sscanf(name, ".tile-%9d-%9d-%9d%n", &position, &output, &tile, &end) != 3 || name[end])
        return;
    bool is_known = position >= 0 && position < (int)job->request.frames.count && output >= 0 &&
                    output < job->request.output_count && tile >= 0 && tile < tile_count(job);
    struct farm_frame *frame = is_known ? &job->frames[position] : NULL;
    if (loading->drops_all || !frame || frame->state != FARM_FRAME_QUEUED ||
        has_file(frame, output) || !prepare(job, frame)) {
        unlinkat(loading->folder_fd, name, 0);
        return;
    }
    tile_of(job, frame, output, tile)->state = FARM_TILE_DONE;
    job->tiles_done++;
}

void farm_tiles_drop_draft(struct jobs *jobs, const struct job_piece *piece)
{
    const struct farm_job *job = piece->job;
    const struct job_place place = farm_job_place(job);
    char name[JOB_FILE_BYTES];
    job_file_name(&job->request.outputs[piece->output],
                  job->request.frames.numbers[piece->position], name);
    job_results_drop(jobs->results, &place, name);
}

static void walk_tiles(struct jobs *jobs, struct farm_job *job, bool drops_all)
{
    const struct job_place place = own_place(job);
    struct error ignored = {0};
    struct loading loading = {.job = job,
                              .folder_fd = job_results_folder(jobs->results, &place, &ignored),
                              .drops_all = drops_all};
    if (loading.folder_fd < 0)
        return;
    if (!state_dir_for_each(loading.folder_fd, load_tile, &loading, &ignored))
        log_write(jobs->desc.log, LOG_WARNING, "job %s: %s", job->record.id, ignored.message);
    close(loading.folder_fd);
}

void farm_tiles_clean(struct jobs *jobs, struct farm_job *job)
{
    if (farm_job_has_tiles(job))
        walk_tiles(jobs, job, true);
}

/* What the first tile chose for all is saved with the start of the job, or was not: then a tile may
 * be of other settings than those to come. */
void farm_tiles_load(struct jobs *jobs, struct farm_job *job)
{
    if (farm_job_has_tiles(job))
        walk_tiles(jobs, job,
                   farm_job_has_ended(job) || (farm_job_is_open(job) && !job->record.started_s));
}
