/* SPDX-License-Identifier: MIT */
/* A hostile device: the least limits, hidden extensions, timers of either kind, a lost context. */
#include "tests/support/gl_hostile.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/support/gl_layers.h"
#include "tests/support/gl_mirror.h"

enum {
    BLOCK_BYTES = 1 << 20, /* far below what GL 4.5 promises (16 MiB), to meet the limit soon */
    TEXELS = 65536,        /* the least that GL 4.5 allows: table 23.53 */
    QUERIES = 1 << 16,
};

static const char post_coverage[] = "GL_ARB_post_depth_coverage";

static struct {
    struct gl_functions next;
    struct gl_hostility hostility;
    uint64_t calls, last_call;   /* the last that comes through; 0: all do */
    bool was_told;               /* that the context is lost */
    uint64_t stamps_ns[QUERIES]; /* and durations, of GL_TIME_ELAPSED */
    GLuint running;              /* the query of GL_TIME_ELAPSED that has begun */
} device;

/* ---- the lost context ---- */

void gl_hostile_lose_after(uint64_t calls)
{
    device.last_call = calls ? device.calls + calls : 0;
    device.was_told = false;
}

bool gl_hostile_is_lost(void)
{
    return device.last_call && device.calls >= device.last_call;
}

uint64_t gl_hostile_calls(void)
{
    return device.calls;
}

static bool comes_through(void)
{
    if (gl_hostile_is_lost())
        return false;
    device.calls++;
    return true;
}

#define LOSE_VOID(type, name, params, args)   \
    static void GLAPIENTRY lose_##name params \
    {                                         \
        if (comes_through())                  \
            device.next.name args;            \
    }
#define LOSE_VALUE(type, name, params, args)                      \
    static type GLAPIENTRY lose_##name params                     \
    {                                                             \
        return comes_through() ? device.next.name args : (type)0; \
    }
GL_TABLE(LOSE_VOID, LOSE_VALUE)

static GLenum GLAPIENTRY on_GetError(void)
{
    return gl_hostile_is_lost() ? GL_CONTEXT_LOST : lose_GetError();
}

/* The reset is over by the second time that it is asked for. */
static GLenum GLAPIENTRY on_GetGraphicsResetStatus(void)
{
    if (!gl_hostile_is_lost())
        return lose_GetGraphicsResetStatus();
    GLenum status = device.was_told ? GL_NO_ERROR : GL_UNKNOWN_CONTEXT_RESET;
    device.was_told = true;
    return status;
}

static GLenum GLAPIENTRY on_ClientWaitSync(GLsync sync, GLbitfield flags, GLuint64 timeout)
{
    return gl_hostile_is_lost() ? GL_WAIT_FAILED : lose_ClientWaitSync(sync, flags, timeout);
}

/* ---- limits ---- */

static void GLAPIENTRY on_GetInteger64v(GLenum what, GLint64 *value)
{
    lose_GetInteger64v(what, value);
    if (gl_hostile_is_lost())
        return;
    if (what == GL_MAX_SHADER_STORAGE_BLOCK_SIZE && device.hostility.has_small_blocks)
        *value = BLOCK_BYTES;
    if (what == GL_MAX_TEXTURE_BUFFER_SIZE && device.hostility.has_small_texels)
        *value = TEXELS;
}

/* How much of the card's memory is free (GL_NVX_gpu_memory_info, GL_ATI_meminfo): what a rasteriser
 * without one answers is chance. */
static bool asks_for_card(GLenum what)
{
    return what == GL_GPU_MEMORY_INFO_CURRENT_AVAILABLE_VIDMEM_NVX ||
           what == GL_TEXTURE_FREE_MEMORY_ATI;
}

static void GLAPIENTRY on_GetIntegerv(GLenum what, GLint *value)
{
    lose_GetIntegerv(what, value);
    if (gl_hostile_is_lost())
        return;
    if (what == GL_MAX_SHADER_STORAGE_BLOCK_SIZE && device.hostility.has_small_blocks)
        *value = BLOCK_BYTES;
    if (what == GL_MAX_TEXTURE_BUFFER_SIZE && device.hostility.has_small_texels)
        *value = TEXELS;
    if (asks_for_card(what) && device.hostility.is_not_software)
        *value = 0;
}

static void check_block(GLenum target, GLuint buffer, uint64_t bytes)
{
    const struct gl_object *object = gl_mirror_buffer(buffer);
    if (device.hostility.has_small_blocks && target == GL_SHADER_STORAGE_BUFFER &&
        bytes > BLOCK_BYTES)
        gl_fault("'%s' is bound as a storage block of %llu bytes, the device has blocks of %d",
                 object ? object->label : "?", (unsigned long long)bytes, BLOCK_BYTES);
}

static void GLAPIENTRY on_BindBufferBase(GLenum target, GLuint index, GLuint buffer)
{
    const struct gl_object *object = gl_mirror_buffer(buffer);
    check_block(target, buffer, object ? object->size_bytes : 0);
    lose_BindBufferBase(target, index, buffer);
}

static void GLAPIENTRY on_BindBufferRange(GLenum target, GLuint index, GLuint buffer,
                                          GLintptr offset, GLsizeiptr size)
{
    check_block(target, buffer, (uint64_t)size);
    lose_BindBufferRange(target, index, buffer, offset, size);
}

static uint64_t texel_bytes(GLenum format)
{
    return format == GL_RGBA32F || format == GL_RGBA32UI                       ? 16
           : format == GL_RGB32F                                               ? 12
           : format == GL_RG32F || format == GL_RG32UI || format == GL_RGBA16F ? 8
           : format == GL_R32F || format == GL_R32UI || format == GL_RGBA8     ? 4
                                                                               : 1;
}

