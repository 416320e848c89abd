/* SPDX-License-Identifier: MIT */
/* Reflection by a thin film over a base: KHR_materials_iridescence (docs/explanation/shading.md,
 * section 3). Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_FILM_H
#define VITRAIL_RENDERER_RAYTRACE_RT_FILM_H

/* What the film makes of a base that reflects f0 in air, head on, per channel; in [0, 1]. ior: of
 * the film, at least 1; thickness_nm: not negative; cosine: between ray and normal, in air, [0, 1].
 * Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying
 * Iridescence", eq. 1 to 10. Deviations: channels are clamped, and films
 * thinner than FILM_LEAST_NM fade away. */
void rt_film_fresnel(const double f0[3], double ior, double thickness_nm, double cosine,
                     double out[3]);

/* The f0 that under Schlick's law reflects at this angle what the film does. */
void rt_film_f0(const double f0[3], double ior, double thickness_nm, double cosine, double out[3]);

#endif
