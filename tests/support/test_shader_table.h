/* SPDX-License-Identifier: MIT */
/* The shaders that only tests run (tests/support/shaders), embedded at build time. */
#ifndef VITRAIL_TESTS_SUPPORT_TEST_SHADER_TABLE_H
#define VITRAIL_TESTS_SUPPORT_TEST_SHADER_TABLE_H

#include "shaders/shader_table.h"

extern const struct shader_file test_shader_table[]; /* ends with a NULL name */

#endif
