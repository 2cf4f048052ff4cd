// An object's own values come first, as one block, then what is in it, each under its name.
#include "server/codec/outline.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/bytes.h"
#include "server/codec/scan.h"

enum { VALUES_SHOWN = 24, DEPTH = 6 };

typedef struct Walk {
    const OutlineWay *way;
    Outline *outline;
    bool is_failed; // no memory
} Walk;

void outline_clear(Outline *outline) {
    for (size_t i = 0; i < outline->count; i++) {
        OutlineBlock *block = &outline->at[i];
        for (size_t k = 0; k < block->rows * block->columns; k++)
            free(block->cells[k]);
        free(block->cells);
        free(block->heading);
    }
    free(outline->at);
    *outline = (Outline){0};
}

static bool is_besides(const Walk *walk, const char *name) {
    for (const char *const *one = walk->way->besides; one != NULL && *one != NULL; one++)
        if (strcmp(*one, name) == 0)
            return true;
    return false;
}

static const char *unit_of(const Walk *walk, const char *name) {
    for (const Field *const *one = walk->way->fields; one != NULL && *one != NULL; one++) {
        const Field *row = fields_find(*one, name, NULL);
        if (row != NULL && row->unit != NULL)
            return row->unit;
    }
    return NULL;
}

// Whether the value stands in a cell: a scalar, or a list of them.
static bool is_plain(const json_t *value) {
    return !json_is_object(value) &&
           !(json_is_array(value) && json_is_object(json_array_get(value, 0)));
}

static bool says_something(const json_t *value) {
    return value != NULL && !json_is_null(value) &&
           !(json_is_array(value) && json_array_size(value) == 0) &&
           !(json_is_string(value) && json_string_length(value) == 0);
}

