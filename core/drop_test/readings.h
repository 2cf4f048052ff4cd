// Readings of drop tests as rows: speed, e and T_c with their uncertainties, without gravity where
// the test states it.
#ifndef CORE_DROP_TEST_READINGS_H
#define CORE_DROP_TEST_READINGS_H

#include "core/base/progress.h"
#include "core/drop_test/drop_test.h"
#include "core/drop_test/force_trace.h"
#include "core/drop_test/reading_statistics.h"

enum { EVALUATION_ROWS_MAX = 20000 };

// A test and its number within the material; COUNT_ABSENT: not numbered yet. Borrowed.
typedef struct Measurement {
    uint64_t number;
    const DropTest *test;
} Measurement;

// The source of a row's e and T_c.
typedef enum RestitutionBy {
    RESTITUTION_BY_HEIGHTS,
    RESTITUTION_BY_SPEEDS,
    RESTITUTION_BY_PULSE
} RestitutionBy;
typedef enum ContactTimeBy { CONTACT_TIME_BY_DURATION, CONTACT_TIME_BY_PULSE } ContactTimeBy;

// One drop, or one contact of a trace. Uncertainties are standard uncertainties; unknown values are
// NAN, CHOICE_ABSENT or NULL.
typedef struct EvaluationRow {
    uint64_t measurement;                              // its number; COUNT_ABSENT
    char *from;                                        // "drop 3"; "trace 1, contact 2"
    uint64_t trace;                                    // from 1; COUNT_ABSENT: a drop
    double approach_speed, approach_speed_uncertainty; // [m/s]
    double restitution, restitution_uncertainty;       // [-]
    int restitution_by;                                // RestitutionBy
    double contact_time, contact_time_uncertainty;     // [s]
    int contact_time_by;                               // ContactTimeBy
    double least_contact_time, most_contact_time;      // of a trace, 95 % [s]
    double read_restitution, read_contact_time; // before the correction of gravity; NAN: none made
    bool restitution_counts, contact_time_counts;
    double restitution_score, contact_time_score; // robust deviations from the median
    bool restitution_is_outlier, contact_time_is_outlier;
    char *excluded;         // why neither counts
    char *note;             // further remarks
    TraceDetection contact; // as detected in the trace
    // Not written to JSON:
    bool is_of_trace; // `place` is an index of /traces, not of /drops
    size_t place;
    size_t test; // index of the Measurement
} EvaluationRow;
typedef struct EvaluationRows {
    EvaluationRow *at;
    size_t count;
} EvaluationRows;
extern const Field evaluation_row_fields[];

// Appends the rows of tests[index]. STATUS_INVALID: a trace cannot be read at all; STATUS_LIMIT:
// too many rows; STATUS_CANCELLED; STATUS_NO_MEMORY.
Status readings_add(const Measurement *tests, size_t index, int separation,
                    const Progress *progress, EvaluationRows *rows, Problem *problem);

// Corrects all drops whose test states gravity; the fit of a trace has corrected its contacts. A
// drop with only one of e and T_c borrows the mean of the other from its test's readings without
// gravity. STATUS_CANCELLED, STATUS_NO_MEMORY.
Status readings_correct_gravity(const Measurement *tests, size_t count, int separation,
                                const Progress *progress, EvaluationRows *rows, Problem *problem);

// The JSON Pointer of a measurement, with `rest` behind it: "/measurements/3/gravity"; without a
// number only the rest.
void measurement_pointer(uint64_t number, const char *rest, char *pointer, size_t size);

// The JSON Pointer of a row: "/drops/2", or "/measurements/3/traces/0".
void reading_pointer(const EvaluationRow *row, char *pointer, size_t size);

// Whether e or T_c counts.
bool reading_counts(const EvaluationRow *row);

// T_c or e of a row; false: it does not count.
bool reading_get(const EvaluationRow *row, bool is_time, Reading *reading);

#endif
