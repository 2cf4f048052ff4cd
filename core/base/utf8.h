// Characters of UTF-8.
#ifndef CORE_BASE_UTF8_H
#define CORE_BASE_UTF8_H

#include <stddef.h>

// The length of the character at `text`, 0 where there is none: cut short, overlong, a surrogate,
// too large. 1 at the end of the text.
size_t utf8_length(const unsigned char *text);

#endif
