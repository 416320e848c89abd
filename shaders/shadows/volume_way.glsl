// SPDX-License-Identifier: MIT
// A way from the eye to a point, and where it crosses the plane of a face. Along a way two
// coordinates are left of each point of space. Needs: volume.glsl before it.
struct corner {
    vec2 at;   // beside the way
    float h;   // how far `at` moves as the way moves
    float z, w;
};

float height_of(vec4 x)
{
#ifdef IS_ORTHOGRAPHIC
    return x.w;
#else
    return x.z;
#endif
}

corner corner_of(vec4 x, vec2 slope)
{
    corner c;
    c.h = height_of(x);
    precise vec2 shift = c.h * slope;
    precise vec2 at = x.xy - shift;
    c.at = at;
    c.z = x.z;
    c.w = x.w;
    return c;
}

float cross_of(corner a, corner b)
{
    return a.at.x * b.at.y - a.at.y * b.at.x;
}

vec2 way_slope(vec3 start)
{
#ifdef IS_ORTHOGRAPHIC
    return start.xy;
#else
    return start.xy / start.z;
#endif
}

// Of a face on whose side the eye is: which way round its corners lie about a way that crosses it.
int way_sign(int side)
{
#ifdef IS_ORTHOGRAPHIC
    return side * int(u_eye);
#else
    return side;
#endif
}

// Whether the crossing is before the way's end. share: how much of each corner it is, the first of
// three cross products that of the last two corners; homogeneous, as the way's two ends make it up.
bool is_before_end(vec3 share, corner p, corner q, corner r, float end)
{
    float z = dot(share, vec3(p.z, q.z, r.z)), w = dot(share, vec3(p.w, q.w, r.w));
#ifdef IS_ORTHOGRAPHIC
    return u_eye * (z - w * end) > 0.0;
#else
    return z - w * end > 0.0;
#endif
}
