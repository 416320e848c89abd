// SPDX-License-Identifier: MIT
// How much of the cosine lobe about a normal the area of a light fills: Lambert's form factor over
// the part of the area above the horizon, and the same after a linear transform of all directions
// (Heitz, Dupuy, Hill, Neubelt 2016, "Real-Time Polygonal-Light Shading with Linearly Transformed
// Cosines", section 3). Forms are vectors: their length is the solid angle's mean direction over
// pi, and z, along the normal, is the form factor (Arvo 1994, "The Irradiance Jacobian for
// Partially Occluded Polyhedral Sources", section 2).
// Provides, where HAS_AREA_FORM: area_source_of, area_source_to, area_diffuse_form, area_lobe_form.
#ifdef HAS_AREA_FORM
layout(binding = UNIT_LIGHT_AREAS) uniform samplerBuffer u_light_areas; // struct area_record

struct area_source { // from the point that is lit
    vec3 centre, u, v; // [m]; u and v: half sides, or radii, across each other
    bool is_disk;
};

const float AREA_TAU = 6.28318530718;
// An inscribed polygon stands for a disk in lobes of GGX, as large as the disk.
const int AREA_DISK_SIDES = 16;
const vec2 AREA_DISK_TURN = vec2(0.92387953251, 0.38268343236); // cosine, sine of a side
const float AREA_DISK_RADIUS = 1.01297097; // sqrt(turn / sine of turn)

// offset: from the point to the light's centre.
area_source area_source_of(uint light, vec3 offset, out float per_area)
{
    vec4 u = texelFetch(u_light_areas, int(2u * light));
    vec4 v = texelFetch(u_light_areas, int(2u * light + 1u));
    per_area = v.w;
    return area_source(offset, u.xyz, v.xyz, u.w > 0.0);
}

// Seen in another frame, whose axes are the rows.
area_source area_source_to(mat3 frame, area_source s)
{
    return area_source(frame * s.centre, frame * s.u, frame * s.v, s.is_disk);
}

// Angle over sine of the angle between unit vectors; half_cosine: of half the angle. tan(angle/4)
// is at most 1: Abramowitz and Stegun 1964, "Handbook of Mathematical Functions", 4.4.49.
float area_angle_over_sine(float half_cosine)
{
    float q = (1.0 - half_cosine) / (1.0 + half_cosine);
    float series = 1.0 + q * (-0.3333314528 + q * (0.1999355085 + q * (-0.1420889944 +
                   q * (0.1065626393 + q * (-0.0752896400 + q * (0.0429096138 +
                   q * (-0.0161657367 + q * 0.0028662257)))))));
    return series * (1.0 + q) * (1.0 + q) / max(1.0 - q, 1e-7);
}

// The angle of a point of the upper half plane, [0, pi].
float area_angle(float x, float y)
{
    float length_ = length(vec2(x, y));
    float half_cosine = sqrt(max(0.5 + 0.5 * x / max(length_, 1e-37), 0.0));
    return length_ > 0.0 ? area_angle_over_sine(half_cosine) * y / length_ : 0.0;
}

vec3 area_unit(vec3 v)
{
    return v * inversesqrt(max(dot(v, v), 1e-37));
}

// Of the great circle between unit vectors. The sum of two of them keeps the cosine of half their
// angle exact where they are nearly opposite.
vec3 area_edge(vec3 a, vec3 b)
{
    return cross(a, b) * area_angle_over_sine(min(0.5 * length(a + b), 1.0));
}

// Where a convex outline leaves the upper side of z = 0, and where it comes back.
struct area_cut {
    vec3 leaves, comes;
};

// Keeps what of the edge from a to b is above; false: nothing.
bool area_clip(inout vec3 a, inout vec3 b, inout area_cut cut)
{
    if (a.z <= 0.0 && b.z <= 0.0)
        return false;
    vec3 on = (a * b.z - b * a.z) / (b.z != a.z ? b.z - a.z : 1.0);
    on.z = 0.0;
    if (b.z <= 0.0)
        b = cut.leaves = on;
    else if (a.z <= 0.0)
        a = cut.comes = on;
    return true;
}

// Few points for a light that is seen so small that edges would cancel: Gauss's of the rectangle,
// and those of degree 3 of the disk (Stroud 1971, "Approximate Calculation of Multiple Integrals",
// S2: 3-1). s is above the horizon where its z is; its lobe where that of lobe * s is.
vec3 area_points(area_source s, mat3 lobe, area_source t)
{
    float at = s.is_disk ? 0.5 : 0.57735026919;
    vec3 across = cross(t.u, t.v) * (s.is_disk ? 0.25 : 1.0 / 3.14159265359);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        vec2 place = vec2((i & 1) != 0 ? at : -at, (i & 2) != 0 ? at : -at);
        vec3 p = t.centre + place.x * t.u + place.y * t.v;
        float z = s.centre.z + place.x * s.u.z + place.y * s.v.z;
        float d2 = max(dot(p, p), 1e-30);
        sum += z > 0.0 && p.z > 0.0 ? p * (abs(dot(across, p)) / (d2 * d2)) : vec3(0.0);
    }
    return sum;
}

bool area_is_small(area_source s)
{
    return dot(s.u, s.u) + dot(s.v, s.v) < 1.6e-3 * dot(s.centre, s.centre);
}

