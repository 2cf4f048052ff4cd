#include "server/client/told_record.h"

#include <string.h>

#include "server/codec/read.h"

// clang-format off
static const Field warning_fields[] = {
    FIELD_TEXT(RecordWarning, pointer, 0, PRESENCE_OPTIONAL, 0, "place"),
    FIELD_TEXT(RecordWarning, detail, 0, PRESENCE_OPTIONAL, 0, "what is doubtful"),
    FIELD_END,
};
static const Field record_fields[] = {
    FIELD_TEXT(RecordTold, name, 0, PRESENCE_OPTIONAL, 0, "name"),
    FIELD_TEXT(RecordTold, layout, 0, PRESENCE_OPTIONAL, 0, "of its file"),
    FIELD_TEXT(RecordTold, unit, 0, PRESENCE_OPTIONAL, 0, "of its file"),
    FIELD_TEXT(RecordTold, source, 0, PRESENCE_OPTIONAL, 0, "where it comes from"),
    FIELD_REAL(RecordTold, interval, "s", ANY, OPTIONAL, "between samples"),
    FIELD_REAL(RecordTold, duration, "s", ANY, OPTIONAL, "from the first sample to the last"),
    FIELD_REAL(RecordTold, peak, "m/s^2", ANY, OPTIONAL, "largest magnitude"),
    FIELD_REAL(RecordTold, peak_time, "s", ANY, OPTIONAL, "when"),
    FIELD_COUNT(RecordTold, count, NULL, ANY, OPTIONAL, "samples"),
    {.name = "warnings", .kind = FIELD_KIND_LIST, .offset = offsetof(RecordTold, warnings),
     .fields = warning_fields, .size = sizeof(RecordWarning), .presence = PRESENCE_OPTIONAL, .doc = "doubts"},
    FIELD_END,
};
static const Field list_fields[] = {
    {.name = "records", .kind = FIELD_KIND_LIST, .offset = offsetof(RecordsTold, records),
     .fields = record_fields, .size = sizeof(RecordTold), .presence = PRESENCE_OPTIONAL, .doc = "records"},
    FIELD_END,
};
// clang-format on

static void tame(char *text) {
    if (text != NULL)
        told_tame(text);
}

static void tame_record(RecordTold *record) {
    RecordWarning *warnings = record->warnings.at;
    tame(record->name);
    tame(record->layout);
    tame(record->unit);
    tame(record->source);
    for (size_t i = 0; i < record->warnings.count; i++) {
        tame(warnings[i].pointer);
        tame(warnings[i].detail);
    }
}

static bool is_record(const RecordTold *record) {
    return record->name != NULL && strlen(record->name) <= 64;
}

static Status refuse(Problem *problem) {
    return problem_set(problem, STATUS_UNREACHABLE,
                       "the answer is no record: what answers there is no impactd");
}

Status record_told_read(const HttpAnswer *answer, RecordTold *record, Problem *problem) {
    // Members that are not known here are no faults, so nobody listens to the reader.
    (void)read_json(answer->body.at, answer->body.count, record_fields, record, NULL);
    if (!is_record(record))
        return refuse(problem);
    tame_record(record);
    return STATUS_OK;
}

void record_told_clear(RecordTold *record) {
    fields_clear(record_fields, record);
}

Status records_told_read(const HttpAnswer *answer, RecordsTold *records, Problem *problem) {
    (void)read_json(answer->body.at, answer->body.count, list_fields, records, NULL);
    RecordTold *at = records->records.at;
    if (answer->body.at == NULL || strstr(answer->body.at, "\"records\"") == NULL)
        return refuse(problem);
    for (size_t i = 0; i < records->records.count; i++) {
        if (!is_record(&at[i]))
            return refuse(problem);
        tame_record(&at[i]);
    }
    return STATUS_OK;
}

void records_told_clear(RecordsTold *records) {
    fields_clear(list_fields, records);
}
