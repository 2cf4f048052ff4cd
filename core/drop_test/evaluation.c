#include "core/drop_test/evaluation.h"

#include <stdlib.h>

#include "core/drop_test/evaluation_warnings.h"

// clang-format off
static const Field ranges_fields[] = {
    FIELD_REAL(Ranges, least_speed, "m/s", ANY, OPTIONAL, "the slowest approach that counts"),
    FIELD_REAL(Ranges, most_speed, "m/s", ANY, OPTIONAL, "the fastest"),
    FIELD_REAL(Ranges, least_temperature, "degC", ANY, OPTIONAL, "the coldest test of which a reading counts"),
    FIELD_REAL(Ranges, most_temperature, "degC", ANY, OPTIONAL, "the warmest"),
    FIELD_END
};

const Field evaluation_fields[] = {
    FIELD_CHOICE(Evaluation, separation, separation_names, OPTIONAL, "the rule by which traces were read and gravity was taken out"),
    FIELD_REAL(Evaluation, confidence, NULL, ANY, OPTIONAL, "of the intervals"),
    FIELD_BASE(Evaluation, ranges, ranges_fields),
    FIELD_ITEM(Evaluation, restitution, reading_statistic_fields, NULL, PRESENCE_DEFAULT, "e [-]"),
    FIELD_ITEM(Evaluation, contact_time, reading_statistic_fields, NULL, PRESENCE_DEFAULT, "T_c [s]"),
    FIELD_LIST(Evaluation, rows, evaluation_row_fields, 0, PRESENCE_DEFAULT, "every reading"),
    FIELD_END
};
// clang-format on

void evaluation_clear(Evaluation *evaluation) {
    fields_clear(evaluation_fields, evaluation);
    warnings_clear(&evaluation->warnings);
}

const Ranges ranges_unknown = {(double)NAN, (double)NAN, (double)NAN, (double)NAN};

void ranges_extend(Ranges *ranges, const EvaluationRow *row, const Measurement *tests) {
    const double temperature = tests[row->test].test->temperature;
    ranges->least_speed = fmin(ranges->least_speed, row->approach_speed);
    ranges->most_speed = fmax(ranges->most_speed, row->approach_speed);
    ranges->least_temperature = fmin(ranges->least_temperature, temperature);
    ranges->most_temperature = fmax(ranges->most_temperature, temperature);
}

size_t evaluation_sample_count(const Measurement *tests, size_t count) {
    size_t samples = 0;
    for (size_t i = 0; i < count; i++)
        samples += drop_test_sample_count(tests[i].test);
    return samples;
}

// Heights and speeds are more reliable than the shape of pulses, which counts only without them.
static void evaluation_choose_restitutions(EvaluationRows *rows) {
    bool has_other = false;
    for (size_t i = 0; i < rows->count; i++)
        has_other = has_other || (rows->at[i].restitution_counts &&
                                  rows->at[i].restitution_by != RESTITUTION_BY_PULSE);
    for (size_t i = 0; i < rows->count; i++)
        if (has_other && rows->at[i].restitution_by == RESTITUTION_BY_PULSE)
            rows->at[i].restitution_counts = false;
}

// The statistic of T_c or e, and the scores of its readings. `readings` has room for all rows and
// one more.
static Status evaluation_set_statistic(bool is_time, Reading *readings, Evaluation *evaluation,
                                       Problem *problem) {
    EvaluationRow *rows = evaluation->rows.at;
    Statistic *statistic = is_time ? &evaluation->contact_time : &evaluation->restitution;
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (reading_get(&rows[i], is_time, &readings[count]))
            readings[count++].row = i;
    TRY(reading_statistics_run(readings, count, is_time ? "contact time" : "restitution",
                               is_time ? " s" : "", statistic, problem));
    // The fit of a single pulse has a better interval than two deviations.
    const EvaluationRow *only = is_time && count == 1 ? &rows[readings[0].row] : NULL;
    if (only != NULL && only->contact_time_by == CONTACT_TIME_BY_PULSE &&
        !isnan(only->least_contact_time) && !isnan(only->most_contact_time)) {
        statistic->low = only->least_contact_time;
        statistic->high = only->most_contact_time;
    }
    for (size_t i = 0; i < count; i++) {
        EvaluationRow *row = &rows[readings[i].row];
        *(is_time ? &row->contact_time_score : &row->restitution_score) = readings[i].score;
        *(is_time ? &row->contact_time_is_outlier : &row->restitution_is_outlier) =
            readings[i].is_outlier;
    }
    return STATUS_OK;
}

Status evaluation_run(const Measurement *tests, size_t count, Separation separation,
                      const Progress *progress, Evaluation *evaluation, Problem *problem) {
    *evaluation = (Evaluation){.separation = (int)separation,
                               .confidence = EVALUATION_CONFIDENCE,
                               .ranges = ranges_unknown};
    EvaluationRows *rows = &evaluation->rows;
    const size_t samples = evaluation_sample_count(tests, count);
    if (samples > EVALUATION_SAMPLES_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "more than %d samples in traces, %zu: evaluate fewer measurements at a "
                           "time",
                           EVALUATION_SAMPLES_MAX, samples);
    for (size_t i = 0; i < count; i++)
        TRY(readings_add(tests, i, (int)separation, progress, rows, problem));
    TRY(readings_correct_gravity(tests, count, (int)separation, progress, rows, problem));
    evaluation_choose_restitutions(rows);
    for (size_t i = 0; i < rows->count; i++)
        if (reading_counts(&rows->at[i]))
            ranges_extend(&evaluation->ranges, &rows->at[i], tests);
    Reading *readings = calloc(rows->count + 1, sizeof *readings);
    Status status = readings != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    for (int is_time = 0; is_time < 2 && status == STATUS_OK; is_time++)
        status = evaluation_set_statistic(is_time == 1, readings, evaluation, problem);
    free(readings);
    const EvaluationResult result = {(int)separation, rows, &evaluation->restitution,
                                     &evaluation->contact_time};
    if (status == STATUS_OK)
        status = evaluation_warnings_add(tests, count, &result, &evaluation->warnings);
    return status == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
}
