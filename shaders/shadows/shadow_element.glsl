// SPDX-License-Identifier: MIT
// The 16-byte element of a linked shadow list: uvec4(depth, ..., ..., next).
// SHADOW_FAITHFUL: {depth, range, unorm8 RGB and 8 flag bits, next} and the linear law over the
// range, as published (Lindbeck 2015, 3.2); eight bits of object id collide above 255 objects.
// Otherwise {depth, unorm16 R and G, unorm16 B and 16 bits of object id, next}; surfaces have no
// range.
#define ELEMENT_END 0xffffffffu
#define ELEMENT_LOCKED 0xfffffffeu

#ifdef SHADOW_FAITHFUL
uvec4 element_make(float depth, vec3 t, uint object, uint next)
{
    uint filter_flags = packUnorm4x8(vec4(t, 0.0)) | (object & 0xffu) << 24u;
    return uvec4(floatBitsToUint(depth), 0u, filter_flags, next);
}

vec3 element_color(uvec4 element)
{
    return unpackUnorm4x8(element.z).rgb;
}

uint element_object(uvec4 element)
{
    return element.z >> 24u;
}

bool element_is_of(uvec4 element, uint object)
{
    return object != 0xffffffffu && element_object(element) == (object & 0xffu);
}

// A surface, not smoke that lets nothing through.
bool element_is_opaque(uvec4 element)
{
    return element.y == 0u && element_color(element) == vec3(0.0);
}

// before: how far behind the element's depth the receiver lies.
vec3 element_transmittance(uvec4 element, float before)
{
    float range = uintBitsToFloat(element.y);
    float part = range > 0.0 ? clamp(before / range, 0.0, 1.0) : 1.0;
    return 1.0 + (element_color(element) - 1.0) * part;
}
#else
uvec4 element_make(float depth, vec3 t, uint object, uint next)
{
    uint b_object = packUnorm2x16(vec2(t.b, 0.0)) | object << 16u;
    return uvec4(floatBitsToUint(depth), packUnorm2x16(t.rg), b_object, next);
}

vec3 element_color(uvec4 element)
{
    return vec3(unpackUnorm2x16(element.y), unpackUnorm2x16(element.z).x);
}

uint element_object(uvec4 element)
{
    return element.z >> 16u;
}

bool element_is_of(uvec4 element, uint object)
{
    return object != 0xffffffffu && element_object(element) == (object & 0xffffu);
}

vec3 element_transmittance(uvec4 element, float before)
{
    return element_color(element);
}
#endif
