/* SPDX-License-Identifier: MIT */
/* The counting layer. */
#include "tests/support/gl_counts.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "tests/support/gl_layers.h"
#include "tests/support/gl_mirror.h"

enum { PASSES = 64, NAME_BYTES = 48, FENCES = 64, QUERIES = 1 << 16 };

struct pass {
    char name[NAME_BYTES];
    struct gl_counts counts;
};

struct fence {
    GLsync sync;
    uint64_t work;
};

/* Work is numbered: command n has been done where done >= n. */
static struct {
    struct gl_functions next;
    struct pass passes[PASSES]; /* the first: outside of passes */
    int pass_count;
    struct gl_counts *now;
    uint64_t work, done, waited_at; /* waited_at: `work` at the last wait */
    struct fence fences[FENCES];    /* a ring */
    unsigned fence_count;
    uint64_t query_work[QUERIES];
} counts;

static const char *const wait_names[GL_WAIT_COUNT] = {"finish", "fence",        "buffer read",
                                                      "map",    "texture read", "query"};

/* ---- every function ---- */

static uint64_t processor_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (uint64_t)now.tv_sec * 1000000000ull + (uint64_t)now.tv_nsec;
}

static uint64_t begin_call(enum gl_function function)
{
    counts.now->calls++;
    counts.now->by_function[function]++;
    return processor_ns();
}

static void end_call(uint64_t begin_ns)
{
    counts.now->processor_ns += processor_ns() - begin_ns;
}

