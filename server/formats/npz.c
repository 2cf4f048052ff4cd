// A ZIP of NPY files, each of one dimension, stored: numbers of measurements hardly get smaller.
#include "server/formats/npz.h"

#include <stdio.h>

#include "server/formats/npy.h"
#include "server/formats/zip.h"

static Status put(Zip *zip, const char *name, const Segments *array, Problem *problem) {
    char file[ZIP_NAME_MAX + 1];
    snprintf(file, sizeof file, "%.74s.npy", name);
    return zip_put(zip, file, array, problem);
}

static Status npz_lay(const Table *table, Segments *layout, Problem *problem) {
    Zip zip = {.layout = layout};
    Status status = STATUS_OK;
    for (size_t c = table->axis_name != NULL ? 0 : 1;
         c <= table->column_count && status == STATUS_OK; c++) {
        Segments array = {0};
        npy_put_header(&array, table->count, 0);
        if (c == 0)
            npy_put_axis(&array, table);
        else
            table_lay_column(table, c - 1, &array);
        status =
            put(&zip, c == 0 ? table->axis_name : table->columns[c - 1]->name, &array, problem);
        segments_clear(&array);
    }
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    return status != STATUS_OK ? status : ended;
}

const TableFormat encoder_npz = {
    .extension = "npz",
    .content_type = "application/x-npz",
    .is_binary = true,
    .lay = npz_lay,
};
