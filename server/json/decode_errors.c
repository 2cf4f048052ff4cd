// Past the hundredth fault nothing is spelt out any more, so that a document of a million faults
// costs no more than its reading.
#include "server/json/decode_errors.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/base/spelling.h"
#include "server/util/dtoa.h"

static const char *type_name(const json_t *value) {
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "an array";
    case JSON_STRING:
        return "a string";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
        return "true";
    case JSON_FALSE:
        return "false";
    case JSON_NULL:
        break;
    }
    return "null";
}

void decode_error_text(const json_t *value, char *target, size_t size) {
    char digits[SHORTEST_SIZE + 1];
    switch (json_typeof(value)) {
    case JSON_STRING:
        text_quote(target, size, json_string_value(value));
        break;
    case JSON_INTEGER:
        snprintf(target, size, "%lld", (long long)json_integer_value(value));
        break;
    case JSON_REAL:
        digits[dtoa_write(digits, json_real_value(value))] = '\0';
        text_fit(target, size, digits);
        break;
    case JSON_OBJECT:
    case JSON_ARRAY:
        target[0] = '\0';
        break;
    default:
        text_fit(target, size, type_name(value));
        break;
    }
}

bool decode_error_has_detail(Decoder *reader) {
    reader->is_faulty = true;
    if (reader->problem != NULL && reader->problem->count < PROBLEM_FAULTS)
        return true;
    problem_add(reader->problem, STATUS_INVALID, "", "one of many");
    return false;
}

void decode_error_value(Decoder *reader, const char *pointer, const json_t *value, const char *unit,
                        const char *meant, const char *format, ...) {
    if (!decode_error_has_detail(reader))
        return;
    Fault fault = {0};
    char text[2 * sizeof fault.detail];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_fit(fault.detail, sizeof fault.detail, text);
    decode_error_text(value, fault.value, sizeof fault.value);
    text_fit(fault.unit, sizeof fault.unit, unit != NULL ? unit : "");
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, meant != NULL ? meant : "");
    problem_add_fault(reader->problem, STATUS_INVALID, &fault);
}

void decode_error_type(Decoder *reader, const char *pointer, const json_t *value,
                       const Field *field, const char *wanted) {
    const char *unit = field != NULL ? field->unit : NULL;
    decode_error_value(reader, pointer, value, unit, NULL, "must be %s%s%s%s, is %s", wanted,
                       unit != NULL ? " [" : "", unit != NULL ? unit : "", unit != NULL ? "]" : "",
                       type_name(value));
}

enum { NAMES_SIZE = sizeof((Fault){0}.detail) };

static void list_names(const char *const *names, char list[NAMES_SIZE]) {
    size_t length = 0;
    list[0] = '\0';
    for (size_t i = 0; names[i] != NULL && length < NAMES_SIZE; i++)
        length += (size_t)snprintf(list + length, NAMES_SIZE - length, "%s%s", i > 0 ? ", " : "",
                                   names[i]);
}

void decode_error_unnamed(Decoder *reader, const char *pointer, const char *const *names) {
    char list[NAMES_SIZE];
    if (!decode_error_has_detail(reader))
        return;
    list_names(names, list);
    problem_add(reader->problem, STATUS_INVALID, pointer, "is required, one of %s", list);
}

const char *decode_error_name(Decoder *reader, const char *pointer, const json_t *value,
                              const char *const *names) {
    const char *name = json_string_value(value);
    const char *meant = spelling_nearest(names, name);
    if (!decode_error_has_detail(reader))
        return meant;
    char list[NAMES_SIZE], shown[64];
    list_names(names, list);
    text_quote(shown, sizeof shown, name);
    decode_error_value(reader, pointer, value, NULL, meant, "must be one of %s, is %s", list,
                       shown);
    return meant;
}
