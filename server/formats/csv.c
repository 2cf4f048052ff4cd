// Numbers have the shortest digits that read back to the same double; what is not a number is nan.
#include "server/formats/csv.h"

#include <math.h>
#include <string.h>

#include "server/util/dtoa.h"

static char *put_real(char *at, double value) {
    if (isfinite(value))
        return at + dtoa_write(at, value);
    const char *text = isnan(value) ? "nan" : value < 0 ? "-inf" : "inf";
    const size_t length = strlen(text);
    memcpy(at, text, length);
    return at + length;
}

static void put_name(Bytes *bytes, const char *name, const char *unit) {
    bytes_text(bytes, name);
    if (unit[0] != '\0')
        bytes_format(bytes, " [%s]", unit);
}

static void put_names(const Table *table, Bytes *bytes) {
    if (table->axis_name != NULL)
        put_name(bytes, table->axis_name, table->axis_unit);
    for (size_t c = 0; c < table->column_count; c++) {
        if (c > 0 || table->axis_name != NULL)
            bytes_text(bytes, ",");
        put_name(bytes, table->columns[c]->name, table->columns[c]->unit);
    }
    bytes_text(bytes, "\n");
}

static bool csv_next(const Table *table, TextPlace *place, Bytes *bytes) {
    if (place->part == 0) {
        put_names(table, bytes);
        place->part = 1;
        return table->count > 0;
    }
    const size_t width = 1 + table->column_count, rows = ENCODER_PIECE_NUMBERS / width + 1;
    const size_t end = table->count - place->row < rows ? table->count : place->row + rows;
    if (!bytes_reserve(bytes, (end - place->row) * width * (SHORTEST_SIZE + 1)))
        return false;
    const size_t first = table->bucket > 0 ? 0 : table->first;
    char *at = bytes->at + bytes->count;
    for (size_t i = place->row; i < end; i++) {
        if (table->axis_name != NULL)
            at = put_real(at, table->axis != NULL ? table->axis[first + i] : table_time(table, i));
        for (size_t c = 0; c < table->column_count; c++) {
            if (c > 0 || table->axis_name != NULL)
                *at++ = ',';
            at = put_real(at, table->columns[c]->values[first + i]);
        }
        *at++ = '\n';
    }
    *at = '\0';
    bytes->count = (size_t)(at - bytes->at);
    place->row = end;
    return end < table->count;
}

const TableFormat encoder_csv = {
    .extension = "csv",
    .content_type = "text/csv; charset=utf-8",
    .is_binary = false,
    .next = csv_next,
};
