#include "server/codec/pairs.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/base/bytes.h"
#include "server/codec/scan.h"

static const Field pair_fields[] = {
    FIELD_TEXT(Pair, name, 0, PRESENCE_OPTIONAL, 0, "name"),
    FIELD_TEXT(Pair, a, 0, PRESENCE_OPTIONAL, 0, "of the first"),
    FIELD_TEXT(Pair, b, 0, PRESENCE_OPTIONAL, 0, "of the second"),
    FIELD_TEXT(Pair, rest, 0, PRESENCE_OPTIONAL, 0, "what else is told"),
    FIELD_END,
};

void pairs_clear(Pairs *pairs) {
    for (size_t i = 0; i < pairs->count; i++)
        fields_clear(pair_fields, &pairs->at[i]);
    free(pairs->at);
    *pairs = (Pairs){0};
}

// A scalar as people read it, a container as JSON; cut to fit.
static void value_put(char target[PAIRS_TEXT], const json_t *value) {
    if (json_is_string(value)) {
        text_fit(target, PAIRS_TEXT, json_string_value(value));
    } else if (json_is_number(value)) {
        snprintf(target, PAIRS_TEXT, "%.9g", json_number_value(value));
    } else {
        char *text = json_dumps(value, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(9));
        text_fit(target, PAIRS_TEXT, json_is_null(value) ? "-" : text != NULL ? text : "?");
        free(text);
    }
}

static bool pair_add(Pairs *pairs, const char *name, const char *a, const char *b,
                     const char *rest) {
    Pair *at = realloc(pairs->at, (pairs->count + 1) * sizeof *at);
    if (at == NULL)
        return false;
    pairs->at = at;
    Pair *pair = &at[pairs->count++];
    *pair = (Pair){strdup(name), strdup(a), b != NULL ? strdup(b) : NULL, strdup(rest)};
    return pair->name != NULL && pair->a != NULL && (b == NULL) == (pair->b == NULL) &&
           pair->rest != NULL;
}

// All scalars of a row but those that are in it already.
static void rest_put(Bytes *rest, const json_t *object, const char *named) {
    const char *key;
    json_t *value;
    char text[PAIRS_TEXT];
    json_object_foreach((json_t *)(uintptr_t)object, key, value) {
        if (strcmp(key, "a") == 0 || strcmp(key, "b") == 0 || strcmp(key, named) == 0 ||
            json_is_object(value) || json_is_array(value) || json_is_null(value))
            continue;
        value_put(text, value);
        bytes_format(rest, "%s%.60s %s", rest->count > 0 ? ", " : "", key, text);
    }
}

static bool walk(const json_t *value, const char *place, const char *key, Pairs *pairs);

static bool row_add(const json_t *object, const char *name, const char *named, Pairs *pairs) {
    char a[PAIRS_TEXT], b[PAIRS_TEXT];
    Bytes rest = {.most = 1000};
    value_put(a, json_object_get(object, "a"));
    value_put(b, json_object_get(object, "b"));
    rest_put(&rest, object, named);
    const bool is_added = pair_add(pairs, name, a, b, rest.at != NULL ? rest.at : "");
    bytes_clear(&rest);
    return is_added;
}

static bool object_walk(const json_t *object, const char *place, const char *key, Pairs *pairs) {
    const json_t *a = json_object_get(object, "a"), *b = json_object_get(object, "b");
    const char *name, *named = json_object_get(object, "pointer") != NULL ? "pointer" : "name";
    const char *own = json_string_value(json_object_get(object, named));
    json_t *value;
    // Beside a name both sides may be anything; without one, two objects are two things with parts.
    if (a != NULL && b != NULL && (own != NULL || (!json_is_object(a) && !json_is_object(b))))
        return row_add(object, own != NULL ? own : key, named, pairs);
    char inner[256];
    json_object_foreach((json_t *)(uintptr_t)object, name, value) {
        if (strcmp(name, "links") == 0)
            continue;
        json_pointer_join(inner, sizeof inner, place, name);
        if (!walk(value, inner, name, pairs))
            return false;
    }
    return true;
}

// One of a list: a row, or a line with all that it says.
static bool element_walk(const json_t *element, const char *place, Pairs *pairs) {
    if (json_is_string(element) || json_object_get(element, "a") != NULL)
        return walk(element, place, place + 1, pairs);
    // Numbers by the thousand are for programs.
    if (!json_is_object(element) || pairs->count >= PAIRS_MAX)
        return true;
    Bytes rest = {.most = 1000};
    rest_put(&rest, element, "");
    const bool is_added = rest.at == NULL || pair_add(pairs, place + 1, rest.at, NULL, "");
    bytes_clear(&rest);
    return is_added;
}

static bool walk(const json_t *value, const char *place, const char *key, Pairs *pairs) {
    char text[PAIRS_TEXT], inner[256];
    if (pairs->count >= PAIRS_MAX)
        return true;
    if (json_is_object(value))
        return object_walk(value, place, key, pairs);
    if (!json_is_array(value)) {
        value_put(text, value);
        return pair_add(pairs, place + 1, text, NULL, "");
    }
    for (size_t i = 0; i < json_array_size(value); i++) {
        json_pointer_index(inner, sizeof inner, place, i);
        if (!element_walk(json_array_get(value, i), inner, pairs))
            return false;
    }
    return true;
}

// Cleared by json_decref.
static Status document_read(const char *text, size_t size, json_t **root, Problem *problem) {
    size_t position;
    const char *sentence;
    *root = size > 0 && scan_allows(text, size, &position, &sentence)
                ? json_loadb(text, size, JSON_REJECT_DUPLICATES, NULL)
                : NULL;
    return json_is_object(*root)
               ? STATUS_OK
               : problem_set(problem, STATUS_UNREADABLE, "the document is no JSON object");
}

Status pairs_read(const char *text, size_t size, Pairs *pairs, Problem *problem) {
    json_t *root;
    *pairs = (Pairs){0};
    Status status = document_read(text, size, &root, problem);
    if (status == STATUS_OK && !walk(root, "", "", pairs))
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory");
    json_decref(root);
    return status;
}

static void cell_put(char cell[LISTING_CELL], const json_t *value) {
    char text[PAIRS_TEXT] = "-";
    if (json_is_number(value))
        snprintf(text, sizeof text, "%.4g", json_number_value(value));
    else if (value != NULL)
        value_put(text, value);
    text_fit(cell, LISTING_CELL, text);
}

Status listing_read(const char *text, size_t size, const char *list, const char *const *members,
                    Listing *listing, Problem *problem) {
    json_t *root;
    *listing = (Listing){0};
    while (members[listing->columns] != NULL)
        listing->columns++;
    Status status = document_read(text, size, &root, problem);
    const json_t *rows = json_object_get(root, list);
    const size_t most = PAIRS_MAX,
                 count = json_array_size(rows) < most ? json_array_size(rows) : most;
    if (status == STATUS_OK && count > 0) {
        listing->cells = calloc(count * listing->columns, sizeof *listing->cells);
        if (listing->cells == NULL)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory");
        else
            listing->rows = count;
    }
    for (size_t i = 0; i < listing->rows * listing->columns; i++)
        cell_put(listing->cells[i], json_object_get(json_array_get(rows, i / listing->columns),
                                                    members[i % listing->columns]));
    json_decref(root);
    return status;
}

void listing_clear(Listing *listing) {
    free(listing->cells);
    *listing = (Listing){0};
}
