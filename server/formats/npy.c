// Fortran order, so that each column is copied as it lies in memory.
#include "server/formats/npy.h"

#include <stdio.h>

enum { PREAMBLE = 10, ALIGNMENT = 64 };

void npy_put_header_of(Segments *layout, const char *type, size_t rows, size_t columns) {
    char header[2 * ALIGNMENT], shape[48];
    if (columns > 0)
        snprintf(shape, sizeof shape, "%zu, %zu", rows, columns);
    else
        snprintf(shape, sizeof shape, "%zu,", rows);
    const int length =
        snprintf(header, sizeof header,
                 "{'descr': '%.16s', 'fortran_order': True, 'shape': (%s), }", type, shape);
    // Blanks and a line's end fill it up, so that the numbers begin at a multiple of 64 bytes.
    const size_t used = PREAMBLE + (size_t)length + 1;
    const size_t size = (used + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT - PREAMBLE;
    segments_put(layout, "\x93NUMPY\x01\x00", 8);
    segments_number(layout, size, 2);
    segments_put(layout, header, (size_t)length);
    segments_fill(layout, ' ', size - 1 - (size_t)length);
    segments_put(layout, "\n", 1);
}

void npy_put_header(Segments *layout, size_t rows, size_t columns) {
    npy_put_header_of(layout, "<f8", rows, columns);
}

void npy_put_axis(Segments *layout, const Table *table) {
    if (table->axis_name == NULL)
        return;
    if (table->axis != NULL)
        segments_values(layout, table_values(table, table->axis), table->count);
    else
        segments_counted(layout, table->first, table->bucket > 0 ? table->bucket : 1,
                         table->axis_rate, table->count);
}

static Status npy_lay(const Table *table, Segments *layout, Problem *problem) {
    (void)problem;
    npy_put_header(layout, table->count, table->column_count + (table->axis_name != NULL ? 1 : 0));
    npy_put_axis(layout, table);
    for (size_t c = 0; c < table->column_count; c++)
        table_lay_column(table, c, layout);
    return STATUS_OK;
}

const TableFormat encoder_npy = {
    .extension = "npy",
    .content_type = "application/x-npy",
    .is_binary = true,
    .lay = npy_lay,
};
