/* SPDX-License-Identifier: MIT */
/* SHA-256 through OpenSSL's EVP interface, its only home. */
#include "server/base/digest.h"

#include <assert.h>
#include <openssl/evp.h>
#include <stdlib.h>
#include <string.h>

struct digest {
    EVP_MD_CTX *state;
};

struct digest *digest_create(struct error *err)
{
    struct digest *digest = calloc(1, sizeof *digest);
    if (digest)
        digest->state = EVP_MD_CTX_new();
    if (!digest || !digest->state || EVP_DigestInit_ex(digest->state, EVP_sha256(), NULL) != 1) {
        error_set(err, ERROR_NO_MEMORY, "SHA-256");
        digest_destroy(digest);
        return NULL;
    }
    return digest;
}

void digest_destroy(struct digest *digest)
{
    if (!digest)
        return;
    EVP_MD_CTX_free(digest->state);
    free(digest);
}

void digest_write(struct digest *digest, const void *bytes, size_t size_bytes)
{
    int is_good = EVP_DigestUpdate(digest->state, bytes, size_bytes);
    assert(is_good == 1); /* in software SHA-256 cannot fail once begun */
}

void digest_end(struct digest *digest, char text[DIGEST_TEXT_BYTES])
{
    static const char digits[] = "0123456789abcdef";
    unsigned char bytes[32];
    int is_good = EVP_DigestFinal_ex(digest->state, bytes, NULL) &&
                  EVP_DigestInit_ex(digest->state, EVP_sha256(), NULL);
    assert(is_good == 1);
    for (size_t i = 0; i < sizeof bytes; i++) {
        text[2 * i] = digits[bytes[i] >> 4];
        text[2 * i + 1] = digits[bytes[i] & 15];
    }
    text[64] = '\0';
}

bool digest_of(const void *bytes, size_t size_bytes, char text[DIGEST_TEXT_BYTES],
               struct error *err)
{
    struct digest *digest = digest_create(err);
    if (!digest)
        return false;
    digest_write(digest, bytes, size_bytes);
    digest_end(digest, text);
    digest_destroy(digest);
    return true;
}

bool digest_is_text(const char *text)
{
    return strlen(text) == 64 && strspn(text, "0123456789abcdef") == 64;
}
