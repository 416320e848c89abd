/* SPDX-License-Identifier: MIT */
/* Under AddressSanitizer libraries stay loaded to the end, and leaks of one are none of ours. A
 * driver is unloaded with its display, and what it refers to would be leaks of an unknown module by
 * then. */
#ifdef __SANITIZE_ADDRESS__

extern const int kept_libraries; /* the linker is asked for it, and so takes this file */
const int kept_libraries = 1;

int dlclose(void *library);

int dlclose(void *library)
{
    (void)library;
    return 0;
}

/* Read by LeakSanitizer. Readers of assimp and OpenVDB forget what they hold when they refuse a
 * file; the decoder, which reads one file, ends then. */
const char *__lsan_default_suppressions(void); /* NOLINT: the name is LeakSanitizer's */
const char *__lsan_default_suppressions(void)  /* NOLINT */
{
    return "leak:libassimp.so\nleak:openvdb::\nleak:libopenvdb.so\n";
}

#endif
