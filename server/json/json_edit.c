#include "server/json/json_edit.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/parse.h"

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

Status json_edit_label(Bytes *text, const char *label, Problem *problem) {
    const char *equals = strchr(label, '=');
    if (equals == NULL || equals == label)
        return problem_add(problem, STATUS_USAGE, "--label", "must be KEY=VALUE, is %.100s", label);
    TRY(json_edit_check_utf8("label", label, problem));
    json_t *root = json_parse_tree(text->at, text->count),
           *labels = json_object_get(root, "labels");
    if (root == NULL || (labels != NULL && !json_is_object(labels) && !json_is_array(labels))) {
        json_decref(root);
        return STATUS_OK;
    }
    bool is_set = true;
    if (labels == NULL) {
        labels = json_object();
        is_set = json_object_set_new(root, "labels", labels) == 0;
    }
    if (is_set && json_is_array(labels)) {
        is_set = json_array_append_new(labels, json_string(label)) == 0;
    } else if (is_set) {
        char *key = strndup(label, (size_t)(equals - label));
        is_set = key != NULL && json_object_set_new(labels, key, json_string(equals + 1)) == 0;
        free(key);
    }
    return json_edit_write(text, root, is_set, problem);
}

Status json_edit_append(Bytes *text, const char *list, const Bytes *value, Problem *problem) {
    json_t *root = json_parse_tree(text->at, text->count), *items = json_object_get(root, list);
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
    bool is_there = items != NULL;
    if (!is_there) {
        items = json_array();
        is_there = json_object_set_new(root, list, items) == 0;
    }
    if (!is_there)
        json_decref(item);
    return json_edit_write(text, root, is_there && json_array_append_new(items, item) == 0,
                           problem);
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

Status json_edit_remove_nulls(Bytes *text, Problem *problem) {
    json_t *root = json_parse_tree(text->at, text->count);
    if (root == NULL)
        return STATUS_OK;
    nulls_remove(root);
    return json_edit_write(text, root, true, problem);
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
