/* SPDX-License-Identifier: MIT */
/* Finds the NT_GNU_BUILD_ID note of the main program. */
#include "server/base/build_id.h"

#include <elf.h>
#include <link.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

static size_t align4(size_t size)
{
    return (size + 3) & ~(size_t)3;
}

/* The notes of one segment: header, name, description, each padded to four bytes. */
static int read_notes(const char *at, size_t size_bytes, char *text)
{
    while (size_bytes >= sizeof(ElfW(Nhdr))) {
        ElfW(Nhdr) note;
        memcpy(&note, at, sizeof note);
        size_t length = sizeof note + align4(note.n_namesz) + align4(note.n_descsz);
        const char *name = at + sizeof note, *id = name + align4(note.n_namesz);
        if (length > size_bytes)
            return 0;
        if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && memcmp(name, "GNU", 4) == 0) {
            for (size_t i = 0; i < note.n_descsz && 2 * i + 2 < BUILD_ID_BYTES; i++)
                snprintf(text + 2 * i, 3, "%02x", (unsigned char)id[i]);
            return 1;
        }
        at += length;
        size_bytes -= length;
    }
    return 0;
}

/* The first object is the program itself; the walk ends there. */
static int visit_object(struct dl_phdr_info *object, size_t size_bytes, void *text)
{
    (void)size_bytes;
    for (int i = 0; i < object->dlpi_phnum; i++) {
        const ElfW(Phdr) *header = &object->dlpi_phdr[i];
        const void *at = (const void *)(uintptr_t)(object->dlpi_addr + header->p_vaddr);
        if (header->p_type == PT_NOTE && read_notes(at, header->p_memsz, text))
            break;
    }
    return 1;
}

void build_id_get(char text[BUILD_ID_BYTES])
{
    snprintf(text, BUILD_ID_BYTES, "%s", VITRAIL_VERSION);
    dl_iterate_phdr(visit_object, text);
}
