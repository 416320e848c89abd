/* SPDX-License-Identifier: MIT */
/* The lobes that area lights are seen through are those that the fit finds, and what the fit says
 * of them. With --write FILE the program makes the table anew (about a minute of processor time),
 * which clang-format then sets. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/shading/area_lobes.h"
#include "tests/support/area_lobe_fit.h"

static void record_of(const struct area_lobe_fit *fit, float record[8])
{
    double root =
        sqrt(fit->view[2] * fit->view[2] * (1 - fit->alpha * fit->alpha) + fit->alpha * fit->alpha);
    const double values[8] = {fit->shape.along / fit->alpha,
                              fit->shape.across / (fit->alpha * root),
                              fit->shape.skew,
                              fit->shape.turn + acos(fit->view[2]),
                              fit->energy,
                              fit->fresnel_cosine,
                              fit->diffuse_cosine,
                              0};
    for (int i = 0; i < 8; i++)
        record[i] = (float)values[i];
}

static void write_head(FILE *file)
{
    fputs("/* SPDX-License-Identifier: MIT */\n"
          "/* Made by `build/bin/unit_area_lobes --write FILE`, not by hand: see area_lobes.h. */\n"
          "#include \"renderer/shading/area_lobes.h\"\n\n"
          "/* clang-format off */\n"
          "const float area_lobes[AREA_LOBE_SIDE * AREA_LOBE_SIDE * 8] = {\n",
          file);
}

/* Columns one after the other, since each cell starts from the one that is less rough. */
static int write_table(const char *path)
{
    static float table[AREA_LOBE_SIDE][AREA_LOBE_SIDE][8];
    for (int column = 0; column < AREA_LOBE_SIDE; column++) {
        struct area_lobe_fit before, fit;
        for (int row = 0; row < AREA_LOBE_SIDE; row++, before = fit) {
            area_lobe_fit_cell(row, column, row ? &before : NULL, &fit);
            record_of(&fit, table[row][column]);
        }
    }
    FILE *file = fopen(path, "w");
    if (!file)
        return 1;
    write_head(file);
    const float *values = &table[0][0][0];
    int columns = fprintf(file, "   ");
    for (int i = 0; i < AREA_LOBE_SIDE * AREA_LOBE_SIDE * 8; i++) {
        char text[32];
        int length = snprintf(text, sizeof text, " %.4g,", (double)values[i]);
        if (columns + length > 99)
            columns = fprintf(file, "\n   ") - 1;
        columns += fprintf(file, "%s", text);
    }
    fputc('\n', file);
    fputs("};\n/* clang-format on */\n", file);
    return fclose(file) ? 1 : 0;
}

static const float *cell_of(int row, int column)
{
    return area_lobes + 8 * (row * AREA_LOBE_SIDE + column);
}

static struct area_lobe_shape shape_in(const float *cell, double alpha, double cosine)
{
    double root = sqrt(cosine * cosine * (1 - alpha * alpha) + alpha * alpha);
    return (struct area_lobe_shape){.along = (double)cell[0] * alpha,
                                    .across = (double)cell[1] * alpha * root,
                                    .skew = (double)cell[2],
                                    .turn = (double)cell[3] - acos(cosine)};
}

/* Found again from the cell's own shape, in rows and columns all over the table. */
static void the_table_is_what_the_fit_finds(void **state)
{
    (void)state;
    for (int row = 0; row < AREA_LOBE_SIDE; row += 10) {
        for (int column = 0; column < AREA_LOBE_SIDE; column += 6) {
            const float *cell = cell_of(row, column);
            double roughness = area_lobe_roughness(row), alpha = roughness * roughness;
            double cosine = area_lobe_view_cosine(column);
            struct area_lobe_fit fit = {.alpha = alpha,
                                        .view = {sqrt(1 - cosine * cosine), 0, cosine}};
            const struct area_lobe_shape start = shape_in(cell, alpha, cosine);
            area_lobe_integrate(&fit);
            area_lobe_find(&fit, &start);
            assert_true(fabs(fit.energy - (double)cell[4]) < 1e-3);
            assert_true(fabs(fit.fresnel_cosine - (double)cell[5]) < 1e-3);
            assert_true(fabs(fit.diffuse_cosine - (double)cell[6]) < 1e-3);
            assert_true(fabs(fit.shape.across / start.across - 1) < 0.03);
            assert_true(fabs(fit.shape.turn - start.turn) < 0.03);
        }
    }
}

/* Over a grid of the hemisphere, the midpoint rule in cosine and azimuth. */
static double integral_of(const struct area_lobe_shape *shape)
{
    enum { SIDE = 400 };
    double sum = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        double z = (i / SIDE + 0.5) / SIDE, phi = 2 * M_PI * (i % SIDE + 0.5) / SIDE;
        double sine = sqrt(1 - z * z), l[3] = {sine * cos(phi), sine * sin(phi), z};
        sum += area_lobe_density(shape, l) * 2 * M_PI / (SIDE * SIDE);
    }
    return sum;
}

static void shapes_hold_all_light_above_the_horizon(void **state)
{
    (void)state;
    for (int row = 14; row < AREA_LOBE_SIDE; row += 4) {
        for (int column = 0; column < AREA_LOBE_SIDE; column += 5) {
            double roughness = area_lobe_roughness(row);
            const struct area_lobe_shape shape = shape_in(
                cell_of(row, column), roughness * roughness, area_lobe_view_cosine(column));
            assert_true(fabs(integral_of(&shape) - 1) < 2e-3);
        }
    }
}

/* What is off, as a share of the lobe's light, at the middle between four cells: the most that any
 * light can be off by. */
static void fits_are_as_near_as_the_manual_says(void **state)
{
    (void)state;
    double worst = 0, worst_usual = 0, worst_energy = 0;
    for (int row = 0; row + 1 < AREA_LOBE_SIDE; row += 3) {
        for (int column = 0; column + 1 < AREA_LOBE_SIDE; column += 3) {
            float cell[8];
            for (int k = 0; k < 8; k++)
                cell[k] = 0.25f * (cell_of(row, column)[k] + cell_of(row + 1, column)[k] +
                                   cell_of(row, column + 1)[k] + cell_of(row + 1, column + 1)[k]);
            double roughness = 0.5 * (area_lobe_roughness(row) + area_lobe_roughness(row + 1));
            double at = (column + 0.5) / (AREA_LOBE_SIDE - 1), cosine = 1 - at * at;
            double alpha = roughness * roughness;
            struct area_lobe_fit fit = {.alpha = alpha,
                                        .view = {sqrt(1 - cosine * cosine), 0, cosine}};
            const struct area_lobe_shape shape = shape_in(cell, alpha, cosine);
            area_lobe_integrate(&fit);
            double off = area_lobe_distance(&fit, &shape);
            worst = fmax(worst, off);
            worst_usual = cosine > 0.5 ? fmax(worst_usual, off) : worst_usual;
            worst_energy = cosine > 0.2 ? fmax(worst_energy, fabs(fit.energy - (double)cell[4]))
                                        : worst_energy;
        }
    }
    printf("off by at most %.3f, up to 60 degrees %.3f; energy up to 78 degrees %.4f\n", worst,
           worst_usual, worst_energy);
    assert_true(worst_usual < 0.08 && worst < 0.5 && worst_energy < 0.005);
}

int main(int count, char **arguments)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_is_what_the_fit_finds),
        cmocka_unit_test(shapes_hold_all_light_above_the_horizon),
        cmocka_unit_test(fits_are_as_near_as_the_manual_says),
    };
    if (count == 3 && !strcmp(arguments[1], "--write"))
        return write_table(arguments[2]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
