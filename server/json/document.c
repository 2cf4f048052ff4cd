#include "server/json/document.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/json/parse.h"
#include "server/json/table.h"

// --- differences: a walk over both trees at once, at most JSON_DEPTH_MAX deep ---

enum { POINTER_SIZE = 256, NUMBERS = 16 };

typedef struct Diff {
    const DiffFormat *format;
    Bytes *bytes;
    size_t count;
} Diff;

static void value_put(Bytes *bytes, const json_t *value) {
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
            value_put(bytes, inner);
            separator = ", ";
        }
        bytes_text(bytes, "}");
        break;
    case JSON_ARRAY:
        bytes_text(bytes, "[");
        json_array_foreach(value, i, inner) {
            bytes_text(bytes, separator);
            value_put(bytes, inner);
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

// Writes one of the values; returns whether it is too long for that.
static bool diff_put_value(Diff *diff, const char *name, const json_t *value) {
    Bytes text = {.most = DIFF_VALUE_MAX};
    if (value != NULL)
        value_put(&text, value);
    if (text.count > 0 || diff->format->is_full)
        bytes_format(diff->bytes, ", \"%s\": ", name);
    if (text.count > 0)
        bytes_put(diff->bytes, text.at, text.count);
    else if (diff->format->is_full)
        bytes_text(diff->bytes, "null");
    const bool is_long = text.is_over;
    diff->bytes->is_failed = diff->bytes->is_failed || (text.is_failed && !is_long);
    bytes_clear(&text);
    return is_long;
}

static void diff_put_detail(Bytes *bytes, const json_t *a, const json_t *b, bool is_long) {
    if (!is_long) {
        bytes_text(bytes, ", \"detail\": null");
        return;
    }
    if (!json_is_array(a) || !json_is_array(b)) {
        bytes_text(bytes, ", \"detail\": \"too long to be shown\"");
        return;
    }
    const size_t count_a = json_array_size(a), count_b = json_array_size(b);
    size_t first = 0;
    while (first < count_a && first < count_b &&
           json_equal(json_array_get(a, first), json_array_get(b, first)))
        first++;
    bytes_format(bytes, ", \"detail\": \"%zu and %zu items, the first that differs is number %zu\"",
                 count_a, count_b, first + 1);
}

static void diff_add(Diff *diff, const char *pointer, const json_t *a, const json_t *b) {
    if (++diff->count > DIFF_MAX)
        return;
    bytes_text(diff->bytes, diff->count > 1 ? ", {\"pointer\": " : "{\"pointer\": ");
    bytes_json_string(diff->bytes, pointer);
    const bool is_long_a = diff_put_value(diff, diff->format->a, a);
    const bool is_long_b = diff_put_value(diff, diff->format->b, b);
    if (diff->format->is_full)
        diff_put_detail(diff->bytes, a, b, is_long_a || is_long_b);
    bytes_text(diff->bytes, "}");
}

static bool is_long_numbers(const json_t *array) {
    return json_array_size(array) > NUMBERS && json_is_number(json_array_get(array, 0));
}

// Equal numbers may be written as 1 and as 1.0.
static bool is_equal(const json_t *a, const json_t *b) {
    if (a == NULL || b == NULL)
        return false;
    return json_is_number(a) && json_is_number(b) ? json_number_value(a) == json_number_value(b)
                                                  : json_equal(a, b) != 0;
}

static void diff_walk(Diff *diff, const char *pointer, const json_t *a, const json_t *b) {
    const char *name;
    json_t *value;
    char place[POINTER_SIZE];
    if (json_is_object(a) && json_is_object(b)) {
        json_object_foreach((json_t *)a, name, value) {
            json_pointer_join(place, sizeof place, pointer, name);
            diff_walk(diff, place, value, json_object_get(b, name));
        }
        json_object_foreach((json_t *)b, name, value) {
            json_pointer_join(place, sizeof place, pointer, name);
            if (json_object_get(a, name) == NULL)
                diff_add(diff, place, NULL, value);
        }
    } else if (json_is_array(a) && json_is_array(b) && !is_long_numbers(a) && !is_long_numbers(b)) {
        for (size_t i = 0; i < json_array_size(a) || i < json_array_size(b); i++) {
            json_pointer_index(place, sizeof place, pointer, i);
            diff_walk(diff, place, json_array_get(a, i), json_array_get(b, i));
        }
    } else if (!is_equal(a, b)) {
        diff_add(diff, pointer, a, b);
    }
}

Status json_diff(const char *a, const char *b, const char *ignored, const DiffFormat *format,
                 Bytes *bytes, size_t *count, Problem *problem) {
    Diff diff = {.format = format, .bytes = bytes};
    json_t *trees[2];
    bool is_out_of_memory = false;
    trees[0] = json_parse_stored(a, &is_out_of_memory);
    trees[1] = json_parse_stored(b, &is_out_of_memory);
    const bool are_read = trees[0] != NULL && trees[1] != NULL;
    if (are_read) {
        for (int i = 0; i < 2 && ignored != NULL; i++)
            (void)json_object_del(trees[i], ignored);
        bytes_text(bytes, "[");
        diff_walk(&diff, "", trees[0], trees[1]);
        bytes_text(bytes, "]");
    }
    json_decref(trees[0]);
    json_decref(trees[1]);
    *count = diff.count;
    if (is_out_of_memory)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to compare two scenes");
    return are_read ? STATUS_OK
                    : problem_set(problem, STATUS_INTERNAL, "a stored scene cannot be read");
}

// --- edits ---

// Replaces the text by `root`, which is released; `is_changed` false: no memory.
static Status json_edit_write(Bytes *text, json_t *root, bool is_changed, Problem *problem) {
    char *changed = is_changed ? json_dumps(root, JSON_COMPACT) : NULL;
    json_decref(root);
    bool is_written = changed != NULL;
    if (is_written) {
        bytes_clear(text);
        text->most = 0; // the new text may be longer
        bytes_text(text, changed);
        is_written = !text->is_failed;
    }
    free(changed);
    return is_written ? STATUS_OK : problem_set(problem, STATUS_NO_MEMORY, "no memory");
}

static Status json_edit_check_utf8(const char *name, const char *value, Problem *problem) {
    char option[80];
    snprintf(option, sizeof option, "--%.70s", name);
    return text_is_utf8(value) ? STATUS_OK
                               : problem_add(problem, STATUS_USAGE, option, "must be UTF-8 text");
}

Status json_edit_set(Bytes *text, const char *name, const char *value, Problem *problem) {
    TRY(json_edit_check_utf8(name, value, problem));
    json_t *root = json_parse_tree(text->at, text->count);
    if (root == NULL)
        return STATUS_OK;
    const bool is_set = json_object_set_new(root, name, json_string(value)) == 0;
    return json_edit_write(text, root, is_set, problem);
}

// The member `name` of `root`, which becomes `empty` where it is missing. Takes `empty`.
static json_t *json_edit_member(json_t *root, const char *name, json_t *empty) {
    if (root != NULL && json_object_get(root, name) == NULL)
        (void)json_object_set(root, name, empty);
    json_decref(empty);
    return json_object_get(root, name);
}

Status json_edit_label(Bytes *text, const char *label, Problem *problem) {
    const char *equals = strchr(label, '=');
    if (equals == NULL || equals == label)
        return problem_add(problem, STATUS_USAGE, "--label", "must be KEY=VALUE, is %.100s", label);
    TRY(json_edit_check_utf8("label", label, problem));
    json_t *root = json_parse_tree(text->at, text->count);
    json_t *labels = json_edit_member(root, "labels", json_object());
    bool is_set = false;
    if (json_is_array(labels)) {
        is_set = json_array_append_new(labels, json_string(label)) == 0;
    } else if (json_is_object(labels)) {
        char *key = strndup(label, (size_t)(equals - label));
        is_set = key != NULL && json_object_set_new(labels, key, json_string(equals + 1)) == 0;
        free(key);
    } else if (root == NULL || labels != NULL) {
        json_decref(root);
        return STATUS_OK;
    }
    return json_edit_write(text, root, is_set, problem);
}

// The member of an object or list.
static json_t *json_edit_get(json_t *around, const char *name) {
    return json_is_array(around) ? json_array_get(around, strtoul(name, NULL, 10))
                                 : json_object_get(around, name);
}

Status json_edit_put(Bytes *text, const char *pointer, const Bytes *value, const char *place,
                     Problem *problem) {
    json_t *root = json_parse_tree(text->at, text->count), *around = root;
    json_t *item =
        value != NULL ? json_loadb(value->at, value->count, JSON_DECODE_ANY, NULL) : json_null();
    char name[POINTER_SIZE], is[64] = "";
    for (;; around = json_edit_get(around, name)) {
        const size_t size = strcspn(++pointer, "/");
        snprintf(name, sizeof name, "%.*s", (int)size, pointer);
        pointer += size;
        if (*pointer == '\0' || (!json_is_object(around) && !json_is_array(around)))
            break;
        if (json_is_object(around) && json_object_get(around, name) == NULL)
            (void)json_object_set_new(around, name, json_object());
    }
    Status status = STATUS_OK;
    bool is_set = false;
    if (item == NULL)
        status = problem_add(problem, STATUS_USAGE, place, "must be JSON, is %.*s",
                             (int)(value->count < 100 ? value->count : 100), value->at);
    else if (json_is_array(around))
        is_set = json_array_set(around, strtoul(name, NULL, 10), item) == 0;
    else if (json_is_object(around) && value == NULL)
        is_set = json_object_get(around, name) == NULL || json_object_del(around, name) == 0;
    else if (json_is_object(around))
        is_set = json_object_set(around, name, item) == 0;
    else if (root != NULL) {
        text_quote(is, sizeof is, json_is_string(around) ? json_string_value(around) : "...");
        status = problem_add(problem, STATUS_USAGE, place,
                             "cannot be set: the scene has %s in place of the object around it; "
                             "set that as JSON",
                             is);
    }
    json_decref(item);
    if (root != NULL && status == STATUS_OK)
        return json_edit_write(text, root, is_set, problem);
    json_decref(root);
    return status;
}

Status json_edit_append(Bytes *text, const char *list, const Bytes *value, Problem *problem) {
    json_t *root = json_parse_tree(text->at, text->count);
    json_t *items = json_edit_member(root, list, json_array());
    if (root == NULL || (items != NULL && !json_is_array(items))) {
        json_decref(root);
        return STATUS_OK;
    }
    json_t *item =
        value->count > 0 ? json_loadb(value->at, value->count, JSON_DECODE_ANY, NULL) : NULL;
    if (item == NULL) {
        json_decref(root);
        return problem_set(problem, STATUS_INVALID, "must be UTF-8 text");
    }
    return json_edit_write(text, root, json_array_append_new(items, item) == 0, problem);
}

Status json_edit_extend(Bytes *text, const Bytes *more, Problem *problem) {
    json_t *root = json_parse_tree(text->at, text->count), *list, *added;
    json_t *other = json_parse_tree(more->at, more->count);
    const char *name;
    bool is_changed = json_is_object(root) && json_is_object(other);
    json_object_foreach(root, name, list) {
        added = json_object_get(other, name);
        if (json_is_array(list) && json_is_array(added))
            is_changed = is_changed && json_array_extend(list, added) == 0;
    }
    json_decref(other);
    if (!json_is_object(root)) {
        json_decref(root);
        return problem_set(problem, STATUS_INVALID, "a page of the list is not an object");
    }
    return json_edit_write(text, root, is_changed, problem);
}

static void nulls_remove(json_t *value) {
    const char *name;
    json_t *inner;
    void *next;
    size_t i;
    json_object_foreach_safe(value, next, name, inner) {
        if (json_is_null(inner))
            (void)json_object_del(value, name);
        else
            nulls_remove(inner);
    }
    json_array_foreach(value, i, inner) nulls_remove(inner);
}

bool json_edit_pick(const Bytes *text, const Field *fields, Bytes *picked) {
    json_t *root = json_parse_tree(text->at, text->count);
    const char *separator = "{\n  ";
    nulls_remove(root);
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        const json_t *value = json_object_get(root, row->name);
        if (value == NULL || (json_is_array(value) && json_array_size(value) == 0))
            continue;
        bytes_format(picked, "%s\"%s\": ", separator, row->name);
        value_put(picked, value);
        separator = ",\n  ";
    }
    json_decref(root);
    bytes_text(picked, picked->count > 0 ? "\n}\n" : "");
    return picked->count > 0;
}

