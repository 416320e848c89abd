/* SPDX-License-Identifier: MIT */
/* A plain main for fuzz targets: runs LLVMFuzzerTestOneInput over every file of a corpus directory
 * and over seeded mutations of them. The same target links with libFuzzer instead of this file.
 *
 *   fuzz_x CORPUS_DIRECTORY [MUTATIONS [SECONDS]]
 *
 * Inputs run in a child: when it dies, or takes over 10 s for one input, the parent says on which
 * input and writes that to fuzz-failure.bin. A mutation follows from the file's place and the
 * mutation's number alone, so a failure repeats. SECONDS (default 20) bounds the whole run; how
 * many mutations it held is printed. */
#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum {
    MUTATIONS_DEFAULT = 20000,
    SECONDS_DEFAULT = 20,
    INPUT_SECONDS_MAX = 10,
    GROWTH_BYTES_MAX = 4096, /* a mutation may add this much */
    EDITS_MAX = 8,           /* edits of one mutation */
};

struct input {
    uint8_t *bytes;
    size_t size;
};

struct corpus {
    struct dirent **names;
    struct input *inputs;
    int count;
};

#define CHILD_VARIABLE "VITRAIL_FUZZ_PROGRESS_FD" /* set: this is the child */

/* What the child is at; shared with the parent. */
struct progress {
    _Atomic int file;
    _Atomic long mutation; /* 0: the file itself */
    _Atomic bool is_done;
};

/* ---- corpus ---- */

static int is_visible(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static bool input_read(const char *directory, const char *name, struct input *input)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *file = fopen(path, "rb");
    if (!file)
        return false;
    bool is_read = fseek(file, 0, SEEK_END) == 0;
    long size = is_read ? ftell(file) : -1;
    input->bytes = size >= 0 ? malloc((size_t)size + 1) : NULL;
    is_read = input->bytes && fseek(file, 0, SEEK_SET) == 0 &&
              fread(input->bytes, 1, (size_t)size, file) == (size_t)size;
    input->size = is_read ? (size_t)size : 0;
    fclose(file);
    return is_read;
}

static bool corpus_read(const char *directory, struct corpus *corpus)
{
    corpus->count = scandir(directory, &corpus->names, is_visible, alphasort);
    if (corpus->count <= 0) {
        fprintf(stderr, "%s: no corpus\n", directory);
        return false;
    }
    corpus->inputs = calloc((size_t)corpus->count, sizeof *corpus->inputs);
    for (int i = 0; corpus->inputs && i < corpus->count; i++) {
        if (!input_read(directory, corpus->names[i]->d_name, &corpus->inputs[i])) {
            fprintf(stderr, "%s/%s: %s\n", directory, corpus->names[i]->d_name, strerror(errno));
            return false;
        }
    }
    return corpus->inputs;
}

static void corpus_finish(struct corpus *corpus)
{
    for (int i = 0; i < corpus->count; i++) {
        free(corpus->names[i]);
        if (corpus->inputs)
            free(corpus->inputs[i].bytes);
    }
    free(corpus->names);
    free(corpus->inputs);
}

/* ---- mutations ---- */

/* SplitMix64: Steele, Lea, Flood 2014, "Fast Splittable Pseudorandom Number Generators", fig. 16.
 */
static uint64_t random_next(uint64_t *seed)
{
    uint64_t z = *seed += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return z ^ z >> 31;
}

static size_t random_below(uint64_t *seed, size_t limit)
{
    return limit ? (size_t)(random_next(seed) % limit) : 0;
}

/* Opens a gap of `count` bytes at `at`, as far as there is room; returns its size. */
static size_t gap_open(struct input *input, size_t at, size_t count, size_t capacity)
{
    if (count > capacity - input->size)
        count = capacity - input->size;
    memmove(input->bytes + at + count, input->bytes + at, input->size - at);
    input->size += count;
    return count;
}

