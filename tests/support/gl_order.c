/* SPDX-License-Identifier: MIT */
/* Another order: dispatches are held back until something orders them, then run last first. Without
 * a barrier between them GL says nothing about the order in which their memory accesses happen
 * (OpenGL 4.5, 7.13), so each order gives the right result, or the renderer lacks a barrier. */
#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/gl_layers.h"
#include "tests/support/gl_mirror.h"

enum {
    HELD = 64,           /* dispatches at most; the next one runs them */
    BINDINGS = 64,       /* of one dispatch */
    UNIFORMS = 96,       /* values of one program, elements of arrays apart */
    COMPONENTS_MAX = 16, /* of a matrix */
};

struct binding {
    enum gl_way way;
    GLuint index, sampler;
    struct gl_slot slot; /* a texture is its object */
};

struct value {
    GLint location;
    GLenum type;
    union {
        GLfloat f[COMPONENTS_MAX];
        GLint i[COMPONENTS_MAX];
        GLuint u[COMPONENTS_MAX];
    } of;
};

struct values {
    GLuint program;
    struct value items[UNIFORMS];
    int count;
};

struct held {
    GLuint groups[3];
    struct values values;
    struct binding bindings[BINDINGS];
    int binding_count;
};

static struct {
    struct gl_functions next;
    struct held *held;  /* HELD of them */
    struct values *now; /* HELD: what the programs' uniforms are to be after all */
    int count;
    bool passes[GL_FUNCTION_COUNT]; /* functions that held dispatches do not mind */
    uint64_t seen, passed;          /* dispatches; those that another one ran before */
} order;

/* ---- uniforms ---- */

enum base { BASE_NONE, BASE_FLOAT, BASE_INT, BASE_UINT };

static enum base base_of(GLenum type, int *components)
{
    static const struct {
        GLenum type;
        enum base base;
        int components;
    } types[] = {
        {GL_FLOAT, BASE_FLOAT, 1},
        {GL_FLOAT_VEC2, BASE_FLOAT, 2},
        {GL_FLOAT_VEC3, BASE_FLOAT, 3},
        {GL_FLOAT_VEC4, BASE_FLOAT, 4},
        {GL_FLOAT_MAT3, BASE_FLOAT, 9},
        {GL_FLOAT_MAT4, BASE_FLOAT, 16},
        {GL_INT, BASE_INT, 1},
        {GL_INT_VEC2, BASE_INT, 2},
        {GL_INT_VEC3, BASE_INT, 3},
        {GL_INT_VEC4, BASE_INT, 4},
        {GL_BOOL, BASE_INT, 1},
        {GL_UNSIGNED_INT, BASE_UINT, 1},
        {GL_UNSIGNED_INT_VEC2, BASE_UINT, 2},
        {GL_UNSIGNED_INT_VEC3, BASE_UINT, 3},
        {GL_UNSIGNED_INT_VEC4, BASE_UINT, 4},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (types[i].type == type) {
            *components = types[i].components;
            return types[i].base;
        }
    }
    *components = 0;
    return BASE_NONE;
}

static void read_value(GLuint program, struct value *value)
{
    int components;
    switch (base_of(value->type, &components)) {
    case BASE_FLOAT:
        order.next.GetUniformfv(program, value->location, value->of.f);
        break;
    case BASE_INT:
        order.next.GetUniformiv(program, value->location, value->of.i);
        break;
    default:
        order.next.GetUniformuiv(program, value->location, value->of.u);
        break;
    }
}

static void write_floats(GLuint program, const struct value *value, int components)
{
    const struct gl_functions *gl = &order.next;
    GLint at = value->location;
    switch (components) {
    case 1:
        gl->ProgramUniform1fv(program, at, 1, value->of.f);
        break;
    case 2:
        gl->ProgramUniform2fv(program, at, 1, value->of.f);
        break;
    case 3:
        gl->ProgramUniform3fv(program, at, 1, value->of.f);
        break;
    case 4:
        gl->ProgramUniform4fv(program, at, 1, value->of.f);
        break;
    case 9:
        gl->ProgramUniformMatrix3fv(program, at, 1, GL_FALSE, value->of.f);
        break;
    default:
        gl->ProgramUniformMatrix4fv(program, at, 1, GL_FALSE, value->of.f);
        break;
    }
}

