// Force traces in the text files of data loggers: columns of times and forces, or of forces alone.
#ifndef CORE_FORMATS_FORCE_TRACE_TEXT_H
#define CORE_FORMATS_FORCE_TRACE_TEXT_H

#include "core/base/field.h"

// Reads lines of two numbers, time [s] and force [N], or of the force alone; commas, semicolons or
// blanks separate them. Lines above the first number are the header; units in brackets there must
// be [s] and [N]. *interval: the known interval of the samples [s], or NAN, which a force alone
// does not allow; replaced by that of the times. `force` is released by free(force->at). Faults are
// at "line 12". STATUS_UNREADABLE, STATUS_TOO_LARGE beyond samples_max, STATUS_NO_MEMORY.
Status force_trace_text_read(const char *text, size_t size, size_t samples_max, double *interval,
                             Reals *force, Problem *problem);

#endif
