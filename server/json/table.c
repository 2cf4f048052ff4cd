// A document comes from a server that is not trusted: rows, blocks, depth and the size of a cell
// have limits.
#include "server/json/table.h"

#include <jansson.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/parse.h"

enum { WIDTH_MAX = 40, ROWS_MAX = 2000, BLOCKS_MAX = 200, VALUES_SHOWN = 24, DEPTH_MAX = 6 };
enum { CELL_BYTES = 1 << 16, OBJECT_BYTES = 160, HEADING_SIZE = 256 };
enum { CELL_SHOWN = 4096, NARROW_MIN = 12 };

void text_make_printable(char *text) {
    for (unsigned char *c = (unsigned char *)text; c != NULL && *c != '\0'; c++)
        if (*c < ' ' || *c == 0x7f || (c[0] == 0xC2 && c[1] >= 0x80 && c[1] < 0xA0)) {
            if (*c == 0xC2)
                *c++ = '?'; // both bytes of a C1 control
            *c = '?';
        } else if (c[0] == 0xE2 && ((c[1] == 0x80 && ((c[2] >= 0x8B && c[2] <= 0x8F) ||
                                                      (c[2] >= 0xA8 && c[2] <= 0xAE))) ||
                                    (c[1] == 0x81 && c[2] >= 0xA6 && c[2] <= 0xA9))) {
            memset(c, '?', 3); // invisible, or changes the direction of the text
            c += 2;
        }
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
    text_make_printable(text);
    char **cells = text != NULL ? realloc(table->cells, (table->count + 1) * sizeof *cells) : NULL;
    if (cells == NULL) {
        free(text);
        table->is_failed = true;
        return;
    }
    table->cells = cells;
    table->cells[table->count++] = text;
}

void print_table_clear(PrintTable *table) {
    for (size_t i = 0; i < table->count; i++)
        free(table->cells[i]);
    free(table->cells);
    *table = (PrintTable){.columns = table->columns};
}

const char *print_table_cell(const PrintTable *table, size_t index) {
    const bool is_unknown =
        table->cells[index][0] == '\0' && table->has_heads && index >= table->columns;
    return is_unknown ? "-" : table->cells[index];
}

bool print_table_is_numeric(const PrintTable *table, size_t column) {
    bool is_numeric = table->has_heads;
    for (size_t i = table->columns + column; i < table->count && is_numeric; i += table->columns) {
        const char *cell = print_table_cell(table, i);
        char *end;
        (void)strtod(cell, &end);
        is_numeric = *end == '\0' || strcmp(cell, "-") == 0;
    }
    return is_numeric;
}

// Makes columns narrower, the widest texts first, until they fit; returns how many of them do.
static size_t print_table_narrow(const PrintTable *table, size_t max, size_t *widths) {
    size_t columns = table->columns;
    while (max > 0 && columns > 1) {
        size_t total = 2 * (columns - 1), widest = 0, width = NARROW_MIN;
        for (size_t k = 0; k < columns; k++) {
            total += widths[k];
            if (widths[k] > width && !print_table_is_numeric(table, k)) {
                widest = k;
                width = widths[k];
            }
        }
        if (total <= max)
            break;
        if (width > NARROW_MIN)
            widths[widest] -= total - max < width - NARROW_MIN ? total - max : width - NARROW_MIN;
        else
            columns--;
    }
    return columns;
}

void print_table_print(const PrintTable *table, const PrintTableForm *form, FILE *file) {
    size_t widths[LISTING_COLUMNS] = {0};
    bool is_numeric[LISTING_COLUMNS];
    const size_t all = table->columns, heads = table->has_heads ? all : 0;
    const size_t shown = form->rows > 0 && table->count > heads + form->rows * all
                             ? heads + form->rows * all
                             : table->count;
    for (size_t k = 0; k < all; k++) {
        is_numeric[k] = print_table_is_numeric(table, k);
        for (size_t i = k; i < shown; i += all) {
            // Without a limit a wider cell shifts its own row alone.
            const size_t width = text_width(print_table_cell(table, i));
            if (width > widths[k] && (width <= WIDTH_MAX || form->width > 0))
                widths[k] = width;
        }
    }
    const size_t columns = print_table_narrow(table, form->width, widths);
    for (size_t i = 0; i < shown; i++) {
        char cell[CELL_SHOWN];
        const size_t k = i % all;
        if (k >= columns)
            continue;
        const size_t room = form->width > 0 && widths[k] + 1 < sizeof cell ? widths[k] : 0;
        const char *whole = print_table_cell(table, i);
        if (room > 0 && *whole == '/' && strlen(whole) > room) // the end of a pointer says more
            snprintf(cell, sizeof cell, "...%s", whole + strlen(whole) - (room - 3));
        else
            text_fit(cell, room > 0 ? room + 1 : sizeof cell, whole);
        const size_t width = text_width(cell), pad = widths[k] > width ? widths[k] - width : 0;
        const bool is_last = k + 1 == columns || i + 1 == table->count;
        fprintf(file, "%s%*s%s%*s%s%s", form->has_colour && i < heads ? "\033[2m" : "",
                is_numeric[k] ? (int)pad : 0, "", cell, is_numeric[k] || is_last ? 0 : (int)pad, "",
                form->has_colour && i < heads ? "\033[0m" : "", is_last ? "\n" : "  ");
    }
    if (table->is_failed)
        fputs("... no memory for the rest\n", file);
    else if (shown < table->count)
        fprintf(file, "... and %zu more rows\n", (table->count - shown) / all);
}

