// An object's own values come first, as one block, then what is in it, each under its name; objects
// in it that are alike stand side by side.
#include "server/codec/outline.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/bytes.h"
#include "server/codec/scan.h"

enum { VALUES_SHOWN = 24, SENTENCE = 32, DEPTH = 6 };

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

// Of a row of that name, also among the parts of others.
static const char *unit_in(const Field *fields, const char *name, int depth) {
    const char *unit = NULL;
    for (const Field *row = fields; row->kind != FIELD_KIND_END && unit == NULL; row++) {
        if (strcmp(row->name, name) == 0)
            unit = row->unit;
        if (unit == NULL && row->fields != NULL && depth < DEPTH)
            unit = unit_in(row->fields, name, depth + 1);
    }
    return unit;
}

static const char *unit_of(const Walk *walk, const char *name) {
    const char *unit = NULL;
    for (const Field *const *one = walk->way->fields; one != NULL && *one != NULL && unit == NULL;
         one++)
        unit = unit_in(*one, name, 0);
    return unit;
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
    outline->is_cut = outline->count == OUTLINE_BLOCKS;
    if (outline->is_cut)
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

static char *head_of(const Walk *walk, const char *name) {
    const char *unit = unit_of(walk, name);
    Bytes head = {0};
    bytes_text(&head, name);
    if (unit != NULL)
        bytes_format(&head, " [%s]", unit);
    return bytes_take(&head, NULL);
}

static const OutlineTable *table_find(const Walk *walk, const char *list) {
    for (const OutlineTable *one = walk->way->tables; one != NULL && one->list != NULL; one++)
        if (strcmp(one->list, list) == 0)
            return one;
    return NULL;
}

// Whether a column has more than what is unknown, and "no" all the way down.
static bool is_worth_a_column(const json_t *list, const char *name) {
    for (size_t i = 0; i < json_array_size(list) && i < OUTLINE_ROWS; i++) {
        const json_t *value = json_object_get(json_array_get(list, i), name);
        if (says_something(value) && is_plain(value) && !json_is_false(value))
            return true;
    }
    return false;
}

// The members of the list's objects, by first appearance.
static size_t columns_find(const Walk *walk, const json_t *list, const char **columns) {
    size_t count = 0;
    for (size_t i = 0; i < json_array_size(list) && i < OUTLINE_ROWS; i++) {
        const char *name;
        json_t *value;
        json_object_foreach(json_array_get(list, i), name, value) {
            bool is_known = is_besides(walk, name);
            for (size_t k = 0; k < count && !is_known; k++)
                is_known = strcmp(columns[k], name) == 0;
            if (!is_known && count < OUTLINE_COLUMNS && is_worth_a_column(list, name))
                columns[count++] = name;
        }
    }
    return count;
}

static void table_add(Walk *walk, const json_t *list, const char *heading, const char *name) {
    const OutlineTable *table = table_find(walk, name);
    const char *columns[OUTLINE_COLUMNS];
    size_t count = 0;
    for (size_t i = 0; table != NULL && table->columns[i] != NULL; i++)
        if (is_worth_a_column(list, table->columns[i]))
            columns[count++] = table->columns[i];
    if (table == NULL)
        count = columns_find(walk, list, columns);
    const size_t all = json_array_size(list), rows = all < OUTLINE_ROWS ? all : OUTLINE_ROWS;
    OutlineBlock *block = count > 0 ? block_add(walk, heading, rows + 1, count) : NULL;
    if (block == NULL)
        return;
    block->has_heads = true;
    block->more = all - rows;
    for (size_t k = 0; k < count; k++) {
        cell_set(walk, block, k, head_of(walk, columns[k]));
        for (size_t i = 0; i < rows; i++)
            cell_set(walk, block, (i + 1) * count + k,
                     cell_of(json_object_get(json_array_get(list, i), columns[k]), NULL));
    }
}

static const char *heading_join(char target[256], const char *heading, const char *name) {
    char joined[400];
    snprintf(joined, sizeof joined, "%s%s%.100s", heading, heading[0] != '\0' ? " " : "", name);
    text_fit(target, 256, joined);
    return target;
}

static bool has_same_names(const json_t *a, const json_t *b) {
    const char *name;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)a, name, value) {
        if (json_object_get(b, name) == NULL)
            return false;
    }
    return json_object_size(a) == json_object_size(b);
}

// Two objects or more that have the same names stand side by side; sentences among their values
// would not, and follow as lines.
typedef struct Alike {
    const char *names[OUTLINE_COLUMNS - 1];
    const json_t *objects[OUTLINE_COLUMNS - 1];
    size_t count;
} Alike;

static bool is_beside(const Walk *walk, const Alike *alike, const char *name) {
    bool says = false;
    for (size_t k = 0; k < alike->count; k++) {
        const json_t *value = json_object_get(alike->objects[k], name);
        if (!is_plain(value) || (json_is_string(value) && json_string_length(value) > SENTENCE))
            return false;
        says = says || says_something(value);
    }
    return says && !is_besides(walk, name);
}

