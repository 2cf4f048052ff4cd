// A walk over both trees at once. Pointers are cut like those of faults; depth is what
// JSON_DEPTH_MAX lets in.
#include "server/json/diff.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/json_pointer.h"

enum { POINTER = 256, NUMBERS = 16 };

typedef struct ImportContext {
    Differences *differences;
    bool is_out_of_memory;
} ImportContext;

static void put_json(Bytes *bytes, const json_t *value) {
    const char *name, *separator = "";
    json_t *inner;
    size_t i;
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        bytes_text(bytes, "{");
        json_object_foreach((json_t *)value, name, inner) {
            bytes_text(bytes, separator);
            bytes_json_string(bytes, name);
            bytes_text(bytes, ": ");
            put_json(bytes, inner);
            separator = ", ";
        }
        bytes_text(bytes, "}");
        break;
    case JSON_ARRAY:
        bytes_text(bytes, "[");
        json_array_foreach(value, i, inner) {
            bytes_text(bytes, separator);
            put_json(bytes, inner);
            separator = ", ";
        }
        bytes_text(bytes, "]");
        break;
    case JSON_STRING:
        bytes_json_string(bytes, json_string_value(value));
        break;
    case JSON_INTEGER:
        bytes_format(bytes, "%lld", (long long)json_integer_value(value));
        break;
    case JSON_REAL:
        bytes_real(bytes, json_real_value(value));
        break;
    case JSON_TRUE:
    case JSON_FALSE:
        bytes_text(bytes, json_is_true(value) ? "true" : "false");
        break;
    case JSON_NULL:
        bytes_text(bytes, "null");
        break;
    }
}

// NULL where there is none, or it is too long.
static char *text_of(const json_t *value, bool *is_long) {
    Bytes bytes = {.most = DIFFER_VALUE_MAX};
    if (value == NULL)
        return NULL;
    put_json(&bytes, value);
    *is_long = *is_long || bytes.is_failed;
    char *text = bytes_take(&bytes, NULL);
    bytes_clear(&bytes);
    return text;
}

static void say_long(const json_t *a, const json_t *b, char *text, size_t size) {
    if (!json_is_array(a) || !json_is_array(b)) {
        snprintf(text, size, "too long to be shown");
        return;
    }
    const size_t count_a = json_array_size(a), count_b = json_array_size(b);
    size_t first = 0;
    while (first < count_a && first < count_b &&
           json_equal(json_array_get(a, first), json_array_get(b, first)))
        first++;
    snprintf(text, size, "%zu and %zu items, the first that differs is number %zu", count_a,
             count_b, first + 1);
}

static void add(ImportContext *context, const char *pointer, const json_t *a, const json_t *b) {
    Differences *differences = context->differences;
    if (differences->count == DIFFER_MAX) {
        differences->more++;
        return;
    }
    Difference *at = realloc(differences->at, (differences->count + 1) * sizeof *at);
    if (at == NULL) {
        context->is_out_of_memory = true;
        return;
    }
    differences->at = at;
    bool is_long = false;
    char detail[120];
    Difference *one = &at[differences->count++];
    *one = (Difference){strdup(pointer), text_of(a, &is_long), text_of(b, &is_long), NULL};
    if (is_long) {
        say_long(a, b, detail, sizeof detail);
        one->detail = strdup(detail);
    }
    context->is_out_of_memory =
        context->is_out_of_memory || one->pointer == NULL || (is_long && one->detail == NULL);
}

static bool is_long_numbers(const json_t *array) {
    return json_array_size(array) > NUMBERS && json_is_number(json_array_get(array, 0));
}

static void walk_values(ImportContext *context, const char *pointer, const json_t *a,
                        const json_t *b);

static void walk_objects(ImportContext *context, const char *pointer, const json_t *a,
                         const json_t *b) {
    const char *name;
    json_t *value;
    char place[POINTER];
    json_object_foreach((json_t *)a, name, value) {
        json_pointer_join(place, sizeof place, pointer, name);
        walk_values(context, place, value, json_object_get(b, name));
    }
    json_object_foreach((json_t *)b, name, value) {
        json_pointer_join(place, sizeof place, pointer, name);
        if (json_object_get(a, name) == NULL)
            walk_values(context, place, NULL, value);
    }
}

// Equal numbers may be written as 1 and as 1.0.
static bool is_equal(const json_t *a, const json_t *b) {
    return json_is_number(a) && json_is_number(b) ? json_number_value(a) == json_number_value(b)
                                                  : json_equal(a, b) != 0;
}

static void walk_values(ImportContext *context, const char *pointer, const json_t *a,
                        const json_t *b) {
    char place[POINTER];
    if (a == NULL || b == NULL || json_typeof(a) != json_typeof(b)) {
        if (a == NULL || b == NULL || !is_equal(a, b))
            add(context, pointer, a, b);
    } else if (json_is_object(a)) {
        walk_objects(context, pointer, a, b);
    } else if (json_is_array(a) && !is_long_numbers(a) && !is_long_numbers(b)) {
        for (size_t i = 0; i < json_array_size(a) || i < json_array_size(b); i++) {
            json_pointer_index(place, sizeof place, pointer, i);
            walk_values(context, place, json_array_get(a, i), json_array_get(b, i));
        }
    } else if (!is_equal(a, b)) {
        add(context, pointer, a, b);
    }
}

Status json_diff(const char *a, const char *b, const char *besides, Differences *differences,
                 Problem *problem) {
    ImportContext context = {.differences = differences};
    *differences = (Differences){0};
    json_t *trees[2] = {json_loads(a, JSON_REJECT_DUPLICATES, NULL),
                        json_loads(b, JSON_REJECT_DUPLICATES, NULL)};
    const bool are_read = trees[0] != NULL && trees[1] != NULL;
    for (int i = 0; i < 2 && are_read && besides != NULL; i++)
        (void)json_object_del(trees[i], besides);
    if (are_read)
        walk_values(&context, "", trees[0], trees[1]);
    json_decref(trees[0]);
    json_decref(trees[1]);
    if (context.is_out_of_memory)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the differences");
    return are_read ? STATUS_OK
                    : problem_set(problem, STATUS_INTERNAL, "a stored scene cannot be read");
}

void differences_clear(Differences *differences) {
    for (size_t i = 0; i < differences->count; i++) {
        free(differences->at[i].pointer);
        free(differences->at[i].a);
        free(differences->at[i].b);
        free(differences->at[i].detail);
    }
    free(differences->at);
    *differences = (Differences){0};
}

void differences_write(Bytes *bytes, const Differences *differences) {
    bytes_text(bytes, "[");
    for (size_t i = 0; i < differences->count; i++) {
        const Difference *one = &differences->at[i];
        bytes_text(bytes, i > 0 ? ", {\"pointer\": " : "{\"pointer\": ");
        bytes_json_string(bytes, one->pointer);
        bytes_format(bytes,
                     ", \"a\": %s, \"b\": %s, \"detail\": ", one->a != NULL ? one->a : "null",
                     one->b != NULL ? one->b : "null");
        bytes_json_string(bytes, one->detail);
        bytes_text(bytes, "}");
    }
    bytes_text(bytes, "]");
}
