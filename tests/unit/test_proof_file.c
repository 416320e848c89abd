/* SPDX-License-Identifier: MIT */
/* What a device was seen to do right, in a file: it says what was written, for its key and its time
 * alone; whatever else lies there says nothing. */
#include <setjmp.h>
#include <stdarg.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "renderer/frame/proof_file.h"

enum { NOW = 1800000000, PROVEN = 0x25 };

struct place {
    char root[64], path[96];
};

static int make_place(void **state)
{
    struct place *place = calloc(1, sizeof *place);
    assert_non_null(place);
    strcpy(place->root, "/tmp/vitrail-proof-XXXXXX");
    assert_non_null(mkdtemp(place->root));
    snprintf(place->path, sizeof place->path, "%s/cache/self-test-0", place->root);
    *state = place;
    return 0;
}

static int remove_place(void **state)
{
    struct place *place = *state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", place->root);
    int status = system(command); /* NOLINT(cert-env33-c): a folder of our own */
    free(place);
    return status;
}

static struct content_key key_of(const char *text)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, text);
    return key;
}

static void save(const struct place *place)
{
    struct error err = {0};
    const struct proof proof = {
        .structures = PROVEN, .since_s = NOW, .wide_floats = {WIDE_FLOATS_PAIRS, 0.8125}};
    if (!proof_file_save(place->path, key_of("device"), &proof, &err))
        fail_msg("%s", err.message);
}

static bool loads(const struct place *place, const char *key, int64_t now_s, struct proof *proof)
{
    bool ok = proof_file_load(place->path, key_of(key), now_s, proof);
    if (!ok)
        assert_true(proof->structures == 0 && proof->since_s == 0);
    return ok;
}

static void write_bytes(const struct place *place, const char *bytes, size_t size)
{
    FILE *file = fopen(place->path, "wb");
    assert_non_null(file);
    assert_int_equal(size, fwrite(bytes, 1, size, file));
    fclose(file);
}

static size_t read_bytes(const struct place *place, char *bytes, size_t size)
{
    FILE *file = fopen(place->path, "rb");
    assert_non_null(file);
    size_t count = fread(bytes, 1, size, file);
    fclose(file);
    return count;
}

static void what_was_written_is_read_by_its_key_alone(void **state)
{
    const struct place *place = *state;
    struct proof proof;
    struct stat status;
    assert_false(loads(place, "device", NOW, &proof)); /* no folder */
    save(place);
    assert_true(loads(place, "device", NOW, &proof));
    assert_int_equal(PROVEN, proof.structures);
    assert_int_equal(NOW, proof.since_s);
    assert_int_equal(WIDE_FLOATS_PAIRS, proof.wide_floats.form);
    assert_true(proof.wide_floats.pairs_over_f64 == 0.8125);
    assert_false(loads(place, "another", NOW, &proof));
    assert_int_equal(0, stat(place->path, &status));
    assert_int_equal(0600, status.st_mode & 0777);
}

static void it_holds_for_a_week_and_not_before_it_was_written(void **state)
{
    const struct place *place = *state;
    struct proof proof;
    save(place);
    assert_true(loads(place, "device", NOW + PROOF_VALID_S, &proof));
    assert_false(loads(place, "device", NOW + PROOF_VALID_S + 1, &proof));
    assert_false(loads(place, "device", NOW - 1, &proof));
}

static void every_damaged_byte_and_every_cut_is_noticed(void **state)
{
    const struct place *place = *state;
    struct proof proof;
    char good[256], bad[256];
    save(place);
    size_t size = read_bytes(place, good, sizeof good - 1);
    assert_true(size > 64 && size < sizeof good - 1);
    for (size_t i = 0; i < size; i++) {
        for (int bit = 0; bit < 8; bit++) {
            memcpy(bad, good, size);
            bad[i] = (char)(bad[i] ^ 1 << bit);
            write_bytes(place, bad, size);
            if (loads(place, "device", NOW, &proof))
                fail_msg("bit %d of byte %zu", bit, i);
        }
        write_bytes(place, good, i);
        assert_false(loads(place, "device", NOW, &proof));
    }
    memcpy(bad, good, size);
    bad[size] = '\n';
    write_bytes(place, bad, size + 1);
    assert_false(loads(place, "device", NOW, &proof));
    write_bytes(place, good, size);
    assert_true(loads(place, "device", NOW, &proof));
}

static void what_is_no_file_of_ours_is_not_read(void **state)
{
    const struct place *place = *state;
    struct proof proof;
    struct error err = {0};
    char other[128];
    save(place);
    snprintf(other, sizeof other, "%s/other", place->root);
    assert_int_equal(0, rename(place->path, other));
    assert_int_equal(0, symlink(other, place->path));
    assert_false(loads(place, "device", NOW, &proof));
    save(place); /* in its place, not through it */
    assert_true(loads(place, "device", NOW, &proof));
    assert_int_equal(0, unlink(place->path));
    assert_int_equal(0, mkfifo(place->path, 0600)); /* whose reader would wait */
    assert_false(loads(place, "device", NOW, &proof));
    assert_int_equal(0, unlink(place->path));
    assert_int_equal(0, mkdir(place->path, 0700));
    assert_false(loads(place, "device", NOW, &proof));
    const struct proof said = {
        .structures = PROVEN, .since_s = NOW, .wide_floats = {WIDE_FLOATS_PAIRS, 0.8125}};
    assert_false(proof_file_save(place->path, key_of("device"), &said, &err));
    assert_int_equal(ERROR_IO, err.code);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_was_written_is_read_by_its_key_alone, make_place,
                                        remove_place),
        cmocka_unit_test_setup_teardown(it_holds_for_a_week_and_not_before_it_was_written,
                                        make_place, remove_place),
        cmocka_unit_test_setup_teardown(every_damaged_byte_and_every_cut_is_noticed, make_place,
                                        remove_place),
        cmocka_unit_test_setup_teardown(what_is_no_file_of_ours_is_not_read, make_place,
                                        remove_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
