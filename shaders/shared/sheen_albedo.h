/* SPDX-License-Identifier: MIT */
/* Shared by C and GLSL: the share of a uniform light from everywhere that the sheen lobe sends to
 * the viewer (docs/explanation/shading.md, section 3), by its roughness and the cosine at the
 * viewer. Integrals of the lobe by the midpoint rule; tests/unit/test_rt_lobes.c takes them
 * again. Row i, column k of SHEEN_ALBEDO are of the roughness SHEEN_ROUGHNESS_LEAST + (1 -
 * SHEEN_ROUGHNESS_LEAST) * (i / (SHEEN_ALBEDO_SIDE - 1))^1.5 and of the cosine (k /
 * (SHEEN_ALBEDO_SIDE - 1))^2. */
#ifndef VITRAIL_SHADERS_SHARED_SHEEN_ALBEDO_H
#define VITRAIL_SHADERS_SHARED_SHEEN_ALBEDO_H

#define SHEEN_ROUGHNESS_LEAST 0.07 /* smoother fibres are taken to be as rough as this */
#define SHEEN_ALBEDO_SIDE 12

/* clang-format off */
#define SHEEN_ALBEDO \
    1.6435, 1.5647, 1.1349, 0.6149, 0.2231, 0.0486, \
    0.0058, 0.0003, 0.0000, 0.0000, 0.0000, 0.0000, \
    1.4242, 1.4050, 1.0992, 0.6878, 0.3265, 0.1130, \
    0.0274, 0.0039, 0.0003, 0.0000, 0.0000, 0.0000, \
    1.1336, 1.1579, 0.9720, 0.6930, 0.4146, 0.2071, \
    0.0857, 0.0273, 0.0059, 0.0007, 0.0000, 0.0000, \
    0.9106, 0.9525, 0.8386, 0.6507, 0.4483, 0.2754, \
    0.1514, 0.0716, 0.0272, 0.0074, 0.0010, 0.0000, \
    0.7658, 0.8148, 0.7418, 0.6094, 0.4590, 0.3191, \
    0.2062, 0.1211, 0.0620, 0.0260, 0.0073, 0.0004, \
    0.6818, 0.7347, 0.6856, 0.5865, 0.4694, 0.3534, \
    0.2525, 0.1689, 0.1029, 0.0553, 0.0230, 0.0039, \
    0.6423, 0.6988, 0.6643, 0.5854, 0.4892, 0.3891, \
    0.2969, 0.2159, 0.1468, 0.0919, 0.0486, 0.0155, \
    0.6358, 0.6958, 0.6703, 0.6037, 0.5208, 0.4311, \
    0.3437, 0.2642, 0.1929, 0.1332, 0.0822, 0.0376, \
    0.6528, 0.7154, 0.6953, 0.6360, 0.5613, 0.4784, \
    0.3935, 0.3136, 0.2401, 0.1769, 0.1206, 0.0684, \
    0.6818, 0.7454, 0.7277, 0.6727, 0.6031, 0.5249, \
    0.4420, 0.3607, 0.2849, 0.2190, 0.1596, 0.1034, \
    0.7058, 0.7685, 0.7517, 0.6994, 0.6337, 0.5595, \
    0.4793, 0.3980, 0.3213, 0.2546, 0.1942, 0.1371, \
    0.7007, 0.7616, 0.7462, 0.6972, 0.6360, 0.5670, \
    0.4917, 0.4143, 0.3405, 0.2764, 0.2185, 0.1638
/* clang-format on */

#endif
