// SPDX-License-Identifier: MIT
// Evaluates the material at a fragment of a camera pass: textures, normal map, geometric normal.
// Needs: TEXTURES (bit mask of sampled slots), HAS_TANGENT, HAS_TEXCOORDS, HAS_COLOR as the vertex
// stage.
// All derivatives and implicit-LOD samples are taken here, before any fragment may return.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "material/material.glsl"
#include "draw/surface.glsl"
#ifdef HAS_LOBES
#include "draw/lobes.glsl"
#endif

layout(location = 0) in vec3 v_position;
layout(location = 1) in vec3 v_normal;
layout(location = 2) flat in uvec4 v_ids;
#ifdef HAS_TANGENT
layout(location = 3) in vec4 v_tangent;
#endif
#ifdef HAS_TEXCOORDS
layout(location = 4) in vec4 v_texcoords;
#endif
#ifdef HAS_COLOR
layout(location = 5) in vec4 v_color;
#endif

vec4 evaluate_texel(uint m, int slot)
{
#ifdef HAS_TEXCOORDS
    return material_texel(m, slot, v_texcoords.xy, v_texcoords.zw, vec4(1.0));
#else
    return vec4(1.0);
#endif
}

// Tangent frame from the vertex tangent, else from derivatives. Schueler 2013, "Followup: Normal
// Mapping without Precomputed Tangents", eq. for the cotangent frame.
// False where there is none.
#if defined HAS_NORMAL_MAP || defined HAS_GRAIN
bool evaluate_frame(uint m, vec3 n, int slot, out vec3 t, out vec3 b)
{
#ifdef HAS_TANGENT
    t = v_tangent.xyz - n * dot(n, v_tangent.xyz);
    b = vec3(0.0);
    if (dot(t, t) < 1e-30)
        return false;
    t = normalize(t);
    b = cross(n, t) * v_tangent.w * (v_ids.w != 0u ? 1.0 : -1.0);
#else
    material_uv uv = material_coordinates(m, slot, v_texcoords.xy, v_texcoords.zw);
    vec3 px = dFdx(v_position), py = dFdy(v_position);
    vec2 ux = uv.dx, uy = uv.dy;
    vec3 qx = cross(py, n), qy = cross(n, px);
    t = qx * ux.x + qy * uy.x;
    b = qx * ux.y + qy * uy.y;
    if (!(dot(t, t) > 0.0 && dot(b, b) > 0.0))
        return false;
    t *= inversesqrt(dot(t, t));
    b *= -inversesqrt(dot(b, b)); // glTF's v points down the image, +Y of the normal map up
#endif
    return true;
}
#endif

#ifdef HAS_NORMAL_MAP
vec3 evaluate_normal_map(uint m, vec3 n, int slot, float scale)
{
    vec3 t, b, texel = evaluate_texel(m, slot).xyz * 2.0 - 1.0;
    texel.xy *= scale;
    if (!evaluate_frame(m, n, slot, t, b))
        return n;
    vec3 mapped = t * texel.x + b * texel.y + n * texel.z;
    return dot(mapped, mapped) > 0.0 ? normalize(mapped) : n;
}
#endif

vec3 evaluate_to_viewer()
{
#ifdef IS_ORTHOGRAPHIC
    return vec3(0.0, 0.0, 1.0);
#else
    return -v_position;
#endif
}

// Of the vertices, on the viewer's side.
vec3 evaluate_vertex_normal(vec3 to_viewer)
{
    float length_n = dot(v_normal, v_normal);
    vec3 n = length_n > 0.0 ? v_normal * inversesqrt(length_n) : normalize(to_viewer);
    return gl_FrontFacing ? n : -n;
}

#ifdef HAS_GRAIN
// Direction along which a surface of KHR_materials_anisotropy is rough, and by how much.
// m: the record after that of the lobes.
vec4 evaluate_grain(uint m, vec3 n, vec3 factors)
{
    vec3 t, b, texel = vec3(1.0, 0.0, 1.0);
    if ((TEXTURES & 1 << SLOT_ANISOTROPY) != 0)
        texel = evaluate_texel(m, SLOT_ANISOTROPY).rgb * vec3(2.0, 2.0, 1.0) - vec3(1.0, 1.0, 0.0);
    vec2 turned = vec2(texel.x * factors.y - texel.y * factors.z,
                       texel.x * factors.z + texel.y * factors.y);
    if (!evaluate_frame(m, n, SLOT_ANISOTROPY, t, b))
        return vec4(0.0);
#ifndef HAS_TANGENT
    // from the ways that coordinates grow fastest to those along which the other one stays
    float side = dot(cross(t, b), n) < 0.0 ? -1.0 : 1.0;
    vec3 along_u = cross(b, n) * side;
    b = cross(n, t) * side;
    t = along_u;
#endif
    vec3 along = t * turned.x + b * turned.y;
    return dot(along, along) > 1e-6 ? vec4(normalize(along), factors.x * texel.z) : vec4(0.0);
}
#endif

