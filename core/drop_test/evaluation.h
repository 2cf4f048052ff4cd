// Evaluation of the drop tests of one material: all readings as rows, mean and interval of e and
// T_c, their trend over speed, warnings, and the revision of the material that they propose.
#ifndef CORE_DROP_TEST_EVALUATION_H
#define CORE_DROP_TEST_EVALUATION_H

#include "core/base/progress.h"
#include "core/base/report.h"
#include "core/contact/contact.h"
#include "core/drop_test/drop_test.h"
#include "core/drop_test/force_trace.h"
#include "core/drop_test/reading_statistics.h"
#include "core/scene/material.h"

enum { EVALUATION_ROWS_MAX = 20000, EVALUATION_SAMPLES_MAX = 4 * TRACE_SAMPLES_MAX };

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

// Conditions of the rows that count; NAN: unknown.
typedef struct Ranges {
    double least_speed, most_speed;             // [m/s]
    double least_temperature, most_temperature; // of the rows' tests [degC]
} Ranges;

typedef struct Evaluation {
    int separation; // Separation: the rule by which traces were evaluated
    double confidence;
    Statistic restitution, contact_time;
    EvaluationRows rows;
    Ranges ranges;     // of all rows that count
    Warnings warnings; // pointers lead into the tests: "/drops/2"
} Evaluation;

extern const Field evaluation_fields[]; // without the warnings

// Number of samples in all traces of all tests.
size_t evaluation_sample_count(const Measurement *tests, size_t count);

// `tests` have passed drop_test_validate. `progress` (may be NULL) is called before each contact
// and each correction of gravity. STATUS_INVALID: a trace cannot be read at all; STATUS_LIMIT: too
// many rows or samples; STATUS_CANCELLED; STATUS_NO_MEMORY. Released by evaluation_clear in any
// case.
Status evaluation_run(const Measurement *tests, size_t count, Separation separation,
                      const Progress *progress, Evaluation *evaluation, Problem *problem);
void evaluation_clear(Evaluation *evaluation);

// One e and T_c for every speed, or a table over approach speed.
typedef enum ProposalForm { PROPOSAL_CONSTANT, PROPOSAL_TABLE } ProposalForm;
extern const char *const proposal_form_names[]; // "constant", "table"; NULL-terminated

// Readings whose speeds differ by a smaller factor share one row of a table.
#define PROPOSAL_BIN 1.1

// The revision, or why there is none: then `material` is empty. Warnings go to the evaluation's.
typedef struct MaterialProposal {
    Material material;
    char *why; // NULL: there is one
} MaterialProposal;

// Name, kind and so on are those of `before`, its figures are not. STATUS_OK or STATUS_NO_MEMORY.
// Released by material_proposal_clear in any case.
Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *proposal,
                             Problem *problem);
void material_proposal_clear(MaterialProposal *proposal);

#endif
