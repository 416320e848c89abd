/* SPDX-License-Identifier: MIT */
/* Which files a .gltf, or a scene of another format, needs: the ones to send along with it. */
#ifndef VITRAIL_CLIENTS_VITRAIL_GLTF_FILES_H
#define VITRAIL_CLIENTS_VITRAIL_GLTF_FILES_H

#include <stdbool.h>
#include <stddef.h>

#include "clients/vitrail/failure.h"
#include "clients/vitrail/http.h"

/* Zeroed = none; gltf_files_finish frees. The first is the scene itself, the others follow in the
 * order of its buffers and images, each once. */
struct gltf_files {
    struct http_part *files;
    size_t count;
};

/* Reads the .gltf at `path` and finds every file that its buffers and images name: percent-decoded,
 * relative, below its folder (also after following symbolic links), regular and there. data:
 * addresses need no file; any other address is refused, since a scene from elsewhere must not
 * choose which of our files leave this machine. Of an .obj these are the libraries of materials
 * that it names, and the textures that those name, as far as they lie below its folder; other
 * formats are sent alone. */
bool gltf_files_find(struct gltf_files *files, const char *path, struct failure *failure);
void gltf_files_finish(struct gltf_files *files);

#endif