#ifdef HAS_LOBES
// Undefined where the material has none.
surface_lobes evaluate_lobes()
{
    uint m = materials[v_ids.x].lobes;
    material_record r = materials[m];
    surface_lobes lobes;
    lobes.specular.rgb = r.LOBES_SPECULAR.rgb * evaluate_texel(m, SLOT_SPECULAR_COLOR).rgb;
    lobes.specular.w = r.LOBES_SPECULAR.w * evaluate_texel(m, SLOT_SPECULAR).a;
    lobes.sheen = r.LOBES_SHEEN_COLOR.rgb * evaluate_texel(m, SLOT_SHEEN_COLOR).rgb;
    vec4 coat_sheen = r.LOBES_COAT_SHEEN;
    lobes.sheen_roughness = coat_sheen.z * evaluate_texel(m, SLOT_SHEEN_ROUGHNESS).a;
    lobes.coat = coat_sheen.x * evaluate_texel(m, SLOT_CLEARCOAT).r;
    lobes.coat_roughness = coat_sheen.y * evaluate_texel(m, SLOT_CLEARCOAT_ROUGHNESS).g;
    lobes.coat_normal = evaluate_vertex_normal(evaluate_to_viewer());
#ifdef HAS_NORMAL_MAP
    if ((TEXTURES & 1 << SLOT_CLEARCOAT_NORMAL) != 0)
        lobes.coat_normal =
            evaluate_normal_map(m, lobes.coat_normal, SLOT_CLEARCOAT_NORMAL, coat_sheen.w);
#endif
#ifdef HAS_MORE_LOBES
    vec4 film = r.LOBES_FILM;
    lobes.grain = vec4(0.0);
#ifdef HAS_GRAIN
    lobes.grain = evaluate_grain(m + 1u, evaluate_vertex_normal(evaluate_to_viewer()),
                                 r.LOBES_GRAIN.xyz);
#endif
    lobes.translucent = r.LOBES_TRANSLUCENT;
    lobes.translucent.rgb *= evaluate_texel(m + 1u, SLOT_DIFFUSE_TRANSMISSION_COLOR).rgb;
    lobes.translucent.w *= evaluate_texel(m + 1u, SLOT_DIFFUSE_TRANSMISSION).a;
    lobes.film.x = film.x * evaluate_texel(m + 1u, SLOT_IRIDESCENCE).r;
    lobes.film.y = mix(film.z, film.w, evaluate_texel(m + 1u, SLOT_IRIDESCENCE_THICKNESS).g);
#endif
    return lobes;
}
#endif

surface evaluate_surface()
{
    uint m = v_ids.x;
    material_record r = materials[m];
    surface s;
    vec3 px = dFdx(v_position), py = dFdy(v_position);
    vec3 cross_product = cross(px, py);
    float area = dot(cross_product, cross_product);
    vec3 to_viewer = evaluate_to_viewer();
    vec3 n = evaluate_vertex_normal(to_viewer);
    s.is_front = gl_FrontFacing;
    s.geo_normal = area > 0.0 ? cross_product * inversesqrt(area) : n;
    if (dot(s.geo_normal, to_viewer) < 0.0)
        s.geo_normal = -s.geo_normal;
    s.normal = n;
#ifdef HAS_NORMAL_MAP
    if ((TEXTURES & 1 << SLOT_NORMAL) != 0)
        s.normal = evaluate_normal_map(m, n, SLOT_NORMAL,
                                       r.metallic_roughness_normal_occlusion.z);
#endif
    vec4 base = r.base_color * evaluate_texel(m, SLOT_BASE_COLOR);
#ifdef HAS_COLOR
    base *= v_color;
#endif
    s.base = clamp(base.rgb, 0.0, 1.0);
    s.alpha = clamp(base.a, 0.0, 1.0);
    vec4 mr = evaluate_texel(m, SLOT_METALLIC_ROUGHNESS);
    vec4 factors = r.metallic_roughness_normal_occlusion;
    s.metallic = clamp(factors.x * mr.b, 0.0, 1.0);
    s.roughness = clamp(factors.y * mr.g, 0.0, 1.0);
    s.occlusion = clamp(1.0 + factors.w * (evaluate_texel(m, SLOT_OCCLUSION).r - 1.0), 0.0, 1.0);
    s.emissive = r.emissive_alpha_cutoff.rgb * evaluate_texel(m, SLOT_EMISSIVE).rgb;
    s.material = m;
    s.node = v_ids.y;
    return s;
}
