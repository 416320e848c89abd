/* SPDX-License-Identifier: MIT */
/* Colour spaces, Hunt effect, HyAB distance and its compression, as FLIP defines them. */
#include "renderer/accuracy/flip_color.h"

#include <math.h>

/* Exponent, and the share of the range (p_t) that the share p_c of the distances is spread over:
 * Andersson 2020, section 4.1.2. */
#define Q_C 0.7f
#define P_C 0.4f
#define P_T 0.95f

/* XYZ relative to D65 white from linear Rec.709: primaries and white of IEC 61966-2-1 with
 * x = 0.3127, y = 0.3290, as exact fractions; each row is divided by its sum, so that white is 1.
 */
static const double relative_xyz_from_rgb[9] = {
    10135552. / 23359437, 8788810. / 23359437, 4435075. / 23359437,  /* X */
    2613072. / 12288897,  8788810. / 12288897, 887015. / 12288897,   /* Y */
    1425312. / 80288307,  8788810. / 80288307, 70074185. / 80288307, /* Z */
};

static void invert(const double m[9], float inverse[9])
{
    double c[9];
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) {
            int r1 = (column + 1) % 3, r2 = (column + 2) % 3;
            int c1 = (row + 1) % 3, c2 = (row + 2) % 3;
            c[3 * row + column] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
        }
    double determinant = m[0] * c[0] + m[1] * c[3] + m[2] * c[6];
    for (int i = 0; i < 9; i++)
        inverse[i] = (float)(c[i] / determinant);
}

static void relative_xyz(const float rgb[3], float xyz[3])
{
    for (int i = 0; i < 3; i++)
        xyz[i] = (float)relative_xyz_from_rgb[3 * i] * rgb[0] +
                 (float)relative_xyz_from_rgb[3 * i + 1] * rgb[1] +
                 (float)relative_xyz_from_rgb[3 * i + 2] * rgb[2];
}

void flip_opponent_from_linear(const float rgb[3], float opponent[3])
{
    float xyz[3];
    relative_xyz(rgb, xyz);
    opponent[0] = 116 * xyz[1] - 16;
    opponent[1] = 500 * (xyz[0] - xyz[1]);
    opponent[2] = 200 * (xyz[1] - xyz[2]);
}

static float lab_root(float t)
{
    const float delta = 6.f / 29;
    return t > delta * delta * delta ? cbrtf(t) : t / (3 * delta * delta) + 4.f / 29;
}

/* CIELab (CIE 15) with a* and b* scaled by the Hunt effect: colours of dim things look pale. */
static void hunt_lab(const float rgb[3], float lab[3])
{
    float xyz[3];
    relative_xyz(rgb, xyz);
    float x = lab_root(xyz[0]), y = lab_root(xyz[1]), z = lab_root(xyz[2]);
    lab[0] = 116 * y - 16;
    lab[1] = 0.01f * lab[0] * 500 * (x - y);
    lab[2] = 0.01f * lab[0] * 200 * (y - z);
}

/* Abasi, Amani Tehran, Fairchild 2020, "Distance metrics for very large color differences". */
static float hyab(const float a[3], const float b[3])
{
    float da = a[1] - b[1], db = a[2] - b[2];
    return fabsf(a[0] - b[0]) + sqrtf(da * da + db * db);
}

void flip_color_init(struct flip_color *color)
{
    float green[3], blue[3];
    invert(relative_xyz_from_rgb, color->rgb_from_xyz);
    hunt_lab((const float[3]){0, 1, 0}, green);
    hunt_lab((const float[3]){0, 0, 1}, blue);
    color->largest = powf(hyab(green, blue), Q_C);
}

/* Back to linear Rec.709, cut to what a screen can show. */
static void shown_from_opponent(const struct flip_color *color, const float opponent[3],
                                float rgb[3])
{
    float y = (opponent[0] + 16) / 116;
    float xyz[3] = {y + opponent[1] / 500, y, y - opponent[2] / 200};
    const float *m = color->rgb_from_xyz;
    for (int i = 0; i < 3; i++) {
        float value = m[3 * i] * xyz[0] + m[3 * i + 1] * xyz[1] + m[3 * i + 2] * xyz[2];
        rgb[i] = fminf(fmaxf(value, 0), 1);
    }
}

float flip_color_distance(const struct flip_color *color, const float a[3], const float b[3])
{
    float rgb[3], lab_a[3], lab_b[3];
    shown_from_opponent(color, a, rgb);
    hunt_lab(rgb, lab_a);
    shown_from_opponent(color, b, rgb);
    hunt_lab(rgb, lab_b);
    float distance = hyab(lab_a, lab_b);
    if (!(distance > 0))
        return 0;
    distance = powf(distance, Q_C);
    float knee = P_C * color->largest;
    if (distance < knee)
        return P_T / knee * distance;
    return fminf(P_T + (distance - knee) / (color->largest - knee) * (1 - P_T), 1);
}

float flip_luminance(const float rgb[3])
{
    return (float)relative_xyz_from_rgb[3] * rgb[0] + (float)relative_xyz_from_rgb[4] * rgb[1] +
           (float)relative_xyz_from_rgb[5] * rgb[2];
}

/* (a x^2 + b x) / (c x^2 + d x + e) */
static const double ACES_A = 0.36 * 2.51, ACES_B = 0.6 * 0.03;
static const double ACES_C = 0.36 * 2.43, ACES_D = 0.6 * 0.59, ACES_E = 0.14;

double flip_tone_curve(double x)
{
    double y = (x * (ACES_A * x + ACES_B)) / (x * (ACES_C * x + ACES_D) + ACES_E);
    return y < 1 ? y : 1;
}

double flip_tone_curve_knee(void)
{
    const double t = 0.85;
    double a = ACES_A - t * ACES_C, b = ACES_B - t * ACES_D, c = -t * ACES_E;
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a);
}
