/* SPDX-License-Identifier: MIT */
/* Files of compiled programs: what is read is what was written, for that driver and source alone;
 * whatever else lies there is no program. */
#include <setjmp.h>
#include <stdarg.h>
#include <dirent.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "renderer/gl/program_store.h"

enum { PATH_BYTES = 512 };

struct place {
    char root[64], folder[96];
};

static int make_place(void **state)
{
    struct place *place = calloc(1, sizeof *place);
    assert_non_null(place);
    strcpy(place->root, "/tmp/vitrail-programs-XXXXXX");
    assert_non_null(mkdtemp(place->root));
    snprintf(place->folder, sizeof place->folder, "%s/cache/programs", place->root);
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

static struct program_store *open_store(const struct place *place, const char *driver,
                                        uint64_t budget_bytes)
{
    struct error err = {0};
    struct program_store *store = program_store_open(
        &(struct program_store_desc){
            .folder = place->folder, .driver = driver, .budget_bytes = budget_bytes},
        &err);
    if (!store)
        fail_msg("%s", err.message);
    return store;
}

static struct content_key key_of(const char *text)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, text);
    return key;
}

static void put(struct program_store *store, const char *source, const char *text, size_t repeats)
{
    struct program_binary binary = {.format = 0x875f, .size_bytes = strlen(text) * repeats};
    char *bytes = malloc(binary.size_bytes + 1);
    assert_non_null(bytes);
    for (size_t i = 0; i < repeats; i++)
        strcpy(bytes + i * strlen(text), text);
    binary.bytes = bytes;
    program_store_write(store, key_of(source), &binary);
    program_binary_finish(&binary);
}

/* What stands under the source, put back; 0 bytes: nothing. */
static size_t look(struct program_store *store, const char *source, char first[16])
{
    struct program_binary binary;
    bool was_there = program_store_has(store, key_of(source));
    first[0] = 0;
    if (!program_store_read(store, key_of(source), &binary))
        return 0;
    assert_true(was_there);
    assert_int_equal(binary.format, 0x875f);
    size_t size = binary.size_bytes;
    snprintf(first, 16, "%.*s", size < 15 ? (int)size : 15, (const char *)binary.bytes);
    program_binary_finish(&binary);
    program_store_confirm(store, key_of(source));
    return size;
}

/* The only program there is. */
static void path_of_file(const struct place *place, char path[PATH_BYTES])
{
    DIR *folder = opendir(place->folder);
    int count = 0;
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));)
        if (entry->d_name[0] != '.' && ++count)
            snprintf(path, PATH_BYTES, "%s/%s", place->folder, entry->d_name);
    closedir(folder);
    assert_int_equal(count, 1);
}

static int count_files(const struct place *place)
{
    DIR *folder = opendir(place->folder);
    int count = 0;
    assert_non_null(folder);
    for (struct dirent *entry; (entry = readdir(folder));)
        count += entry->d_name[0] != '.';
    closedir(folder);
    return count;
}

