#include "server/codec/amend.h"

#include <jansson.h>
#include <stdlib.h>

#include "server/codec/scan.h"

// NULL where it is no object. Ended by json_decref.
static json_t *object_read(const Bytes *text) {
    size_t position;
    const char *sentence;
    if (text->count == 0)
        return NULL;
    const size_t mark = scan_mark(text->at, text->count);
    const char *json = text->at + mark;
    const size_t size = text->count - mark;
    json_t *root = scan_allows(json, size, &position, &sentence)
                       ? json_loadb(json, size, JSON_REJECT_DUPLICATES, NULL)
                       : NULL;
    if (json_is_object(root))
        return root;
    json_decref(root);
    return NULL;
}

// What is put in may be as long as what it is put into.
static json_t *value_read(const Bytes *value, Problem *problem) {
    json_t *read =
        value->count > 0 ? json_loadb(value->at, value->count, JSON_DECODE_ANY, NULL) : NULL;
    if (read == NULL)
        (void)problem_set(problem, STATUS_INVALID, "must be UTF-8 text");
    return read;
}

static Status object_write(Bytes *text, json_t *root, bool is_changed, Problem *problem) {
    char *changed = is_changed ? json_dumps(root, JSON_COMPACT) : NULL;
    json_decref(root);
    if (changed == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    bytes_clear(text);
    text->most = 0;
    bytes_text(text, changed);
    free(changed);
    return text->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory") : STATUS_OK;
}

Status amend_set(Bytes *text, const char *name, const Bytes *value, Problem *problem) {
    json_t *root = object_read(text);
    if (root == NULL)
        return STATUS_OK;
    json_t *given = value_read(value, problem);
    if (given == NULL) {
        json_decref(root);
        return STATUS_INVALID;
    }
    return object_write(text, root, json_object_set_new(root, name, given) == 0, problem);
}

Status amend_append(Bytes *text, const char *list, const Bytes *value, Problem *problem) {
    json_t *root = object_read(text);
    json_t *items = json_object_get(root, list);
    if (root == NULL || (items != NULL && !json_is_array(items))) {
        json_decref(root);
        return STATUS_OK;
    }
    json_t *given = value_read(value, problem);
    if (given == NULL) {
        json_decref(root);
        return STATUS_INVALID;
    }
    bool is_there = items != NULL;
    if (!is_there) {
        items = json_array();
        is_there = json_object_set_new(root, list, items) == 0;
    }
    if (!is_there) {
        json_decref(given);
        return object_write(text, root, false, problem);
    }
    return object_write(text, root, json_array_append_new(items, given) == 0, problem);
}

static void nulls_drop(json_t *value) {
    const char *name;
    json_t *inner;
    void *next;
    size_t i;
    json_object_foreach_safe(value, next, name, inner) {
        if (json_is_null(inner))
            (void)json_object_del(value, name);
        else
            nulls_drop(inner);
    }
    json_array_foreach(value, i, inner) nulls_drop(inner);
}

Status amend_known(Bytes *text, Problem *problem) {
    json_t *root = object_read(text);
    if (root == NULL)
        return STATUS_OK;
    nulls_drop(root);
    return object_write(text, root, true, problem);
}

Status amend_take(const Bytes *text, const char *name, Bytes *part, Problem *problem) {
    json_t *root = object_read(text);
    const json_t *found = json_object_get(root, name);
    char *taken = json_is_object(found) ? json_dumps(found, JSON_COMPACT) : NULL;
    json_decref(root);
    if (taken == NULL)
        return problem_set(problem, STATUS_NOT_FOUND, "the answer has no \"%s\"", name);
    bytes_text(part, taken);
    free(taken);
    return part->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory") : STATUS_OK;
}
