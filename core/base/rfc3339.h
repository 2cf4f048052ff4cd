// Reads dates and times of RFC 3339.
#ifndef CORE_BASE_RFC3339_H
#define CORE_BASE_RFC3339_H

#include <stdbool.h>
#include <stdint.h>

// Reads "2026-11-21T09:00:00.123Z" as milliseconds since 1970, with any fraction and UTC offset.
// Also allowed: a date alone, which is its midnight UTC; and a blank instead of the "+" of an
// offset, because an unescaped "+" in a query string is decoded to a blank. False for any other
// text.
bool rfc3339_read(const char *text, int64_t *unix_ms);

#endif
