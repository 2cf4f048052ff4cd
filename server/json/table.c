// An answer may come from anywhere: rows, blocks, depth and the size of a cell have limits.
#include "server/json/table.h"

#include <jansson.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/parse.h"
#include "server/util/bytes.h"

enum { WIDTH_MAX = 40, ROWS_MAX = 2000, BLOCKS_MAX = 200, VALUES_SHOWN = 24, DEPTH_MAX = 6 };
enum { CELL_BYTES = 1 << 16, OBJECT_BYTES = 160, HEADING_SIZE = 256 };

void text_make_printable(char *text) {
    for (unsigned char *c = (unsigned char *)text; c != NULL && *c != '\0'; c++)
        if (*c < ' ' || *c == 0x7f || (c[0] == 0xC2 && c[1] >= 0x80 && c[1] < 0xA0)) {
            if (*c == 0xC2)
                *c++ = '?'; // both bytes of a C1 control
            *c = '?';
        }
}

// Takes `text`; NULL: no memory.
static void print_table_take(PrintTable *table, char *text) {
    char **cells = text != NULL ? realloc(table->cells, (table->count + 1) * sizeof *cells) : NULL;
    if (cells == NULL) {
        free(text);
        table->is_failed = true;
        return;
    }
    text_make_printable(text);
    table->cells = cells;
    table->cells[table->count++] = text;
}

void print_table_add(PrintTable *table, const char *format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int size = vsnprintf(NULL, 0, format, arguments);
    char *text = size >= 0 ? malloc((size_t)size + 1) : NULL;
    if (text != NULL)
        (void)vsnprintf(text, (size_t)size + 1, format, again);
    va_end(again);
    va_end(arguments);
    print_table_take(table, text);
}

void print_table_number(PrintTable *table, const char *format, double value) {
    char text[64];
    snprintf(text, sizeof text, format, value);
    print_table_take(table, strdup(isnan(value) ? "-" : text));
}

void print_table_clear(PrintTable *table) {
    for (size_t i = 0; i < table->count; i++)
        free(table->cells[i]);
    free(table->cells);
    *table = (PrintTable){.columns = table->columns};
}

// Characters of UTF-8, as a terminal counts most of them.
static int text_width(const char *text) {
    int width = 0;
    for (; *text != '\0'; text++)
        width += ((unsigned char)*text & 0xC0) != 0x80;
    return width;
}

static const char *print_table_cell(const PrintTable *table, size_t index) {
    const bool is_unknown =
        table->cells[index][0] == '\0' && table->has_heads && index >= table->columns;
    return is_unknown ? "-" : table->cells[index];
}

// Whether a column has heads and, below, nothing but numbers.
static bool print_table_is_numeric(const PrintTable *table, size_t column) {
    bool is_numeric = table->has_heads;
    for (size_t i = table->columns + column; i < table->count && is_numeric; i += table->columns) {
        const char *cell = print_table_cell(table, i);
        char *end;
        (void)strtod(cell, &end);
        is_numeric = *end == '\0' || strcmp(cell, "-") == 0;
    }
    return is_numeric;
}

void print_table_print(PrintTable *table, FILE *file) {
    int widths[LISTING_COLUMNS] = {0};
    bool is_numeric[LISTING_COLUMNS];
    const size_t columns = table->columns;
    for (size_t k = 0; k < columns; k++) {
        is_numeric[k] = print_table_is_numeric(table, k);
        for (size_t i = k; i < table->count; i += columns) {
            // A wider cell shifts its own row alone.
            const int width = text_width(print_table_cell(table, i));
            widths[k] = width > widths[k] && width <= WIDTH_MAX ? width : widths[k];
        }
    }
    for (size_t i = 0; i < table->count; i++) {
        const char *cell = print_table_cell(table, i);
        const size_t k = i % columns;
        const int pad = widths[k] > text_width(cell) ? widths[k] - text_width(cell) : 0;
        const bool is_last = k + 1 == columns || i + 1 == table->count;
        fprintf(file, "%*s%s%*s%s", is_numeric[k] ? pad : 0, "", cell,
                is_numeric[k] || is_last ? 0 : pad, "", is_last ? "\n" : "  ");
    }
    if (table->is_failed)
        fputs("... no memory for the rest\n", file);
    print_table_clear(table);
}

