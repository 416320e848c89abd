/* SPDX-License-Identifier: MIT */
/* One line of text: what it is of, what it says, and a sum over both. */
#include "renderer/frame/proof_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LINE_BYTES = 192, FORM_BYTES = 16, PATH_BYTES = 4096 + 128 };

static size_t compose(char line[LINE_BYTES], struct content_key key, const struct proof *proof)
{
    char said[LINE_BYTES / 2];
    const struct wide_floats_choice *wide = &proof->wide_floats;
    struct content_key sum = key;
    snprintf(said, sizeof said, "%08" PRIx32 " %" PRId64 " %s %.4f", proof->structures,
             proof->since_s, wide_floats_name(wide->form), wide->pairs_over_f64);
    content_key_add_text(&sum, said);
    int length = snprintf(line, LINE_BYTES,
                          "vitrail-proof 2 %016" PRIx64 "%016" PRIx64 " %s %016" PRIx64 "\n",
                          key.words[0], key.words[1], said, sum.words[0] ^ sum.words[1]);
    return (size_t)length;
}

static bool find_form(const char *name, enum wide_floats *form)
{
    for (int i = 0; i < WIDE_FLOATS_COUNT; i++)
        if (i != WIDE_FLOATS_MEASURED && !strcmp(name, wide_floats_name((enum wide_floats)i))) {
            *form = (enum wide_floats)i;
            return true;
        }
    return false;
}

/* Reads an ordinary file of our own. Returns the bytes that were read, at most `size`. */
static size_t read_line(const char *path, char *line, size_t size)
{
    struct stat status;
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return 0;
    bool is_ours = fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid();
    ssize_t count = is_ours ? read(fd, line, size) : 0;
    close(fd);
    return count > 0 ? (size_t)count : 0;
}

bool proof_file_load(const char *path, struct content_key key, int64_t now_s, struct proof *proof)
{
    char found[LINE_BYTES + 1], expected[LINE_BYTES];
    char form[FORM_BYTES];
    struct proof said;
    size_t count = read_line(path, found, LINE_BYTES);
    *proof = (struct proof){0};
    found[count] = 0;
    if (sscanf(found, "vitrail-proof 2 %*32[0-9a-f] %8" SCNx32 " %18" SCNd64 " %15s %15lf",
               &said.structures, &said.since_s, form, &said.wide_floats.pairs_over_f64) != 4 ||
        !find_form(form, &said.wide_floats.form))
        return false;
    size_t length = compose(expected, key, &said);
    if (count != length || memcmp(found, expected, length) != 0 || said.since_s > now_s ||
        now_s - said.since_s > PROOF_VALID_S)
        return false;
    *proof = said;
    return true;
}

static void make_folder(const char *path)
{
    char folder[PATH_BYTES];
    const char *end = strrchr(path, '/');
    if (end && end > path && (size_t)(end - path) < sizeof folder) {
        memcpy(folder, path, (size_t)(end - path));
        folder[end - path] = 0;
        mkdir(folder, 0700); /* what is wrong with it, opening the file tells */
    }
}

bool proof_file_save(const char *path, struct content_key key, const struct proof *proof,
                     struct error *err)
{
    char line[LINE_BYTES], draft[PATH_BYTES];
    size_t length = compose(line, key, proof);
    if ((size_t)snprintf(draft, sizeof draft, "%s.%d.draft", path, (int)getpid()) >= sizeof draft)
        return error_set(err, ERROR_IO, "'%s': the path is too long", path);
    make_folder(path);
    unlink(draft); /* whatever lies there, what is opened is ours */
    int fd = open(draft, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    bool ok = fd >= 0 && write(fd, line, length) == (ssize_t)length;
    if (fd >= 0)
        ok = close(fd) == 0 && ok;
    ok = ok && rename(draft, path) == 0;
    return ok || error_set(err, ERROR_IO, "'%s' cannot be written: %s", path, strerror(errno));
}
