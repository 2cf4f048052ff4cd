#include "server/encode/ensemble_csv.h"

#include <math.h>
#include <string.h>

static void put_header(Bytes *bytes) {
    bytes_text(bytes, "seed,steps");
    for (const Field *field = summary_fields; field->kind != FIELD_KIND_END; field++) {
        bytes_format(bytes, ",%s", field->name);
        if (field->unit != NULL)
            bytes_format(bytes, " [%s]", field->unit);
    }
    bytes_text(bytes, ",why\n");
}

static void put_real(Bytes *bytes, double value) {
    if (isfinite(value))
        bytes_real(bytes, value);
    else
        bytes_text(bytes, isnan(value) ? "nan" : value < 0 ? "-inf" : "inf");
}

static void put_member(Bytes *bytes, const Field *field, const Summary *summary) {
    const void *member = (const char *)summary + field->offset;
    bytes_text(bytes, ",");
    if (field->kind == FIELD_KIND_REAL)
        put_real(bytes, *(const double *)member);
    else if (*(const uint64_t *)member == COUNT_ABSENT)
        bytes_text(bytes, "nan");
    else
        bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)member);
}

// Quoted, its quotes doubled.
static void put_text(Bytes *bytes, const char *text) {
    bytes_text(bytes, "\"");
    for (; *text != '\0'; text++)
        bytes_put(bytes, *text == '"' ? "\"\"" : text, *text == '"' ? 2 : 1);
    bytes_text(bytes, "\"");
}

void ensemble_csv(const Ensemble *ensemble, Bytes *bytes) {
    put_header(bytes);
    for (size_t i = 0; i < ensemble->table.count; i++) {
        const EnsembleRun *run = &ensemble->table.at[i];
        bytes_format(bytes, "%llu,", (unsigned long long)run->seed);
        put_real(bytes, run->steps);
        for (const Field *field = summary_fields; field->kind != FIELD_KIND_END; field++)
            put_member(bytes, field, &run->summary);
        bytes_text(bytes, ",");
        if (run->why != NULL)
            put_text(bytes, run->why);
        bytes_text(bytes, "\n");
    }
}