static void token_insert(struct input *input, size_t at, size_t capacity, uint64_t *seed)
{
    static const char *const tokens[] = {"{",
                                         "}",
                                         "[",
                                         "]",
                                         "\"",
                                         ":",
                                         ",",
                                         "null",
                                         "true",
                                         "-1",
                                         "0",
                                         "1e999",
                                         "1e308",
                                         "-0.0",
                                         "1e-320",
                                         "NaN",
                                         "\\u0000",
                                         "\\ud800",
                                         "4294967296",
                                         "-9223372036854775808",
                                         "\xFF",
                                         "\xC3",
                                         "\xEF\xBB\xBF",
                                         "\"\":"};
    const char *token = tokens[random_below(seed, sizeof tokens / sizeof *tokens)];
    size_t count = gap_open(input, at, strlen(token), capacity);
    memcpy(input->bytes + at, token, count);
}

/* A piece of another input of the corpus. */
static void splice_insert(struct input *input, size_t at, size_t capacity,
                          const struct corpus *corpus, uint64_t *seed)
{
    const struct input *donor = &corpus->inputs[random_below(seed, (size_t)corpus->count)];
    size_t from = random_below(seed, donor->size + 1);
    size_t count = gap_open(input, at, random_below(seed, donor->size - from + 1), capacity);
    memcpy(input->bytes + at, donor->bytes + from, count);
}

static void edit(struct input *input, size_t capacity, const struct corpus *corpus, uint64_t *seed)
{
    static const uint32_t words[] = {0,          1,          0x7F,       0x80,       0xFF,
                                     0x7FFF,     0xFFFF,     0x7FFFFFFF, 0x80000000, 0xFFFFFFFF,
                                     0x7FC00000, 0x7F800000, 0x3F800000};
    size_t at = random_below(seed, input->size + 1), rest = input->size - at, count;
    uint32_t word = words[random_below(seed, sizeof words / sizeof *words)];
    switch (random_below(seed, 8)) {
    case 0: /* one bit */
        if (rest)
            input->bytes[at] ^= (uint8_t)(1u << random_below(seed, 8));
        break;
    case 1: /* one byte */
        if (rest)
            input->bytes[at] = (uint8_t)random_next(seed);
        break;
    case 2: /* an interesting little-endian number */
        memcpy(input->bytes + at, &word, rest < sizeof word ? rest : sizeof word);
        break;
    case 3: /* cut short */
        input->size = at;
        break;
    case 4: /* a piece removed */
        count = random_below(seed, (rest < 64 ? rest : 64) + 1);
        memmove(input->bytes + at, input->bytes + at + count, rest - count);
        input->size -= count;
        break;
    case 5: /* a piece repeated */
        (void)gap_open(input, at, random_below(seed, (rest < 256 ? rest : 256) + 1), capacity);
        break;
    case 6:
        token_insert(input, at, capacity, seed);
        break;
    default:
        splice_insert(input, at, capacity, corpus, seed);
        break;
    }
}

/* The input of this number, in memory of exactly its size, so that sanitizers see every read beyond
 * it. The caller frees. */
static struct input input_make(const struct corpus *corpus, int file, long mutation)
{
    const struct input *source = &corpus->inputs[file];
    size_t capacity = source->size + GROWTH_BYTES_MAX;
    struct input work = {malloc(capacity), source->size};
    if (!work.bytes)
        abort();
    memcpy(work.bytes, source->bytes, source->size);
    uint64_t seed = (uint64_t)file << 40 ^ (uint64_t)mutation;
    size_t edits = mutation ? 1 + random_below(&seed, EDITS_MAX) : 0;
    for (size_t i = 0; i < edits; i++)
        edit(&work, capacity, corpus, &seed);

    struct input made = {malloc(work.size ? work.size : 1), work.size};
    if (!made.bytes)
        abort();
    memcpy(made.bytes, work.bytes, work.size);
    free(work.bytes);
    return made;
}

/* ---- running ---- */

