/* SPDX-License-Identifier: MIT */
/* The extensions of glTF that are evaluated. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_EXTENSIONS_H
#define VITRAIL_RENDERER_IMPORT_EXTENSIONS_H

const char *const *scene_import_extensions(void); /* NULL-terminated */

/* These, and those that a file may require because the importer refuses by itself what cannot do
 * without them. */
const char *const *scene_import_passed_extensions(void);

#endif
