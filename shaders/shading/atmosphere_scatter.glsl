// SPDX-License-Identifier: MIT
// The light that the haze on a stretch of a ray scatters towards the eye, through the haze before
// it: of a lamp at one point, through its shadow.
// Needs: those of lighting.glsl, window/view_ray.glsl, shading/atmosphere.glsl and
// atmosphere_slices.glsl, lights/light_arriving.glsl; where HAS_SHADOWS shadows/shadow_query.glsl;
// IS_ORTHOGRAPHIC; u_atmosphere_offset; HAS_WAYS: rays of pixels are looked along, too (is_way).
// Provides: stretch, stretch_at and stretch_of, light_offset, scattered_at, to_eye, lamp_sight,
// sight_of, place_lamp, light_lookups.
const float PI = 3.14159265358979;
const float NEAREST = 1e-6; // [m] from a lamp to the ray

// Part of a ray, such as that in a slice: metres from where it begins.
struct stretch {
    vec3 origin, way; // view space; unit
    float eye_depth;  // optical, from where the ray begins to the origin
    float per_m;      // metres on the ray per metre of view depth
    float offset;     // of the column's point in a slice, (0, 1)
    float turn;       // by which the columns exchange their quarters, any number
};

// Of the ray at a place of the window, from a view depth on.
stretch stretch_at(vec2 at, float near)
{
    stretch s;
    s.origin = view_position(at, near);
    s.way = view_position(at, near + 1.0) - s.origin;
    s.per_m = length(s.way);
    s.way /= s.per_m;
    s.eye_depth = atmosphere_depth(view_position(at, 0.0), s.origin);
    return s;
}

// Of a column of the image, from where that slice begins on.
stretch stretch_of(ivec2 column, uint slice, vec2 at, float near)
{
    stretch s = stretch_at(at, near);
    // the four columns around a corner have the four quarters of a slice
    uvec2 parity = uvec2(column) & 1u;
    float quarter = 0.5 * float(parity.x) + 0.25 * float(parity.x ^ parity.y);
    s.offset = quarter + 0.25 * u_atmosphere_offset;
    s.turn = float(slice) * 0.6180339887;
    return s;
}

// Where a light's point lies in a slice, as a share.
float light_offset(stretch s, uint index)
{
    float turn = floor(4.0 * fract(s.turn + float(index) * 0.7548776662));
    return fract(s.offset + 0.25 * turn);
}

uint light_lookups = 0u;

// Henyey and Greenstein 1941. cosine: between the light's way on and that to the eye.
float phase(float cosine)
{
    float g = u_atmosphere.w, d = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}

// What a light scatters from one point, by the share of the haze there that counts.
vec3 scattered_at(light_record r, vec3 p, vec3 way, float share)
{
    vec3 l;
    vec3 arriving = light_arriving(r, p, l) * share;
    if (max(arriving.r, max(arriving.g, arriving.b)) <= 0.0)
        return vec3(0.0);
    arriving *= phase(dot(l, way)); // -l goes on, -way goes to the eye
#ifdef HAS_SHADOWS
    if (r.shadow != NO_SHADOW) {
        arriving *= shadow_transmittance(r.shadow, p, vec3(0.0), vec2(0.0), NO_OBJECT);
        light_lookups++;
    }
#endif
#ifdef HAS_GRIDS
    if (max(arriving.r, max(arriving.g, arriving.b)) > 0.0)
        arriving *= light_through_grids(r, p);
#endif
    return arriving;
}

float to_eye(stretch s, float t)
{
    return s.eye_depth + atmosphere_depth(s.origin, s.origin + t * s.way);
}

// How wide the view is at a lamp, over its width at depth 1.
float column_scale(vec3 position)
{
#ifdef IS_ORTHOGRAPHIC
    return 1.0;
#else
    return abs(position.z);
#endif
}

// Columns at and beside a spot have what its cone passes in the mean all around it, since the ray
// in their middle meets the thin end of the cone or misses it. Up to the first number of columns
// from the spot this counts alone, from the second on the ray. Chosen: the sum over columns,
// wherever in one the spot is, is then nearest to the integral.
const float CONE_NEAR = 0.4, CONE_FAR = 1.2;
const int CONE_SIDES = 16; // of the half circle

