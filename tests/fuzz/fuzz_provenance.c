/* SPDX-License-Identifier: MIT */
/* Fuzz target: whatever an image file is, its provenance lies within it.
 *
 * Input: the file. */
#include <assert.h>
#include <stdint.h>

#include "protocol/provenance_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *text;
    size_t length;
    if (!provenance_find(data, size, &text, &length)) {
        assert(length == 0 || text);
        return 0;
    }
    const uint8_t *begin = (const uint8_t *)text;
    assert(begin >= data && begin <= data + size);
    assert(length <= size - (size_t)(begin - data));
    volatile char last = length ? text[length - 1] : '\0'; /* it can be read */
    (void)last;
    return 0;
}
