# SPDX-License-Identifier: MIT
# Writes one file as a C array NAME and its length NAME_bytes. Bytes as hex, because a C string literal is limited to 64 KiB.
file(READ ${FILE} HEX HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," BYTES "${HEX}")
set(BODY "/* Generated from ${FILE}; do not edit. */\n#include \"${HEADER}\"\n")
string(APPEND BODY "const unsigned char ${NAME}[] = {${BYTES}0};\n")
string(APPEND BODY "const size_t ${NAME}_bytes = sizeof ${NAME} - 1;\n")
file(WRITE ${OUTPUT}.tmp "${BODY}")
file(COPY_FILE ${OUTPUT}.tmp ${OUTPUT} ONLY_IF_DIFFERENT)
file(TOUCH_NOCREATE ${OUTPUT})