// Around a spot, at a point `at` metres behind what is nearest to it and `apart` metres beside it.
float light_cone_around(light_record r, vec3 way, float at, float apart)
{
    float along = dot(r.direction_cone.xyz, way), scale = inversesqrt(at * at + apart * apart);
    float across = apart * scale * sqrt(max(1.0 - along * along, 0.0)), sum = 0.0;
    for (int i = 0; i < CONE_SIDES; i++)
        sum += light_cone(r, along * at * scale +
                                 across * cos(PI * (float(i) + 0.5) / float(CONE_SIDES)));
    return sum / float(CONE_SIDES);
}

// The spot without its cone, what that passes in the column's share, so much of it by `around`, and
// a point in its light.
void open_cone(inout light_record r, vec3 way, float at, float apart, float around, float near,
               inout vec3 p, inout float share)
{
    float own = light_cone(r, dot(r.direction_cone.xyz, normalize(p - r.position_range.xyz)));
    share *= mix(own, around, near);
    if (own == 0.0) { // where the shadow map has nothing
        vec3 aside = r.direction_cone.xyz - dot(r.direction_cone.xyz, way) * way;
        aside *= apart * inversesqrt(max(dot(aside, aside), 1e-37));
        p = r.position_range.xyz + at * way + aside;
    }
    r.direction_cone.w = 0.0;
    r.spot_offset = 1.0;
}

// No point of a ray is in the cone whose angle from what is nearest to the spot differs from that
// of the cone's axis by more than the cone is wide. first, last: of the ray, from what is nearest
// on.
void cut_to_cone(light_record r, vec3 way, float apart, inout float first, inout float last)
{
    float along = dot(r.direction_cone.xyz, way), across = sqrt(max(1.0 - along * along, 0.0));
    float cosine = clamp(-r.spot_offset / r.direction_cone.w, 0.0, 1.0);
    float sine = sqrt(1.0 - cosine * cosine);
    float low = across * cosine + along * sine, high = across * cosine - along * sine;
    if (low > 0.0)
        first = max(first, apart * (along * cosine - across * sine) / low);
    if (high > 0.0)
        last = min(last, apart * (along * cosine + across * sine) / high);
}

// A lamp as a ray passes it.
struct lamp_sight {
    float nearest;     // metres from the stretch's beginning to where the ray is nearest to it
    vec3 aside;        // from the lamp to there
    float own, apart;  // its length, and what counts as such over the width of what is looked at
    float width;       // of a column there, or of a pixel [m]
    float first, last; // what is in its cone, from what is nearest on
};

#ifdef HAS_WAYS
bool is_way = false; // the ray at hand is that of a pixel
const float PIXEL_NEAR = 4.0; // pixels from a lamp: what it sends differs much within one

// x asinh(y / |x|), where r is the length of both.
float mean_part(float x, float y, float r)
{
    return x * sign(y) * log((abs(y) + r) / max(abs(x), 1e-6));
}

// The integral of 1 / distance over a rectangle from the origin to a corner.
float mean_corner(vec2 corner)
{
    float r = length(corner);
    return mean_part(corner.x, corner.y, r) + mean_part(corner.y, corner.x, r);
}

// 1 over the mean of 1 / distance over a pixel: in closed form over its square beside the lamp,
// which rays aslant see squeezed on one side.
float lamp_apart(light_record r, stretch s, lamp_sight e)
{
    float to_lamp = (r.position_range.z - s.origin.z) / s.way.z;
    vec2 at = (s.origin.xy + to_lamp * s.way.xy - r.position_range.xy) / e.width;
    float px = length(at), mean = 1.0 / max(px, 1e-6) + 1.0 / (24.0 * px * px * px);
    if (px < PIXEL_NEAR)
        mean = mean_corner(at + 0.5) + mean_corner(at - 0.5) - mean_corner(at + vec2(0.5, -0.5)) -
               mean_corner(at + vec2(-0.5, 0.5));
    float squeezed = mix(sqrt(abs(s.way.z)), e.own / (max(px, 1e-3) * e.width), min(px, 1.0));
    return max(squeezed * e.width / mean, NEAREST);
}

const int PIXEL_PLACES = 4; // a side