// The edges of the polygon, clipped by z = 0 before the lobe's transform and after it.
vec3 area_outline(area_source s, mat3 lobe)
{
    int sides = s.is_disk ? AREA_DISK_SIDES : 4;
    vec2 turn = s.is_disk ? AREA_DISK_TURN : vec2(0.0, 1.0);
    vec2 place = s.is_disk ? vec2(AREA_DISK_RADIUS, 0.0) : vec2(1.0);
    area_cut horizon = area_cut(vec3(0.0), vec3(0.0)), rim = horizon;
    vec3 sum = vec3(0.0), last = area_unit(s.centre + place.x * s.u + place.y * s.v);
    for (int i = 0; i <= sides; i++) {
        vec3 a = last, b = horizon.comes; // at the end the side along the horizon
        bool is_kept = true;
        if (i < sides) {
            place = vec2(place.x * turn.x - place.y * turn.y, place.x * turn.y + place.y * turn.x);
            b = last = area_unit(s.centre + place.x * s.u + place.y * s.v);
            is_kept = area_clip(a, b, horizon);
        } else {
            a = horizon.leaves;
        }
        a = area_unit(lobe * a);
        b = area_unit(lobe * b);
        if (is_kept && area_clip(a, b, rim))
            sum += area_edge(area_unit(a), area_unit(b));
    }
    return (sum + area_edge(area_unit(rim.leaves), area_unit(rim.comes))) / AREA_TAU;
}

// What the area fills of a lobe; to: its transform to the cosine's.
vec3 area_lobe_form(area_source s, mat3 to)
{
    area_source t = area_source_to(to, s);
    vec3 form = area_is_small(t) ? area_points(s, to, t) : area_outline(s, to);
    return form.z < 0.0 ? -form : form;
}

// The integral along the rim of a disk: dr of it is linear in cosine and sine, and so is its
// squared distance, d.x + d.y cos + d.z sin. k: what cross(r, dr) is, of 1, cos and sin. s is d.y^2
// + d.z^2, root the root of d.x^2 - s. Whole.
vec3 area_whole_rim(mat3 k, vec3 d, float root)
{
    return (k[0] - (k[1] * d.y + k[2] * d.z) / (d.x + root)) / root;
}

// From -angle to angle, over tau.
vec3 area_part_of_rim(mat3 k, vec3 d, float root, float angle, vec2 turn)
{
    float s = dot(d.yz, d.yz), c = turn.x, sine = turn.y;
    if (s < 1e-5 * d.x * d.x) { // a series in the distance's changes, of which little is left
        vec2 squares = angle + vec2(sine * c, -sine * c);
        vec2 by = d.yz / d.x;
        vec3 sum = k[0] * (2.0 * angle - 2.0 * by.x * sine + dot(by * by, squares)) +
                   k[1] * (2.0 * sine - by.x * squares.x) - k[2] * (by.y * squares.y);
        return sum / (d.x * AREA_TAU);
    }
    float inverse = 2.0 / root * area_angle(d.x * c + d.y, root * sine); // of 1 / distance squared
    float ratio = (d.x + d.y * c + d.z * sine) / max(d.x + d.y * c - d.z * sine, 1e-30);
    vec3 along = (k[1] * d.y + k[2] * d.z) / s, across = (k[1] * d.z - k[2] * d.y) / s;
    vec3 sum = k[0] * inverse + along * (2.0 * angle - d.x * inverse) +
               across * log(max(ratio, 1e-30));
    return sum / AREA_TAU;
}

// Lambert's form factor of a disk: the contour integral of Baum, Rushmeier and Winget 1989,
// "Improving Radiosity Solutions Through the Use of Analytically Determined Form-Factors", eq. 9,
// taken along the arc above the horizon.
vec3 area_disk_form(area_source s)
{
    float size = 1.0 / (length(s.centre) + length(s.u)), rise = length(vec2(s.u.z, s.v.z));
    vec2 up = rise > 0.0 ? vec2(s.u.z, s.v.z) / rise : vec2(1.0, 0.0);
    vec3 c = s.centre * size;
    vec3 u = (s.u * up.x + s.v * up.y) * size, v = (s.v * up.x - s.u * up.y) * size;
    rise *= size;
    if (c.z + rise <= 0.0)
        return vec3(0.0);
    float radius = length(u), radius2 = radius * radius;
    mat3 k = mat3(cross(u, v), cross(c, v), -cross(c, u));
    vec3 d = vec3(dot(c, c) + radius2, 2.0 * dot(c, u), 2.0 * dot(c, v));
    float away = length(d.yz) / (2.0 * radius) - radius, height = dot(k[0], c) / radius2;
    float far = d.x + length(d.yz), near = away * away + height * height;
    float root = sqrt(max(near * far, 1e-14 * radius2));
    if (c.z >= rise)
        return area_whole_rim(k, d, root);
    vec2 turn = vec2(-c.z / rise, 0.0);
    turn.y = sqrt(max(1.0 - turn.x * turn.x, 0.0));
    vec3 from = c + u * turn.x + v * turn.y, to = c + u * turn.x - v * turn.y;
    from.z = to.z = 0.0;
    return area_part_of_rim(k, d, root, area_angle(turn.x, turn.y), turn) +
           area_edge(area_unit(from), area_unit(to)) / AREA_TAU;
}

vec3 area_diffuse_form(area_source s)
{
    if (!s.is_disk)
        return area_lobe_form(s, mat3(1.0));
    vec3 form = area_disk_form(s);
    return form.z < 0.0 ? -form : form;
}
#endif
