/* SPDX-License-Identifier: MIT */
/* Under AddressSanitizer libraries stay loaded to the end. A driver is unloaded with its display,
 * and what it refers to would be leaks of an unknown module by then. */
#ifdef __SANITIZE_ADDRESS__

extern const int kept_libraries; /* the linker is asked for it, and so takes this file */
const int kept_libraries = 1;

int dlclose(void *library);

int dlclose(void *library)
{
    (void)library;
    return 0;
}

#endif
