#include "core/drop_test/evaluation_warnings.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/base/canonical.h"
#include "core/base/json_pointer.h"
#include "core/drop_test/gravity_correction.h"

enum { OUTLIERS_MAX = 5, POINTER_SIZE = sizeof((Fault){0}.pointer) };

static const double effect_min = 0.01;     // of gravity
static const double pair_tolerance = 0.02; // of effective masses that are considered equal

// "/measurements/3/gravity"; without a name the measurement alone.
static void warning_pointer(const Measurement *of, const char *name, char pointer[POINTER_SIZE]) {
    char test[40] = "";
    if (of->number != COUNT_ABSENT)
        snprintf(test, sizeof test, "/measurements/%llu", (unsigned long long)of->number);
    if (name != NULL)
        json_pointer_join(pointer, POINTER_SIZE, test, name);
    else
        snprintf(pointer, POINTER_SIZE, "%s", test);
}

// The slowest row of a test that counts.
static const EvaluationRow *warning_slowest(const EvaluationRows *rows, size_t test) {
    const EvaluationRow *found = NULL;
    for (size_t i = 0; i < rows->count; i++) {
        const EvaluationRow *row = &rows->at[i];
        if (row->test == test && reading_counts(row) && !isnan(row->approach_speed) &&
            (found == NULL || row->approach_speed < found->approach_speed))
            found = row;
    }
    return found;
}

