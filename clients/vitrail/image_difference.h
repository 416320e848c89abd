/* SPDX-License-Identifier: MIT */
/* How far two image files are apart, as vitrail-compare measures it: this program holds no image
 * library. */
#ifndef VITRAIL_CLIENTS_VITRAIL_IMAGE_DIFFERENCE_H
#define VITRAIL_CLIENTS_VITRAIL_IMAGE_DIFFERENCE_H

#include "clients/vitrail/failure.h"

struct image_difference {
    double share; /* of values that are not the same number, of the output where it is largest */
    double rmse, max;
};

/* outputs: names of the layers to compare, NULL at the end; an empty list means the file's only
 * one. Fails where the files cannot be compared: other sizes, other layers. */
bool image_difference_measure(const char *image, const char *reference, const char *const *outputs,
                              struct image_difference *difference, struct failure *failure);

#endif
