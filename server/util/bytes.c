// One block, doubled when it is full. A NUL stands behind the bytes at all times, and is not
// counted.
#include "server/util/bytes.h"

#include <assert.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wctype.h>

#include "core/base/utf8.h"
#include "server/util/dtoa.h"

enum { FIRST_ROOM = 256, CHUNK = 4096 }; // bytes; numbers that room is made for at once

static bool bytes_fail(Bytes *bytes) {
    free(bytes->at);
    *bytes = (Bytes){.most = bytes->most, .is_failed = true};
    return false;
}

void bytes_clear(Bytes *bytes) {
    free(bytes->at);
    *bytes = (Bytes){.most = bytes->most};
}

bool bytes_reserve(Bytes *bytes, size_t more) {
    if (bytes->is_failed)
        return false;
    const size_t most = bytes->most != 0 ? bytes->most : SIZE_MAX / 2;
    if (bytes->count > most || more > most - bytes->count) {
        bytes_fail(bytes);
        bytes->is_over = bytes->most != 0;
        return false;
    }
    const size_t wanted = bytes->count + more + 1;
    if (wanted <= bytes->room)
        return true;
    size_t room = bytes->room > 0 ? bytes->room : FIRST_ROOM;
    while (room < wanted)
        room = room <= SIZE_MAX / 2 ? 2 * room : wanted;
    // The last doubling stops at the limit.
    if (room > most)
        room = most + 1;
    char *at = realloc(bytes->at, room);
    if (at == NULL)
        return bytes_fail(bytes);
    at[bytes->count] = '\0';
    bytes->at = at;
    bytes->room = room;
    return true;
}

void bytes_put(Bytes *bytes, const void *data, size_t size) {
    if (!bytes_reserve(bytes, size) || size == 0)
        return;
    memcpy(bytes->at + bytes->count, data, size);
    bytes->count += size;
    bytes->at[bytes->count] = '\0';
}

void bytes_text(Bytes *bytes, const char *text) {
    bytes_put(bytes, text, strlen(text));
}

void bytes_format(Bytes *bytes, const char *format, ...) {
    if (bytes->is_failed)
        return;
    char text[512];
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length < 0) {
        bytes_fail(bytes);
    } else if ((size_t)length < sizeof text) {
        bytes_put(bytes, text, (size_t)length);
    } else if (bytes_reserve(bytes, (size_t)length)) {
        vsnprintf(bytes->at + bytes->count, (size_t)length + 1, format, again);
        bytes->count += (size_t)length;
    }
    va_end(again);
}

void bytes_real(Bytes *bytes, double value) {
    char digits[SHORTEST_SIZE];
    if (isfinite(value))
        bytes_put(bytes, digits, dtoa_write(digits, value));
    else
        bytes_put(bytes, "null", 4);
}

void bytes_reals(Bytes *bytes, const double *values, size_t count) {
    for (size_t i = 0; i < count; i += CHUNK) {
        const size_t some = count - i < CHUNK ? count - i : CHUNK;
        if (!bytes_reserve(bytes, some * (SHORTEST_SIZE + 1) + 1))
            return;
        char *at = bytes->at + bytes->count;
        if (i > 0)
            *at++ = ',';
        at += dtoa_list(at, values + i, some);
        *at = '\0';
        bytes->count = (size_t)(at - bytes->at);
    }
}

// Wide characters of East Asia (UAX #11) and pictographs, by the first three bytes of their UTF-8,
// whose order is that of the characters.
static bool utf8_is_wide(const char *text) {
    static const struct {
        const char *first, *last;
    } ranges[] = {{"\xE1\x84\x80", "\xE1\x85\x9F"}, {"\xE2\xBA\x80", "\xEA\x93\x86"},
                  {"\xEA\xB0\x80", "\xED\x9E\xA3"}, {"\xEF\xA4\x80", "\xEF\xAB\xBF"},
                  {"\xEF\xB8\xB0", "\xEF\xB9\xAF"}, {"\xEF\xBC\x81", "\xEF\xBD\xA0"},
                  {"\xEF\xBF\xA0", "\xEF\xBF\xA6"}, {"\xF0\x9F\x8C", "\xF0\x9F\x99"},
                  {"\xF0\x9F\xA4", "\xF0\x9F\xA7"}, {"\xF0\xA0\x80", "\xF0\xBF\xBF"}};
    for (size_t i = 0; (unsigned char)*text >= 0xE1 && i < sizeof ranges / sizeof ranges[0]; i++)
        if (strncmp(text, ranges[i].first, 3) >= 0 && strncmp(text, ranges[i].last, 3) <= 0)
            return true;
    return false;
}

size_t text_width(const char *text) {
    size_t width = 0;
    for (; *text != '\0'; text++)
        width += (((unsigned char)*text & 0xC0) != 0x80) + (utf8_is_wide(text) ? 1U : 0U);
    return width;
}

bool text_is_utf8(const char *text) {
    const unsigned char *at = (const unsigned char *)text;
    for (size_t length; *at != '\0'; at += length)
        if ((length = utf8_length(at)) == 0)
            return false;
    return true;
}

static bool text_is_plain(unsigned char c) {
    return c >= 0x20 && c < 0x7F && c != '"' && c != '\\';
}

static void bytes_escape(Bytes *bytes, unsigned char c) {
    static const char from[] = "\"\\\b\f\n\r\t", to[] = "\"\\bfnrt";
    const char *short_form = strchr(from, c);
    if (short_form != NULL)
        bytes_put(bytes, (const char[]){'\\', to[short_form - from]}, 2);
    else
        bytes_format(bytes, "\\u%04x", (unsigned)c);
}