typedef struct Printer {
    const PrintTableView *view;
    FILE *file;
    size_t blocks, longest;
    char heading[HEADING_SIZE]; // of the last block
} Printer;

static bool printer_skips(const Printer *printer, const char *name) {
    for (const char *const *one = printer->view->skipped; one != NULL && *one != NULL; one++)
        if (strcmp(*one, name) == 0)
            return true;
    return false;
}

// The unit of the row of that name, also among parts of others.
static const char *unit_find(const Field *fields, const char *name, int depth) {
    const char *unit = NULL;
    for (const Field *row = fields; row->kind != FIELD_KIND_END && unit == NULL; row++) {
        if (strcmp(row->name, name) == 0)
            unit = row->unit;
        if (unit == NULL && row->fields != NULL && depth < DEPTH_MAX)
            unit = unit_find(row->fields, name, depth + 1);
    }
    return unit;
}

static const char *printer_unit(const Printer *printer, const char *name) {
    const char *unit = NULL;
    for (const Field *const *one = printer->view->fields; one != NULL && *one != NULL; one++)
        unit = unit != NULL ? unit : unit_find(*one, name, 0);
    return unit;
}

// Prints the table, unless it is empty, under its heading, unless that was just printed or the
// table is the document's first.
static void printer_table(Printer *printer, PrintTable *table, const char *heading) {
    char text[HEADING_SIZE];
    if (table->count == 0 || printer->blocks > BLOCKS_MAX)
        return;
    text_fit(text, sizeof text, heading);
    text_make_printable(text);
    if (printer->blocks++ == BLOCKS_MAX) {
        fputs("\n... and more; --json has all\n", printer->file);
        return;
    }
    if (printer->blocks > 1)
        fputc('\n', printer->file);
    if (printer->blocks > 1 && text[0] != '\0' && strcmp(text, printer->heading) != 0)
        fprintf(printer->file, "%s\n", text);
    text_fit(printer->heading, sizeof printer->heading, text);
    const size_t rows = table->count / table->columns - (table->has_heads ? 1 : 0);
    printer->longest = rows > printer->longest ? rows : printer->longest;
    print_table_print(table, printer->file);
}

// A scalar, or a list of them: what fits into a cell.
static bool value_is_plain(const json_t *value) {
    return !json_is_object(value) &&
           !(json_is_array(value) && json_is_object(json_array_get(value, 0)));
}

static bool value_is_empty(const json_t *value) {
    return value == NULL || json_is_null(value) ||
           (json_is_array(value) && json_array_size(value) == 0) ||
           (json_is_string(value) && json_string_length(value) == 0);
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
            const json_t *item = json_array_get(value, i);
            bytes_text(cell, i > 0 ? ", " : "");
            value_put(cell, json_is_array(item) ? json_null() : item);
        }
    } else if (json_is_object(value)) {
        char *text = json_dumps(value, JSON_COMPACT | JSON_REAL_PRECISION(6)), fitted[OBJECT_BYTES];
        text_fit(fitted, sizeof fitted, text != NULL ? text : "");
        bytes_text(cell, fitted);
        free(text);
    }
}

static void value_add(PrintTable *table, const json_t *value, const char *unit) {
    Bytes cell = {.most = CELL_BYTES};
    value_put(&cell, value);
    if (unit != NULL && (json_is_number(value) || json_is_array(value)))
        bytes_format(&cell, " %s", unit);
    print_table_add(table, "%s", cell.is_failed ? "..." : cell.at != NULL ? cell.at : "");
    bytes_clear(&cell);
}

