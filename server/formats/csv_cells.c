#include "server/formats/csv_cells.h"

#include <math.h>

static bool is_number(const Field *field) {
    return field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT;
}

void csv_cells_header_of(Bytes *bytes, const char *before, const Field *fields) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (!is_number(field))
            continue;
        bytes_format(bytes, ",%s%s%s", before, *before != '\0' ? "." : "", field->name);
        if (field->unit != NULL)
            bytes_format(bytes, " [%s]", field->unit);
    }
}

void csv_cells_header(Bytes *bytes, const Field *fields) {
    csv_cells_header_of(bytes, "", fields);
}

void csv_cells_real(Bytes *bytes, double value) {
    if (isfinite(value))
        bytes_real(bytes, value);
    else
        bytes_text(bytes, isnan(value) ? "nan" : value < 0 ? "-inf" : "inf");
}

void csv_cells_members(Bytes *bytes, const Field *fields, const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (!is_number(field))
            continue;
        bytes_text(bytes, ",");
        if (field->kind == FIELD_KIND_REAL)
            csv_cells_real(bytes, *(const double *)member);
        else if (*(const uint64_t *)member == COUNT_ABSENT)
            bytes_text(bytes, "nan");
        else
            bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)member);
    }
}

void csv_cells_text(Bytes *bytes, const char *text) {
    if (text == NULL)
        return;
    bytes_text(bytes, "\"");
    for (; *text != '\0'; text++)
        bytes_put(bytes, *text == '"' ? "\"\"" : text, *text == '"' ? 2 : 1);
    bytes_text(bytes, "\"");
}
