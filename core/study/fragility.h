// The study "fragility": a suite of ground motions, each scaled to rising intensities; the
// intensities at which limits on metrics are exceeded, and their lognormal distribution.
#ifndef CORE_STUDY_FRAGILITY_H
#define CORE_STUDY_FRAGILITY_H

#include "core/study/axis.h"
#include "core/study/statistics.h"

enum {
    FRAGILITY_RECORDS = 1000,
    FRAGILITY_LEVELS = 1000,
    FRAGILITY_LIMITS = 16,
    FRAGILITY_RUNS = 10000,
};

// How strong a ground motion is: its peak, or the pseudo-acceleration of an oscillator.
typedef struct FragilityIntensity {
    int measure;          // 0: "pga"; CHOICE_ABSENT: of the oscillator
    double period;        // of the oscillator [s]
    double damping_ratio; // of the oscillator
} FragilityIntensity;

// A range becomes values when it is completed [m/s^2].
typedef struct FragilityLevels {
    Reals values;
    double from, to;
    uint64_t count;
} FragilityLevels;

typedef struct FragilityLimit {
    int metric; // of study_metric_names
    double value;
} FragilityLimit;

// The request.
typedef struct FragilityStudy {
    Variant variant;
    PinnedRecords records;
    FragilityIntensity intensity;
    FragilityLevels levels;
    struct {
        FragilityLimit *at;
        size_t count;
    } limits;
} FragilityStudy;

// A run: a record at a level.
typedef struct FragilityPoint {
    double level;         // [m/s^2]
    StudyMetrics metrics; // NAN: unknown
} FragilityPoint;

typedef struct FragilityCurve {
    char *record;
    double intensity; // as it was recorded [m/s^2]
    struct {
        FragilityPoint *at;
        size_t count;
    } points;
} FragilityCurve;

// Over the records at one level.
typedef struct FragilityFractile {
    int metric;
    double level;   // [m/s^2]
    uint64_t count; // of records whose value is known
    double p16, p50, p84;
} FragilityFractile;

// The distribution of the level at which a record first exceeds the limit.
typedef struct FragilityState {
    int metric;
    double value;
    uint64_t exceeded; // records that exceed it at some level
    double median;     // [m/s^2]
    Reals median_interval_95;
    double dispersion; // standard deviation of the logarithm
    Reals dispersion_interval_95;
} FragilityState;

// The answer.
typedef struct Fragility {
    Variant variant;
    StudyRuns made;
    FragilityIntensity intensity;
    struct {
        FragilityCurve *at;
        size_t count;
    } curves;
    struct {
        FragilityFractile *at;
        size_t count;
    } fractiles;
    struct {
        FragilityState *at;
        size_t count;
    } limits;
} Fragility;

#endif
