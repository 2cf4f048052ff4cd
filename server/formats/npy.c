// NumPy's array file, version 1.0, in Fortran order, so that columns are copied as they lie in
// memory; and its archive, a ZIP of such files of one dimension, stored: numbers hardly compress.
// Names and units of an NPY are in the result's document.
#include <stdio.h>

#include "server/formats/format.h"
#include "server/formats/zip.h"

enum { PREAMBLE = 10, ALIGNMENT = 64 };

void npy_put_header(Segments *segments, const char *type, size_t rows, size_t columns) {
    char header[2 * ALIGNMENT], shape[48];
    if (columns > 0)
        snprintf(shape, sizeof shape, "%zu, %zu", rows, columns);
    else
        snprintf(shape, sizeof shape, "%zu,", rows);
    const int length =
        snprintf(header, sizeof header,
                 "{'descr': '%.16s', 'fortran_order': True, 'shape': (%s), }", type, shape);
    // Blanks and a line feed fill it up, so that the numbers begin at a multiple of 64 bytes.
    const size_t used = PREAMBLE + (size_t)length + 1;
    const size_t size = (used + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT - PREAMBLE;
    segments_put(segments, "\x93NUMPY\x01\x00", 8);
    segments_number(segments, size, 2);
    segments_put(segments, header, (size_t)length);
    segments_fill(segments, ' ', size - 1 - (size_t)length);
    segments_put(segments, "\n", 1);
}

static Status npy_lay(const Table *table, Segments *segments, Problem *problem) {
    const bool has_axis = table->axis_name != NULL;
    (void)problem;
    npy_put_header(segments, "<f8", table->count, table->column_count + has_axis);
    if (has_axis)
        table_lay_axis(table, segments);
    for (size_t c = 0; c < table->column_count; c++)
        table_lay_column(table, c, segments);
    return STATUS_OK;
}

// The axis is number 0.
static Status npz_lay(const Table *table, Segments *segments, Problem *problem) {
    Zip zip = {.segments = segments};
    Status status = STATUS_OK;
    for (size_t c = table->axis_name != NULL ? 0 : 1;
         c <= table->column_count && status == STATUS_OK; c++) {
        Segments array = {0};
        char name[ZIP_NAME_MAX + 1];
        snprintf(name, sizeof name, "%.74s.npy",
                 c == 0 ? table->axis_name : table->columns[c - 1]->name);
        npy_put_header(&array, "<f8", table->count, 0);
        if (c == 0)
            table_lay_axis(table, &array);
        else
            table_lay_column(table, c - 1, &array);
        status = zip_put(&zip, name, &array, problem);
        segments_clear(&array);
    }
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    return status != STATUS_OK ? status : ended;
}

const TableFormat format_npy = {
    .extension = "npy",
    .content_type = "application/x-npy",
    .is_binary = true,
    .lay = npy_lay,
};

const TableFormat format_npz = {
    .extension = "npz",
    .content_type = "application/x-npz",
    .is_binary = true,
    .lay = npz_lay,
};
