// Impacts may be many: they are parsed one by one, so that no tree of them all is built.
#include "server/json/stored_columns.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/stored_report.h"

static Status refuse(const char *what, Problem *problem) {
    return problem_set(problem, STATUS_INTERNAL, "the stored %s cannot be read", what);
}

// One column; null is not a finite number.
static bool read_column(const json_t *holder, const char *name, Columns *columns, size_t index) {
    const char *unit = json_string_value(json_object_get(holder, "unit"));
    const json_t *values = json_object_get(holder, "values");
    if (unit == NULL || json_array_size(values) != columns->rows)
        return false;
    columns_name(columns, index, name, unit);
    for (size_t i = 0; i < columns->rows; i++) {
        const json_t *value = json_array_get(values, i);
        if (!json_is_number(value) && !json_is_null(value))
            return false;
        columns->at[index].values[i] = json_is_null(value) ? (double)NAN : json_number_value(value);
    }
    return true;
}

static Status read_spectra(const json_t *root, Columns *columns, Problem *problem) {
    static const char first[] = "frequency";
    json_t *densities = json_object_get(root, "channels"), *density;
    const json_t *frequency = json_object_get(root, first);
    const size_t count = json_object_size(densities),
                 rows = json_array_size(json_object_get(frequency, "values"));
    if (count == 0 || rows == 0)
        return refuse("spectra", problem);
    TRY(columns_allocate(columns, 1 + count, rows, 0, problem));
    bool is_read = read_column(frequency, first, columns, 0);
    size_t i = 1;
    const char *name;
    json_object_foreach(densities, name, density) {
        is_read = is_read && read_column(density, name, columns, i++);
    }
    return is_read ? STATUS_OK : refuse("spectra", problem);
}

Status stored_spectra(const char *text, Columns *columns, Problem *problem) {
    *columns = (Columns){.count = 0};
    json_t *root = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    const Status status = read_spectra(root, columns, problem);
    json_decref(root);
    if (status != STATUS_OK)
        columns_clear(columns);
    return status;
}

// How many objects there are from here on; none of an impact's texts holds a brace.
static size_t count_objects(const char *text) {
    size_t count = 0;
    for (; (text = strchr(text, '{')) != NULL; text++)
        count++;
    return count;
}

static const char list[] = "\"impacts\": [";

Status stored_impacts(const char *text, Impacts *impacts, Problem *problem) {
    *impacts = (Impacts){NULL, 0};
    const char *at = strstr(text, list);
    if (at == NULL)
        return refuse("impacts", problem);
    const size_t count = count_objects(at);
    impacts->at = calloc(count + 1, sizeof *impacts->at);
    Status status = impacts->at != NULL
                        ? STATUS_OK
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for the impacts");
    while (status == STATUS_OK && impacts->count < count) {
        at = strchr(at, '{');
        const char *end = strchr(at, '}');
        status = end == NULL ? refuse("impacts", problem)
                             : stored_report_read(at, (size_t)(end - at) + 1, impact_fields,
                                                  &impacts->at[impacts->count++], problem);
        at = end;
    }
    if (status != STATUS_OK) {
        free(impacts->at);
        *impacts = (Impacts){NULL, 0};
    }
    return status;
}

// A number of the impact that begins at `row`; what is null is not yet there.
static double impact_time(const char *row, const char *name) {
    const char *at = strstr(row, name);
    if (at == NULL)
        return (double)INFINITY;
    at += strlen(name);
    char *end;
    const double value = strtod(at, &end);
    return end > at ? value : (double)INFINITY;
}

// Only the two times of a row are read, and none behind the window: 200,000 rows are 60 MB of text.
Status stored_impacts_window(const char *text, const ImpactWindow *window, bool is_numbered,
                             Bytes *bytes, Problem *problem) {
    const char *at = strstr(text, list);
    if (at == NULL)
        return refuse("impacts", problem);
    at += sizeof list - 1;
    bytes_put(bytes, text, (size_t)(at - text));
    size_t number = 0, matching = 0, written = 0;
    for (const char *row = strchr(at, '{'), *end; row != NULL; row = strchr(end, '{')) {
        end = strchr(row, '}');
        if (end == NULL)
            return refuse("impacts", problem);
        number++;
        if (impact_time(row, "\"start\": ") > window->to)
            break; // they stand in the order of their starts
        if (impact_time(row, "\"end\": ") < window->from)
            continue;
        matching++;
        if (number < window->first || written == window->limit)
            continue;
        bytes_text(bytes, written++ > 0 ? ", {" : "{");
        if (is_numbered)
            bytes_format(bytes, "\"number\": %zu, ", number);
        bytes_put(bytes, row + 1, (size_t)(end - row));
    }
    bytes_text(bytes, "]");
    if (is_numbered)
        bytes_format(bytes, ", \"matching\": %zu", matching);
    bytes_text(bytes, "}");
    return STATUS_OK;
}
