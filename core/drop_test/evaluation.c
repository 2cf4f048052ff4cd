#include "core/drop_test/evaluation.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/base/canonical.h"
#include "core/drop_test/gravity_correction.h"

enum { OUTLIERS_MAX = 5, POINTER_SIZE = sizeof((Fault){0}.pointer) };

static const double effect_min = 0.01;     // of gravity
static const double pair_tolerance = 0.02; // of effective masses that are considered equal

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

// The slowest row of a test that counts.
static const EvaluationRow *evaluation_slowest(const EvaluationRows *rows, size_t test) {
    const EvaluationRow *found = NULL;
    for (size_t i = 0; i < rows->count; i++) {
        const EvaluationRow *row = &rows->at[i];
        if (row->test == test && reading_counts(row) && !isnan(row->approach_speed) &&
            (found == NULL || row->approach_speed < found->approach_speed))
            found = row;
    }
    return found;
}

static Status evaluation_warn_of_gravity(const Measurement *of, size_t test,
                                         Evaluation *evaluation) {
    const EvaluationRow *row =
        isnan(of->test->gravity) ? evaluation_slowest(&evaluation->rows, test) : NULL;
    if (row == NULL)
        return STATUS_OK;
    Warnings *warnings = &evaluation->warnings;
    char place[POINTER_SIZE];
    measurement_pointer(of->number, "/gravity", place, sizeof place);
    const double e = row->restitution_counts ? row->restitution : evaluation->restitution.mean;
    const double T = row->contact_time_counts ? row->contact_time : evaluation->contact_time.mean;
    if (isnan(T))
        return warnings_add(warnings, place,
                            "gravity during contact is not corrected, and its effect is unknown "
                            "without a contact time; \"gravity\": 0 states that there is none");
    if (!(e > 0))
        return STATUS_OK;
    const GravityLoad load = {STANDARD_GRAVITY, row->approach_speed,
                              (Separation)evaluation->separation,
                              row->restitution_by == RESTITUTION_BY_HEIGHTS};
    const GravityContact with = gravity_apply(&load, e, T);
    static const char advice[] = "set \"gravity\": 9.80665 to correct it, 0 where there is none";
    if (!(with.restitution > 0))
        return warnings_add(warnings, place,
                            "gravity during contact is not corrected: in a vertical drop at the "
                            "slowest %.3g m/s a contact with this e and T_c would not end; %s",
                            row->approach_speed, advice);
    const double longer = with.contact_time / T - 1, lower = 1 - with.restitution / e;
    if (!(fmax(longer, lower) > effect_min))
        return STATUS_OK;
    return warnings_add(
        warnings, place,
        "gravity during contact is not corrected: in a vertical drop at the slowest %.3g m/s it "
        "lengthens a contact with this e and T_c by %.2g %% and lowers e by %.2g %%; %s",
        row->approach_speed, 100 * longer, 100 * lower, advice);
}

// Heights give speeds by standard gravity, which need not be the gravity during contact.
static Status evaluation_warn_of_heights(const Measurement *of, size_t test,
                                         Evaluation *evaluation) {
    const double gravity = of->test->gravity;
    if (!(gravity > 0) || !(fabs(gravity / STANDARD_GRAVITY - 1) > effect_min))
        return STATUS_OK;
    bool is_by_height = false;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row->test != test || row->is_of_trace || !reading_counts(row))
            continue;
        const Drop *drop = &of->test->drops.at[row->place];
        is_by_height = is_by_height || (!isnan(drop->approach_speed)
                                            ? row->restitution_by == (int)RESTITUTION_BY_HEIGHTS
                                            : !isnan(drop->drop_height));
    }
    char place[POINTER_SIZE];
    measurement_pointer(of->number, "/gravity", place, sizeof place);
    return !is_by_height
               ? STATUS_OK
               : warnings_add(&evaluation->warnings, place,
                              "gravity during contact is %.4g m/s^2, but speeds follow from "
                              "heights by %.6g m/s^2: where the impactor fell by another gravity, "
                              "give approach_speed and rebound_speed",
                              gravity, STANDARD_GRAVITY);
}

static Status evaluation_warn_of_pairs(const Measurement *tests, size_t count, Warnings *warnings) {
    for (size_t i = 1; i < count; i++) {
        char place[POINTER_SIZE];
        measurement_pointer(tests[i].number, "", place, sizeof place);
        const double first = drop_test_effective_mass(tests[0].test);
        const double other = drop_test_effective_mass(tests[i].test);
        if (fabs(other - first) > pair_tolerance * first)
            TRY(warnings_add(warnings, place,
                             "was made with another pair of masses: effective mass %.4g kg, that "
                             "of the first is %.4g kg; e and T_c belong to a pair",
                             other, first));
    }
    return STATUS_OK;
}

// FNV-1a; two of a hundred different tests practically never have the same 64 bits.
static void evaluation_digest(void *context, const void *bytes, size_t size) {
    uint64_t *sum = context;
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; i++)
        *sum = (*sum ^ at[i]) * 1099511628211u;
}