typedef struct Printer {
    const PrintTableView *view;
    const PrintTableForm *form;
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

// The unit of the row of that name, also among the members of others.
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

// Prints the table under its heading, which is left out if it is that of the table before.
static void printer_table(Printer *printer, PrintTable *table, const char *heading) {
    char text[HEADING_SIZE];
    if (table->count == 0 || printer->blocks >= BLOCKS_MAX) {
        if (table->count > 0 && printer->blocks++ == BLOCKS_MAX)
            fputs("\n... and more; --json has all\n", printer->file);
        print_table_clear(table);
        return;
    }
    text_fit(text, sizeof text, heading);
    text_make_printable(text);
    if (printer->blocks++ > 0) {
        fputc('\n', printer->file);
        if (text[0] != '\0' && strcmp(text, printer->heading) != 0)
            fprintf(printer->file, "%s\n", text);
    }
    text_fit(printer->heading, sizeof printer->heading, text);
    const size_t rows = table->count / table->columns - (table->has_heads ? 1 : 0);
    printer->longest = rows > printer->longest ? rows : printer->longest;
    print_table_print(table, printer->form, printer->file);
    print_table_clear(table);
}

// Whether a value fits into a cell: a scalar or a list of scalars.
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

static void name_add(const Printer *printer, PrintTable *table, const char *name) {
    const char *point = strchr(name, '.'), *last = point != NULL ? point + 1 : name;
    const char *unit = printer_unit(printer, last);
    print_table_add(table, "%s%s%s%s", last, unit != NULL ? " [" : "", unit != NULL ? unit : "",
                    unit != NULL ? "]" : "");
}

static void heading_join(char target[HEADING_SIZE], const char *heading, const char *name) {
    snprintf(target, HEADING_SIZE, "%.120s%s%.120s", heading, heading[0] != '\0' ? " " : "", name);
}

// The member of an object; "errors.psd" is that of a member.
static const json_t *member_get(const json_t *object, const char *name) {
    const json_t *value = json_object_get(object, name);
    const char *point = strchr(name, '.');
    if (value != NULL || point == NULL)
        return value;
    value = json_object_getn(object, name, (size_t)(point - name));
    return json_object_get(value, point + 1);
}

// Whether any object of a list has a value there that is worth a cell; "no" everywhere is not.
static bool list_has(const json_t *list, const char *name) {
    for (size_t i = 0; i < json_array_size(list) && i < ROWS_MAX; i++) {
        const json_t *value = member_get(json_array_get(list, i), name);
        if (!value_is_empty(value) && value_is_plain(value) && !json_is_false(value))
            return true;
    }
    return false;
}

// The columns that the view has for the list; NULL: all members of its objects.
static const char *const *list_columns(const Printer *printer, const char *name) {
    for (const PrintTableColumns *one = printer->view->lists; one != NULL && one->list != NULL;
         one++)
        if (strcmp(one->list, name) == 0)
            return one->columns;
    return NULL;
}

static void list_add_column(const json_t *list, const char *name,
                            const char *columns[LISTING_COLUMNS + 1]) {
    size_t count = 0;
    while (columns[count] != NULL && strcmp(columns[count], name) != 0)
        count++;
    if (columns[count] == NULL && count < LISTING_COLUMNS && list_has(list, name))
        columns[count] = name;
}

static void list_print(Printer *printer, const json_t *list, const char *const *wanted,
                       const char *heading) {
    const char *columns[LISTING_COLUMNS + 1] = {NULL};
    if (wanted != NULL) // the names of neighbouring objects
        list_add_column(list, "", columns);
    const size_t size = json_array_size(list), rows = size < ROWS_MAX ? size : ROWS_MAX;
    for (; wanted != NULL && *wanted != NULL; wanted++)
        list_add_column(list, *wanted, columns);
    for (size_t i = 0; wanted == NULL && i < rows; i++) {
        const char *name;
        json_t *value;
        json_object_foreach(json_array_get(list, i), name, value) {
            if (!printer_skips(printer, name))
                list_add_column(list, name, columns);
        }
    }
    PrintTable table = {.has_heads = true};
    while (columns[table.columns] != NULL)
        name_add(printer, &table, columns[table.columns++]);
    for (size_t i = 0; i < rows; i++)
        for (size_t k = 0; k < table.columns; k++)
            value_add(&table, member_get(json_array_get(list, i), columns[k]), NULL);
    const bool is_cut = table.columns > 0 && size > rows;
    printer_table(printer, &table, heading);
    if (is_cut)
        fprintf(printer->file, "... and %zu more; --json has all\n", size - rows);
}

static void object_print(Printer *printer, json_t *object, const char *heading, int depth);

// Objects as a table; those with parts one by one, under their names or numbers.
static void objects_print(Printer *printer, const json_t *list, const char *const *wanted,
                          const char *heading, int depth) {
    const char *name;
    json_t *value;
    bool has_parts = false;
    json_object_foreach(json_array_get(list, 0), name, value) has_parts =
        has_parts || (json_is_object(value) && !printer_skips(printer, name));
    if (!has_parts || wanted != NULL) {
        list_print(printer, list, wanted, heading);
        return;
    }
    for (size_t i = 0; i < json_array_size(list); i++) {
        char number[24], inner[HEADING_SIZE];
        const json_t *called = json_object_get(json_array_get(list, i), "");
        snprintf(number, sizeof number, "%zu", i + 1);
        heading_join(inner, heading, called != NULL ? json_string_value(called) : number);
        (void)json_object_del(json_array_get(list, i), "");
        object_print(printer, json_array_get(list, i), inner, depth + 1);
    }
}

static bool has_same_members(json_t *a, json_t *b) {
    const char *name;
    json_t *value;
    if (json_object_size(a) != json_object_size(b))
        return false;
    json_object_foreach(a, name, value) {
        if (json_object_get(b, name) == NULL)
            return false;
    }
    return true;
}

// Prints the objects from the member *at on that have the same members; more than one of them as a
// list whose first column is their name. *at moves behind them.
static void neighbours_print(Printer *printer, json_t *object, void **at, const char *heading,
                             int depth) {
    json_t *first = json_object_iter_value(*at), *list = json_array();
    char inner[HEADING_SIZE];
    heading_join(inner, heading, json_object_iter_key(*at));
    do {
        json_t *row = json_object();
        const char *name = json_object_iter_key(*at), *unit = printer_unit(printer, name);
        (void)json_object_set_new(
            row, "", unit != NULL ? json_sprintf("%s [%s]", name, unit) : json_string(name));
        (void)json_object_update(row, json_object_iter_value(*at));
        (void)json_array_append_new(list, row);
        *at = json_object_iter_next(object, *at);
    } while (*at != NULL && !printer_skips(printer, json_object_iter_key(*at)) &&
             json_is_object(json_object_iter_value(*at)) &&
             has_same_members(first, json_object_iter_value(*at)));
    if (json_array_size(list) > 1)
        objects_print(printer, list, list_columns(printer, heading), heading, depth);
    else
        object_print(printer, first, inner, depth + 1);
    json_decref(list);
}

// The plain values of an object, a name and a value a row; then its objects and lists of objects.
static void object_print(Printer *printer, json_t *object, const char *heading, int depth) {
    PrintTable table = {.columns = 2};
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        if (!value_is_plain(value) || value_is_empty(value) || printer_skips(printer, name))
            continue;
        print_table_add(&table, "%s", name);
        value_add(&table, value, printer_unit(printer, name));
    }
    printer_table(printer, &table, heading);
    for (void *at = json_object_iter(object); at != NULL && depth <= DEPTH_MAX;) {
        char inner[HEADING_SIZE];
        name = json_object_iter_key(at);
        value = json_object_iter_value(at);
        if (json_is_object(value) && !printer_skips(printer, name)) {
            neighbours_print(printer, object, &at, heading, depth);
            continue;
        }
        heading_join(inner, heading, name);
        if (!value_is_plain(value) && !printer_skips(printer, name))
            objects_print(printer, value, list_columns(printer, name), inner, depth);
        at = json_object_iter_next(object, at);
    }
}

Status print_table_print_json(const Bytes *json, const PrintTableView *view, PrintTableForm form,
                              FILE *file, size_t *longest, Problem *problem) {
    Printer printer = {.view = view, .form = &form, .file = file};
    if (json->is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the tables");
    json_t *root = json_parse_tree(json->at, json->count);
    if (root == NULL)
        return problem_set(problem, STATUS_UNREACHABLE,
                           "unexpected response; is the server really impactd?");
    object_print(&printer, root, "", 0);
    json_decref(root);
    if (longest != NULL)
        *longest = printer.longest;
    return STATUS_OK;
}