static void value_put(Bytes *cell, const json_t *value) {
    if (json_is_string(value)) {
        bytes_text(cell, json_string_value(value));
    } else if (json_is_integer(value)) {
        bytes_format(cell, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
    } else if (json_is_real(value)) {
        bytes_format(cell, "%.6g", json_real_value(value));
    } else if (json_is_boolean(value)) {
        bytes_text(cell, json_is_true(value) ? "yes" : "no");
    } else if (json_is_array(value) && json_array_size(value) > VALUES_SHOWN) {
        bytes_format(cell, "%zu values", json_array_size(value));
    } else if (json_is_array(value)) {
        for (size_t i = 0; i < json_array_size(value); i++) {
            bytes_text(cell, i > 0 ? ", " : "");
            value_put(cell, json_is_array(json_array_get(value, i)) ? json_null()
                                                                    : json_array_get(value, i));
        }
    }
}

static char *cell_of(const json_t *value, const char *unit) {
    Bytes cell = {.most = 1 << 16};
    value_put(&cell, value);
    if (unit != NULL && (json_is_number(value) || json_is_array(value)))
        bytes_format(&cell, " %s", unit);
    char *text = bytes_take(&cell, NULL);
    return text != NULL ? text : strdup("...");
}

// With room for `cells` of them; NULL without memory or beyond the limit.
static OutlineBlock *block_add(Walk *walk, const char *heading, size_t rows, size_t columns) {
    Outline *outline = walk->outline;
    if (outline->count == OUTLINE_BLOCKS)
        return NULL;
    OutlineBlock *at = realloc(outline->at, (outline->count + 1) * sizeof *at);
    if (at != NULL)
        outline->at = at;
    OutlineBlock block = {.heading = strdup(heading),
                          .cells = calloc(rows * columns + 1, sizeof *block.cells)};
    if (at == NULL || block.heading == NULL || block.cells == NULL) {
        free(block.heading);
        free(block.cells);
        walk->is_failed = true;
        return NULL;
    }
    block.rows = rows;
    block.columns = columns;
    outline->at[outline->count] = block;
    return &outline->at[outline->count++];
}

static void cell_set(Walk *walk, OutlineBlock *block, size_t cell, char *text) {
    block->cells[cell] = text;
    walk->is_failed = walk->is_failed || text == NULL;
}

static void pairs_add(Walk *walk, const json_t *object, const char *heading) {
    const char *name;
    json_t *value;
    size_t count = 0, row = 0;
    json_object_foreach((json_t *)(uintptr_t)object, name, value) count +=
        is_plain(value) && says_something(value) && !is_besides(walk, name);
    OutlineBlock *block = count > 0 ? block_add(walk, heading, count, 2) : NULL;
    if (block == NULL)
        return;
    json_object_foreach((json_t *)(uintptr_t)object, name, value) {
        if (!is_plain(value) || !says_something(value) || is_besides(walk, name))
            continue;
        cell_set(walk, block, 2 * row, strdup(name));
        cell_set(walk, block, 2 * row + 1, cell_of(value, unit_of(walk, name)));
        row++;
    }
}

static const OutlineTable *table_find(const Walk *walk, const char *list) {
    for (const OutlineTable *one = walk->way->tables; one != NULL && one->list != NULL; one++)
        if (strcmp(one->list, list) == 0)
            return one;
    return NULL;
}

// All plain members of the list's objects that say something anywhere, by first appearance.
static size_t columns_find(const Walk *walk, const json_t *list, const char **columns) {
    size_t count = 0;
    for (size_t i = 0; i < json_array_size(list) && i < OUTLINE_ROWS; i++) {
        const char *name;
        json_t *value;
        json_object_foreach(json_array_get(list, i), name, value) {
            bool is_known = !is_plain(value) || !says_something(value) || is_besides(walk, name);
            for (size_t k = 0; k < count && !is_known; k++)
                is_known = strcmp(columns[k], name) == 0;
            if (!is_known && count < OUTLINE_COLUMNS)
                columns[count++] = name;
        }
    }
    return count;
}

static void table_add(Walk *walk, const json_t *list, const char *heading, const char *name) {
    const OutlineTable *table = table_find(walk, name);
    const char *columns[OUTLINE_COLUMNS];
    size_t count = 0;
    while (table != NULL && count < OUTLINE_COLUMNS && table->columns[count] != NULL) {
        columns[count] = table->columns[count];
        count++;
    }
    if (table == NULL)
        count = columns_find(walk, list, columns);
    const size_t all = json_array_size(list), rows = all < OUTLINE_ROWS ? all : OUTLINE_ROWS;
    OutlineBlock *block = count > 0 ? block_add(walk, heading, rows + 1, count) : NULL;
    if (block == NULL)
        return;
    block->has_heads = true;
    block->more = all - rows;
    for (size_t k = 0; k < count; k++) {
        const char *unit = unit_of(walk, columns[k]);
        Bytes head = {0};
        bytes_text(&head, columns[k]);
        if (unit != NULL)
            bytes_format(&head, " [%s]", unit);
        cell_set(walk, block, k, bytes_take(&head, NULL));
        for (size_t i = 0; i < rows; i++)
            cell_set(walk, block, (i + 1) * count + k,
                     cell_of(json_object_get(json_array_get(list, i), columns[k]), NULL));
    }
}

static void object_add(Walk *walk, const json_t *object, const char *heading, int depth) {
    const char *name;
    json_t *value;
    pairs_add(walk, object, heading);
    json_object_foreach((json_t *)(uintptr_t)object, name, value) {
        char inner[256], joined[400];
        if (is_plain(value) || is_besides(walk, name) || depth == DEPTH)
            continue;
        snprintf(joined, sizeof joined, "%s%s%.100s", heading, heading[0] != '\0' ? " " : "", name);
        text_fit(inner, sizeof inner, joined);
        if (json_is_object(value))
            object_add(walk, value, inner, depth + 1);
        else
            table_add(walk, value, inner, name);
    }
}

Status outline_read(const char *text, size_t size, const OutlineWay *way, Outline *outline,
                    Problem *problem) {
    size_t position;
    const char *sentence;
    *outline = (Outline){0};
    Walk walk = {.way = way, .outline = outline};
    json_t *root = size > 0 && scan_allows(text, size, &position, &sentence)
                       ? json_loadb(text, size, JSON_REJECT_DUPLICATES, NULL)
                       : NULL;
    if (!json_is_object(root)) {
        json_decref(root);
        return problem_set(problem, STATUS_UNREADABLE, "the document is no JSON object");
    }
    object_add(&walk, root, "", 0);
    json_decref(root);
    return walk.is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory") : STATUS_OK;
}
