// What drop tests of one material come to: every reading as a row, e and T_c with their spread,
// whether they hold over speed. Not the tests themselves (drop_test.h), not the revision that would
// say so (proposal.h) and not their storage. Used by whoever shows or proposes it.
#ifndef CORE_DROP_TEST_EVALUATION_H
#define CORE_DROP_TEST_EVALUATION_H

#include "core/base/report.h"
#include "core/drop_test/drop_test.h"
#include "core/drop_test/force_trace.h"

enum { EVALUATION_ROWS_MAX = 20000, EVALUATION_SAMPLES_MAX = 4 * TRACE_SAMPLES_MAX };
#define EVALUATION_CONFIDENCE 0.95

// One test, by its number of the material; COUNT_ABSENT: it has none yet. Borrowed.
typedef struct Measurement {
    uint64_t number;
    const DropTest *test;
} Measurement;

// Where a row's e and T_c come from.
typedef enum RestitutionBy {
    RESTITUTION_BY_HEIGHTS,
    RESTITUTION_BY_SPEEDS,
    RESTITUTION_BY_PULSE
} RestitutionBy;
typedef enum ContactTimeBy { CONTACT_TIME_BY_DURATION, CONTACT_TIME_BY_PULSE } ContactTimeBy;
extern const char *const restitution_by_names[];  // "heights" ...; NULL-terminated
extern const char *const contact_time_by_names[]; // "duration", "pulse"; NULL-terminated

// One reading. Uncertainties are standard ones; what is not known is NAN, CHOICE_ABSENT or NULL.
typedef struct EvaluationRow {
    uint64_t measurement;                              // its number; COUNT_ABSENT
    char *from;                                        // "drop 3"; "trace 1, contact 2"
    uint64_t trace;                                    // from 1; COUNT_ABSENT: of a drop
    double approach_speed, approach_speed_uncertainty; // [m/s]
    double restitution, restitution_uncertainty;       // [-]
    int restitution_by;                                // RestitutionBy
    double contact_time, contact_time_uncertainty;     // [s]
    int contact_time_by;                               // ContactTimeBy
    double least_contact_time, most_contact_time;      // of a trace, 95 % [s]
    double read_restitution, read_contact_time; // before gravity was taken out; NAN: it was not
    bool restitution_counts, contact_time_counts;
    double restitution_score, contact_time_score;         // deviations from the middle, robust ones
    bool restitution_is_outlier, contact_time_is_outlier; // which counts all the same
    char *excluded;                                       // why neither counts
    char *note;                                           // what else there is to know of it
    TraceDetection contact;                               // as it is seen in the trace
    bool is_of_trace; // "/traces/0" rather than "/drops/0"; no members of the answer:
    size_t place;
    size_t test; // of those given
} EvaluationRow;
typedef struct EvaluationRows {
    EvaluationRow *at;
    size_t count;
} EvaluationRows;

// Constant: no slope is shown, and a change of more than TREND_MATTERS of the mean would have been.
typedef enum TrendVerdict { TREND_CONSTANT, TREND_NOT_CONSTANT, TREND_UNDECIDED } TrendVerdict;
extern const char *const trend_verdict_names[]; // "constant" ...; NULL-terminated
#define TREND_MATTERS 0.2

// A straight line over approach speed by least squares: whether "constant over speed" holds.
typedef struct Trend {
    uint64_t count;                          // of readings with a speed
    double least_speed, most_speed;          // [m/s]
    double mean_speed, mean_value;           // which the line goes through
    double slope, standard_error, low, high; // per m/s; 95 %
    double t, p;                             // of no slope at all
    double change;                           // that the line makes over the measured speeds
    double missed_change; // the largest over them that the data do not rule out, 95 %
    int verdict;          // TrendVerdict; CHOICE_ABSENT: no test can be made
    char *detail;         // the verdict for people
} Trend;

// e or T_c over all readings that count.
typedef struct Statistic {
    uint64_t count;
    double mean;            // weighted where the readings state their uncertainties
    double unweighted_mean; // of the readings as they are
    double deviation;       // standard deviation of the readings
    double scatter;         // of them beyond their stated uncertainties; NAN: not weighted
    double standard_error;  // of the mean
    double spread;          // standard deviation that a revision states beside the mean: scatter
                            // where the mean is weighted, else deviation; at least standard_error
    double low, high;       // 95 % interval of the mean
    double minimum, median, maximum;
    uint64_t outliers;
    double mean_without_outliers; // NAN: there are none
    char *why;                    // how the interval was made, or why there is none
    Trend trend;
} Statistic;

// Over which rows that count something was measured; NAN: not known.
typedef struct Ranges {
    double least_speed, most_speed;             // [m/s]
    double least_temperature, most_temperature; // of the rows' tests [degC]
} Ranges;

typedef struct Evaluation {
    int separation; // Separation: the rule by which traces were read
    double confidence;
    Statistic restitution, contact_time;
    EvaluationRows rows;
    Ranges ranges;     // of all rows that count
    Warnings warnings; // pointers lead into the tests: "/drops/2"
} Evaluation;

extern const Field evaluation_fields[]; // without the warnings

// Samples in all traces of all tests.
size_t evaluation_sample_count(const Measurement *tests, size_t count);

// `tests` were judged by drop_test_validate. STATUS_INVALID: a trace cannot be read at all;
// STATUS_LIMIT: too many rows or samples; STATUS_CANCELLED: `progress` (NULL: nobody), asked
// before each contact and each drop that gravity is taken out of, says so. Cleared by
// evaluation_clear in any case.
Status evaluation_run(const Measurement *tests, size_t count, Separation separation,
                      const Progress *progress, Evaluation *evaluation, Problem *problem);
void evaluation_clear(Evaluation *evaluation);

bool row_counts(const EvaluationRow *row); // at least one of e and T_c

// Widens them by a row; all NAN at first.
extern const Ranges ranges_unknown;
void ranges_take(Ranges *ranges, const EvaluationRow *row, const Measurement *tests);

#endif
