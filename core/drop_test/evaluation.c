#include "core/drop_test/evaluation.h"

#include <stdlib.h>

#include "core/drop_test/evaluation_warnings.h"
#include "core/drop_test/reading_statistics.h"
#include "core/drop_test/readings.h"

const char *const restitution_by_names[] = {"heights", "speeds", "pulse", NULL};
const char *const contact_time_by_names[] = {"duration", "pulse", NULL};
const char *const trend_verdict_names[] = {"constant", "not_constant", "undecided", NULL};

// clang-format off
static const Field row_fields[] = {
    FIELD_COUNT(EvaluationRow, measurement, NULL, AT_MIN(1), OPTIONAL, "number of the measurement"),
    FIELD_TEXT(EvaluationRow, from, 0, PRESENCE_OPTIONAL, 0, "which drop, or which contact of which trace, from 1"),
    FIELD_COUNT(EvaluationRow, trace, NULL, AT_MIN(1), OPTIONAL, "which trace of its measurement, from 1; null: a drop"),
    FIELD_REAL(EvaluationRow, approach_speed, "m/s", ANY, OPTIONAL, "as read, else sqrt(2 g h)"),
    FIELD_REAL(EvaluationRow, approach_speed_uncertainty, "m/s", ANY, OPTIONAL, "its standard uncertainty"),
    FIELD_REAL(EvaluationRow, restitution, NULL, ANY, OPTIONAL, "e"),
    FIELD_REAL(EvaluationRow, restitution_uncertainty, NULL, ANY, OPTIONAL, "its standard uncertainty, from the instrument's or the fit's"),
    FIELD_CHOICE(EvaluationRow, restitution_by, restitution_by_names, OPTIONAL, "what told it"),
    FIELD_REAL(EvaluationRow, contact_time, "s", ANY, OPTIONAL, "T_c of the isolated pair"),
    FIELD_REAL(EvaluationRow, contact_time_uncertainty, "s", ANY, OPTIONAL, "its standard uncertainty"),
    FIELD_CHOICE(EvaluationRow, contact_time_by, contact_time_by_names, OPTIONAL, "what told it"),
    FIELD_REAL(EvaluationRow, least_contact_time, "s", ANY, OPTIONAL, "of a trace: within which T_c lies, 95 %, also where there is no figure"),
    FIELD_REAL(EvaluationRow, most_contact_time, "s", ANY, OPTIONAL, "likewise"),
    FIELD_REAL(EvaluationRow, read_restitution, NULL, ANY, OPTIONAL, "e before gravity was taken out; null: it was not"),
    FIELD_REAL(EvaluationRow, read_contact_time, "s", ANY, OPTIONAL, "T_c before gravity was taken out; null: it was not"),
    FIELD_FLAG(EvaluationRow, restitution_counts, 0, "e is in the mean"),
    FIELD_FLAG(EvaluationRow, contact_time_counts, 0, "T_c is in the mean"),
    FIELD_REAL(EvaluationRow, restitution_score, NULL, ANY, OPTIONAL, "robust deviations of e from the median, or from the line where a trend is shown"),
    FIELD_FLAG(EvaluationRow, restitution_is_outlier, 0, "so far away that one good sample in twenty has such a reading; it counts all the same"),
    FIELD_REAL(EvaluationRow, contact_time_score, NULL, ANY, OPTIONAL, "the same of T_c"),
    FIELD_FLAG(EvaluationRow, contact_time_is_outlier, 0, "the same of T_c"),
    FIELD_TEXT(EvaluationRow, excluded, 0, PRESENCE_OPTIONAL, 0, "why neither counts, in the words of who measured"),
    FIELD_TEXT(EvaluationRow, note, 0, PRESENCE_OPTIONAL, 0, "what else there is to know of it"),
    FIELD_ITEM(EvaluationRow, contact, trace_detection_fields, NULL, PRESENCE_OPTIONAL, "the contact as it was detected in its trace; null: none was, or a drop"),
    FIELD_END
};

static const Field ranges_fields[] = {
    FIELD_REAL(Ranges, least_speed, "m/s", ANY, OPTIONAL, "the slowest approach that counts"),
    FIELD_REAL(Ranges, most_speed, "m/s", ANY, OPTIONAL, "the fastest"),
    FIELD_REAL(Ranges, least_temperature, "degC", ANY, OPTIONAL, "the coldest test of which a reading counts"),
    FIELD_REAL(Ranges, most_temperature, "degC", ANY, OPTIONAL, "the warmest"),
    FIELD_END
};