// Tests that count and equal an earlier one in every member.
static Status evaluation_warn_of_copies(const Measurement *tests, size_t count,
                                        Evaluation *evaluation) {
    const EvaluationRows *rows = &evaluation->rows;
    uint64_t *sums = calloc(count + 1, sizeof *sums); // 0: does not count
    Status status = sums != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    for (size_t i = 0; i < rows->count && status == STATUS_OK; i++)
        if (reading_counts(&rows->at[i]))
            sums[rows->at[i].test] = 14695981039346656037u;
    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        if (sums[i] == 0)
            continue;
        canonical_write(drop_test_fields, tests[i].test, evaluation_digest, &sums[i]);
        size_t k = 0;
        while (sums[k] != sums[i])
            k++;
        if (k == i)
            continue;
        char place[POINTER_SIZE], other[40] = "a test before it";
        measurement_pointer(tests[i].number, "", place, sizeof place);
        if (tests[k].number != COUNT_ABSENT)
            snprintf(other, sizeof other, "measurement %llu", (unsigned long long)tests[k].number);
        status = warnings_add(&evaluation->warnings, place,
                              "is %s once more, equal in every member, and both count: if it was "
                              "sent twice the standard errors are too small; leave one out",
                              other);
    }
    free(sums);
    return status;
}

// The shape of a pulse gives e too, but only as far as the buffer follows the model.
static Status evaluation_warn_of_pulses(Evaluation *evaluation) {
    bool is_by_pulse = false, is_left_out = false;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        const bool is_pulse = row->restitution_by == RESTITUTION_BY_PULSE;
        is_left_out =
            is_left_out || (is_pulse && row->excluded == NULL && !row->restitution_counts);
        is_by_pulse = is_by_pulse || (is_pulse && row->restitution_counts);
    }
    if (is_left_out)
        return warnings_add(&evaluation->warnings, "",
                            "the restitution from the shape of pulses is shown but does not "
                            "count: heights or speeds are known");
    if (is_by_pulse)
        return warnings_add(&evaluation->warnings, "",
                            "restitution follows from the shape of force pulses alone, which is "
                            "right only for a buffer that follows the model; heights or speeds are "
                            "more reliable");
    return STATUS_OK;
}

static Status evaluation_warn_of_interval(Evaluation *evaluation) {
    for (size_t i = 0; i < evaluation->rows.count && evaluation->contact_time.count == 0; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        char place[POINTER_SIZE];
        reading_pointer(row, place, sizeof place);
        if (row->excluded == NULL && !isnan(row->least_contact_time) &&
            !isnan(row->most_contact_time))
            return warnings_add(&evaluation->warnings, place,
                                "no trace gives a value of the contact time; by %s it is between "
                                "%.3g and %.3g s (%s)",
                                row->from, row->least_contact_time, row->most_contact_time,
                                row->note != NULL ? row->note : "no reason is known");
    }
    return STATUS_OK;
}

// Contacts of traces that count although their figures are doubtful.
static Status evaluation_warn_of_doubt(Evaluation *evaluation) {
    const EvaluationRow *first = NULL;
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (!row->is_of_trace || !row->contact_time_counts || row->note == NULL)
            continue;
        first = first != NULL ? first : row;
        count++;
    }
    if (first == NULL)
        return STATUS_OK;
    char place[POINTER_SIZE];
    reading_pointer(first, place, sizeof place);
    return warnings_add(&evaluation->warnings, place,
                        "%zu contact%s of traces count%s though doubtful; %s: %s", count,
                        count == 1 ? "" : "s", count == 1 ? "s" : "", first->from, first->note);
}

static Status evaluation_warn_of_outliers(Evaluation *evaluation) {
    int warned[2] = {0, 0};
    for (size_t i = 0; i < 2 * evaluation->rows.count; i++) {
        const bool is_time = i % 2 == 1;
        const EvaluationRow *row = &evaluation->rows.at[i / 2];
        const Statistic *of = is_time ? &evaluation->contact_time : &evaluation->restitution;
        if (!(is_time ? row->contact_time_is_outlier : row->restitution_is_outlier) ||
            warned[is_time]++ >= OUTLIERS_MAX)
            continue;
        char place[POINTER_SIZE];
        reading_pointer(row, place, sizeof place);
        TRY(warnings_add(
            &evaluation->warnings, place,
            "%s %.4g of %s is %.1f robust deviations from the median; it counts: the mean is %.4g "
            "with all readings and %.4g without outliers (%llu); a reading that is known to be "
            "wrong needs \"excluded\" with the reason",
            is_time ? "contact time" : "restitution",
            is_time ? row->contact_time : row->restitution, row->from,
            fabs(is_time ? row->contact_time_score : row->restitution_score), of->mean,
            of->mean_without_outliers, (unsigned long long)of->outliers));
    }
    return STATUS_OK;
}

static Status evaluation_warn(const Measurement *tests, size_t count, Evaluation *evaluation) {
    for (size_t i = 0; i < count; i++) {
        TRY(evaluation_warn_of_gravity(&tests[i], i, evaluation));
        TRY(evaluation_warn_of_heights(&tests[i], i, evaluation));
    }
    TRY(evaluation_warn_of_pairs(tests, count, &evaluation->warnings));
    TRY(evaluation_warn_of_copies(tests, count, evaluation));
    TRY(evaluation_warn_of_pulses(evaluation));
    TRY(evaluation_warn_of_interval(evaluation));
    TRY(evaluation_warn_of_doubt(evaluation));
    return evaluation_warn_of_outliers(evaluation);
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
    if (status == STATUS_OK)
        status = evaluation_warn(tests, count, evaluation);
    return status == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
}
