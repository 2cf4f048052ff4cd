// What cannot be read in an array is told and its place kept, so that those behind it keep theirs.
#include "server/json/decode_arrays.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/util/bytes.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

void decode_no_memory(Decoder *reader) {
    reader->is_out_of_memory = true;
}

double decode_number(const json_t *value) {
    return json_number_value(value) + 0.0; // -0 becomes 0
}

bool decode_allows(Decoder *reader, const json_t *value, const Field *field, size_t has,
                   const char *what, const char *pointer) {
    if (field->max == 0 || has <= field->max)
        return true;
    decode_error_value(reader, pointer, value, NULL, NULL, "must have at most %zu %s, has %zu",
                       field->max, what, has);
    return false;
}

// A number that the row allows, in place of one that could not be read, so that it is not judged a
// second time.
static double allowed_number(const Range *range) {
    if (!isinf(range->min))
        return range->is_open_below ? nextafter(range->min, (double)INFINITY) : range->min;
    if (!isinf(range->max))
        return range->max;
    return 0;
}

void decode_reals(Decoder *reader, const json_t *value, const Field *field, Reals *target,
                  const char *pointer) {
    const bool takes_number = (field->flags & FIELD_LONE) != 0;
    if (!json_is_array(value) && !(takes_number && json_is_number(value))) {
        decode_error_type(reader, pointer, value, field,
                          takes_number ? "a number or an array of numbers" : "an array of numbers");
        return;
    }
    if (json_is_number(value)) {
        double *at = malloc(sizeof *at);
        if (at == NULL) {
            decode_no_memory(reader);
            return;
        }
        *at = decode_number(value);
        free(target->at);
        *target = (Reals){at, 1};
        return;
    }
    const size_t count = json_array_size(value);
    if (!decode_allows(reader, value, field, count, "numbers", pointer))
        return;
    double *at = count > 0 ? malloc(count * sizeof *at) : NULL;
    if (at == NULL && count > 0) {
        decode_no_memory(reader);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        const json_t *element = json_array_get(value, i);
        if (json_is_number(element)) {
            at[i] = decode_number(element);
            continue;
        }
        at[i] = allowed_number(&field->range);
        if (!decode_error_has_detail(reader))
            continue;
        char place[POINTER_SIZE];
        json_pointer_index(place, sizeof place, pointer, i);
        decode_error_type(reader, place, element, field, "a number");
    }
    free(target->at);
    *target = (Reals){at, count};
}

// A row that could not be read stays empty, so that those behind it keep their places.
void decode_rows(Decoder *reader, const json_t *value, const Field *field, Rows *target,
                 const char *pointer) {
    if (!json_is_array(value)) {
        decode_error_type(reader, pointer, value, field, "an array of rows of numbers");
        return;
    }
    const size_t count = json_array_size(value);
    if (!decode_allows(reader, value, field, count, "rows", pointer))
        return;
    Reals *at = count > 0 ? calloc(count, sizeof *at) : NULL;
    if (at == NULL && count > 0) {
        decode_no_memory(reader);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        char place[POINTER_SIZE];
        json_pointer_index(place, sizeof place, pointer, i);
        decode_reals(reader, json_array_get(value, i), field, &at[i], place);
    }
    for (size_t i = 0; i < target->count; i++)
        free(target->at[i].at);
    free(target->at);
    *target = (Rows){at, count};
}

// "key=value", or `value` alone without a key.
static char *pair_text(const char *key, const char *value) {
    if (key == NULL)
        return strdup(value);
    const size_t size = strlen(key) + 1 + strlen(value) + 1;
    char *text = malloc(size);
    if (text != NULL)
        snprintf(text, size, "%s=%s", key, value);
    return text;
}

// The value as JSON text; NULL without memory.
static char *scalar_text(const json_t *value) {
    Bytes bytes = {0};
    if (json_is_string(value))
        bytes_json_string(&bytes, json_string_value(value));
    else if (json_is_boolean(value))
        bytes_text(&bytes, json_is_true(value) ? "true" : "false");
    else if (json_is_integer(value) && json_integer_value(value) > (json_int_t)1 << 53)
        bytes_format(&bytes, "%lld", (long long)json_integer_value(value));
    else
        bytes_real(&bytes, decode_number(value));
    return bytes_take(&bytes, NULL);
}

static void add_scalar(Decoder *reader, const json_t *value, Texts *texts, const char *place) {
    const bool is_scalar = json_is_string(value) || json_is_boolean(value) || json_is_number(value);
    if (!is_scalar)
        decode_error_type(reader, place, value, NULL, "a number, a string, true or false");
    char *text = is_scalar ? scalar_text(value) : strdup("0");
    if (text == NULL)
        decode_no_memory(reader);
    else
        texts->at[texts->count++] = text;
}

// What is no string is told and its place kept by an allowed text, so that those behind it keep
// theirs.
static void add_text(Decoder *reader, const json_t *value, const char *key, const Field *field,
                     Texts *texts, const char *place) {
    const char *content = json_string_value(value);
    if (content == NULL) {
        decode_error_type(reader, place, value, NULL, "a string");
        content = field->choices != NULL ? field->choices[0] : "";
    }
    char *text = pair_text(key, content);
    if (text == NULL)
        decode_no_memory(reader);
    else
        texts->at[texts->count++] = text;
}

void decode_texts(Decoder *reader, const json_t *value, const Field *field, Texts *target,
                  const char *pointer) {
    const bool is_pairs = json_is_object(value) && (field->flags & FIELD_PAIRS) != 0;
    if (!json_is_array(value) && !is_pairs) {
        decode_error_type(reader, pointer, value, field,
                          (field->flags & FIELD_PAIRS) != 0 ? "an array or an object of strings"
                                                            : "an array of strings");
        return;
    }
    const size_t count = is_pairs ? json_object_size(value) : json_array_size(value);
    if (!decode_allows(reader, value, field, count, "texts", pointer))
        return;
    Texts texts = {count > 0 ? calloc(count, sizeof *texts.at) : NULL, 0};
    if (texts.at == NULL && count > 0) {
        decode_no_memory(reader);
        return;
    }
    char place[POINTER_SIZE];
    if (is_pairs) {
        const char *key;
        json_t *element;
        json_object_foreach((json_t *)value, key, element) {
            json_pointer_join(place, sizeof place, pointer, key);
            add_text(reader, element, key, field, &texts, place);
        }
    } else {
        for (size_t i = 0; i < count; i++) {
            json_pointer_index(place, sizeof place, pointer, i);
            if ((field->flags & FIELD_SCALARS) != 0)
                add_scalar(reader, json_array_get(value, i), &texts, place);
            else
                add_text(reader, json_array_get(value, i), NULL, field, &texts, place);
        }
    }
    for (size_t i = 0; i < target->count; i++)
        free(target->at[i]);
    free(target->at);
    *target = texts;
}
