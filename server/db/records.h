// Ground-motion records as they are stored: a description and the samples. They never change, and
// are deleted only while no result and no unfinished job uses them.
#ifndef SERVER_DB_RECORDS_H
#define SERVER_DB_RECORDS_H

#include "core/excitation/recorded_motion.h"
#include "server/db/db.h"

enum { RECORDS_MAX = 20000, RECORD_TWINS = 4 };
#define RECORDS_SAMPLES (UINT64_C(1) << 31) // of all records: 16 GiB

// A text that was not given is NULL.
typedef struct RecordRow {
    int64_t number; // the database's
    char *name;     // record_name_is_sound
    char *source, *processing, *earthquake, *station, *notes;
    char *layout, *header;    // as `impactd import` prints them; "json" without a header
    char *unit, *stated_unit; // of the file: the one used, the one it states
    double interval;          // [s]
    uint64_t count;           // samples
    double peak, peak_time;   // the largest magnitude [m/s^2], when [s]
    double peak_velocity;     // of the base, from rest [m/s]
    double end_velocity;      // likewise
    char *digest;             // record_digest
    char *author;             // the token's name; NULL: the local user
    int64_t created_unix_ms;
} RecordRow;
typedef struct RecordRows {
    RecordRow *at;
    size_t count;
} RecordRows;
void record_row_clear(RecordRow *row);
void record_rows_clear(RecordRows *rows);

// 1 to 64 of letters, digits, dot, underscore and dash, the first a letter or a digit.
bool record_name_is_sound(const char *name);
// SHA-256 of the interval and the samples as little-endian doubles, in hexadecimal digits; ""
// without memory.
void record_digest(double interval, const Reals *samples, char digest[RECORD_DIGEST_SIZE]);
// Sets what follows from the samples [m/s^2], the interval and the unit that they came in.
// STATUS_NO_MEMORY.
Status record_row_measure(RecordRow *row, const Reals *samples, int unit);

// Adds both in one transaction. Where the same record exists already *is_there is set and nothing
// is written; another one of that name is STATUS_CONFLICT. STATUS_LIMIT where there are
// RECORDS_MAX, or where they would have more than RECORDS_SAMPLES.
Status db_record_add(Db *db, const RecordRow *row, const Reals *samples, bool *is_there,
                     Problem *problem);

// STATUS_NOT_FOUND. `row` may be uninitialised; cleared in any case.
Status db_record(Db *db, const char *name, RecordRow *row, Problem *problem);
// By name, those behind `after` ("": from the first) in which `words` (NULL: any) occur, at most
// `most`.
Status db_records(Db *db, const char *words, const char *after, size_t most, RecordRows *rows,
                  Problem *problem);
// Up to RECORD_TWINS others with the same interval and samples.
Status db_record_twins(Db *db, const RecordRow *row, RecordRows *rows, Problem *problem);

// Interval and samples; all callers share one copy. The caller gets a reference. STATUS_NOT_FOUND.
Status db_record_named(Db *db, const char *name, NamedRecord **named, Problem *problem);

// Results made with it, and unfinished jobs that will be.
typedef struct RecordUses {
    uint64_t results, jobs;
} RecordUses;
Status db_record_uses(Db *db, const char *name, RecordUses *uses, Problem *problem);
// "record:elcentro", as result_uses has it.
void record_use_name(const char *name, char target[RECORD_NAME_SIZE + 8]);

// Deletes it; STATUS_CONFLICT, with *uses, where it is used, STATUS_NOT_FOUND. Jobs that are on
// their way to the database are not seen: the caller prevents that.
Status db_record_delete(Db *db, const char *name, RecordUses *uses, Problem *problem);

#endif
