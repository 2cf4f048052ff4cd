// What a daemon tells of ground-motion records, as plain structs; as told.h does of jobs. Used by
// command/records.c.
#ifndef SERVER_CLIENT_TOLD_RECORD_H
#define SERVER_CLIENT_TOLD_RECORD_H

#include "server/client/told.h"

typedef struct RecordWarning {
    char *pointer, *detail;
} RecordWarning;

// Of one record, or of a list; what is not told is NULL, NAN or COUNT_ABSENT.
typedef struct RecordTold {
    char *name, *layout, *unit, *source;
    double interval, duration, peak, peak_time; // [s], [m/s^2]
    uint64_t count;
    List warnings; // RecordWarning
} RecordTold;
typedef struct RecordsTold {
    List records; // RecordTold
} RecordsTold;

// STATUS_UNREACHABLE if the answer is no record. Cleared by record_told_clear in any case.
Status record_told_read(const HttpAnswer *answer, RecordTold *record, Problem *problem);
void record_told_clear(RecordTold *record);

// Those that have a name. Cleared by records_told_clear in any case.
Status records_told_read(const HttpAnswer *answer, RecordsTold *records, Problem *problem);
void records_told_clear(RecordsTold *records);

#endif
