/* SPDX-License-Identifier: MIT */
/* The assembler role: joins the files of one picture's tiles, so that a library that trips over one
 * of them costs an attempt and not the server. Thread: main of its own process. */
#ifndef VITRAIL_SERVER_ASSEMBLER_ASSEMBLER_H
#define VITRAIL_SERVER_ASSEMBLER_ASSEMBLER_H

/* Serves one picture on `socket` and returns the exit status.
 *
 * in:  {"prefix": of the tiles' names, before their number, "columns", "rows", "format": name,
 * "quality"}, descriptors: the folder of the tiles, the file of the picture (written)
 * out: {"ok": true} or {"error": {...}} */
int assembler_main(int socket);

#endif
