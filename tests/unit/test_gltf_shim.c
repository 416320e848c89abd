/* SPDX-License-Identifier: MIT */
/* gltf_shim: the glTF library has no access to files, whatever a document says. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/import/gltf_shim.h"

/* The importer takes buffers out of documents before the library sees them; here one is left in. */
static void the_library_opens_no_file(void **state)
{
    (void)state;
    const char *const known[] = {NULL};
    char folder[] = "/tmp/vitrail-gltf-XXXXXX", path[64], json[256];
    struct error err = {0};
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/four.bin", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("four", file);
    assert_int_equal(fclose(file), 0);

    /* the same document is taken where its bytes are in it */
    int length = snprintf(json, sizeof json,
                          "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":4,"
                          "\"uri\":\"data:application/octet-stream;base64,Zm91cg==\"}]}");
    struct gltf_document *document = gltf_document_create(json, (size_t)length, known, &err);
    assert_non_null(document);
    gltf_document_destroy(document);

    length = snprintf(json, sizeof json,
                      "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":4,"
                      "\"uri\":\"%s\"}]}",
                      path);
    document = gltf_document_create(json, (size_t)length, known, &err);
    assert_null(document);
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
    unlink(path);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_library_opens_no_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