static const Field trend_fields[] = {
    FIELD_COUNT(Trend, count, NULL, AT_MIN(0), OPTIONAL, "readings with a speed"),
    FIELD_REAL(Trend, least_speed, "m/s", ANY, OPTIONAL, "the slowest of them"),
    FIELD_REAL(Trend, most_speed, "m/s", ANY, OPTIONAL, "the fastest"),
    FIELD_REAL(Trend, mean_speed, "m/s", ANY, OPTIONAL, "which the line goes through"),
    FIELD_REAL(Trend, mean_value, NULL, ANY, OPTIONAL, "there"),
    FIELD_REAL(Trend, slope, NULL, ANY, OPTIONAL, "per m/s, by least squares"),
    FIELD_REAL(Trend, standard_error, NULL, ANY, OPTIONAL, "of the slope"),
    FIELD_REAL(Trend, low, NULL, ANY, OPTIONAL, "95 % interval of the slope"),
    FIELD_REAL(Trend, high, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(Trend, t, NULL, ANY, OPTIONAL, "slope over standard error"),
    FIELD_REAL(Trend, p, NULL, ANY, OPTIONAL, "chance of at least such a slope where there is none"),
    FIELD_REAL(Trend, change, NULL, ANY, OPTIONAL, "that the line makes from the slowest to the fastest"),
    FIELD_REAL(Trend, missed_change, NULL, ANY, OPTIONAL, "the largest such change that the data do not rule out, 95 %"),
    FIELD_CHOICE(Trend, verdict, trend_verdict_names, OPTIONAL, "not_constant: a slope is shown, p < 0.05; constant: none is, and a change of 20 % would have been seen; undecided: it would not; null: no test can be made"),
    FIELD_TEXT(Trend, detail, 0, PRESENCE_OPTIONAL, 0, "the verdict in words"),
    FIELD_END
};

static const Field statistic_fields[] = {
    FIELD_COUNT(Statistic, count, NULL, AT_MIN(0), OPTIONAL, "readings that count"),
    FIELD_REAL(Statistic, mean, NULL, ANY, OPTIONAL, "of all that count; where at least four do and all state their uncertainty, weighted by that and scatter"),
    FIELD_REAL(Statistic, unweighted_mean, NULL, ANY, OPTIONAL, "of the readings as they are"),
    FIELD_REAL(Statistic, deviation, NULL, ANY, OPTIONAL, "standard deviation of the readings"),
    FIELD_REAL(Statistic, scatter, NULL, ANY, OPTIONAL, "standard deviation beyond the stated uncertainties; null: the mean is not weighted"),
    FIELD_REAL(Statistic, standard_error, NULL, ANY, OPTIONAL, "of the mean"),
    FIELD_REAL(Statistic, spread, NULL, ANY, OPTIONAL, "standard deviation that a revision states beside the mean: scatter where the mean is weighted, else deviation, and standard_error at least"),
    FIELD_REAL(Statistic, low, NULL, ANY, OPTIONAL, "95 % interval of the mean"),
    FIELD_REAL(Statistic, high, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(Statistic, minimum, NULL, ANY, OPTIONAL, "the smallest reading"),
    FIELD_REAL(Statistic, median, NULL, ANY, OPTIONAL, "the middle one"),
    FIELD_REAL(Statistic, maximum, NULL, ANY, OPTIONAL, "the largest one"),
    FIELD_COUNT(Statistic, outliers, NULL, AT_MIN(0), OPTIONAL, "readings that lie far off; they are in the mean"),
    FIELD_REAL(Statistic, mean_without_outliers, NULL, ANY, OPTIONAL, "null where there are none"),
    FIELD_TEXT(Statistic, why, 0, PRESENCE_OPTIONAL, 0, "how the interval was made, or why there is none"),
    FIELD_ITEM(Statistic, trend, trend_fields, NULL, PRESENCE_DEFAULT, "whether it is constant over approach speed"),
    FIELD_END
};

const Field evaluation_fields[] = {
    FIELD_CHOICE(Evaluation, separation, separation_names, OPTIONAL, "the rule by which traces were read and gravity was taken out"),
    FIELD_REAL(Evaluation, confidence, NULL, ANY, OPTIONAL, "of the intervals"),
    FIELD_BASE(Evaluation, ranges, ranges_fields),
    FIELD_ITEM(Evaluation, restitution, statistic_fields, NULL, PRESENCE_DEFAULT, "e [-]"),
    FIELD_ITEM(Evaluation, contact_time, statistic_fields, NULL, PRESENCE_DEFAULT, "T_c [s]"),
    FIELD_LIST(Evaluation, rows, row_fields, 0, PRESENCE_DEFAULT, "every reading"),
    FIELD_END
};
// clang-format on

void evaluation_clear(Evaluation *evaluation) {
    fields_clear(evaluation_fields, evaluation);
    warnings_clear(&evaluation->warnings);
}

// Heights and speeds are surer than the shape of pulses, which count only where there is nothing
// else.
static void choose_restitutions(Evaluation *evaluation) {
    bool has_sure = false;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        has_sure =
            has_sure || (row->restitution_counts && row->restitution_by != RESTITUTION_BY_PULSE);
    }
    for (size_t i = 0; has_sure && i < evaluation->rows.count; i++)
        if (evaluation->rows.at[i].restitution_by == RESTITUTION_BY_PULSE)
            evaluation->rows.at[i].restitution_counts = false;
}

bool row_counts(const EvaluationRow *row) {
    return row->restitution_counts || row->contact_time_counts;
}

const Ranges ranges_unknown = {(double)NAN, (double)NAN, (double)NAN, (double)NAN};

void ranges_take(Ranges *ranges, const EvaluationRow *row, const Measurement *tests) {
    const double temperature = tests[row->test].test->temperature;
    ranges->least_speed = fmin(ranges->least_speed, row->approach_speed);
    ranges->most_speed = fmax(ranges->most_speed, row->approach_speed);
    ranges->least_temperature = fmin(ranges->least_temperature, temperature);
    ranges->most_temperature = fmax(ranges->most_temperature, temperature);
}

static Status make_restitution(Reading *readings, Evaluation *evaluation, Problem *problem) {
    EvaluationRow *rows = evaluation->rows.at;
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (rows[i].restitution_counts)
            readings[count++] = (Reading){.value = rows[i].restitution,
                                          .uncertainty = rows[i].restitution_uncertainty,
                                          .speed = rows[i].approach_speed,
                                          .row = i};
    TRY(statistic_make(readings, count, "restitution", "", &evaluation->restitution, problem));
    for (size_t i = 0; i < count; i++) {
        rows[readings[i].row].restitution_score = readings[i].score;
        rows[readings[i].row].restitution_is_outlier = readings[i].is_outlier;
    }
    return STATUS_OK;
}

static Status make_contact_time(Reading *readings, Evaluation *evaluation, Problem *problem) {
    EvaluationRow *rows = evaluation->rows.at;
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (rows[i].contact_time_counts)
            readings[count++] = (Reading){.value = rows[i].contact_time,
                                          .uncertainty = rows[i].contact_time_uncertainty,
                                          .speed = rows[i].approach_speed,
                                          .row = i};
    TRY(statistic_make(readings, count, "contact time", " s", &evaluation->contact_time, problem));
    // The fit of a single pulse knows its interval better than two deviations tell it.
    Statistic *of = &evaluation->contact_time;
    const EvaluationRow *only = count == 1 ? &rows[readings[0].row] : NULL;
    if (only != NULL && only->contact_time_by == CONTACT_TIME_BY_PULSE &&
        !isnan(only->least_contact_time) && !isnan(only->most_contact_time)) {
        of->low = only->least_contact_time;
        of->high = only->most_contact_time;
    }
    for (size_t i = 0; i < count; i++) {
        rows[readings[i].row].contact_time_score = readings[i].score;
        rows[readings[i].row].contact_time_is_outlier = readings[i].is_outlier;
    }
    return STATUS_OK;
}

size_t evaluation_sample_count(const Measurement *tests, size_t count) {
    size_t samples = 0;
    for (size_t i = 0; i < count; i++)
        samples += drop_test_sample_count(tests[i].test);
    return samples;
}

// They are all in memory.
static Status check_size(const Measurement *tests, size_t count, Problem *problem) {
    const size_t samples = evaluation_sample_count(tests, count);
    if (samples <= EVALUATION_SAMPLES_MAX)
        return STATUS_OK;
    return problem_set(problem, STATUS_LIMIT,
                       "more than %d samples in traces, %zu: evaluate fewer measurements at a time",
                       EVALUATION_SAMPLES_MAX, samples);
}

Status evaluation_run(const Measurement *tests, size_t count, Separation separation,
                      const Progress *progress, Evaluation *evaluation, Problem *problem) {
    *evaluation = (Evaluation){.separation = (int)separation,
                               .confidence = EVALUATION_CONFIDENCE,
                               .ranges = ranges_unknown};
    TRY(check_size(tests, count, problem));
    for (size_t i = 0; i < count; i++)
        TRY(rows_add(&tests[i], i, progress, evaluation, problem));
    TRY(rows_unpull(tests, count, progress, evaluation, problem));
    choose_restitutions(evaluation);
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (row_counts(&evaluation->rows.at[i]))
            ranges_take(&evaluation->ranges, &evaluation->rows.at[i], tests);
    Reading *readings = calloc(evaluation->rows.count + 1, sizeof *readings);
    if (readings == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
    Status status = make_restitution(readings, evaluation, problem);
    if (status == STATUS_OK)
        status = make_contact_time(readings, evaluation, problem);
    free(readings);
    if (status != STATUS_OK)
        return status;
    return evaluation_warn(tests, count, evaluation) == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
}