static void run_one(const struct corpus *corpus, int file, long mutation, struct progress *progress)
{
    struct input input = input_make(corpus, file, mutation);
    progress->file = file;
    progress->mutation = mutation;
    alarm(INPUT_SECONDS_MAX); /* its default action ends the child */
    LLVMFuzzerTestOneInput(input.bytes, input.size);
    alarm(0);
    free(input.bytes);
}

static void run_all(const struct corpus *corpus, long mutations, double seconds,
                    struct progress *progress)
{
    struct timespec start, now;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (int file = 0; file < corpus->count; file++)
        run_one(corpus, file, 0, progress);
    long done = 0;
    for (double elapsed = 0; done < mutations && elapsed < seconds; done++) {
        run_one(corpus, (int)(done % corpus->count), 1 + done / corpus->count, progress);
        clock_gettime(CLOCK_MONOTONIC, &now);
        elapsed =
            (double)(now.tv_sec - start.tv_sec) + (double)(now.tv_nsec - start.tv_nsec) * 1e-9;
    }
    printf("%d files and %ld mutations\n", corpus->count, done);
    progress->is_done = true;
}

static int report(const struct corpus *corpus, const struct progress *progress, int status)
{
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && progress->is_done)
        return 0;
    if (WIFEXITED(status) && progress->is_done) {
        fprintf(stderr, "every input passed, yet the run ended with status %d (a leak?)\n",
                WEXITSTATUS(status));
        return 1;
    }
    struct input input = input_make(corpus, progress->file, progress->mutation);
    FILE *file = fopen("fuzz-failure.bin", "wb");
    if (file) {
        fwrite(input.bytes, 1, input.size, file);
        fclose(file);
    }
    free(input.bytes);
    fprintf(stderr, "%s, mutation %ld: %s %d; the input is in fuzz-failure.bin\n",
            corpus->names[progress->file]->d_name, (long)progress->mutation,
            WIFSIGNALED(status) ? "signal" : "exit status",
            WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
    return 1;
}

static struct progress *progress_map(int fd)
{
    struct progress *progress =
        mmap(NULL, sizeof *progress, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    return progress == MAP_FAILED ? NULL : progress;
}

/* The child is this program anew, not a mere fork: libraries that start threads when they are
 * loaded leave a forked child in a state that hangs the leak check. */
static int watch_child(const struct corpus *corpus, char **argv)
{
    int fd = memfd_create("progress", 0), status = 0;
    char fd_text[16];
    snprintf(fd_text, sizeof fd_text, "%d", fd);
    struct progress *progress =
        fd >= 0 && ftruncate(fd, sizeof *progress) == 0 ? progress_map(fd) : NULL;
    if (!progress)
        return 1;
    pid_t child = fork();
    if (child == 0) {
        setenv(CHILD_VARIABLE, fd_text, 1);
        execv("/proc/self/exe", argv);
        _exit(127);
    }
    if (child < 0 || waitpid(child, &status, 0) != child)
        return 1;
    return report(corpus, progress, status);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: %s CORPUS_DIRECTORY [MUTATIONS [SECONDS]]\n", argv[0]);
        return 2;
    }
    long mutations = argc > 2 ? strtol(argv[2], NULL, 10) : MUTATIONS_DEFAULT;
    double seconds = argc > 3 ? strtod(argv[3], NULL) : SECONDS_DEFAULT;
    const char *child_fd = getenv(CHILD_VARIABLE);
    struct corpus corpus = {0};
    int result = 1;
    if (!corpus_read(argv[1], &corpus)) {
        corpus_finish(&corpus);
        return 1;
    }
    if (child_fd) {
        struct progress *progress = progress_map((int)strtol(child_fd, NULL, 10));
        if (progress) {
            run_all(&corpus, mutations, seconds, progress);
            result = 0;
        }
    } else {
        result = watch_child(&corpus, argv);
    }
    corpus_finish(&corpus);
    return result;
}