static void head_add(const Printer *printer, PrintTable *table, const char *name) {
    const char *unit = printer_unit(printer, name);
    print_table_add(table, "%s%s%s%s", name, unit != NULL ? " [" : "", unit != NULL ? unit : "",
                    unit != NULL ? "]" : "");
}

static void heading_join(char target[HEADING_SIZE], const char *heading, const char *name) {
    snprintf(target, HEADING_SIZE, "%.120s%s%.120s", heading, heading[0] != '\0' ? " " : "", name);
}

// The plain values of an object: a name and a value a row.
static void values_print(Printer *printer, json_t *object, const char *heading) {
    const char *name;
    json_t *value;
    PrintTable table = {.columns = 2};
    json_object_foreach(object, name, value) {
        if (!value_is_plain(value) || value_is_empty(value) || printer_skips(printer, name))
            continue;
        print_table_add(&table, "%s", name);
        value_add(&table, value, printer_unit(printer, name));
    }
    printer_table(printer, &table, heading);
}

// Whether any object of a list has a value there that is worth a cell; "no" everywhere is not.
static bool list_has(const json_t *list, const char *name) {
    for (size_t i = 0; i < json_array_size(list) && i < ROWS_MAX; i++) {
        const json_t *value = json_object_get(json_array_get(list, i), name);
        if (!value_is_empty(value) && value_is_plain(value) && !json_is_false(value))
            return true;
    }
    return false;
}

static const PrintTableColumns *list_find(const Printer *printer, const char *name) {
    for (const PrintTableColumns *one = printer->view->lists; one != NULL && one->list != NULL;
         one++)
        if (strcmp(one->list, name) == 0)
            return one;
    return NULL;
}

// The members of the list's objects, in the order in which they appear.
static size_t list_members(const Printer *printer, const json_t *list, const char **columns) {
    size_t count = 0;
    for (size_t i = 0; i < json_array_size(list) && i < ROWS_MAX; i++) {
        const char *name;
        json_t *value;
        json_object_foreach(json_array_get(list, i), name, value) {
            bool is_there = printer_skips(printer, name);
            for (size_t k = 0; k < count && !is_there; k++)
                is_there = strcmp(columns[k], name) == 0;
            if (!is_there && count < LISTING_COLUMNS && list_has(list, name))
                columns[count++] = name;
        }
    }
    return count;
}

static void list_print(Printer *printer, const json_t *list, const PrintTableColumns *wanted,
                       const char *heading) {
    const char *columns[LISTING_COLUMNS];
    size_t count = 0;
    for (size_t i = 0; wanted != NULL && wanted->columns[i] != NULL; i++)
        if (list_has(list, wanted->columns[i]))
            columns[count++] = wanted->columns[i];
    if (wanted == NULL)
        count = list_members(printer, list, columns);
    PrintTable table = {.columns = count, .has_heads = true};
    for (size_t k = 0; k < count; k++)
        head_add(printer, &table, columns[k]);
    for (size_t i = 0; i < json_array_size(list) && i < ROWS_MAX; i++)
        for (size_t k = 0; k < count; k++)
            value_add(&table, json_object_get(json_array_get(list, i), columns[k]), NULL);
    printer_table(printer, &table, heading);
    if (count > 0 && json_array_size(list) > ROWS_MAX)
        fprintf(printer->file, "... and %zu more; --json has all\n",
                json_array_size(list) - ROWS_MAX);
}

// Neighbouring objects with the same members.
typedef struct MaterialGroup {
    const char *names[LISTING_COLUMNS - 1];
    json_t *objects[LISTING_COLUMNS - 1];
    size_t count;
} MaterialGroup;

static bool group_takes(const MaterialGroup *group, const json_t *object) {
    const char *name;
    json_t *value;
    if (group->count == COUNT(group->names) ||
        json_object_size(group->objects[0]) != json_object_size(object))
        return false;
    json_object_foreach(group->objects[0], name, value) {
        if (json_object_get(object, name) == NULL)
            return false;
    }
    return true;
}

