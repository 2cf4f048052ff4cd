#include "server/formats/struct_columns.h"

static bool is_number(const Field *field) {
    return field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT ||
           field->kind == FIELD_KIND_CHOICE;
}

static double number_of(const Field *field, const char *item) {
    const void *at = item + field->offset;
    if (field_is_absent(field, item))
        return (double)NAN;
    return field->kind == FIELD_KIND_REAL    ? *(const double *)at
           : field->kind == FIELD_KIND_COUNT ? (double)*(const uint64_t *)at
                                             : (double)*(const int *)at;
}

Status struct_columns(const Field *fields, const void *items, size_t count, size_t size,
                      Columns *columns, Problem *problem) {
    size_t wide = 0;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++)
        wide += is_number(field);
    TRY(columns_allocate(columns, wide, count, 0, problem));
    size_t c = 0;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (!is_number(field))
            continue;
        columns_name(columns, c, field->name, field->unit);
        for (size_t i = 0; i < count; i++)
            columns->at[c].values[i] = number_of(field, (const char *)items + i * size);
        c++;
    }
    return STATUS_OK;
}
