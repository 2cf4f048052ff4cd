#include "core/study/metrics.h"

#include <math.h>
#include <string.h>

#define METRIC_NAME(name, unit) #name,
const char *const study_metric_names[] = {STUDY_METRIC_LIST(METRIC_NAME) NULL};

#define METRIC_ROW(name, unit) FIELD_REAL(StudyMetrics, name, unit, ANY, OPTIONAL, #name),
const Field study_metrics_fields[] = {STUDY_METRIC_LIST(METRIC_ROW) FIELD_END};

static const char reduction_suffix[] = "_reduction";

const char *study_metric_unit(int metric) {
    return study_metrics_fields[metric].unit;
}

bool study_metric_is_reduction(int metric) {
    const char *name = study_metric_names[metric];
    const size_t length = strlen(name), suffix = sizeof reduction_suffix - 1;
    return length > suffix && strcmp(name + length - suffix, reduction_suffix) == 0;
}

Status study_metric_check(const Simulation *simulation, int metric, const char *place,
                          Problem *problem) {
    char name[64];
    text_fit(name, sizeof name, study_metric_names[metric]);
    if (study_metric_is_reduction(metric)) {
        if (simulation->scene.dampers.count == 0)
            return problem_add(problem, STATUS_INVALID, place,
                               "needs a damper: a reduction compares the scene with and without");
        name[strlen(name) - (sizeof reduction_suffix - 1)] = '\0';
    }
    return simulation_check_metric(simulation, name, place, problem);
}

static double metric_read(const Field *fields, const void *item, const char *name) {
    size_t offset = 0;
    const Field *row = fields_find(fields, name, &offset);
    const void *member = (const char *)item + offset + row->offset;
    if (row->kind == FIELD_KIND_REAL)
        return *(const double *)member;
    const uint64_t count = *(const uint64_t *)member;
    return count != COUNT_ABSENT ? (double)count : (double)NAN;
}

double study_summary_value(const Summary *summary, const char *name) {
    return metric_read(summary_fields, summary, name);
}

StudyMetrics study_metrics_of(const RunRecord *run) {
    StudyMetrics metrics;
    for (int i = 0; i < STUDY_METRIC_COUNT; i++)
        metrics.of[i] = study_metric_is_reduction(i)
                            ? metric_read(reduction_fields, &run->reduction, study_metric_names[i])
                            : study_summary_value(&run->summary, study_metric_names[i]);
    return metrics;
}
