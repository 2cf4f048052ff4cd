// Lower case of single characters as the C library's UTF-8 locale has it; wchar_t is the code
// point.
#include "server/util/utf8_fold.h"

#include <locale.h>
#include <pthread.h>
#include <stdint.h>
#include <wctype.h>

static pthread_once_t once = PTHREAD_ONCE_INIT;
static locale_t unicode;

static void open_locale(void) {
    unicode = newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0);
}

// The character at `text` and how many bytes it has; 0 for what is no UTF-8.
static size_t decode(const unsigned char *text, uint32_t *character) {
    const size_t size = text[0] < 0xC2   ? 0
                        : text[0] < 0xE0 ? 2
                        : text[0] < 0xF0 ? 3
                        : text[0] < 0xF5 ? 4
                                         : 0;
    if (size == 0)
        return 0;
    *character = text[0] & (0x7Fu >> size);
    for (size_t i = 1; i < size; i++) {
        if ((text[i] & 0xC0) != 0x80)
            return 0;
        *character = *character << 6 | (text[i] & 0x3Fu);
    }
    return size;
}

static void encode(Bytes *bytes, uint32_t character) {
    unsigned char at[4];
    size_t size = 0;
    if (character < 0x80) {
        at[size++] = (unsigned char)character;
    } else if (character < 0x800) {
        at[size++] = (unsigned char)(0xC0 | character >> 6);
    } else if (character < 0x10000) {
        at[size++] = (unsigned char)(0xE0 | character >> 12);
        at[size++] = (unsigned char)(0x80 | (character >> 6 & 0x3F));
    } else {
        at[size++] = (unsigned char)(0xF0 | character >> 18);
        at[size++] = (unsigned char)(0x80 | (character >> 12 & 0x3F));
        at[size++] = (unsigned char)(0x80 | (character >> 6 & 0x3F));
    }
    if (character >= 0x80)
        at[size++] = (unsigned char)(0x80 | (character & 0x3F));
    bytes_put(bytes, at, size);
}

void utf8_fold(Bytes *bytes, const char *text) {
    pthread_once(&once, open_locale);
    const unsigned char *at = (const unsigned char *)text;
    while (*at != '\0') {
        uint32_t character = 0;
        const size_t size = *at < 0x80 ? 0 : decode(at, &character);
        if (size == 0) {
            const unsigned char c = *at++;
            const char lower = (char)(c < ' ' || c == 0x7F   ? ' '
                                      : c >= 'A' && c <= 'Z' ? c + ('a' - 'A')
                                                             : c);
            bytes_put(bytes, &lower, 1);
            continue;
        }
        at += size;
        encode(bytes, unicode == (locale_t)0 ? character
                                             : (uint32_t)towlower_l((wint_t)character, unicode));
    }
}