static void write_integers(GLuint program, const struct value *value, int components,
                           bool is_signed)
{
    const struct gl_functions *gl = &order.next;
    GLint at = value->location;
    switch (components) {
    case 1:
        is_signed ? gl->ProgramUniform1iv(program, at, 1, value->of.i)
                  : gl->ProgramUniform1uiv(program, at, 1, value->of.u);
        break;
    case 2:
        is_signed ? gl->ProgramUniform2iv(program, at, 1, value->of.i)
                  : gl->ProgramUniform2uiv(program, at, 1, value->of.u);
        break;
    case 3:
        is_signed ? gl->ProgramUniform3iv(program, at, 1, value->of.i)
                  : gl->ProgramUniform3uiv(program, at, 1, value->of.u);
        break;
    default:
        is_signed ? gl->ProgramUniform4iv(program, at, 1, value->of.i)
                  : gl->ProgramUniform4uiv(program, at, 1, value->of.u);
        break;
    }
}

static void write_values(const struct values *values)
{
    for (int i = 0; i < values->count; i++) {
        const struct value *value = &values->items[i];
        int components;
        enum base base = base_of(value->type, &components);
        if (base == BASE_FLOAT)
            write_floats(values->program, value, components);
        else
            write_integers(values->program, value, components, base == BASE_INT);
    }
}

/* False: more uniforms, or of other types, than are known here. */
static bool add_elements(struct values *values, GLint index, GLint count)
{
    for (GLint k = 0; k < count; k++) {
        char name[GL_LABEL_BYTES], element[GL_LABEL_BYTES + 16];
        struct value *value = &values->items[values->count];
        const GLenum property = GL_TYPE;
        GLint type = 0;
        int components;
        order.next.GetProgramResourceiv(values->program, GL_UNIFORM, (GLuint)index, 1, &property, 1,
                                        NULL, &type);
        order.next.GetProgramResourceName(values->program, GL_UNIFORM, (GLuint)index, sizeof name,
                                          NULL, name);
        name[strcspn(name, "[")] = 0;
        snprintf(element, sizeof element, count > 1 ? "%s[%d]" : "%s", name, k);
        if (values->count == UNIFORMS || base_of((GLenum)type, &components) == BASE_NONE)
            return false;
        value->type = (GLenum)type;
        value->location = order.next.GetUniformLocation(values->program, element);
        read_value(values->program, value);
        values->count++;
    }
    return true;
}

static bool is_opaque(const struct gl_shape *shape, GLint location)
{
    for (int i = 0; i < shape->resource_count; i++)
        if (shape->resources[i].location == location)
            return true;
    return false;
}

static bool read_values(const struct gl_shape *shape, struct values *values)
{
    static const GLenum properties[] = {GL_LOCATION, GL_ARRAY_SIZE};
    GLint count = 0;
    values->program = shape->name;
    values->count = 0;
    order.next.GetProgramInterfaceiv(shape->name, GL_UNIFORM, GL_ACTIVE_RESOURCES, &count);
    for (GLint i = 0; i < count; i++) {
        GLint found[2] = {-1, 0};
        order.next.GetProgramResourceiv(shape->name, GL_UNIFORM, (GLuint)i, 2, properties, 2, NULL,
                                        found);
        if (found[0] < 0 || is_opaque(shape, found[0]))
            continue; /* members of blocks are in their buffers */
        if (!add_elements(values, i, found[1]))
            return false;
    }
    return true;
}

static void read_again(struct values *values)
{
    for (int i = 0; i < values->count; i++)
        read_value(values->program, &values->items[i]);
}

/* ---- bindings ---- */

static struct binding binding_now(enum gl_way way, GLuint index)
{
    const struct gl_mirror *state = gl_mirror_state();
    struct binding binding = {.way = way, .index = index};
    if (way == GL_WAY_FETCH) {
        binding.slot.object = state->textures[index];
        binding.sampler = state->samplers[index];
    } else {
        binding.slot = way == GL_WAY_STORAGE   ? state->storage[index]
                       : way == GL_WAY_UNIFORM ? state->uniforms[index]
                                               : state->images[index];
    }
    return binding;
}

static void bind(const struct binding *binding)
{
    const struct gl_functions *gl = &order.next;
    const struct gl_slot *slot = &binding->slot;
    GLuint index = binding->index, name = slot->object ? slot->object->name : 0;
    GLenum target = binding->way == GL_WAY_STORAGE ? GL_SHADER_STORAGE_BUFFER : GL_UNIFORM_BUFFER;
    if (binding->way == GL_WAY_FETCH) {
        gl->BindTextureUnit(index, name);
        gl->BindSampler(index, binding->sampler);
    } else if (binding->way == GL_WAY_IMAGE) {
        gl->BindImageTexture(index, name, slot->level, slot->is_layered, slot->layer,
                             name ? slot->access : GL_READ_ONLY, name ? slot->format : GL_R8);
    } else if (name) {
        gl->BindBufferRange(target, index, name, (GLintptr)slot->begin,
                            (GLsizeiptr)(slot->end - slot->begin));
    } else {
        gl->BindBufferBase(target, index, 0);
    }
}

