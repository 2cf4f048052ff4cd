// Columns lie row by row in the table, so each is copied out before it is laid down.
#include "server/encode/sweep_npz.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/encode/npy.h"
#include "server/encode/sweep_columns.h"
#include "server/encode/zip.h"

enum { PIECE = 1 << 16 };

typedef struct Archive {
    const Sweep *sweep;
    size_t rows;
    Zip zip;
    Status status;
} Archive;

static void put(Archive *archive, const char *name, Layout *array) {
    char file[ZIP_NAME_MOST + 1];
    snprintf(file, sizeof file, "%.74s.npy", *name == '/' ? name + 1 : name);
    if (archive->status == STATUS_OK)
        archive->status = zip_put(&archive->zip, file, array, NULL);
    layout_clear(array);
}

static void put_numbers(Archive *archive, const char *name, const double *values) {
    Layout array = {0};
    npy_put_header(&array, archive->rows, 0);
    layout_values(&array, values, archive->rows);
    put(archive, name, &array);
}

// Texts of one width, filled up with zeros. `text_at` gives a row's, which has no quotes.
static void put_texts(Archive *archive, const char *name,
                      const char *(*text_at)(const Sweep *sweep, size_t column, size_t row,
                                             size_t *length),
                      size_t column) {
    Layout array = {0};
    Bytes texts = {0};
    char type[32];
    size_t most = 1, length;
    for (size_t row = 0; row < archive->rows; row++) {
        text_at(archive->sweep, column, row, &length);
        most = length > most ? length : most;
    }
    for (size_t row = 0; row < archive->rows; row++) {
        static const char zeros[256];
        const char *text = text_at(archive->sweep, column, row, &length);
        bytes_put(&texts, text, length);
        for (size_t left = most - length; left > 0;) {
            const size_t some = left < sizeof zeros ? left : sizeof zeros;
            bytes_put(&texts, zeros, some);
            left -= some;
        }
    }
    snprintf(type, sizeof type, "|S%zu", most);
    npy_put_header_of(&array, type, archive->rows, 0);
    layout_put(&array, texts.at, texts.count);
    if (texts.is_failed)
        archive->status = STATUS_NO_MEMORY;
    bytes_clear(&texts);
    put(archive, name, &array);
}

static const char *axis_text(const Sweep *sweep, size_t axis, size_t row, size_t *length) {
    const size_t point = (size_t)sweep->table.points.at[row];
    const char *json = sweep->axes.at[axis].values.at[sweep_value_index(sweep, axis, point)];
    const bool is_quoted = *json == '"';
    *length = strlen(json) - (is_quoted ? 2 : 0);
    return json + is_quoted;
}

static const char *status_text(const Sweep *sweep, size_t column, size_t row, size_t *length) {
    (void)column;
    const char *name = sweep_status_names[(size_t)sweep->table.statuses.at[row]];
    *length = strlen(name);
    return name;
}

// `column`: room for one column of each of all.
static void put_columns(Archive *archive, double *column) {
    const Sweep *sweep = archive->sweep;
    const size_t metrics = sweep->metrics.count;
    put_numbers(archive, "index", sweep->table.points.at);
    for (size_t i = 0; i < sweep->axes.count; i++) {
        const SweepTold *axis = &sweep->axes.at[i];
        if (!sweep_axis_is_numeric(axis)) {
            put_texts(archive, axis->pointer, axis_text, i);
            continue;
        }
        for (size_t row = 0; row < archive->rows; row++) {
            const size_t point = (size_t)sweep->table.points.at[row];
            column[row] = strtod(axis->values.at[sweep_value_index(sweep, i, point)], NULL);
        }
        put_numbers(archive, axis->pointer, column);
        column += archive->rows;
    }
    for (size_t i = 0; i < metrics; i++) {
        for (size_t row = 0; row < archive->rows; row++)
            column[row] = sweep->table.values.at[row * metrics + i];
        put_numbers(archive, sweep->metrics.at[i], column);
        column += archive->rows;
    }
    put_texts(archive, "status", status_text, 0);
}

static void copy(const Layout *layout, Bytes *bytes) {
    char *piece = malloc(PIECE);
    if (piece == NULL)
        bytes->is_failed = true;
    for (uint64_t at = 0; piece != NULL && at < layout->size;) {
        const size_t size = layout->size - at < PIECE ? (size_t)(layout->size - at) : PIECE;
        layout_read(layout, at, piece, size);
        bytes_put(bytes, piece, size);
        at += size;
    }
    free(piece);
}

void sweep_npz(const Sweep *sweep, Bytes *bytes) {
    Layout layout = {0};
    Archive archive = {
        .sweep = sweep, .rows = sweep->table.points.count, .zip = {.layout = &layout}};
    const size_t columns = sweep->axes.count + sweep->metrics.count;
    double *room = calloc(archive.rows * columns + 1, sizeof *room);
    if (room == NULL)
        archive.status = STATUS_NO_MEMORY;
    else
        put_columns(&archive, room);
    const Status ended = zip_end(&archive.zip, NULL);
    if (archive.status == STATUS_OK && ended == STATUS_OK && !layout.is_failed)
        copy(&layout, bytes);
    else
        bytes->is_failed = true;
    layout_clear(&layout);
    free(room);
}
