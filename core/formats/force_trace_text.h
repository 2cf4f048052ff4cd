// A force trace as loggers write it: columns of text, a time and its force or the force alone. Not
// its evaluation (trace.h), nor a ground motion (excite/import.h). Used by whoever takes a file of
// one.
#ifndef CORE_FORMATS_FORCE_TRACE_TEXT_H
#define CORE_FORMATS_FORCE_TRACE_TEXT_H

#include "core/drop_test/drop_test.h"

// Reads lines of two numbers, or of one where `interval` is given (NAN: it is not) [s], with
// commas, semicolons or blanks between them; lines above the first number are its header, and what
// stands there in brackets must be [s] and [N]. Sets interval and force of `trace`, which is all
// zero before; force.at is freed by free. Faults stand at "line 12". STATUS_UNREADABLE,
// STATUS_TOO_LARGE, STATUS_NO_MEMORY.
Status force_trace_text_read(const char *text, size_t size, double interval, Trace *trace,
                             Problem *problem);

#endif
