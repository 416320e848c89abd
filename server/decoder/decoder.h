/* SPDX-License-Identifier: MIT */
/* The decoder role: turns one upload into one blob of a scene or an environment map, in a sandbox.
 * Thread: main of its own process. */
#ifndef VITRAIL_SERVER_DECODER_DECODER_H
#define VITRAIL_SERVER_DECODER_DECODER_H

/* Serves one job on `socket` and returns the exit status.
 *
 * in:  {"kind": "scene" or "environment", "files": [{"name", "offset", "size"}...], "memory_bytes",
 * "timeout_s"}, descriptors: the spool (read-only use), the blob (written), a memfd for the summary
 * (written) out: {"ok": true} or
 * {"error": {...}} */
int decoder_main(int socket);

#endif
