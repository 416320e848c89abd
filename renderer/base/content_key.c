/* SPDX-License-Identifier: MIT */
/* Hashing of plain data, a word at a time. */
#include "renderer/base/content_key.h"

#include <string.h>

/* The finaliser of MurmurHash3 (Appleby, public domain). */
static uint64_t scramble(uint64_t x)
{
    x = (x ^ x >> 33) * 0xff51afd7ed558ccdull;
    x = (x ^ x >> 33) * 0xc4ceb9fe1a85ec53ull;
    return x ^ x >> 33;
}

void content_key_add_word(struct content_key *key, uint64_t word)
{
    key->words[0] = scramble(key->words[0] ^ word);
    key->words[1] = scramble(key->words[1] + 0x9e3779b97f4a7c15ull * (word + 1)); /* golden ratio */
}

struct content_key content_key_begin(void)
{
    return (struct content_key){{0xa4093822299f31d0ull, 0x082efa98ec4e6c89ull}}; /* digits of pi */
}

void content_key_add(struct content_key *key, const void *bytes, size_t size_bytes)
{
    const unsigned char *at = bytes;
    content_key_add_word(key, size_bytes);
    for (size_t i = 0; i < size_bytes; i += 8) {
        uint64_t word = 0;
        memcpy(&word, at + i, size_bytes - i < 8 ? size_bytes - i : 8);
        content_key_add_word(key, word);
    }
}

void content_key_add_text(struct content_key *key, const char *text)
{
    content_key_add_word(key, text != NULL);
    if (text)
        content_key_add(key, text, strlen(text));
}