static void a_program_is_there_at_the_next_start(void **state)
{
    char first[16];
    struct stat status;
    struct program_store *store = open_store(*state, "driver 1", 1 << 20);
    assert_int_equal(look(store, "red", first), 0);
    put(store, "red", "crimson", 1);
    put(store, "blue", "azure", 1000);
    assert_int_equal(look(store, "red", first), 7);
    assert_string_equal(first, "crimson");
    put(store, "red", "scarlet!", 1); /* in the place of the first */
    program_store_close(store);
    store = open_store(*state, "driver 1", 1 << 20);
    assert_int_equal(look(store, "red", first), 8);
    assert_string_equal(first, "scarlet!");
    assert_int_equal(look(store, "blue", first), 5000);
    assert_int_equal(look(store, "green", first), 0);
    struct program_store_totals totals;
    program_store_get_totals(store, &totals);
    assert_int_equal(totals.files, 2);
    assert_int_equal(totals.confirmed, 2);
    assert_int_equal(totals.refused, 0);
    program_store_close(store);
    const struct place *place = *state;
    assert_int_equal(stat(place->folder, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0700);
}

static void files_are_for_their_owner_alone(void **state)
{
    char path[PATH_BYTES];
    struct stat status;
    struct program_store *store = open_store(*state, "driver", 1 << 20);
    put(store, "red", "crimson", 1);
    program_store_close(store);
    path_of_file(*state, path);
    assert_int_equal(stat(path, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0600);
}

static void another_driver_has_programs_of_its_own(void **state)
{
    char first[16];
    struct program_store *store = open_store(*state, "driver 1", 1 << 20);
    put(store, "red", "crimson", 1);
    program_store_close(store);
    store = open_store(*state, "driver 2", 1 << 20);
    assert_int_equal(look(store, "red", first), 0);
    put(store, "red", "other", 1);
    assert_int_equal(count_files(*state), 2);
    program_store_close(store);
    store = open_store(*state, "driver 1", 1 << 20);
    look(store, "red", first);
    assert_string_equal(first, "crimson");
    program_store_close(store);
}

/* Each byte of the file changed, each shorter file, and a longer one. */
static void a_damaged_file_is_no_program(void **state)
{
    char path[PATH_BYTES], first[16], bytes[256];
    struct program_store *store = open_store(*state, "driver", 1 << 20);
    put(store, "red", "crimson", 1);
    path_of_file(*state, path);
    FILE *file = fopen(path, "re");
    assert_non_null(file);
    size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    assert_true(size > 7 && size < sizeof bytes);
    for (size_t i = 0; i < 2 * size + 1; i++) {
        size_t length = i < size ? size : i - size; /* changed, then cut short */
        char damaged[sizeof bytes];
        memcpy(damaged, bytes, size);
        if (i < size)
            damaged[i] ^= 0x10;
        if (i == 2 * size)
            length = size + 1; /* too long */
        damaged[size] = i == 2 * size ? 1 : damaged[size];
        file = fopen(path, "we");
        assert_non_null(file);
        assert_int_equal(fwrite(damaged, 1, length, file), length);
        fclose(file);
        assert_int_equal(look(store, "red", first), 0);
        assert_int_equal(access(path, F_OK), -1); /* and is gone */
    }
    struct program_store_totals totals;
    program_store_get_totals(store, &totals);
    assert_int_equal(totals.refused, 2 * size + 1);
    program_store_close(store);
}

static void links_pipes_and_folders_are_no_programs(void **state)
{
    char path[PATH_BYTES], other[PATH_BYTES + 8], first[16];
    struct program_store *store = open_store(*state, "driver", 1 << 20);
    put(store, "red", "crimson", 1);
    path_of_file(*state, path);
    snprintf(other, sizeof other, "%s.other", path);
    assert_int_equal(rename(path, other), 0);
    assert_int_equal(symlink(other, path), 0); /* to the very program */
    assert_int_equal(look(store, "red", first), 0);
    unlink(path);
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_int_equal(look(store, "red", first), 0); /* and does not wait */
    unlink(path);
    assert_int_equal(mkdir(path, 0700), 0);
    assert_int_equal(look(store, "red", first), 0);
    program_store_close(store);
}

static void the_least_recently_used_leave(void **state)
{
    char first[16];
    struct program_store *store = open_store(*state, "driver", 3000);
    put(store, "one", "1", 900);
    put(store, "two", "2", 900);
    put(store, "three", "3", 900);
    assert_int_equal(look(store, "one", first), 900); /* used again */
    put(store, "four", "4", 900);
    assert_int_equal(look(store, "two", first), 0);
    assert_int_equal(look(store, "one", first), 900);
    assert_int_equal(look(store, "four", first), 900);
    put(store, "five", "5", 4000); /* never fits */
    assert_int_equal(look(store, "five", first), 0);
    struct program_store_totals totals;
    program_store_get_totals(store, &totals);
    assert_int_equal(totals.files, 3);
    assert_true(totals.bytes <= 3000);
    assert_int_equal(totals.evicted, 1);
    program_store_close(store);
    store = open_store(*state, "another", 1000); /* the budget is that of all */
    program_store_get_totals(store, &totals);
    assert_int_equal(totals.files, 1);
    program_store_close(store);
}

/* Read, and the process ends before the driver has said yes. */
static void what_ends_the_process_is_not_tried_again(void **state)
{
    char first[16];
    struct program_binary binary;
    struct program_store *store = open_store(*state, "driver", 1 << 20);
    put(store, "red", "crimson", 1);
    assert_true(program_store_read(store, key_of("red"), &binary));
    program_binary_finish(&binary);
    program_store_close(store);
    store = open_store(*state, "driver", 1 << 20);
    assert_int_equal(look(store, "red", first), 0);
    assert_int_equal(count_files(*state), 0);
    put(store, "red", "crimson", 1);
    assert_true(program_store_read(store, key_of("red"), &binary));
    program_binary_finish(&binary);
    program_store_drop(store, key_of("red")); /* the driver said no */
    assert_int_equal(count_files(*state), 0);
    program_store_close(store);
}

static int child_that_has_ended(void)
{
    pid_t child = fork();
    if (child == 0)
        _exit(0);
    assert_int_equal(waitpid(child, NULL, 0), child);
    return (int)child;
}

static void drafts_of_processes_that_run_stay(void **state)
{
    char command[PATH_BYTES], first[16];
    struct program_store *store = open_store(*state, "driver", 1 << 20);
    const struct place *place = *state;
    put(store, "red", "crimson", 1);
    program_store_close(store);
    snprintf(command, sizeof command,
             "cd '%s' && f=$(echo *.program) && cp $f $f.%d.draft && cp $f $f.%d.draft && "
             "cp $f $f.draft",
             place->folder, (int)getppid(), child_that_has_ended());
    assert_int_equal(system(command), 0); /* NOLINT(cert-env33-c): a folder of our own */
    assert_int_equal(count_files(*state), 4);
    store = open_store(*state, "driver", 1 << 20);
    assert_int_equal(count_files(*state), 2); /* the program, and what another process tries */
    assert_int_equal(look(store, "red", first), 7);
    assert_int_equal(count_files(*state), 2);
    program_store_close(store);
}

static void a_folder_that_cannot_be_is_named(void **state)
{
    struct error err = {0};
    (void)state;
    assert_null(program_store_open(&(struct program_store_desc){.folder = "/dev/null/programs",
                                                                .driver = "driver",
                                                                .budget_bytes = 1},
                                   &err));
    assert_non_null(strstr(err.message, "/dev/null/programs"));
}

#define IN_PLACE(test) cmocka_unit_test_setup_teardown(test, make_place, remove_place)

int main(void)
{
    const struct CMUnitTest tests[] = {
        IN_PLACE(a_program_is_there_at_the_next_start),
        IN_PLACE(files_are_for_their_owner_alone),
        IN_PLACE(another_driver_has_programs_of_its_own),
        IN_PLACE(a_damaged_file_is_no_program),
        IN_PLACE(links_pipes_and_folders_are_no_programs),
        IN_PLACE(the_least_recently_used_leave),
        IN_PLACE(what_ends_the_process_is_not_tried_again),
        IN_PLACE(drafts_of_processes_that_run_stay),
        cmocka_unit_test(a_folder_that_cannot_be_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
