/* SPDX-License-Identifier: MIT */
/* 128-bit keys of plain data: equal keys, equal data. For caches, not against attackers. Thread:
 * any. */
#ifndef VITRAIL_RENDERER_BASE_CONTENT_KEY_H
#define VITRAIL_RENDERER_BASE_CONTENT_KEY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct content_key {
    uint64_t words[2]; /* all zero: of nothing; no content has it */
};

struct content_key content_key_begin(void);
void content_key_add_word(struct content_key *key, uint64_t word);
/* Padding inside of a struct counts too: it may tell equal structs apart, never the reverse. */
void content_key_add(struct content_key *key, const void *bytes, size_t size_bytes);
/* NULL and the empty text differ. */
void content_key_add_text(struct content_key *key, const char *text);

static inline bool content_key_equals(struct content_key a, struct content_key b)
{
    return a.words[0] == b.words[0] && a.words[1] == b.words[1];
}

static inline bool content_key_is_set(struct content_key key)
{
    return key.words[0] || key.words[1];
}

#endif
