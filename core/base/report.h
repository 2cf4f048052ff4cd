// Warnings and decisions: sentences for people that accompany a result. A fault, which prevents
// one, is a Problem (base/status.h).
#ifndef CORE_BASE_REPORT_H
#define CORE_BASE_REPORT_H

#include "core/base/field.h"

typedef struct Warning {
    char *pointer, *detail; // JSON Pointer to the doubtful value; the sentence
} Warning;
typedef struct Warnings {
    Warning *at;
    size_t count;
} Warnings;

// One automatic choice and its reason.
typedef struct Decision {
    char *about; // "modes"
    char *chose; // "left_out" for work that the scene does not require
    char *why;
    double value; // the number that decided; NAN: none
    char *unit;   // of that number; NULL: none
} Decision;
typedef struct Decisions {
    Decision *at;
    size_t count;
} Decisions;

extern const Field warning_fields[], decision_fields[];

// These append one line and copy its texts. A list holds 256 lines; further lines are dropped, and
// all lines where the list is NULL. STATUS_NO_MEMORY leaves the list unchanged.
Status warnings_add(Warnings *warnings, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
Status decisions_add(Decisions *decisions, const char *about, const char *chose, double value,
                     const char *unit, const char *format, ...)
    __attribute__((format(printf, 6, 7)));

void warnings_clear(Warnings *warnings);

#endif