static void check_texels(GLuint texture, GLenum format, uint64_t bytes)
{
    const struct gl_object *object = gl_mirror_texture(texture);
    if (device.hostility.has_small_texels && bytes / texel_bytes(format) > TEXELS)
        gl_fault("'%s' shows %llu texels of a buffer, the device reads %d",
                 object ? object->label : "?", (unsigned long long)(bytes / texel_bytes(format)),
                 TEXELS);
}

static void GLAPIENTRY on_TextureBuffer(GLuint texture, GLenum format, GLuint buffer)
{
    const struct gl_object *object = gl_mirror_buffer(buffer);
    check_texels(texture, format, object ? object->size_bytes : 0);
    lose_TextureBuffer(texture, format, buffer);
}

static void GLAPIENTRY on_TextureBufferRange(GLuint texture, GLenum format, GLuint buffer,
                                             GLintptr offset, GLsizeiptr size)
{
    check_texels(texture, format, (uint64_t)size);
    lose_TextureBufferRange(texture, format, buffer, offset, size);
}

/* ---- names and extensions ---- */

static const GLubyte *GLAPIENTRY on_GetString(GLenum what)
{
    const GLubyte *text = lose_GetString(what);
    if (text && what == GL_RENDERER && device.hostility.is_not_software)
        return (const GLubyte *)"Hostile Device";
    return text;
}

/* The number of extensions stays: one has another name. */
static const GLubyte *GLAPIENTRY on_GetStringi(GLenum what, GLuint index)
{
    const GLubyte *text = lose_GetStringi(what, index);
    if (text && what == GL_EXTENSIONS && device.hostility.lacks_post_coverage &&
        !strcmp((const char *)text, post_coverage))
        return (const GLubyte *)"GL_HOSTILE_absent";
    return text;
}

/* Without the line that enables the extension what uses it does not compile. */
static char *without_extension(const char *text)
{
    static const char line[] = "#extension GL_ARB_post_depth_coverage";
    char *copy = strdup(text), *found = copy ? strstr(copy, line) : NULL;
    if (found)
        memcpy(found, "//", 2);
    return copy;
}

static void GLAPIENTRY on_ShaderSource(GLuint shader, GLsizei count, const GLchar *const *text,
                                       const GLint *length)
{
    char *copy =
        device.hostility.lacks_post_coverage && count == 1 ? without_extension(text[0]) : NULL;
    if (copy)
        lose_ShaderSource(shader, 1, (const GLchar *const[]){copy}, NULL);
    else
        lose_ShaderSource(shader, count, text, length);
    free(copy);
}

/* ---- timers ---- */

static uint64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000ull + (uint64_t)now.tv_nsec;
}

/* A true timer stamps what was done before; a lying one stands still. */
static void stamp(GLuint query, uint64_t since_ns)
{
    if (device.hostility.timers != GL_TIMERS_TRUE || gl_hostile_is_lost() || query >= QUERIES)
        return;
    device.next.Finish();
    device.stamps_ns[query] = now_ns() - since_ns;
}

static void GLAPIENTRY on_QueryCounter(GLuint query, GLenum target)
{
    lose_QueryCounter(query, target);
    stamp(query, 0);
}

static void GLAPIENTRY on_BeginQuery(GLenum target, GLuint query)
{
    lose_BeginQuery(target, query);
    if (target != GL_TIME_ELAPSED || query >= QUERIES)
        return;
    device.running = query;
    stamp(query, 0);
}

static void GLAPIENTRY on_EndQuery(GLenum target)
{
    lose_EndQuery(target);
    if (target == GL_TIME_ELAPSED)
        stamp(device.running, device.stamps_ns[device.running]);
}

/* The driver is not asked for what is known here: where the device executes nothing, iris would
 * wait for an answer for ever. */
static void GLAPIENTRY on_GetQueryObjectui64v(GLuint query, GLenum what, GLuint64 *value)
{
    if (device.hostility.timers == GL_TIMERS_AS_THEY_ARE || gl_hostile_is_lost() ||
        query >= QUERIES)
        lose_GetQueryObjectui64v(query, what, value);
    else
        *value = what == GL_QUERY_RESULT_AVAILABLE ? GL_TRUE : device.stamps_ns[query];
}

bool gl_stamps_are_answered(void)
{
    GLuint stamp;
    GLuint64 is_there = GL_FALSE;
    glCreateQueries(GL_TIMESTAMP, 1, &stamp);
    glQueryCounter(stamp, GL_TIMESTAMP);
    glFinish();
    glGetQueryObjectui64v(stamp, GL_QUERY_RESULT_AVAILABLE, &is_there);
    glDeleteQueries(1, &stamp);
    return is_there;
}

/* ---- installation ---- */

void gl_hostile_install(struct gl_functions *functions, const struct gl_hostility *hostility)
{
    memset(&device, 0, sizeof device);
    device.next = *functions;
    device.hostility = *hostility;
    gl_hostile_lose_after(hostility->lost_after);
#define LOSABLE(type, name, params, args) functions->name = lose_##name;
    GL_TABLE(LOSABLE, LOSABLE)
#undef LOSABLE
#define HOOK(name) functions->name = on_##name
    HOOK(GetError);
    HOOK(GetGraphicsResetStatus);
    HOOK(ClientWaitSync);
    HOOK(GetInteger64v);
    HOOK(GetIntegerv);
    HOOK(BindBufferBase);
    HOOK(BindBufferRange);
    HOOK(TextureBuffer);
    HOOK(TextureBufferRange);
    HOOK(GetString);
    HOOK(GetStringi);
    HOOK(ShaderSource);
    HOOK(QueryCounter);
    HOOK(BeginQuery);
    HOOK(EndQuery);
    HOOK(GetQueryObjectui64v);
#undef HOOK
}
