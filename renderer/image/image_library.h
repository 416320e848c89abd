/* SPDX-License-Identifier: MIT */
/* OpenImageIO on demand: the module vitrail-images.so beside the program is loaded by the first
 * use. Linked in, its 250 libraries would cost every process 0.2 s of start-up, those that never
 * see an image file too. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_IMAGE_LIBRARY_H
#define VITRAIL_RENDERER_IMAGE_IMAGE_LIBRARY_H

#include "renderer/image/oiio_shim.h"

/* The shim's functions, once loaded. NULL with ERROR_INTERNAL where the module is missing or does
 * not load; then every later call fails alike. */
const struct oiio_functions *image_library(struct error *err);

#endif