static bool read_bindings(const struct gl_shape *shape, struct held *held)
{
    held->binding_count = 0;
    for (int i = 0; i < shape->resource_count; i++) {
        const struct gl_resource *resource = &shape->resources[i];
        for (GLint k = resource->binding; k < resource->binding + resource->count; k++) {
            if (held->binding_count == BINDINGS || k < 0 || k >= GL_UNITS)
                return false;
            held->bindings[held->binding_count++] = binding_now(resource->way, (GLuint)k);
        }
    }
    return true;
}

/* ---- holding and running ---- */

static void run(const struct held *held)
{
    write_values(&held->values);
    for (int i = 0; i < held->binding_count; i++)
        bind(&held->bindings[i]);
    order.next.UseProgram(held->values.program);
    order.next.DispatchCompute(held->groups[0], held->groups[1], held->groups[2]);
}

/* Uniforms and bindings as the renderer has set them since. */
static void restore(void)
{
    for (int i = 0; i < order.count; i++) {
        write_values(&order.now[i]);
        for (int k = 0; k < order.held[i].binding_count; k++) {
            const struct binding *used = &order.held[i].bindings[k];
            const struct binding now = binding_now(used->way, used->index);
            bind(&now);
        }
    }
    order.next.UseProgram(gl_mirror_state()->program);
}

static void run_held(void)
{
    if (!order.count)
        return;
    for (int i = 0; i < order.count; i++) {
        order.now[i] = order.held[i].values;
        read_again(&order.now[i]);
    }
    for (int i = order.count - 1; i >= 0; i--)
        run(&order.held[i]);
    restore();
    order.passed += (uint64_t)order.count - 1;
    order.count = 0;
}

static void GLAPIENTRY on_DispatchCompute(GLuint x, GLuint y, GLuint z)
{
    const struct gl_shape *shape = gl_mirror_program(gl_mirror_state()->program);
    order.seen++;
    if (order.count == HELD)
        run_held();
    struct held *held = &order.held[order.count];
    if (!shape || !read_values(shape, &held->values) || !read_bindings(shape, held)) {
        run_held();
        order.next.DispatchCompute(x, y, z);
        return;
    }
    memcpy(held->groups, (GLuint[3]){x, y, z}, sizeof held->groups);
    order.count++;
}

static void let_pass(enum gl_function function)
{
    if (!order.passes[function])
        run_held();
}

#define ORDER_VOID(type, name, params, args)   \
    static void GLAPIENTRY order_##name params \
    {                                          \
        let_pass(GL_FUNCTION_##name);          \
        order.next.name args;                  \
    }
#define ORDER_VALUE(type, name, params, args)  \
    static type GLAPIENTRY order_##name params \
    {                                          \
        let_pass(GL_FUNCTION_##name);          \
        return order.next.name args;           \
    }
GL_TABLE(ORDER_VOID, ORDER_VALUE)

/* Held dispatches keep the bindings and uniforms that they had, so that these may change; a
 * timestamp orders nothing. All else, and whatever is not known here, orders. */
static bool is_passed(const char *function)
{
    static const char *const names[] = {
        "glUseProgram",      "glBindBufferBase", "glBindBufferRange",
        "glBindTextureUnit", "glBindSampler",    "glBindImageTexture",
        "glPushDebugGroup",  "glPopDebugGroup",  "glGetUniformLocation",
        "glQueryCounter",    "glGetError",       "glGetGraphicsResetStatus",
        "glGetIntegerv",
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(function, names[i]))
            return true;
    return !strncmp(function, "glProgramUniform", strlen("glProgramUniform"));
}

void gl_order_print(void)
{
    if (order.seen)
        fprintf(stderr, "gl reorder: %llu dispatches, %llu of them ran before an earlier one\n",
                (unsigned long long)order.seen, (unsigned long long)order.passed);
}

void gl_order_install(struct gl_functions *functions)
{
    free(order.held);
    free(order.now);
    memset(&order, 0, sizeof order);
    order.next = *functions;
    order.held = calloc(HELD, sizeof *order.held);
    order.now = calloc(HELD, sizeof *order.now);
    assert(order.held && order.now);
    for (int i = 0; i < GL_FUNCTION_COUNT; i++)
        order.passes[i] = is_passed(gl_function_name((enum gl_function)i));
#define ORDERED(type, name, params, args) functions->name = order_##name;
    GL_TABLE(ORDERED, ORDERED)
#undef ORDERED
#define HOOK(name) functions->name = on_##name
    HOOK(DispatchCompute);
#undef HOOK
}