#define COUNT_VOID(type, name, params, args)                \
    static void GLAPIENTRY count_##name params              \
    {                                                       \
        uint64_t begin_ns = begin_call(GL_FUNCTION_##name); \
        counts.next.name args;                              \
        end_call(begin_ns);                                 \
    }
#define COUNT_VALUE(type, name, params, args)               \
    static type GLAPIENTRY count_##name params              \
    {                                                       \
        uint64_t begin_ns = begin_call(GL_FUNCTION_##name); \
        type value = counts.next.name args;                 \
        end_call(begin_ns);                                 \
        return value;                                       \
    }
GL_TABLE(COUNT_VOID, COUNT_VALUE)

/* ---- work and waits ---- */

static void note_done(uint64_t work)
{
    if (work > counts.done)
        counts.done = work;
}

/* Waits for what was given at once are one, whatever their number. */
static void wait_for(enum gl_wait kind, uint64_t work)
{
    if (work > counts.done && counts.work > counts.waited_at) {
        counts.now->waits[kind]++;
        counts.now->stalls += work == counts.work;
        counts.waited_at = counts.work;
    }
    note_done(work);
}

static void note_write(struct gl_object *object)
{
    if (object)
        object->written_at = counts.work;
}

static void note_program_writes(bool is_draw)
{
    struct gl_touches touches = {.count = 0};
    counts.work++;
    if (is_draw)
        counts.now->draws++;
    else
        counts.now->dispatches++;
    gl_mirror_add_program(&touches);
    for (int i = 0; i < touches.count; i++)
        if (touches.items[i].writes)
            note_write(touches.items[i].object);
}

static void GLAPIENTRY on_DispatchCompute(GLuint x, GLuint y, GLuint z)
{
    note_program_writes(false);
    count_DispatchCompute(x, y, z);
}

static void GLAPIENTRY on_DispatchComputeIndirect(GLintptr indirect)
{
    note_program_writes(false);
    count_DispatchComputeIndirect(indirect);
}

static void GLAPIENTRY on_DrawArrays(GLenum mode, GLint first, GLsizei n)
{
    note_program_writes(true);
    count_DrawArrays(mode, first, n);
}

static void GLAPIENTRY on_DrawArraysInstanced(GLenum mode, GLint first, GLsizei n,
                                              GLsizei instances)
{
    note_program_writes(true);
    count_DrawArraysInstanced(mode, first, n, instances);
}

static void GLAPIENTRY on_DrawArraysInstancedBaseInstance(GLenum mode, GLint first, GLsizei n,
                                                          GLsizei instances, GLuint base)
{
    note_program_writes(true);
    count_DrawArraysInstancedBaseInstance(mode, first, n, instances, base);
}

static void GLAPIENTRY on_MultiDrawElementsIndirect(GLenum mode, GLenum type, const void *indirect,
                                                    GLsizei n, GLsizei stride)
{
    note_program_writes(true);
    count_MultiDrawElementsIndirect(mode, type, indirect, n, stride);
}

static void GLAPIENTRY on_ClearNamedBufferSubData(GLuint buffer, GLenum internal, GLintptr offset,
                                                  GLsizeiptr size, GLenum format, GLenum type,
                                                  const void *data)
{
    counts.work++;
    note_write(gl_mirror_buffer(buffer));
    count_ClearNamedBufferSubData(buffer, internal, offset, size, format, type, data);
}

static void GLAPIENTRY on_CopyNamedBufferSubData(GLuint from, GLuint to, GLintptr from_offset,
                                                 GLintptr to_offset, GLsizeiptr size)
{
    counts.work++;
    note_write(gl_mirror_buffer(to));
    count_CopyNamedBufferSubData(from, to, from_offset, to_offset, size);
}

static void GLAPIENTRY on_Finish(void)
{
    wait_for(GL_WAIT_FINISH, counts.work);
    count_Finish();
}

static GLsync GLAPIENTRY on_FenceSync(GLenum condition, GLbitfield flags)
{
    GLsync sync = count_FenceSync(condition, flags);
    counts.fences[counts.fence_count++ % FENCES] = (struct fence){sync, counts.work};
    return sync;
}

static GLenum GLAPIENTRY on_ClientWaitSync(GLsync sync, GLbitfield flags, GLuint64 timeout)
{
    GLenum result = count_ClientWaitSync(sync, flags, timeout);
    for (int i = 0; i < FENCES; i++) {
        struct fence *fence = &counts.fences[i];
        if (!sync || fence->sync != sync)
            continue;
        bool has_passed = result == GL_ALREADY_SIGNALED || result == GL_CONDITION_SATISFIED;
        if (timeout && has_passed)
            wait_for(GL_WAIT_FENCE, fence->work);
        else if (has_passed)
            note_done(fence->work);
    }
    return result;
}

static void GLAPIENTRY on_DeleteSync(GLsync sync)
{
    for (int i = 0; i < FENCES; i++)
        if (counts.fences[i].sync == sync)
            counts.fences[i] = (struct fence){0};
    count_DeleteSync(sync);
}

static void GLAPIENTRY on_QueryCounter(GLuint query, GLenum target)
{
    if (query < QUERIES)
        counts.query_work[query] = ++counts.work;
    count_QueryCounter(query, target);
}

static void GLAPIENTRY on_GetQueryObjectui64v(GLuint query, GLenum what, GLuint64 *value)
{
    if (query < QUERIES && what == GL_QUERY_RESULT)
        wait_for(GL_WAIT_QUERY, counts.query_work[query]);
    count_GetQueryObjectui64v(query, what, value);
}

/* ---- bytes ---- */

static void GLAPIENTRY on_GetNamedBufferSubData(GLuint buffer, GLintptr offset, GLsizeiptr size,
                                                void *data)
{
    const struct gl_object *object = gl_mirror_buffer(buffer);
    wait_for(GL_WAIT_BUFFER_READ, object ? object->written_at : counts.work);
    counts.now->bytes_down += (uint64_t)size;
    count_GetNamedBufferSubData(buffer, offset, size, data);
}

static void *GLAPIENTRY on_MapNamedBufferRange(GLuint buffer, GLintptr offset, GLsizeiptr size,
                                               GLbitfield access)
{
    const struct gl_object *object = gl_mirror_buffer(buffer);
    if (!(access & (GL_MAP_UNSYNCHRONIZED_BIT | GL_MAP_PERSISTENT_BIT)))
        wait_for(GL_WAIT_MAP, object ? object->written_at : counts.work);
    if (access & GL_MAP_READ_BIT)
        counts.now->bytes_down += (uint64_t)size;
    else
        counts.now->bytes_up += (uint64_t)size;
    return count_MapNamedBufferRange(buffer, offset, size, access);
}

static void GLAPIENTRY on_GetTextureSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z,
                                             GLsizei width, GLsizei height, GLsizei depth,
                                             GLenum format, GLenum type, GLsizei size, void *pixels)
{
    struct gl_object *pack = gl_mirror_state()->pack;
    counts.work++;
    note_write(pack);
    if (!pack) {
        wait_for(GL_WAIT_TEXTURE_READ, counts.work);
        counts.now->bytes_down += (uint64_t)size;
    }
    count_GetTextureSubImage(texture, level, x, y, z, width, height, depth, format, type, size,
                             pixels);
}

static void GLAPIENTRY on_NamedBufferStorage(GLuint buffer, GLsizeiptr size, const void *data,
                                             GLbitfield flags)
{
    counts.now->bytes_up += data ? (uint64_t)size : 0;
    count_NamedBufferStorage(buffer, size, data, flags);
}

static void GLAPIENTRY on_NamedBufferSubData(GLuint buffer, GLintptr offset, GLsizeiptr size,
                                             const void *data)
{
    counts.work++;
    counts.now->bytes_up += (uint64_t)size;
    count_NamedBufferSubData(buffer, offset, size, data);
}

static uint64_t texel_bytes(GLenum format, GLenum type)
{
    uint64_t channels = format == GL_RED || format == GL_RED_INTEGER ? 1
                        : format == GL_RG || format == GL_RG_INTEGER ? 2
                        : format == GL_RGB                           ? 3
                                                                     : 4;
    return channels * (type == GL_FLOAT || type == GL_UNSIGNED_INT          ? 4
                       : type == GL_HALF_FLOAT || type == GL_UNSIGNED_SHORT ? 2
                                                                            : 1);
}

static void GLAPIENTRY on_TextureSubImage2D(GLuint texture, GLint level, GLint x, GLint y,
                                            GLsizei width, GLsizei height, GLenum format,
                                            GLenum type, const void *pixels)
{
    counts.work++;
    if (!gl_mirror_state()->unpack)
        counts.now->bytes_up += (uint64_t)width * (uint64_t)height * texel_bytes(format, type);
    count_TextureSubImage2D(texture, level, x, y, width, height, format, type, pixels);
}

static void GLAPIENTRY on_CompressedTextureSubImage2D(GLuint texture, GLint level, GLint x, GLint y,
                                                      GLsizei width, GLsizei height, GLenum format,
                                                      GLsizei size, const void *data)
{
    counts.work++;
    if (!gl_mirror_state()->unpack)
        counts.now->bytes_up += (uint64_t)size;
    count_CompressedTextureSubImage2D(texture, level, x, y, width, height, format, size, data);
}

/* ---- the driver's own thread ---- */

static GLenum GLAPIENTRY on_GetError(void)
{
    counts.now->syncs++;
    return count_GetError();
}

static GLenum GLAPIENTRY on_CheckNamedFramebufferStatus(GLuint framebuffer, GLenum target)
{
    counts.now->syncs++;
    return count_CheckNamedFramebufferStatus(framebuffer, target);
}

static void GLAPIENTRY on_GetShaderiv(GLuint shader, GLenum what, GLint *value)
{
    counts.now->syncs++;
    count_GetShaderiv(shader, what, value);
}

static void GLAPIENTRY on_GetProgramiv(GLuint program, GLenum what, GLint *value)
{
    counts.now->syncs++;
    count_GetProgramiv(program, what, value);
}

/* ---- passes ---- */

static struct gl_counts *pass_of(const char *name)
{
    for (int i = 0; i < counts.pass_count; i++)
        if (!strncmp(counts.passes[i].name, name, NAME_BYTES - 1))
            return &counts.passes[i].counts;
    if (counts.pass_count == PASSES)
        return &counts.passes[0].counts;
    struct pass *pass = &counts.passes[counts.pass_count++];
    snprintf(pass->name, sizeof pass->name, "%s", name);
    return &pass->counts;
}

static void GLAPIENTRY on_PushDebugGroup(GLenum source, GLuint id, GLsizei length,
                                         const GLchar *message)
{
    counts.now = pass_of(message);
    count_PushDebugGroup(source, id, length, message);
}

static void GLAPIENTRY on_PopDebugGroup(void)
{
    count_PopDebugGroup();
    counts.now = &counts.passes[0].counts; /* passes do not nest */
}

/* ---- sums ---- */

static void add(struct gl_counts *sum, const struct gl_counts *part)
{
    uint64_t *to = (uint64_t *)sum;
    const uint64_t *from = (const uint64_t *)part;
    for (size_t i = 0; i < sizeof *sum / sizeof *to; i++)
        to[i] += from[i];
}

void gl_counts_get(struct gl_counts *out)
{
    *out = (struct gl_counts){0};
    for (int i = 0; i < counts.pass_count; i++)
        add(out, &counts.passes[i].counts);
}

struct gl_counts gl_counts_between(const struct gl_counts *before, const struct gl_counts *after)
{
    struct gl_counts difference;
    const uint64_t *a = (const uint64_t *)before, *b = (const uint64_t *)after;
    uint64_t *out = (uint64_t *)&difference;
    for (size_t i = 0; i < sizeof difference / sizeof *out; i++)
        out[i] = b[i] - a[i];
    return difference;
}

uint64_t gl_counts_waits(const struct gl_counts *sum)
{
    uint64_t waits = 0;
    for (int i = 0; i < GL_WAIT_COUNT; i++)
        waits += sum->waits[i];
    return waits;
}

static void show_line(const char *title, const struct gl_counts *c)
{
    fprintf(stderr, "gl count: %-28s %8llu calls %6llu draws %6llu dispatches", title,
            (unsigned long long)c->calls, (unsigned long long)c->draws,
            (unsigned long long)c->dispatches);
    fprintf(stderr, " %6llu syncs %10llu up %10llu down %9.3f ms, %llu waits",
            (unsigned long long)c->syncs, (unsigned long long)c->bytes_up,
            (unsigned long long)c->bytes_down, (double)c->processor_ns * 1e-6,
            (unsigned long long)gl_counts_waits(c));
    for (int i = 0; i < GL_WAIT_COUNT; i++)
        if (c->waits[i])
            fprintf(stderr, ", %llu %s", (unsigned long long)c->waits[i], wait_names[i]);
    fprintf(stderr, "\n");
}

void gl_counts_show(const char *title, const struct gl_counts *sum, int functions)
{
    bool was_shown[GL_FUNCTION_COUNT] = {false};
    show_line(title, sum);
    for (int k = 0; k < functions; k++) {
        int most = 0;
        for (int i = 1; i < GL_FUNCTION_COUNT; i++)
            if (was_shown[most] || (!was_shown[i] && sum->by_function[i] > sum->by_function[most]))
                most = i;
        if (was_shown[most] || !sum->by_function[most])
            return;
        was_shown[most] = true;
        fprintf(stderr, "gl count: %8llu %s\n", (unsigned long long)sum->by_function[most],
                gl_function_name((enum gl_function)most));
    }
}

void gl_counts_print(void)
{
    struct gl_counts all;
    gl_counts_get(&all);
    if (!all.calls)
        return;
    for (int i = 0; i < counts.pass_count; i++)
        show_line(counts.passes[i].name, &counts.passes[i].counts);
    gl_counts_show("all", &all, 30);
}

/* ---- installation ---- */

static void hook_commands(struct gl_functions *functions)
{
#define HOOK(name) functions->name = on_##name
    HOOK(DispatchCompute);
    HOOK(DispatchComputeIndirect);
    HOOK(DrawArrays);
    HOOK(DrawArraysInstanced);
    HOOK(DrawArraysInstancedBaseInstance);
    HOOK(MultiDrawElementsIndirect);
    HOOK(ClearNamedBufferSubData);
    HOOK(CopyNamedBufferSubData);
    HOOK(Finish);
    HOOK(FenceSync);
    HOOK(ClientWaitSync);
    HOOK(DeleteSync);
    HOOK(QueryCounter);
    HOOK(GetQueryObjectui64v);
    HOOK(GetNamedBufferSubData);
    HOOK(MapNamedBufferRange);
    HOOK(GetTextureSubImage);
    HOOK(NamedBufferStorage);
    HOOK(NamedBufferSubData);
    HOOK(TextureSubImage2D);
    HOOK(CompressedTextureSubImage2D);
    HOOK(GetError);
    HOOK(CheckNamedFramebufferStatus);
    HOOK(GetShaderiv);
    HOOK(GetProgramiv);
    HOOK(PushDebugGroup);
    HOOK(PopDebugGroup);
#undef HOOK
}

void gl_counts_install(struct gl_functions *functions)
{
    memset(&counts, 0, sizeof counts);
    counts.next = *functions;
    counts.now = pass_of("outside of passes");
#define COUNTED(type, name, params, args) functions->name = count_##name;
    GL_TABLE(COUNTED, COUNTED)
#undef COUNTED
    hook_commands(functions);
}
