// The study "optimize": values of some members of the scene for which a metric is best, or for
// which two are, under constraints on others.
#ifndef CORE_STUDY_OPTIMIZE_H
#define CORE_STUDY_OPTIMIZE_H

#include "core/study/axis.h"
#include "core/study/statistics.h"

typedef enum OptimizeGoal { OPTIMIZE_MINIMIZE, OPTIMIZE_MAXIMIZE } OptimizeGoal;

typedef struct OptimizeObjective {
    int metric, goal; // OptimizeGoal
} OptimizeObjective;

typedef struct OptimizeObjectives {
    OptimizeObjective *at;
    size_t count;
} OptimizeObjectives;

typedef struct OptimizeConstraint {
    int metric;
    double min, max; // NAN: none
} OptimizeConstraint;

typedef struct OptimizeConstraints {
    OptimizeConstraint *at;
    size_t count;
} OptimizeConstraints;

// The runs of each candidate; all absent: one, of the scene as it is.
typedef struct OptimizeOver {
    uint64_t runs, first_seed; // 0 runs: those of the records
    PinnedRecords records;
} OptimizeOver;

typedef enum OptimizeStatisticOf {
    OPTIMIZE_MEAN,
    OPTIMIZE_MAX,
    OPTIMIZE_QUANTILE
} OptimizeStatisticOf;

// Of a metric over these runs.
typedef struct OptimizeStatistic {
    int of;          // OptimizeStatisticOf; CHOICE_ABSENT: the mean
    double quantile; // NAN: none
} OptimizeStatistic;

// The request.
typedef struct OptimizeStudy {
    Variant variant;
    StudyAxes variables;
    OptimizeObjectives objectives;
    OptimizeConstraints constraints;
    OptimizeOver over;
    OptimizeStatistic statistic;
    uint64_t max_candidates, search_seed;
    StudyNames names;
} OptimizeStudy;

// The value of a variable.
typedef struct OptimumValue {
    StudyMember member;
    char *value; // a scalar as JSON text
} OptimumValue;

typedef struct OptimumValues {
    OptimumValue *at;
    size_t count;
} OptimumValues;

typedef struct OptimumObjective {
    int metric;
    double value;
    Reals interval_95; // of the statistic over all possible seeds; none: unknown
} OptimumObjective;

typedef struct OptimumObjectives {
    OptimumObjective *at;
    size_t count;
} OptimumObjectives;

typedef struct OptimumBest {
    OptimumValues values;
    OptimumObjectives objectives;
    StudyMetrics metrics; // the statistic of each
    bool feasible;
} OptimumBest;

// The statistic of every metric of a scene.
typedef struct OptimumScene {
    StudyMetrics metrics;
} OptimumScene;

// One side of a box around the best.
typedef struct OptimumInterval {
    StudyMember member;
    double low, high;
} OptimumInterval;

typedef struct OptimumRegion {
    OptimumInterval *at;
    size_t count;
} OptimumRegion;

// Another good candidate.
typedef struct OptimumRival {
    OptimumValues values;
    double difference; // of the first objective: its own less the best
    Reals interval_95; // of the mean difference over all possible seeds
} OptimumRival;

typedef struct OptimumRivals {
    OptimumRival *at;
    size_t count;
} OptimumRivals;

typedef struct OptimumCandidate {
    uint64_t index;
    OptimumValues values;
    Reals objectives; // none: it has failed
    bool feasible;
} OptimumCandidate;

typedef struct OptimumCandidates {
    OptimumCandidate *at;
    size_t count;
} OptimumCandidates;

// The answer.
typedef struct Optimum {
    Variant variant;
    StudyRuns made;
    uint64_t candidates;           // evaluated
    OptimizeObjectives objectives; // as requested
    OptimumBest best;              // values empty: there is no feasible candidate
    OptimumScene given, undamped;
    OptimumRegion region;
    OptimumRivals rivals;
    OptimumCandidates front; // of two objectives, none of which can improve without the other
    OptimumCandidates history;
} Optimum;

#endif