static bool group_has(const MaterialGroup *group, const char *name) {
    for (size_t k = 0; k < group->count; k++) {
        const json_t *value = json_object_get(group->objects[k], name);
        if (value_is_plain(value) && !value_is_empty(value))
            return true;
    }
    return false;
}

// A column for each object, a row for each member.
static void group_table(Printer *printer, const MaterialGroup *group, const char *heading) {
    const char *name;
    json_t *value;
    PrintTable table = {.columns = group->count + 1, .has_heads = true};
    print_table_add(&table, "%s", "");
    for (size_t k = 0; k < group->count; k++)
        head_add(printer, &table, group->names[k]);
    json_object_foreach(group->objects[0], name, value) {
        if (!group_has(group, name) || printer_skips(printer, name))
            continue;
        print_table_add(&table, "%s", name);
        for (size_t k = 0; k < group->count; k++)
            value_add(&table, json_object_get(group->objects[k], name),
                      printer_unit(printer, name));
    }
    printer_table(printer, &table, heading);
}

static void parts_print(Printer *printer, json_t *object, const char *heading, int depth);

static void group_print(Printer *printer, MaterialGroup *group, const char *heading, int depth) {
    if (group->count > 1)
        group_table(printer, group, heading);
    for (size_t k = 0; k < group->count; k++) {
        char inner[HEADING_SIZE];
        heading_join(inner, heading, group->names[k]);
        if (group->count == 1)
            values_print(printer, group->objects[k], inner);
        parts_print(printer, group->objects[k], inner, depth + 1);
    }
    group->count = 0;
}

// A list whose objects have parts is shown object by object, any other as a table.
static void objects_print(Printer *printer, const json_t *list, const char *name,
                          const char *heading, int depth) {
    const char *key;
    json_t *value;
    const PrintTableColumns *wanted = list_find(printer, name);
    bool has_parts = false;
    json_object_foreach(json_array_get(list, 0), key, value) has_parts =
        has_parts || (json_is_object(value) && !printer_skips(printer, key));
    if (!has_parts || wanted != NULL) {
        list_print(printer, list, wanted, heading);
        return;
    }
    for (size_t i = 0; i < json_array_size(list); i++) {
        char number[24], inner[HEADING_SIZE];
        snprintf(number, sizeof number, "%zu", i + 1);
        heading_join(inner, heading, number);
        values_print(printer, json_array_get(list, i), inner);
        parts_print(printer, json_array_get(list, i), inner, depth + 1);
    }
}

// The objects and lists of objects in an object.
static void parts_print(Printer *printer, json_t *object, const char *heading, int depth) {
    const char *name;
    json_t *value;
    MaterialGroup group = {.count = 0};
    if (depth > DEPTH_MAX)
        return;
    json_object_foreach(object, name, value) {
        char inner[HEADING_SIZE];
        if (value_is_plain(value) || printer_skips(printer, name))
            continue;
        if (group.count > 0 && !(json_is_object(value) && group_takes(&group, value)))
            group_print(printer, &group, heading, depth);
        if (json_is_object(value)) {
            group.names[group.count] = name;
            group.objects[group.count++] = value;
        } else {
            heading_join(inner, heading, name);
            objects_print(printer, value, name, inner, depth);
        }
    }
    group_print(printer, &group, heading, depth);
}

Status print_table_print_json(const char *text, size_t size, const PrintTableView *view, FILE *file,
                              size_t *longest, Problem *problem) {
    Printer printer = {.view = view, .file = file};
    json_t *root = json_parse_tree(text, size);
    const bool is_object = root != NULL;
    if (is_object) {
        values_print(&printer, root, "");
        parts_print(&printer, root, "", 0);
    }
    json_decref(root);
    *longest = printer.longest;
    return is_object ? STATUS_OK
                     : problem_set(problem, STATUS_UNREACHABLE,
                                   "the answer is no document: what answers there is no impactd");
}
