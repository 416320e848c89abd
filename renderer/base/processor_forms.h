/* SPDX-License-Identifier: MIT */
/* One function for each kind of processor: the loader takes the widest form that the processor has
 * (x86-64-v4: 512 bits, v3: 256, else 128). Multiplications are not contracted with additions
 * anywhere, so all forms have the same bits. */
#ifndef VITRAIL_RENDERER_BASE_PROCESSOR_FORMS_H
#define VITRAIL_RENDERER_BASE_PROCESSOR_FORMS_H

/* Sanitizers run before the loader can choose; other compilers and processors have one form. */
#if defined __x86_64__ && __GNUC__ >= 12 && !defined __clang__ && defined __gnu_linux__ && \
    !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__
#define PROCESSOR_FORMS \
    __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))

/* Width of the form that the loader takes. */
static inline int processor_form_bits(void)
{
    return __builtin_cpu_supports("x86-64-v4")   ? 512
           : __builtin_cpu_supports("x86-64-v3") ? 256
                                                 : 128;
}
#else
#define PROCESSOR_FORMS

static inline int processor_form_bits(void)
{
    return 128;
}
#endif
/* Of functions that are called from one that has forms, to be compiled with each. */
#define INSIDE_FORMS static inline __attribute__((always_inline))

#endif
