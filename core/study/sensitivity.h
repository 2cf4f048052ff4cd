// The study "sensitivity": effects of errors of restitution, contact time and masses on the contact
// parameters and on the response.
#ifndef CORE_STUDY_SENSITIVITY_H
#define CORE_STUDY_SENSITIVITY_H

#include "core/study/parameter_perturbation.h"
#include "core/study/spectrum_accumulator.h"
#include "core/study/statistics.h"
#include "core/study/study.h"

enum { SENSITIVITY_STEPS = 3 }; // each half of the one before

// The request.
typedef struct SensitivityStudy {
    Variant variant;
    Texts parameters; // none until completed: those that the scene has
    double step;      // relative, the largest of SENSITIVITY_STEPS
    InputUncertainty uncertainty;
    uint64_t runs; // COUNT_ABSENT until completed: none without a deviation
    uint64_t seed;
} SensitivityStudy;

// Sensitivity of one stop's k_b and c_b: relative change over relative error.
typedef struct SensitivityStop {
    uint64_t damper; // from 1
    int side;        // Side
    double restitution, contact_time, effective_mass, stiffness, damping;
    double stiffness_by_restitution, stiffness_by_contact_time;
    double damping_by_restitution, damping_by_contact_time;
    double by_damper_mass, by_structure_mass;      // of both k_b and c_b
    double stiffness_deviation, damping_deviation; // relative, of the input's; NAN: none
    char *why;                                     // why there are no closed forms
} SensitivityStop;

typedef struct SensitivityStops {
    SensitivityStop *at;
    size_t count;
} SensitivityStops;

// Derivative of one metric by one parameter.
typedef struct SensitivitySlope {
    int metric;        // StatisticsMetric
    double value;      // of the scene itself
    double derivative; // relative change over relative change, at the middle step
    double spread;     // largest less smallest of all steps
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
    char *why; // why there are none
} SensitivityRow;

typedef struct SensitivityRows {
    SensitivityRow *at;
    size_t count;
} SensitivityRows;

typedef struct SensitivityStatistics {
    RunStatistic *at;
    size_t count;
} SensitivityStatistics;

// The answer.
typedef struct Sensitivity {
    Variant variant;
    Summary summary; // of the scene itself
    double steps;    // solver steps of all runs
    SensitivityStops contact;
    SensitivityRows response;
    bool is_chaotic; // the scene continues beyond its trust horizon
    char *why;       // consequence for the slopes
    uint64_t runs, made, failed, seed;
    InputUncertainty uncertainty;
    char *distribution;
    double confidence;
    SensitivityStatistics statistics; // over the drawn runs
    StudyFailures failures;
    Reals frequency; // [Hz]
    RunSpectra spectra;
    RunTable table; // the drawn runs, from 1
} Sensitivity;

#endif
