// Texts are read here with the escapes that codec/ writes, and no others.
#include "core/base/json_scalar.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"

Scalar scalar_number(double number) {
    const bool is_whole = number >= 0 && number < 0x1p63 && floor(number) == number;
    return (Scalar){.kind = SCALAR_NUMBER,
                    .number = number,
                    .whole = is_whole ? (uint64_t)number : COUNT_ABSENT};
}

static bool read_hexadecimal(const char *at, unsigned *code) {
    char digits[5] = "";
    memcpy(digits, at, strnlen(at, 4));
    char *end;
    *code = (unsigned)strtoul(digits, &end, 16);
    return end == digits + 4;
}

// One escape behind its backslash; returns the bytes of `json` it took, 0 for none known.
static size_t read_escape(const char *json, char **to) {
    static const char from[] = "\"\\/bfnrt", meant[] = "\"\\/\b\f\n\r\t";
    const char *found = *json != '\0' ? strchr(from, *json) : NULL;
    unsigned code;
    if (found != NULL) {
        *(*to)++ = meant[found - from];
        return 1;
    }
    // Only control characters are written so.
    if (*json != 'u' || !read_hexadecimal(json + 1, &code) || code == 0 || code >= 0x80)
        return 0;
    *(*to)++ = (char)code;
    return 5;
}

static bool read_text(const char *json, char *room) {
    for (json++; *json != '"'; json++) {
        if (*json == '\0')
            return false;
        if (*json != '\\') {
            *room++ = *json;
            continue;
        }
        const size_t taken = read_escape(json + 1, &room);
        if (taken == 0)
            return false;
        json += taken;
    }
    *room = '\0';
    return json[1] == '\0';
}

bool scalar_read(const char *json, Scalar *value, char *room) {
    char *end;
    *value = (Scalar){.kind = SCALAR_FLAG, .flag = *json == 't'};
    if (strcmp(json, "true") == 0 || strcmp(json, "false") == 0)
        return true;
    if (*json == '"') {
        *value = (Scalar){.kind = SCALAR_TEXT, .text = room};
        return read_text(json, room);
    }
    const double number = strtod(json, &end);
    if (end == json || *end != '\0' || !isfinite(number))
        return false;
    *value = scalar_number(number);
    // Beyond 2^53 the digits say more than a double.
    if (value->whole != COUNT_ABSENT && strspn(json, "0123456789") == strlen(json))
        value->whole = strtoull(json, NULL, 10);
    return true;
}
