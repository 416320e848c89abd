/* SPDX-License-Identifier: MIT */
/* What fuzz targets expect: failing is a finding. */
#ifndef VITRAIL_TESTS_FUZZ_EXPECT_H
#define VITRAIL_TESTS_FUZZ_EXPECT_H

#include <stdbool.h>
#include <stdlib.h>

#include "protocol/error.h"
#include "protocol/utf8.h"

static inline void expect(bool is_true)
{
    if (!is_true)
        abort();
}

static inline bool expect_is_utf8(const char *text)
{
    for (size_t bytes; *text; text += bytes)
        if ((bytes = utf8_sequence_bytes(text)) == 0)
            return false;
    return true;
}

/* A refusal in words, with the place where there is one. */
static inline void expect_complete(const struct error *err)
{
    expect(err->code != ERROR_NONE && err->code != ERROR_INTERNAL);
    expect(err->message[0] && expect_is_utf8(err->message) && expect_is_utf8(err->pointer));
    expect(err->pointer[0] == '\0' || err->pointer[0] == '/');
}

#endif
