// The study "sensitivity": how errors of e, T_c and of masses reach the contact's parameters and
// the response. What is asked, and what comes of it. Not how: contact/propagate.h has the closed
// forms, sensitivity_change.h changes the scene, sensitivity_run.c makes the runs. Used by whoever
// shows a table or a chart.
#ifndef CORE_STUDY_SENSITIVITY_H
#define CORE_STUDY_SENSITIVITY_H

#include "core/study/ensemble.h"

// By what the response is differentiated: of all dampers and sides at once.
typedef enum SensitivityParameter {
    SENSITIVITY_RESTITUTION,
    SENSITIVITY_CONTACT_TIME,
    SENSITIVITY_STIFFNESS,
    SENSITIVITY_DAMPING,
    SENSITIVITY_MASS,
    SENSITIVITY_CLEARANCE,
    SENSITIVITY_PARAMETERS
} SensitivityParameter;
extern const char *const sensitivity_parameter_names[]; // NULL-terminated

enum { SENSITIVITY_STEPS = 3 }; // each half of the one before

// How sure one buffer's numbers are.
typedef struct SensitivitySpread {
    uint64_t damper;                  // from 1
    int buffer;                       // SensitivityBuffer
    char *source;                     // "sponge@1"; NULL: somebody said so
    double restitution, contact_time; // relative standard deviations; NAN: not known, taken as sure
} SensitivitySpread;
typedef enum SensitivityBuffer {
    SENSITIVITY_BOTH,
    SENSITIVITY_LEFT,
    SENSITIVITY_RIGHT
} SensitivityBuffer;

typedef struct SensitivitySpreads {
    SensitivitySpread *at;
    size_t count;
} SensitivitySpreads;
extern const Field sensitivity_spread_fields[];

// What is asked.
typedef struct SensitivityStudy {
    Study study;
    Texts parameters; // none until completed: those that the scene has
    double step;      // relative, the largest of SENSITIVITY_STEPS
    // Relative, of all buffers; 0: sure. NAN: as `spread` says, buffer by buffer.
    double restitution_deviation, contact_time_deviation;
    SensitivitySpreads spread; // none until completed: what the materials' revisions tell
    uint64_t runs;             // COUNT_ABSENT until completed: none without a deviation
    uint64_t seed;
} SensitivityStudy;

// What errors do to one stop's k_b and c_b: relative change over relative error.
typedef struct SensitivityStop {
    uint64_t damper; // from 1
    int side;        // Side
    double restitution, contact_time, effective_mass, stiffness, damping;
    double stiffness_by_restitution, stiffness_by_contact_time;
    double damping_by_restitution, damping_by_contact_time;
    double by_damper_mass, by_structure_mass; // of both k_b and c_b
    double stiffness_deviation;               // relative, of the stated deviations; NAN: none
    double damping_deviation;
    char *why; // where there are no closed forms
} SensitivityStop;

typedef struct SensitivityStops {
    SensitivityStop *at;
    size_t count;
} SensitivityStops;

// One statistic by one parameter.
typedef struct SensitivitySlope {
    int metric;        // EnsembleMetric
    double value;      // of the scene itself
    double derivative; // relative change over relative change, at the middle step
    double spread;     // largest less smallest of all steps'
    bool is_settled;   // the spread is small: the steps agree
} SensitivitySlope;

typedef struct SensitivitySlopes {
    SensitivitySlope *at;
    size_t count;
} SensitivitySlopes;

typedef struct SensitivityRow {
    int parameter; // SensitivityParameter
    Reals steps;   // relative
    SensitivitySlopes slopes;
    char *why; // it has none
} SensitivityRow;

typedef struct SensitivityRows {
    SensitivityRow *at;
    size_t count;
} SensitivityRows;

// One statistic over the drawn runs.
typedef struct SensitivityBand {
    int metric;
    char *unit;
    uint64_t count;
    double value; // of the scene itself
    double mean, standard_deviation, low, high, minimum, q05, median, q95, maximum;
} SensitivityBand;

typedef struct SensitivityBands {
    SensitivityBand *at;
    size_t count;
} SensitivityBands;

typedef struct SensitivitySpectrum {
    char *channel, *unit;
    Reals value, mean, q05, median, q95;
} SensitivitySpectrum;

typedef struct SensitivitySpectra {
    SensitivitySpectrum *at;
    size_t count;
} SensitivitySpectra;

// One drawn run: every buffer's numbers are the scene's times these, damper by damper, buffer by
// buffer.
typedef struct SensitivityDraw {
    uint64_t run; // from 1
    char *why;    // it failed
    Reals restitution, contact_time;
    Summary summary;
} SensitivityDraw;

typedef struct SensitivityDraws {
    SensitivityDraw *at;
    size_t count;
} SensitivityDraws;

// The answer.
typedef struct Sensitivity {
    Variant variant;
    Summary summary; // of the scene itself
    double steps;    // solver steps of all runs, counted
    SensitivityStops contact;
    SensitivityRows response;
    bool is_chaotic; // the scene goes on beyond its trust horizon
    char *why;       // what that means for the slopes
    uint64_t runs, made, failed, seed;
    double restitution_deviation, contact_time_deviation;
    SensitivitySpreads spread;
    char *distribution;
    double confidence;
    SensitivityBands statistics;
    EnsembleFailures failures;
    Reals frequency; // [Hz]
    SensitivitySpectra spectra;
    SensitivityDraws table;
} Sensitivity;

#endif
