// The study "compare": one scene under several contact models and separation rules, each compared
// with the scene's own.
#ifndef CORE_STUDY_MODEL_COMPARISON_H
#define CORE_STUDY_MODEL_COMPARISON_H

#include "core/result/signal_comparison.h"
#include "core/result/spectrum_distance.h"
#include "core/study/study.h"

// The request.
typedef struct CompareStudy {
    Variant variant;
    Texts models;      // none until completed: the scene's own if separations are named, else all
    Texts separations; // likewise
    double part;       // of the reference's largest displacement, by which motions diverge
    Reals band;        // of the spectra [Hz]; none: 99.9 % of the reference's power
    uint64_t storey;   // whose motion is compared; COUNT_ABSENT until completed: the first damper's
} CompareStudy;

typedef enum CompareStatus { COMPARE_RUN, COMPARE_REFUSED, COMPARE_FAILED } CompareStatus;
extern const char *const compare_status_names[];

// Summary of all impacts; NAN where unknown.
typedef struct CompareContacts {
    uint64_t resting; // intervals of persistent contact
    double mean_duration, mean_approach_speed, largest_approach_speed, mean_restitution;
    double energy_lost; // in all contacts [J]
} CompareContacts;

// Relative to the reference's number: 0.1 is a tenth more.
typedef struct CompareDifferences {
    double peak_displacement, rms_displacement, peak_acceleration, rms_acceleration;
    double impacts; // difference of the numbers
    double peak_contact_force;
} CompareDifferences;

// Time at which the displacements diverge, and whether the contact model is the cause.
typedef struct CompareDivergence {
    double time;     // NAN: not within the run
    double horizon;  // the earlier trust horizon; NAN: both can be trusted to the end
    bool is_trusted; // the time is within the horizon
    char *why;
} CompareDivergence;

// Displacement over time, the smallest and the largest of each bucket of samples.
typedef struct CompareTrace {
    Reals minimum, maximum;
} CompareTrace;

// One variant of the scene.
typedef struct CompareEntry {
    char *name; // "spring_damper, zero_force"
    char *contact_model;
    int separation; // CHOICE_ABSENT if the model has none
    int status;     // CompareStatus
    char *why;      // it did not run to its end
    double steps;
    DerivedList derived;
    Summary summary;
    CompareContacts contacts;
    CompareDifferences differences;
    SpectrumDistance psd;
    SignalComparison displacement;
    CompareDivergence divergence;
    Reals density;
    CompareTrace trace;
} CompareEntry;

typedef struct CompareEntries {
    CompareEntry *at;
    size_t count;
} CompareEntries;

// The answer. The first entry is the reference: the scene as it is.
typedef struct Comparison {
    Variant variant;
    uint64_t storey;
    double part;
    char *channel, *unit;   // of the densities
    Reals frequency;        // [Hz]
    double trace_rate;      // buckets a second
    uint64_t trace_samples; // in each bucket
    CompareEntries entries;
} Comparison;

extern const Field compare_contacts_fields[], compare_differences_fields[];

#endif
