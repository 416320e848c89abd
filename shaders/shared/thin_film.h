/* SPDX-License-Identifier: MIT */
/* How the eye answers to light whose spectrum a thin film has combed: Gaussian fits of the CIE 1931
 * colour matching functions in the frequency domain (Belcour and Barla 2017, "A Practical Extension
 * to Microfacet Theory for the Modeling of Varying Iridescence", section 4; the numbers are those
 * of the KHR_materials_iridescence specification). Each row: height, middle [1/m], variance [1/m2]
 * of X, Y, Z and of the second peak of X. Read by C and by GLSL. */
#ifndef VITRAIL_SHADERS_SHARED_THIN_FILM_H
#define VITRAIL_SHADERS_SHARED_THIN_FILM_H

#define FILM_HEIGHT_X 5.4856e-13
#define FILM_HEIGHT_Y 4.4201e-13
#define FILM_HEIGHT_Z 5.2481e-13
#define FILM_HEIGHT_X2 9.7470e-14
#define FILM_MIDDLE_X 1.6810e+06
#define FILM_MIDDLE_Y 1.7953e+06
#define FILM_MIDDLE_Z 2.2084e+06
#define FILM_MIDDLE_X2 2.2399e+06
#define FILM_VARIANCE_X 4.3278e+09
#define FILM_VARIANCE_Y 9.3046e+09
#define FILM_VARIANCE_Z 6.6121e+09
#define FILM_VARIANCE_X2 4.5282e+09
#define FILM_WHITE 1.0685e-7 /* the integral of Y */

#define FILM_LEAST_NM 0.03 /* thinner ones fade away */

#endif
