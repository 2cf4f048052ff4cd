// The list of formats.
#include <string.h>

#include "server/formats/format.h"

const TableFormat *const table_formats[] = {
    &format_json, &format_csv, &format_npy, &format_npz, &format_mat, &format_svg, NULL,
};

const TableFormat *const table_formats_without_chart[] = {
    &format_json, &format_csv, &format_npy, &format_npz, &format_mat, NULL,
};

const TableFormat *format_find(const char *extension) {
    for (size_t i = 0; table_formats[i] != NULL; i++)
        if (strcmp(table_formats[i]->extension, extension) == 0)
            return table_formats[i];
    return NULL;
}

Status format_write(const TableFormat *format, const Table *table, Bytes *bytes, Problem *problem) {
    if (format->next != NULL) {
        TextPlace place = {0, 0};
        while (format->next(table, &place, bytes) && !bytes->is_failed)
            continue;
        return STATUS_OK;
    }
    Segments segments = {0};
    const Status status = format->layout(table, &segments, problem);
    if (status == STATUS_OK)
        segments_write(&segments, bytes);
    segments_clear(&segments);
    return status;
}
