// A sentence for people, made of a format, that its owner frees. Not a fault (base/status.h) and
// not a warning (base/report.h). Used by measure/ alone.
#ifndef CORE_BASE_TEXT_FORMAT_H
#define CORE_BASE_TEXT_FORMAT_H

#include <stdbool.h>

enum { SENTENCE_MAX = 500 };

// Replaces what *target owns; cut at SENTENCE_MAX. False without memory, and then it has none.
bool sentence(char **target, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
