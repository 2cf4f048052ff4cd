#include "core/base/report.h"

#include <stdlib.h>
#include <string.h>

enum { REPORT_LINES_MAX = 256 };

// clang-format off
const Field warning_fields[] = {
    FIELD_TEXT(Warning, pointer, 0, PRESENCE_OPTIONAL, 0, "JSON Pointer to what is doubtful"),
    FIELD_TEXT(Warning, detail, 0, PRESENCE_OPTIONAL, 0, "what is doubtful about it"),
    FIELD_END
};

const Field decision_fields[] = {
    FIELD_TEXT(Decision, about, 0, PRESENCE_OPTIONAL, 0, "what was to be chosen"),
    FIELD_TEXT(Decision, chose, 0, PRESENCE_OPTIONAL, 0, "what was chosen"),
    FIELD_TEXT(Decision, why, 0, PRESENCE_OPTIONAL, 0, "the reason"),
    FIELD_REAL(Decision, value, NULL, ANY, OPTIONAL, "the number that decided"),
    FIELD_TEXT(Decision, unit, 0, PRESENCE_OPTIONAL, 0, "of that number"),
    FIELD_END
};
// clang-format on

// The formatted text, owned by the caller; NULL without memory.
static char *report_text(const char *format, va_list arguments) {
    if (strchr(format, '%') == NULL)
        return strdup(format);
    char text[512];
    text_fit_format(text, sizeof text, format, arguments);
    return strdup(text);
}

Status warnings_add(Warnings *warnings, const char *pointer, const char *format, ...) {
    if (warnings == NULL || warnings->count >= REPORT_LINES_MAX)
        return STATUS_OK;
    Warning *warning = list_append(warnings, sizeof *warning);
    if (warning == NULL)
        return STATUS_NO_MEMORY;
    va_list arguments;
    va_start(arguments, format);
    *warning = (Warning){.pointer = strdup(pointer), .detail = report_text(format, arguments)};
    va_end(arguments);
    if (warning->pointer != NULL && warning->detail != NULL)
        return STATUS_OK;
    fields_clear(warning_fields, warning);
    warnings->count--;
    return STATUS_NO_MEMORY;
}

void warnings_clear(Warnings *warnings) {
    for (size_t i = 0; i < warnings->count; i++)
        fields_clear(warning_fields, &warnings->at[i]);
    free(warnings->at);
    *warnings = (Warnings){NULL, 0};
}

Status decisions_add(Decisions *decisions, const char *about, const char *chose, double value,
                     const char *unit, const char *format, ...) {
    if (decisions == NULL || decisions->count >= REPORT_LINES_MAX)
        return STATUS_OK;
    Decision *decision = list_append(decisions, sizeof *decision);
    if (decision == NULL)
        return STATUS_NO_MEMORY;
    va_list arguments;
    va_start(arguments, format);
    *decision = (Decision){.about = strdup(about),
                           .chose = strdup(chose),
                           .why = report_text(format, arguments),
                           .value = value,
                           .unit = unit != NULL ? strdup(unit) : NULL};
    va_end(arguments);
    if (decision->about != NULL && decision->chose != NULL && decision->why != NULL &&
        (unit == NULL || decision->unit != NULL))
        return STATUS_OK;
    fields_clear(decision_fields, decision);
    decisions->count--;
    return STATUS_NO_MEMORY;
}
