#include "core/base/text_format.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"

bool sentence(char **target, const char *format, ...) {
    char text[2 * SENTENCE_MAX], cut[SENTENCE_MAX];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    text_fit(cut, sizeof cut, text);
    free(*target);
    *target = strdup(cut);
    return *target != NULL;
}
