#include "server/base/journal.h"

#include <stdio.h>
#include <string.h>

void journal_put(Bytes *bytes, const char *name, const char *text, size_t most) {
    if (text == NULL)
        return;
    bytes_format(bytes, " %s=\"", name);
    for (size_t i = 0; text[i] != '\0' && i < most; i++) {
        const unsigned char c = (unsigned char)text[i];
        if (c < 0x20 || c >= 0x7f || c == '"' || c == '\\')
            bytes_format(bytes, "\\x%02x", c);
        else
            bytes_put(bytes, &text[i], 1);
    }
    bytes_text(bytes, strnlen(text, most + 1) > most ? "...\"" : "\"");
}

void journal_write(const Bytes *line) {
    if (line->at != NULL)
        fprintf(stderr, "impactd: %s\n", line->at);
}
