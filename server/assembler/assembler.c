/* SPDX-License-Identifier: MIT */
/* One message in, one picture, one message out. */
#include "server/assembler/assembler.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/limits.h"
#include "protocol/provenance.h"
#include "protocol/provenance_file.h"
#include "renderer/image/image_join.h"
#include "server/base/ipc.h"

enum { FD_FOLDER, FD_PICTURE, FD_COUNT };

static int integer_of(const json_t *json, const char *key)
{
    return (int)json_integer_value(json_object_get(json, key));
}

/* Paths of the tiles through the folder's descriptor. */
static char **make_paths(const struct ipc_message *message, int count)
{
    const char *prefix = json_string_value(json_object_get(message->json, "prefix"));
    char **paths = calloc((size_t)count, sizeof *paths);
    for (int i = 0; paths && i < count; i++)
        if (asprintf(&paths[i], "/proc/self/fd/%d/%s%d", message->fds[FD_FOLDER],
                     prefix ? prefix : "", i) < 0)
            paths[i] = NULL;
    return paths;
}

/* How the picture was made, by what its first tile says; NULL where that says nothing. */
static char *make_provenance(const char *path, const char *format, int quality)
{
    struct stat file;
    const char *text;
    size_t length;
    char *made = NULL;
    int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    void *bytes = fd >= 0 && fstat(fd, &file) == 0 && file.st_size > 0
                      ? mmap(NULL, (size_t)file.st_size, PROT_READ, MAP_PRIVATE, fd, 0)
                      : MAP_FAILED;
    if (fd >= 0)
        close(fd);
    if (bytes == MAP_FAILED)
        return NULL;
    if (provenance_find(bytes, (size_t)file.st_size, &text, &length))
        made = provenance_of_picture(text, length, format, quality);
    munmap(bytes, (size_t)file.st_size);
    return made;
}

static bool assemble(const struct ipc_message *message, struct error *err)
{
    struct image_join_desc desc = {.columns = integer_of(message->json, "columns"),
                                   .rows = integer_of(message->json, "rows"),
                                   .quality = integer_of(message->json, "quality"),
                                   .description = "Rendered by Vitrail " VITRAIL_VERSION};
    const char *format = json_string_value(json_object_get(message->json, "format"));
    if (message->fd_count != FD_COUNT || !format || !image_format_from_name(format, &desc.format) ||
        desc.columns < 1 || desc.rows < 1 || desc.columns > LIMIT_PICTURE_TILES / desc.rows)
        return error_set(err, ERROR_INTERNAL, "the assembler was asked for no picture");
    desc.fd = message->fds[FD_PICTURE];
    int count = desc.columns * desc.rows;
    char **paths = make_paths(message, count);
    bool is_good = paths;
    for (int i = 0; is_good && i < count; i++)
        is_good = paths[i];
    desc.paths = (const char *const *)paths;
    char *provenance = is_good ? make_provenance(paths[0], format, desc.quality) : NULL;
    desc.provenance = provenance;
    is_good = is_good ? image_join(&desc, err)
                      : error_set(err, ERROR_NO_MEMORY, "paths of %d tiles", count);
    free(provenance);
    for (int i = 0; paths && i < count; i++)
        free(paths[i]);
    free(paths);
    return is_good;
}

int assembler_main(int socket)
{
    struct ipc_message message = {.json = NULL};
    struct error problem = {0}, lost = {0};
    if (ipc_receive(socket, &message, &problem) != IPC_MESSAGE)
        return EXIT_FAILURE;
    json_t *answer = assemble(&message, &problem)
                         ? json_pack("{s:b}", "ok", 1)
                         : json_pack("{s:o}", "error", ipc_error_to_json(&problem));
    bool is_answered = answer && ipc_send(socket, answer, NULL, 0, &lost);
    json_decref(answer);
    ipc_message_finish(&message);
    return is_answered ? EXIT_SUCCESS : EXIT_FAILURE;
}