static void alike_table(Walk *walk, const Alike *alike, const char *heading) {
    const char *name;
    json_t *value;
    const size_t columns = alike->count + 1;
    size_t rows = 0, row = 0;
    json_object_foreach((json_t *)(uintptr_t)alike->objects[0], name, value) rows +=
        is_beside(walk, alike, name);
    OutlineBlock *block = rows > 0 ? block_add(walk, heading, rows + 1, columns) : NULL;
    if (block == NULL)
        return;
    block->has_heads = true;
    cell_set(walk, block, 0, strdup(" "));
    for (size_t k = 0; k < alike->count; k++)
        cell_set(walk, block, k + 1, head_of(walk, alike->names[k]));
    json_object_foreach((json_t *)(uintptr_t)alike->objects[0], name, value) {
        if (!is_beside(walk, alike, name))
            continue;
        row++;
        cell_set(walk, block, row * columns, strdup(name));
        for (size_t k = 0; k < alike->count; k++)
            cell_set(walk, block, row * columns + k + 1,
                     cell_of(json_object_get(alike->objects[k], name), unit_of(walk, name)));
    }
}

static bool is_sentence(const Walk *walk, const Alike *alike, const char *name,
                        const json_t *value) {
    return is_plain(value) && says_something(value) && !is_besides(walk, name) &&
           !is_beside(walk, alike, name);
}

static void alike_sentences(Walk *walk, const Alike *alike, const char *heading) {
    const char *name;
    json_t *value;
    size_t count = 0, row = 0;
    for (size_t k = 0; k < alike->count; k++)
        json_object_foreach((json_t *)(uintptr_t)alike->objects[k], name, value) count +=
            is_sentence(walk, alike, name, value);
    OutlineBlock *block = count > 0 ? block_add(walk, heading, count, 2) : NULL;
    for (size_t k = 0; k < alike->count && block != NULL; k++)
        json_object_foreach((json_t *)(uintptr_t)alike->objects[k], name, value) {
            char inner[256];
            if (!is_sentence(walk, alike, name, value))
                continue;
            cell_set(walk, block, 2 * row, strdup(heading_join(inner, alike->names[k], name)));
            cell_set(walk, block, 2 * row + 1, cell_of(value, unit_of(walk, name)));
            row++;
        }
}

static void object_add(Walk *walk, const json_t *object, const char *heading, int depth);

static void insides_add(Walk *walk, const json_t *object, const char *heading, int depth);

static void alike_add(Walk *walk, const Alike *alike, const char *heading, int depth) {
    char inner[256];
    if (alike->count == 1) {
        object_add(walk, alike->objects[0], heading_join(inner, heading, alike->names[0]), depth);
        return;
    }
    alike_table(walk, alike, heading);
    alike_sentences(walk, alike, heading);
    for (size_t k = 0; k < alike->count; k++)
        insides_add(walk, alike->objects[k], heading_join(inner, heading, alike->names[k]), depth);
}

// A list whose items have parts is shown item by item.
static void list_add(Walk *walk, const json_t *list, const char *heading, const char *name,
                     int depth) {
    const char *key;
    json_t *value;
    bool has_parts = false;
    json_object_foreach(json_array_get(list, 0), key, value) has_parts =
        has_parts || (json_is_object(value) && !is_besides(walk, key));
    if (!has_parts || table_find(walk, name) != NULL) {
        table_add(walk, list, heading, name);
        return;
    }
    for (size_t i = 0; i < json_array_size(list); i++) {
        char number[24], inner[256];
        snprintf(number, sizeof number, "%zu", i + 1);
        object_add(walk, json_array_get(list, i), heading_join(inner, heading, number), depth);
    }
}

// The objects and lists in an object.
static void insides_add(Walk *walk, const json_t *object, const char *heading, int depth) {
    const char *name;
    json_t *value;
    Alike alike = {0};
    if (depth == DEPTH)
        return;
    json_object_foreach((json_t *)(uintptr_t)object, name, value) {
        char inner[256];
        const bool is_shown = !is_plain(value) && !is_besides(walk, name);
        const bool goes_on = is_shown && json_is_object(value) && alike.count > 0 &&
                             alike.count < COUNT(alike.names) &&
                             has_same_names(alike.objects[0], value);
        if (alike.count > 0 && is_shown && !goes_on) {
            alike_add(walk, &alike, heading, depth + 1);
            alike.count = 0;
        }
        if (is_shown && json_is_object(value)) {
            alike.names[alike.count] = name;
            alike.objects[alike.count++] = value;
        } else if (is_shown) {
            list_add(walk, value, heading_join(inner, heading, name), name, depth + 1);
        }
    }
    if (alike.count > 0)
        alike_add(walk, &alike, heading, depth + 1);
}

static void object_add(Walk *walk, const json_t *object, const char *heading, int depth) {
    pairs_add(walk, object, heading);
    insides_add(walk, object, heading, depth);
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
