/* SPDX-License-Identifier: MIT */
/* f64 vectors and column-major 4x4 matrices. cglm is f32 only, and world space needs f64 (a
 * millimetre at 1e7 m). */
#ifndef VITRAIL_RENDERER_BASE_MATRIX_H
#define VITRAIL_RENDERER_BASE_MATRIX_H

#include <math.h>
#include <stdbool.h>
#include <string.h>

static inline double vec3_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void vec3_sub(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

static inline double vec3_length(const double a[3])
{
    return sqrt(vec3_dot(a, a));
}

/* out may alias neither input. */
static inline void vec3_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* False and unchanged when the length is zero or not finite. */
static inline bool vec3_normalize(double a[3])
{
    double length = vec3_length(a);
    if (!(length > 0) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++)
        a[i] /= length;
    return true;
}

static inline void mat4_identity(double m[16])
{
    memset(m, 0, 16 * sizeof *m);
    m[0] = m[5] = m[10] = m[15] = 1;
}

/* glTF 2.0 specification 3.5.3: T * R * S, R from the unit quaternion (x, y, z, w). */
static inline void mat4_compose(const double t[3], const double q[4], const double s[3],
                                double m[16])
{
    double x = q[0], y = q[1], z = q[2], w = q[3];
    double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w),     2 * (x * z - y * w),
                   2 * (x * y - z * w),     1 - 2 * (x * x + z * z), 2 * (y * z + x * w),
                   2 * (x * z + y * w),     2 * (y * z - x * w),     1 - 2 * (x * x + y * y)};
    mat4_identity(m);
    for (int column = 0; column < 3; column++) {
        for (int row = 0; row < 3; row++)
            m[column * 4 + row] = r[column * 3 + row] * s[column];
        m[12 + column] = t[column];
    }
}

/* out = a * b; out may alias either. */
static inline void mat4_mul(const double a[16], const double b[16], double out[16])
{
    double r[16];
    for (int col = 0; col < 4; col++)
        for (int row = 0; row < 4; row++)
            r[col * 4 + row] = a[row] * b[col * 4] + a[4 + row] * b[col * 4 + 1] +
                               a[8 + row] * b[col * 4 + 2] + a[12 + row] * b[col * 4 + 3];
    memcpy(out, r, sizeof r);
}

static inline void mat4_transform_point(const double m[16], const double p[3], double out[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i];
    memcpy(out, r, sizeof r);
}

static inline void mat4_transform_direction(const double m[16], const double d[3], double out[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = m[i] * d[0] + m[4 + i] * d[1] + m[8 + i] * d[2];
    memcpy(out, r, sizeof r);
}

/* Determinant of the upper 3x3. */
static inline double mat4_determinant3(const double m[16])
{
    return m[0] * (m[5] * m[10] - m[9] * m[6]) - m[4] * (m[1] * m[10] - m[9] * m[2]) +
           m[8] * (m[1] * m[6] - m[5] * m[2]);
}

#endif
