// A growing buffer of bytes with a limit; text is built in it. Once it failed (limit or memory) it
// stays failed and empty, so that writers need not check each call.
#ifndef SERVER_UTIL_BYTES_H
#define SERVER_UTIL_BYTES_H

#include <stdbool.h>
#include <stddef.h>

typedef struct Bytes {
    char *at;     // NUL-terminated when not NULL
    size_t count; // without the NUL
    size_t room;
    size_t most; // of count; 0: no limit
    bool is_failed;
    bool is_over; // failed because of the limit, not for want of memory
} Bytes;

void bytes_clear(Bytes *bytes); // empty and sound again, under the same limit
void bytes_put(Bytes *bytes, const void *data, size_t size);
void bytes_text(Bytes *bytes, const char *text);
void bytes_format(Bytes *bytes, const char *format, ...) __attribute__((format(printf, 2, 3)));
bool bytes_reserve(Bytes *bytes, size_t more); // room for `more` beyond count; false once failed
// The shortest digits that read back to the same double; "null" where it is not finite.
void bytes_real(Bytes *bytes, double value);
// Many of them, with commas between; room is made for thousands at once.
void bytes_reals(Bytes *bytes, const double *values, size_t count);
// Quoted and escaped; NULL is null, bad UTF-8 becomes U+FFFD.
void bytes_json_string(Bytes *bytes, const char *text);
// JSON by a format of printf, whose conversions mean: %s a string, quoted and escaped, NULL is
// null, or within quotes of the format the text as it is; %g a number as by bytes_real; %p JSON
// text, NULL is null; %d, %zu and %llu whole numbers. There are no others.
void bytes_json(Bytes *bytes, const char *format, ...) __attribute__((format(printf, 2, 3)));
const char *json_flag(bool flag); // "true" or "false"
// The columns of a terminal that UTF-8 text takes: two for a wide character of East Asia, else one.
size_t text_width(const char *text);
// Whether all of a text is UTF-8.
bool text_is_utf8(const char *text);
// As it is compared where upper and lower case are one: lower case of any script, with a space for
// each control character. What is no UTF-8 is kept.
void bytes_folded(Bytes *bytes, const char *text);
// As part of a URL's query: what is not a letter, a digit or one of -._~ as %XX.
void bytes_percent(Bytes *bytes, const char *text);
// What is left behind the first *taken bytes, as much as fits, to target[size]; *taken moves on.
// Returns how many.
size_t bytes_hand(const Bytes *bytes, size_t *taken, char *target, size_t size);
// Takes the text out ("" if there is none), leaving the buffer empty; the caller frees it with
// free(). NULL if failed.
char *bytes_take(Bytes *bytes, size_t *size);

#endif
