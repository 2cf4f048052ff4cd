#include "server/formats/impacts_csv.h"

static void write_cell(Bytes *bytes, const Field *field, const Impact *impact) {
    const char *at = (const char *)impact + field->offset;
    if (field_is_absent(field, impact))
        return;
    if (field->kind == FIELD_KIND_REAL)
        bytes_real(bytes, *(const double *)(const void *)at);
    else if (field->kind == FIELD_KIND_COUNT)
        bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)(const void *)at);
    else if (field->kind == FIELD_KIND_CHOICE)
        bytes_text(bytes, field->choices[*(const int *)(const void *)at]);
}

void impacts_csv(const Impacts *impacts, Bytes *bytes) {
    for (const Field *field = impact_fields; field->kind != FIELD_KIND_END; field++) {
        bytes_format(bytes, "%s%s", field == impact_fields ? "" : ",", field->name);
        if (field->unit != NULL)
            bytes_format(bytes, " [%s]", field->unit);
    }
    bytes_text(bytes, "\n");
    for (size_t i = 0; i < impacts->count; i++) {
        for (const Field *field = impact_fields; field->kind != FIELD_KIND_END; field++) {
            bytes_text(bytes, field == impact_fields ? "" : ",");
            write_cell(bytes, field, &impacts->at[i]);
        }
        bytes_text(bytes, "\n");
    }
}
