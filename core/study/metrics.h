// The metrics by which studies compare runs, in one enumeration: numbers of the summary, and their
// reductions by the dampers.
#ifndef CORE_STUDY_METRICS_H
#define CORE_STUDY_METRICS_H

#include "core/study/study.h"

// Name, unit. The names are those of Summary and Reduction.
#define STUDY_METRIC_LIST(X)                                                                       \
    X(peak_displacement, "m")                                                                      \
    X(rms_displacement, "m")                                                                       \
    X(peak_acceleration, "m/s^2")                                                                  \
    X(rms_acceleration, "m/s^2")                                                                   \
    X(impacts, NULL)                                                                               \
    X(peak_contact_force, "N")                                                                     \
    X(peak_storey_drift, "m")                                                                      \
    X(peak_base_shear, "N")                                                                        \
    X(peak_displacement_reduction, NULL)                                                           \
    X(rms_displacement_reduction, NULL)                                                            \
    X(peak_acceleration_reduction, NULL)                                                           \
    X(rms_acceleration_reduction, NULL)                                                            \
    X(peak_storey_drift_reduction, NULL)                                                           \
    X(peak_base_shear_reduction, NULL)

#define STUDY_METRIC_ONE(name, unit) +1
enum { STUDY_METRIC_COUNT = 0 STUDY_METRIC_LIST(STUDY_METRIC_ONE) };

extern const char *const study_metric_names[]; // NULL-terminated; a metric is its index

// All metrics of a run, or statistics of them over runs. NAN: unknown.
#define STUDY_METRIC_MEMBER(name, unit) double name;
typedef union StudyMetrics {
    struct {
        STUDY_METRIC_LIST(STUDY_METRIC_MEMBER)
    };
    double of[STUDY_METRIC_COUNT];
} StudyMetrics;
extern const Field study_metrics_fields[];

// A number of a summary by its name; NAN: unknown.
double study_summary_value(const Summary *summary, const char *name);
const char *study_metric_unit(int metric); // NULL: none
// Whether a run needs output.reduction for it.
bool study_metric_is_reduction(int metric);
// Validates that the scene can have a metric, which is the value at `place`.
Status study_metric_check(const Simulation *simulation, int metric, const char *place,
                          Problem *problem);
// Of a run that ended; without its reductions where output.reduction was not requested.
StudyMetrics study_metrics_of(const RunRecord *run);

#endif
