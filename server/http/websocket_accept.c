/* SPDX-License-Identifier: MIT */
/* The handshake of RFC 6455: base64 of the SHA-1 of the client's key and a fixed text. */
#include <openssl/evp.h>
#include <stdio.h>
#include <string.h>

#include "server/http/websocket.h"

enum { KEY_CHARACTERS = 24 /* 16 bytes in base64 */, SHA1_BYTES = 20 };

static bool is_key(const char *key)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    return key && strlen(key) == KEY_CHARACTERS && strspn(key, digits) == KEY_CHARACTERS - 2 &&
           strcmp(key + KEY_CHARACTERS - 2, "==") == 0;
}

bool websocket_accept(const char *key, char accept[WEBSOCKET_ACCEPT_BYTES])
{
    char text[KEY_CHARACTERS + 40];
    unsigned char hash[SHA1_BYTES];
    unsigned hash_bytes;
    if (!is_key(key))
        return false;
    int length = snprintf(text, sizeof text, "%s258EAFA5-E914-47DA-95CA-C5AB0DC85B11", key);
    return EVP_Digest(text, (size_t)length, hash, &hash_bytes, EVP_sha1(), NULL) == 1 &&
           EVP_EncodeBlock((unsigned char *)accept, hash, SHA1_BYTES) == WEBSOCKET_ACCEPT_BYTES - 1;
}