static Status warn_of_gravity(const Measurement *of, size_t test, const EvaluationResult *result,
                              Warnings *warnings) {
    const EvaluationRow *row =
        isnan(of->test->gravity) ? warning_slowest(result->rows, test) : NULL;
    if (row == NULL)
        return STATUS_OK;
    char place[POINTER_SIZE];
    warning_pointer(of, "gravity", place);
    const double e = row->restitution_counts ? row->restitution : result->restitution->mean;
    const double T = row->contact_time_counts ? row->contact_time : result->contact_time->mean;
    if (isnan(T))
        return warnings_add(warnings, place,
                            "gravity during contact is not corrected, and its effect is unknown "
                            "without a contact time; \"gravity\": 0 states that there is none");
    if (!(e > 0))
        return STATUS_OK;
    const GravityLoad load = {STANDARD_GRAVITY, row->approach_speed, (Separation)result->separation,
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
static Status warn_of_heights(const Measurement *of, size_t test, const EvaluationRows *rows,
                              Warnings *warnings) {
    const double gravity = of->test->gravity;
    if (!(gravity > 0) || !(fabs(gravity / STANDARD_GRAVITY - 1) > effect_min))
        return STATUS_OK;
    for (size_t i = 0; i < rows->count; i++) {
        const EvaluationRow *row = &rows->at[i];
        if (row->test != test || row->is_of_trace || !reading_counts(row))
            continue;
        const Drop *drop = &of->test->drops.at[row->place];
        const bool is_by_height = !isnan(drop->approach_speed)
                                      ? row->restitution_by == (int)RESTITUTION_BY_HEIGHTS
                                      : !isnan(drop->drop_height);
        if (!is_by_height)
            continue;
        char place[POINTER_SIZE];
        warning_pointer(of, "gravity", place);
        return warnings_add(
            warnings, place,
            "gravity during contact is %.4g m/s^2, but speeds follow from heights by %.6g m/s^2: "
            "where the impactor fell by another gravity, give approach_speed and rebound_speed",
            gravity, STANDARD_GRAVITY);
    }
    return STATUS_OK;
}

static Status warn_of_pairs(const Measurement *tests, size_t count, Warnings *warnings) {
    for (size_t i = 1; i < count; i++) {
        char pointer[POINTER_SIZE];
        warning_pointer(&tests[i], NULL, pointer);
        const double first = drop_test_effective_mass(tests[0].test);
        const double other = drop_test_effective_mass(tests[i].test);
        if (fabs(other - first) > pair_tolerance * first)
            TRY(warnings_add(warnings, pointer,
                             "was made with another pair of masses: effective mass %.4g kg, that "
                             "of the first is %.4g kg; e and T_c belong to a pair",
                             other, first));
    }
    return STATUS_OK;
}

// FNV-1a; two of a hundred different tests practically never have the same 64 bits.
static void warning_digest(void *context, const void *bytes, size_t size) {
    uint64_t *sum = context;
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; i++)
        *sum = (*sum ^ at[i]) * 1099511628211u;
}

// Tests that count and equal an earlier one in every member. `sums` has room for all; 0: does not
// count.
static Status warn_of_copies(const Measurement *tests, size_t count, const EvaluationRows *rows,
                             uint64_t *sums, Warnings *warnings) {
    for (size_t i = 0; i < rows->count; i++)
        if (reading_counts(&rows->at[i]))
            sums[rows->at[i].test] = 14695981039346656037u;
    for (size_t i = 0; i < count; i++) {
        if (sums[i] == 0)
            continue;
        canonical_write(drop_test_fields, tests[i].test, warning_digest, &sums[i]);
        size_t k = 0;
        while (sums[k] != sums[i])
            k++;
        if (k == i)
            continue;
        char pointer[POINTER_SIZE], other[40] = "a test before it";
        warning_pointer(&tests[i], NULL, pointer);
        if (tests[k].number != COUNT_ABSENT)
            snprintf(other, sizeof other, "measurement %llu", (unsigned long long)tests[k].number);
        TRY(warnings_add(warnings, pointer,
                         "is %s once more, equal in every member, and both count: if it was sent "
                         "twice the standard errors are too small; leave one out",
                         other));
    }
    return STATUS_OK;
}

// The shape of a pulse gives e too, but only as far as the buffer follows the model.
static Status warn_of_pulses(const EvaluationRows *rows, Warnings *warnings) {
    bool is_first = true, is_by_pulse = false;
    for (size_t i = 0; i < rows->count; i++) {
        const EvaluationRow *row = &rows->at[i];
        const bool is_pulse = row->restitution_by == RESTITUTION_BY_PULSE;
        if (is_pulse && row->excluded == NULL && !row->restitution_counts)
            return warnings_add(warnings, "",
                                "the restitution from the shape of pulses is shown but does not "
                                "count: heights or speeds are known");
        if (row->restitution_counts && is_first)
            is_by_pulse = is_pulse;
        is_first = is_first && !row->restitution_counts;
    }
    return !is_by_pulse ? STATUS_OK
                        : warnings_add(warnings, "",
                                       "restitution follows from the shape of force pulses alone, "
                                       "which is right only for a buffer that follows the model; "
                                       "heights or speeds are more reliable");
}

static Status warn_of_interval(const EvaluationResult *result, Warnings *warnings) {
    for (size_t i = 0; i < result->rows->count && result->contact_time->count == 0; i++) {
        const EvaluationRow *row = &result->rows->at[i];
        char pointer[POINTER_SIZE];
        reading_pointer(row, pointer, sizeof pointer);
        if (row->excluded == NULL && !isnan(row->least_contact_time) &&
            !isnan(row->most_contact_time))
            return warnings_add(warnings, pointer,
                                "no trace gives a value of the contact time; by %s it is between "
                                "%.3g and %.3g s (%s)",
                                row->from, row->least_contact_time, row->most_contact_time,
                                row->note != NULL ? row->note : "no reason is known");
    }
    return STATUS_OK;
}

// Contacts of traces that count although their figures are doubtful.
static Status warn_of_doubt(const EvaluationRows *rows, Warnings *warnings) {
    const EvaluationRow *first = NULL;
    size_t count = 0;
    for (size_t i = 0; i < rows->count; i++) {
        const EvaluationRow *row = &rows->at[i];
        if (!row->is_of_trace || !row->contact_time_counts || row->note == NULL)
            continue;
        first = first != NULL ? first : row;
        count++;
    }
    if (first == NULL)
        return STATUS_OK;
    char pointer[POINTER_SIZE];
    reading_pointer(first, pointer, sizeof pointer);
    return warnings_add(warnings, pointer,
                        "%zu contact%s of traces count%s though doubtful; %s: %s", count,
                        count == 1 ? "" : "s", count == 1 ? "s" : "", first->from, first->note);
}

static Status warn_of_outliers(const EvaluationResult *result, Warnings *warnings) {
    int warned[2] = {0, 0};
    for (size_t i = 0; i < result->rows->count; i++)
        for (int is_time = 0; is_time < 2; is_time++) {
            const EvaluationRow *row = &result->rows->at[i];
            const Statistic *of = is_time ? result->contact_time : result->restitution;
            const bool is_outlier =
                is_time ? row->contact_time_is_outlier : row->restitution_is_outlier;
            if (!is_outlier || warned[is_time]++ >= OUTLIERS_MAX)
                continue;
            char pointer[POINTER_SIZE];
            reading_pointer(row, pointer, sizeof pointer);
            TRY(warnings_add(
                warnings, pointer,
                "%s %.4g of %s is %.1f robust deviations from the median; it counts: the mean is "
                "%.4g with all readings and %.4g without outliers (%llu); a reading that is known "
                "to be wrong needs \"excluded\" with the reason",
                is_time ? "contact time" : "restitution",
                is_time ? row->contact_time : row->restitution, row->from,
                fabs(is_time ? row->contact_time_score : row->restitution_score), of->mean,
                of->mean_without_outliers, (unsigned long long)of->outliers));
        }
    return STATUS_OK;
}

Status evaluation_warnings_add(const Measurement *tests, size_t count,
                               const EvaluationResult *result, Warnings *warnings) {
    for (size_t i = 0; i < count; i++) {
        TRY(warn_of_gravity(&tests[i], i, result, warnings));
        TRY(warn_of_heights(&tests[i], i, result->rows, warnings));
    }
    TRY(warn_of_pairs(tests, count, warnings));
    uint64_t *sums = calloc(count + 1, sizeof *sums);
    const Status status = sums != NULL ? warn_of_copies(tests, count, result->rows, sums, warnings)
                                       : STATUS_NO_MEMORY;
    free(sums);
    TRY(status);
    TRY(warn_of_pulses(result->rows, warnings));
    TRY(warn_of_interval(result, warnings));
    TRY(warn_of_doubt(result->rows, warnings));
    return warn_of_outliers(result, warnings);
}
