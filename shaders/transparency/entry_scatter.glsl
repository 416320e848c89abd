// SPDX-License-Identifier: MIT
// Writes a transparent fragment's surface as an entry, for lighting and compositing.
// Needs: those of evaluate.glsl, HAS_COVERAGE (multisampled target), with COVERAGE_BY_DEPTH where
// the device has no post-depth coverage;
// IS_MEDIUM, and with it IS_HIDDEN (drawn behind the opaque depth) and CUT_PLANES (count);
// TAKE_ENTRY(pixel, depth, tie), the place of the entry, or NO_ENTRY: the fragment is not kept;
// KEY_DEPTH and KEY_TIE, what the lists are sorted by, if not by depth.
#include "draw/evaluate.glsl"
#include "material/camera_filter.glsl"
#include "transparency/tie_key.glsl"
layout(early_fragment_tests) in;
#ifdef COVERAGE_BY_DEPTH
#include "transparency/sample_coverage.glsl"
#elif defined HAS_COVERAGE
layout(post_depth_coverage) in;
#endif
layout(std430, binding = BIND_ENTRY_KEYS) writeonly buffer key_buffer { uvec4 keys[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_0) writeonly buffer s0_buffer {
    uvec4 surfaces_0[];
};
layout(std430, binding = BIND_ENTRY_SURFACE_1) writeonly buffer s1_buffer {
    uvec4 surfaces_1[];
};
layout(std430, binding = BIND_ENTRY_SURFACE_2) writeonly buffer s2_buffer {
    uvec4 surfaces_2[];
};
layout(std430, binding = BIND_ENTRY_COLORS) writeonly buffer color_buffer { vec4 colors[]; };
#ifdef HAS_LOBES
layout(std430, binding = BIND_ENTRY_LOBES) writeonly buffer lobes_buffer {
    uvec4 lobes_words[];
};
#endif
#ifdef HAS_MORE_LOBES
layout(std430, binding = BIND_ENTRY_MORE_LOBES) writeonly buffer more_lobes_buffer {
    uvec4 more_lobes_words[];
};
#endif
uniform uint u_width_px;
#ifdef CUT_PLANES
uniform vec4 u_clip_planes[CUT_PLANES]; // for v_position
#endif

#ifdef IS_MEDIUM
// All surfaces of a medium are listed, seen or not.
bool is_hidden()
{
#ifdef IS_HIDDEN
    return true;
#else
    bool is_cut = false;
#ifdef CUT_PLANES
    for (int k = 0; k < CUT_PLANES; k++)
        is_cut = is_cut || dot(u_clip_planes[k].xyz, v_position) + u_clip_planes[k].w < 0.0;
#endif
    return is_cut;
#endif
}
#endif

// The back face of a medium whose material is single-sided: crossed, but not drawn.
bool is_left_unseen(surface s)
{
#ifdef IS_MEDIUM
    return !s.is_front && (materials[s.material].flags & MATERIAL_DOUBLE_SIDED) == 0u;
#else
    return false;
#endif
}

vec3 direction_to_camera()
{
#ifdef IS_ORTHOGRAPHIC
    return vec3(0.0, 0.0, 1.0);
#else
    return normalize(-v_position);
#endif
}

#ifdef HAS_LOBES
// The share of light from behind that interface, fibres and coat do not let through.
float reflected_by_lobes(surface_lobes lobes, material_record r, vec3 normal, vec3 view)
{
    float n_dot_v = clamp(abs(dot(normal, view)), 1e-4, 1.0);
    vec4 specular = MATERIAL_IS(r.flags, MATERIAL_SPECULAR) ? lobes.specular : vec4(1.0);
    float f0 = r.transmission_f0_thickness.y;
    vec3 reflected = specular_fresnel(f0, specular, n_dot_v);
#ifdef HAS_MORE_LOBES
    if (MATERIAL_IS(r.flags, MATERIAL_FILM)) {
        float film_ior = materials[r.lobes].LOBES_FILM.y;
        vec3 tinted = min(f0 * specular.rgb, vec3(1.0));
        vec3 film = film_fresnel(tinted, film_ior, lobes.film.y, n_dot_v);
        reflected = mix(reflected, specular.w * film, lobes.film.x);
    }
#endif
    float passed = 1.0 - largest_of(reflected);
    if (MATERIAL_IS(r.flags, MATERIAL_SHEEN))
        passed *= sheen_base_share(lobes.sheen, clamp(dot(normal, view), 1e-4, 1.0),
                                   lobes.sheen_roughness);
    if (MATERIAL_IS(r.flags, MATERIAL_CLEARCOAT))
        passed *= 1.0 - coat_share(lobes.coat, clamp(dot(lobes.coat_normal, view), 1e-4, 1.0));
    return 1.0 - passed;
}
#endif

// Its word is written here, where the surface still has all its bits.
// reflected: by interface and lobes, of what comes from behind.
vec3 filter_to_camera(surface s, float transmission, float thickness_m, vec3 view, float reflected)
{
#ifdef IS_MEDIUM
    thickness_m = 0.0; // the way through it attenuates instead: shade_pixels.comp.glsl
#endif
    return camera_filter(s, transmission, thickness_m, abs(dot(s.normal, view)),
                         is_left_unseen(s) ? 0.0 : reflected);
}

void main()
{
    surface s = evaluate_surface();
#ifdef HAS_LOBES
    surface_lobes lobes = evaluate_lobes();
#endif
    float depth = gl_FragCoord.z;
#if defined IS_MEDIUM || defined COVERAGE_BY_DEPTH
    vec2 slope = vec2(dFdx(depth), dFdy(depth));
#endif
    material_record r = materials[s.material];
    float transmission =
        r.transmission_f0_thickness.x * evaluate_texel(s.material, SLOT_TRANSMISSION).r;
    float thickness_m =
        r.transmission_f0_thickness.z * evaluate_texel(s.material, SLOT_THICKNESS).g;
#ifdef IS_MASKED
    bool is_hole = s.alpha < r.emissive_alpha_cutoff.w;
#endif
    if (!MATERIAL_IS(r.flags, MATERIAL_BLEND))
        s.alpha = 1.0;
#ifdef IS_MASKED
    if (is_hole)
        s.alpha = 0.0; // counted already, so it stays in the list as nothing
#endif
    // No helper guard: there is no loop, and llvmpipe calls a partly covered fragment whose centre
    // is outside a helper.
    uint pixel = uint(gl_FragCoord.y) * u_width_px + uint(gl_FragCoord.x);
    // outside [0, 1] where the pixel's middle is beside the triangle, or depths are not clipped
    uint depth_key = floatBitsToUint(clamp(depth, 0.0, 1.0)), tie = tie_key();
#ifdef KEY_DEPTH
    depth_key = KEY_DEPTH;
    tie = KEY_TIE;
#endif
    uint entry = TAKE_ENTRY(pixel, depth_key, tie);
    if (entry == NO_ENTRY)
        return;
#ifdef HAS_COVERAGE
    uint coverage = uint(gl_SampleMaskIn[0]);
#ifdef COVERAGE_BY_DEPTH
    uint in_front = coverage_in_front(depth, slope);
#ifdef IS_HIDDEN
    coverage &= ~in_front;
#else
    coverage &= in_front;
#endif
    if (coverage == 0u)
        s.alpha = 0.0; // not to be lit
#endif
#else
    uint coverage = 1u;
#endif
    vec3 view = direction_to_camera();
    float reflected =
        dielectric_fresnel(r.transmission_f0_thickness.y, abs(dot(s.normal, view)));
#ifdef HAS_LOBES
    reflected = reflected_by_lobes(lobes, r, s.normal, view);
#endif
    vec3 filter_ = filter_to_camera(s, transmission, thickness_m, view, reflected);
#ifdef IS_MASKED
    if (is_hole)
        filter_ = filter_pack(vec3(1.0), vec3(0.0));
#endif
    uvec2 extra = uvec2(floatBitsToUint(transmission), floatBitsToUint(thickness_m));
#ifdef IS_MEDIUM
    extra = pack_factor_and_pair(transmission, slope); // no thickness: media have no use for it
    if (is_hidden()) {
        coverage |= ENTRY_HIDDEN;
        s.alpha = 0.0; // not to be lit
    }
#endif
    if (MATERIAL_IS(r.flags, MATERIAL_BENDS) && s.alpha > 0.0)
        coverage |= ENTRY_BENDS;
    keys[entry] = uvec4(depth_key, tie, entry, coverage);
    surfaces_0[entry] = surface_pack_0(s);
    surfaces_1[entry] = surface_pack_1(s);
#ifdef HAS_LOBES
    lobes_words[entry] = lobes_pack(lobes);
#endif
#ifdef HAS_MORE_LOBES
    more_lobes_words[entry] = more_lobes_pack(lobes);
#endif
    surfaces_2[entry] = uvec4(extra, pixel, floatBitsToUint(depth));
    colors[2u * entry + 1u] = vec4(filter_, is_left_unseen(s) ? 0.0 : s.alpha);
}
