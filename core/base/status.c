// Faults are kept in order, one per place. Beyond PROBLEM_FAULTS they are counted without
// formatting their text, so that a document with a million faults costs no more than reading it.
#include "core/base/status.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/utf8.h"

static const char *const status_slugs[] = {
#define STATUS_SLUG(name, slug, title) slug,
    STATUS_LIST(STATUS_SLUG)
#undef STATUS_SLUG
};

static const char *const status_titles[] = {
#define STATUS_TITLE(name, slug, title) title,
    STATUS_LIST(STATUS_TITLE)
#undef STATUS_TITLE
};

const char *status_slug(Status status) {
    return (size_t)status < COUNT(status_slugs) ? status_slugs[status]
                                                : status_slugs[STATUS_INTERNAL];
}

const char *status_title(Status status) {
    return (size_t)status < COUNT(status_titles) ? status_titles[status]
                                                 : status_titles[STATUS_INTERNAL];
}

// The largest length <= `max` at which `text` can be cut between two UTF-8 characters.
static size_t text_boundary(const char *text, size_t max) {
    while (max > 0 && ((unsigned char)text[max] & 0xC0) == 0x80)
        max--;
    return max;
}

void text_fit(char *target, size_t size, const char *text) {
    if (size == 0)
        return;
    const size_t length = strlen(text);
    if (length < size) {
        memcpy(target, text, length + 1);
        return;
    }
    const char *mark = size > 4 ? "..." : "";
    const size_t kept = text_boundary(text, size - 1 - strlen(mark));
    memcpy(target, text, kept);
    memcpy(target + kept, mark, strlen(mark) + 1);
}

void text_fit_format(char *target, size_t size, const char *format, va_list arguments) {
    char text[1024]; // longer than any target
    vsnprintf(text, sizeof text, format, arguments);
    text_fit(target, size, text);
}

Status text_copy(const char *text, char **target) {
    *target = text != NULL ? strdup(text) : NULL;
    return status_made(*target != NULL || text == NULL);
}

bool text_same(const char *a, const char *b) {
    return a == NULL || b == NULL ? a == b : strcmp(a, b) == 0;
}

void text_list(char *target, size_t size, const char *item) {
    size_t used = strlen(target);
    if (used > 0) {
        text_fit(target + used, size - used, ", ");
        used += strlen(target + used);
    }
    text_fit(target + used, size - used, item);
}

void text_quote(char *target, size_t size, const char *text) {
    if (size < 8) {
        if (size > 0)
            target[0] = '\0';
        return;
    }
    // A character needs at most 6 bytes; the end is "..." and the closing quote.
    const size_t end = size - 5;
    size_t length = 0;
    target[length++] = '"';
    for (size_t i = 0; text[i] != '\0'; i++) {
        const unsigned char c = (unsigned char)text[i];
        char piece[8];
        size_t bytes = 1;
        if (utf8_length((const unsigned char *)text + i) == 0) {
            bytes = (size_t)snprintf(piece, sizeof piece, "\xEF\xBF\xBD"); // U+FFFD
        } else if (c < 0x20 || c == '"' || c == '\\') {
            bytes = (size_t)snprintf(piece, sizeof piece, c < 0x20 ? "\\u%04x" : "\\%c", (int)c);
        } else {
            bytes = utf8_length((const unsigned char *)text + i);
            memcpy(piece, text + i, bytes);
            i += bytes - 1;
        }
        if (length + bytes > end) {
            memcpy(target + length, "...", 3);
            length += 3;
            break;
        }
        memcpy(target + length, piece, bytes);
        length += bytes;
    }
    target[length] = '"';
    target[length + 1] = '\0';
}

const char *text_real(char target[32], double value) {
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(target, 32, "%.*g", digits, value);
        if (strtod(target, NULL) == value)
            break;
    }
    return target;
}

RealText real_text(double value) {
    RealText text;
    text_real(text.at, value);
    return text;
}

void problem_clear(Problem *problem) {
    if (problem == NULL)
        return;
    problem->status = STATUS_OK;
    problem->detail[0] = '\0';
    problem->count = 0;
    problem->whose = NULL;
}

Status problem_set(Problem *problem, Status status, const char *format, ...) {
    if (problem == NULL || problem->status != STATUS_OK || status == STATUS_OK)
        return status;
    va_list arguments;
    va_start(arguments, format);
    text_fit_format(problem->detail, sizeof problem->detail, format, arguments);
    va_end(arguments);
    problem->status = status;
    return status;
}

// Counts a fault beyond PROBLEM_FAULTS and returns true; false if there is space for it.
static bool problem_count_only(Problem *problem) {
    if (problem == NULL)
        return true;
    if (problem->count < PROBLEM_FAULTS)
        return false;
    problem->count++;
    return true;
}

Status problem_add_fault(Problem *problem, Status status, const Fault *fault) {
    if (problem_count_only(problem))
        return status;
    for (size_t i = 0; i < problem->count; i++)
        if (strcmp(problem->faults[i].pointer, fault->pointer) == 0)
            return status;
    problem->faults[problem->count++] = *fault;
    return problem_set(problem, status, "%s%s%s", fault->pointer,
                       fault->pointer[0] == '\0' ? "" : ": ", fault->detail);
}

Status problem_add_arguments(Problem *problem, Status status, const char *pointer, double value,
                             const char *unit, const char *format, va_list arguments) {
    if (problem_count_only(problem))
        return status;
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_fit_format(fault.detail, sizeof fault.detail, format, arguments);
    // JSON has no representation of infinity and NaN.
    text_fit(fault.value, sizeof fault.value, isfinite(value) ? real_text(value).at : "");
    text_fit(fault.unit, sizeof fault.unit, unit != NULL ? unit : "");
    return problem_add_fault(problem, status, &fault);
}

Status problem_add(Problem *problem, Status status, const char *pointer, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    problem_add_arguments(problem, status, pointer, (double)NAN, NULL, format, arguments);
    va_end(arguments);
    return status;
}

Status problem_add_real(Problem *problem, Status status, const char *pointer, double value,
                        const char *unit, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    problem_add_arguments(problem, status, pointer, value, unit, format, arguments);
    va_end(arguments);
    return status;
}

bool problem_concerns(const Problem *problem, const char *pointer) {
    if (problem == NULL)
        return false;
    const size_t length = strlen(pointer);
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        const char *place = problem->faults[i].pointer;
        if (strncmp(place, pointer, length) == 0 && (place[length] == '\0' || place[length] == '/'))
            return true;
    }
    return false;
}

bool text_format(char **target, const char *format, ...) {
    char text[TEXT_FORMAT_MAX];
    va_list arguments;
    va_start(arguments, format);
    text_fit_format(text, sizeof text, format, arguments);
    va_end(arguments);
    free(*target);
    *target = strdup(text);
    return *target != NULL;
}