Status json_edit_extract(const Bytes *text, const char *name, Bytes *part, Problem *problem) {
    json_t *root = json_parse_tree(text->at, text->count);
    const json_t *found = json_object_get(root, name);
    char *taken = json_is_object(found) ? json_dumps(found, JSON_COMPACT) : NULL;
    json_decref(root);
    if (taken == NULL)
        return problem_set(problem, STATUS_NOT_FOUND, "the answer has no \"%s\"", name);
    bytes_text(part, taken);
    free(taken);
    return part->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory") : STATUS_OK;
}

// --- reading ---

JsonDocument *json_open(const Bytes *text) {
    return json_parse_tree(text->at, text->count);
}

void json_close(JsonDocument *document) {
    json_decref(document);
}

const char *json_get_text(const JsonDocument *of, const char *name) {
    const char *text = json_string_value(json_object_get(of, name));
    text_make_printable((char *)text); // the document's own memory
    return text;
}

double json_get_number(const JsonDocument *of, const char *name) {
    const json_t *value = json_object_get(of, name);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

bool json_get_flag(const JsonDocument *of, const char *name) {
    return json_is_true(json_object_get(of, name));
}

const JsonDocument *json_get_object(const JsonDocument *of, const char *name) {
    return json_object_get(of, name);
}

bool json_has_list(const JsonDocument *of, const char *name) {
    const json_t *list = json_object_get(of, name);
    bool is_list = json_is_array(list);
    for (size_t i = 0; i < json_array_size(list); i++)
        is_list = is_list && json_is_object(json_array_get(list, i));
    return is_list;
}

const JsonDocument *json_get_item(const JsonDocument *of, const char *name, size_t i) {
    return json_array_get(json_object_get(of, name), i);
}