// What the cone of a spot passes at one angle, in the mean over the pixel: of 1 / distance.
float light_cone_in_pixel(light_record r, lamp_sight e, vec3 way, float at)
{
    vec3 x = normalize(vec3(1.0, 0.0, 0.0) - way.x * way), y = cross(way, x);
    float scale = inversesqrt(at * at + e.apart * e.apart), sum = 0.0, weights = 0.0;
    for (int i = 0; i < PIXEL_PLACES * PIXEL_PLACES; i++) {
        vec2 place = (vec2(i % PIXEL_PLACES, i / PIXEL_PLACES) + 0.5) / float(PIXEL_PLACES) - 0.5;
        vec3 aside = e.aside + e.width * (place.x * x + place.y * y);
        float weight = 1.0 / max(length(aside), 0.25 * e.width / float(PIXEL_PLACES));
        weights += weight;
        sum += weight * light_cone(r, dot(r.direction_cone.xyz,
                                          scale * (at * way + e.apart * weight * aside)));
    }
    return sum / weights;
}

#define LIGHT_CONE_IN_PIXEL(r, e, way, at) light_cone_in_pixel(r, e, way, at)

// The side on which the ray passes the lamp: any where it meets it.
vec3 lamp_beside(lamp_sight e, vec3 way)
{
    if (e.own > 1e-4 * e.apart)
        return e.aside / e.own;
    return normalize(cross(way, abs(way.y) < 0.7 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
}
#else
#define LIGHT_CONE_IN_PIXEL(r, e, way, at) 0.0
#endif

lamp_sight sight_of(light_record r, stretch s, float begin, float end)
{
    lamp_sight e;
    vec3 to_light = r.position_range.xyz - s.origin;
    e.nearest = dot(to_light, s.way);
    e.aside = e.nearest * s.way - to_light;
    e.own = length(e.aside);
#ifdef HAS_WAYS
    e.width = (is_way ? 1.0 : u_atmosphere_side_px) * u_window.z *
              column_scale(r.position_range.xyz);
    e.apart = is_way ? lamp_apart(r, s, e) : max(e.own, max(0.25 * e.width, NEAREST));
#else
    e.width = u_atmosphere_side_px * u_window.z * column_scale(r.position_range.xyz);
    // around a lamp itself 1 / distance has the mean over the column: 4 / width
    e.apart = max(e.own, max(0.25 * e.width, NEAREST));
#endif
    e.first = begin - e.nearest;
    e.last = end - e.nearest;
    if (light_is(r, LIGHT_SPOT))
        cut_to_cone(r, s.way, e.apart, e.first, e.last);
    return e;
}

// A point of a lamp, and the share of the haze there that counts, 0 where there is none: drawn by
// its distance. Kulla and Fajardo 2012, "Importance Sampling Techniques for Path Tracing in
// Participating Media", section 4.1, by sums of angles, so that those of far points keep their
// digits.
vec3 place_lamp(inout light_record r, stretch s, float begin, float end, float offset,
                out float share)
{
    lamp_sight e = sight_of(r, s, begin, end);
    float first = e.first, last = e.last, apart = e.apart;
    share = 0.0;
    if (!(last > first))
        return s.origin;
    float angle = atan(apart * (last - first), apart * apart + first * last);
    float c = cos(offset * angle), sine = sin(offset * angle);
    float at = apart * (first * c + apart * sine) / (apart * c - first * sine);
    float t = e.nearest + clamp(at, first, last);
    vec3 p = s.origin + t * s.way;
    share = atmosphere_extinction(p) * exp(-to_eye(s, t)) * angle / apart;
    float near = clamp((CONE_FAR * e.width - e.own) / ((CONE_FAR - CONE_NEAR) * e.width), 0.0, 1.0);
    bool is_in_column = true;
#ifdef HAS_WAYS
    is_in_column = !is_way;
    if (is_way) { // by the angle, also where the ray meets the lamp
        p += (apart - e.own) * lamp_beside(e, s.way);
        near = e.own < PIXEL_NEAR * e.width ? 1.0 : 0.0;
    }
#endif
    if (light_is(r, LIGHT_SPOT) && near > 0.0) {
        float around = is_in_column ? light_cone_around(r, s.way, t - e.nearest, apart)
                                    : LIGHT_CONE_IN_PIXEL(r, e, s.way, t - e.nearest);
        open_cone(r, s.way, t - e.nearest, apart, around, near, p, share);
    }
    vec3 d = p - r.position_range.xyz;
    share *= dot(d, d);
    return p;
}
