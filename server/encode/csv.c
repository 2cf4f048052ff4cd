// Numbers have the shortest digits that read back to the same double; what is not a number is nan.
#include "server/encode/csv.h"

#include <math.h>
#include <string.h>

#include "server/base/shortest.h"

enum { CHUNK = 4096 }; // numbers that room is made for at once

static char *put_real(char *at, double value) {
    if (isfinite(value))
        return at + shortest_write(at, value);
    const char *text = isnan(value) ? "nan" : value < 0 ? "-inf" : "inf";
    const size_t length = strlen(text);
    memcpy(at, text, length);
    return at + length;
}

static void csv_write(const Table *table, Bytes *bytes) {
    bytes_format(bytes, "%s [%s]", table->axis_name, table->axis_unit);
    for (size_t c = 0; c < table->column_count; c++)
        bytes_format(bytes, ",%s [%s]", table->columns[c]->name, table->columns[c]->unit);
    bytes_text(bytes, "\n");

    const size_t end = table->first + table->count;
    const size_t rows = CHUNK / (1 + table->column_count) + 1;
    for (size_t chunk = table->first; chunk < end; chunk += rows) {
        const size_t chunk_end = end - chunk < rows ? end : chunk + rows;
        if (!bytes_reserve(bytes,
                           (chunk_end - chunk) * (1 + table->column_count) * (SHORTEST_SIZE + 1)))
            return;
        char *at = bytes->at + bytes->count;
        for (size_t i = chunk; i < chunk_end; i++) {
            // A division, so that row 50 at 1000 Hz reads 0.05.
            at = put_real(at, table->axis != NULL ? table->axis[i] : (double)i / table->axis_rate);
            for (size_t c = 0; c < table->column_count; c++) {
                *at++ = ',';
                at = put_real(at, table->columns[c]->values[i]);
            }
            *at++ = '\n';
        }
        *at = '\0';
        bytes->count = (size_t)(at - bytes->at);
    }
}

const Encoder encoder_csv = {
    .extension = "csv",
    .content_type = "text/csv; charset=utf-8",
    .is_binary = false,
    .write = csv_write,
};
