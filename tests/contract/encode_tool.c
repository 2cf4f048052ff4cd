// encode_tool FORMAT COLUMNS RATE FIRST COUNT [AXIS]: rows of the columns at standard input, one
// column after the other, in a format of server/formats. With AXIS, the first column is the axis.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/format.h"
#include "tests/support/doubles.h"

enum { COLUMNS_MAX = 16 };

int main(int count, char **arguments) {
    if (count != 6 && count != 7)
        return 2;
    const TableFormat *encoder = format_find(arguments[1]);
    const size_t columns = strtoul(arguments[2], NULL, 10);
    size_t values = 0;
    double *block = doubles_read(&values);
    if (encoder == NULL || block == NULL || columns < 1 || columns > COLUMNS_MAX ||
        values % columns != 0)
        return 2;

    const bool has_axis = count == 7;
    const size_t rows = values / columns, offset = has_axis ? 1 : 0;
    Column column[COLUMNS_MAX];
    const Column *chosen[COLUMNS_MAX];
    for (size_t c = offset; c < columns; c++) {
        column[c].values = block + c * rows;
        snprintf(column[c].name, sizeof column[c].name, "channel_%zu", c);
        snprintf(column[c].unit, sizeof column[c].unit, "m/s^%zu", c);
        chosen[c - offset] = &column[c];
    }
    const Table table = {
        .axis_name = has_axis ? arguments[6] : "time",
        .axis_unit = has_axis ? "Hz" : "s",
        .axis_rate = strtod(arguments[3], NULL),
        .first = strtoul(arguments[4], NULL, 10),
        .count = strtoul(arguments[5], NULL, 10),
        .axis = has_axis ? block : NULL,
        .columns = chosen,
        .column_count = columns - offset,
    };
    if (table.first > rows || table.count > rows - table.first)
        return 2;
    Bytes bytes = {0};
    const Status status = format_write(encoder, &table, &bytes, NULL);
    const bool is_written = status == STATUS_OK && !bytes.is_failed &&
                            fwrite(bytes.at, 1, bytes.count, stdout) == bytes.count &&
                            fflush(stdout) == 0;
    bytes_clear(&bytes);
    free(block);
    return is_written ? 0 : 1;
}