void bytes_json_string(Bytes *bytes, const char *text) {
    if (text == NULL) {
        bytes_text(bytes, "null");
        return;
    }
    bytes_put(bytes, "\"", 1);
    const unsigned char *at = (const unsigned char *)text;
    while (*at != '\0') {
        const unsigned char *start = at;
        while (text_is_plain(*at))
            at++;
        bytes_put(bytes, start, (size_t)(at - start));
        if (*at == '\0')
            break;
        const size_t length = utf8_length(at);
        if (length == 0)
            bytes_put(bytes, "\xEF\xBF\xBD",
                      3); // U+FFFD: what we write is JSON whatever we were given
        else if (length == 1)
            bytes_escape(bytes, *at);
        else
            bytes_put(bytes, at, length);
        at += length > 0 ? length : 1;
    }
    bytes_put(bytes, "\"", 1);
}

const char *json_flag(bool flag) {
    return flag ? "true" : "false";
}

void bytes_json(Bytes *bytes, const char *format, ...) {
    bool is_quoted = false;
    const char *text;
    va_list arguments;
    va_start(arguments, format);
    for (const char *at = format; *at != '\0';) {
        const size_t plain = strcspn(at, "%\"");
        bytes_put(bytes, at, plain);
        at += plain;
        if (*at == '"') {
            is_quoted = !is_quoted;
            bytes_put(bytes, at++, 1);
        } else if (strncmp(at, "%s", 2) == 0) {
            text = va_arg(arguments, const char *);
            if (is_quoted)
                bytes_text(bytes, text);
            else
                bytes_json_string(bytes, text);
            at += 2;
        } else if (strncmp(at, "%p", 2) == 0) {
            text = va_arg(arguments, const char *);
            bytes_text(bytes, text != NULL ? text : "null");
            at += 2;
        } else if (strncmp(at, "%g", 2) == 0) {
            bytes_real(bytes, va_arg(arguments, double));
            at += 2;
        } else if (strncmp(at, "%d", 2) == 0) {
            bytes_format(bytes, "%d", va_arg(arguments, int));
            at += 2;
        } else if (strncmp(at, "%zu", 3) == 0) {
            bytes_format(bytes, "%zu", va_arg(arguments, size_t));
            at += 3;
        } else if (strncmp(at, "%llu", 4) == 0) {
            bytes_format(bytes, "%llu", va_arg(arguments, unsigned long long));
            at += 4;
        } else if (*at != '\0') {
            assert(false && "a conversion that bytes_json does not have");
            break;
        }
    }
    va_end(arguments);
}

static pthread_once_t locale_once = PTHREAD_ONCE_INIT;
static locale_t locale_unicode;

static void locale_open(void) {
    locale_unicode = newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0);
}

static void bytes_character(Bytes *bytes, uint32_t character) {
    static const unsigned char marks[] = {0, 0xC0, 0xE0, 0xF0};
    const size_t more = character < 0x80 ? 0 : character < 0x800 ? 1 : character < 0x10000 ? 2 : 3;
    unsigned char at[4];
    for (size_t i = more; i > 0; i--, character >>= 6)
        at[i] = (unsigned char)(0x80 | (character & 0x3F));
    at[0] = (unsigned char)(marks[more] | character);
    bytes_put(bytes, at, more + 1);
}

// Lower case of single characters as the C library's UTF-8 locale has it; wchar_t is the code
// point.
void bytes_folded(Bytes *bytes, const char *text) {
    pthread_once(&locale_once, locale_open);
    for (const unsigned char *at = (const unsigned char *)text; *at != '\0';) {
        const size_t length = utf8_length(at);
        if (length < 2) {
            const unsigned char c = *at++;
            bytes_put(bytes,
                      &(unsigned char){c < ' ' || c == 0x7F   ? ' '
                                       : c >= 'A' && c <= 'Z' ? (unsigned char)(c + ('a' - 'A'))
                                                              : c},
                      1);
            continue;
        }
        uint32_t character = at[0] & (0x7Fu >> length);
        for (size_t i = 1; i < length; i++)
            character = character << 6 | (at[i] & 0x3Fu);
        at += length;
        if (locale_unicode != (locale_t)0)
            character = (uint32_t)towlower_l((wint_t)character, locale_unicode);
        bytes_character(bytes, character);
    }
}

void bytes_percent(Bytes *bytes, const char *text) {
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        if ((c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
            strchr("-._~", c) != NULL)
            bytes_put(bytes, text, 1);
        else
            bytes_format(bytes, "%%%02X", (unsigned)c);
    }
}

size_t bytes_hand(const Bytes *bytes, size_t *taken, char *target, size_t size) {
    const size_t left = bytes->count - *taken, count = left < size ? left : size;
    if (count > 0)
        memcpy(target, bytes->at + *taken, count);
    *taken += count;
    return count;
}

char *bytes_take(Bytes *bytes, size_t *size) {
    const bool is_whole = bytes_reserve(bytes, 0);
    char *at = is_whole ? bytes->at : NULL;
    if (size != NULL)
        *size = is_whole ? bytes->count : 0;
    if (is_whole) {
        *bytes = (Bytes){.most = bytes->most};
    } else { // also where another text of the caller's failed
        free(bytes->at);
        *bytes = (Bytes){.most = bytes->most, .is_failed = true, .is_over = bytes->is_over};
    }
    return at;
}
