#include "core/drop_test/evaluation_warnings.h"

#include <stdio.h>
#include <string.h>

#include "core/drop_test/evaluation_same.h"
#include "core/drop_test/gravity_correction.h"
#include "core/drop_test/readings.h"

enum { OUTLIERS_TOLD = 5, POINTER_SIZE = sizeof((Fault){0}.pointer) };

static const double worth_telling = 0.01;  // an effect of gravity
static const double pair_tolerance = 0.02; // of effective masses that are taken for the same

static bool has(double value) {
    return !isnan(value);
}

static void test_pointer(const Measurement *of, char pointer[POINTER_SIZE]) {
    pointer[0] = '\0';
    if (of->number != COUNT_ABSENT)
        snprintf(pointer, POINTER_SIZE, "/measurements/%llu", (unsigned long long)of->number);
}

// The slowest drop that counts, of a test that leaves gravity alone.
static const EvaluationRow *slowest(const Evaluation *evaluation, size_t test) {
    const EvaluationRow *found = NULL;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row->test == test && row_counts(row) && has(row->approach_speed) &&
            (found == NULL || row->approach_speed < found->approach_speed))
            found = row;
    }
    return found;
}

static Status warn_of_gravity(const Measurement *of, size_t test, Evaluation *evaluation) {
    const EvaluationRow *row = has(of->test->gravity) ? NULL : slowest(evaluation, test);
    if (row == NULL)
        return STATUS_OK;
    char pointer[POINTER_SIZE], place[POINTER_SIZE];
    test_pointer(of, pointer);
    pointer_join(place, sizeof place, pointer, "gravity");
    const double e = row->restitution_counts ? row->restitution : evaluation->restitution.mean;
    const double T = row->contact_time_counts ? row->contact_time : evaluation->contact_time.mean;
    if (!has(T))
        return warnings_add(&evaluation->warnings, place,
                            "gravity during contact is not taken out, and without a contact time "
                            "nobody can tell how much it does; \"gravity\": 0 says that none "
                            "pulls");
    if (!(e > 0))
        return STATUS_OK;
    const GravityLoad pull = {STANDARD_GRAVITY, row->approach_speed,
                              (Separation)evaluation->separation,
                              row->restitution_by == RESTITUTION_BY_HEIGHTS};
    const GravityContact pulled = gravity_apply(&pull, e, T);
    static const char advice[] = "say \"gravity\": 9.80665 to take it out, 0 where none pulls";
    if (!(pulled.restitution > 0))
        return warnings_add(&evaluation->warnings, place,
                            "gravity during contact is not taken out: in a vertical drop at the "
                            "slowest %.3g m/s a contact of this e and T_c would not part at all; "
                            "%s",
                            row->approach_speed, advice);
    const double longer = pulled.contact_time / T - 1, lower = 1 - pulled.restitution / e;
    if (!(fmax(longer, lower) > worth_telling))
        return STATUS_OK;
    return warnings_add(&evaluation->warnings, place,
                        "gravity during contact is not taken out: in a vertical drop at the "
                        "slowest %.3g m/s it lengthens a contact of this e and T_c by %.2g %% and "
                        "lowers e by %.2g %%; %s",
                        row->approach_speed, 100 * longer, 100 * lower, advice);
}

// A height is worth a speed by the gravity of the lab, which what pulls during contact need not be.
static Status warn_of_heights(const Measurement *of, size_t test, Evaluation *evaluation) {
    const double gravity = of->test->gravity;
    if (!(gravity > 0) || !(fabs(gravity / STANDARD_GRAVITY - 1) > worth_telling))
        return STATUS_OK;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row->test != test || row->is_of_trace || !row_counts(row))
            continue;
        const Drop *drop = &of->test->drops.at[row->place];
        const bool is_by_height = has(drop->approach_speed)
                                      ? row->restitution_by == (int)RESTITUTION_BY_HEIGHTS
                                      : has(drop->drop_height);
        if (!is_by_height)
            continue;
        char pointer[POINTER_SIZE], place[POINTER_SIZE];
        test_pointer(of, pointer);
        pointer_join(place, sizeof place, pointer, "gravity");
        return warnings_add(&evaluation->warnings, place,
                            "%.4g m/s^2 pull during contact, but speeds are told from heights by "
                            "%.6g m/s^2: where that is not what the impactor fell by, give "
                            "approach_speed and rebound_speed",
                            gravity, STANDARD_GRAVITY);
    }
    return STATUS_OK;
}

static Status warn_of_pairs(const Measurement *tests, size_t count, Evaluation *evaluation) {
    for (size_t i = 1; i < count; i++) {
        char pointer[POINTER_SIZE];
        test_pointer(&tests[i], pointer);
        const double first = drop_test_effective_mass(tests[0].test),
                     other = drop_test_effective_mass(tests[i].test);
        if (fabs(other - first) > pair_tolerance * first)
            TRY(warnings_add(&evaluation->warnings, pointer,
                             "was made with another pair of masses: effective mass %.4g kg, the "
                             "first's is %.4g kg; e and T_c belong to a pair",
                             other, first));
    }
    return STATUS_OK;
}

// Pulses tell e, too, but only as far as the buffer is the model's.
static Status warn_of_pulses(Evaluation *evaluation, bool is_left_out) {
    if (is_left_out)
        return warnings_add(&evaluation->warnings, "",
                            "the restitution that pulses tell by their shape is shown but does "
                            "not count beside heights or speeds");
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (evaluation->rows.at[i].restitution_counts)
            return evaluation->rows.at[i].restitution_by != RESTITUTION_BY_PULSE
                       ? STATUS_OK
                       : warnings_add(&evaluation->warnings, "",
                                      "restitution is told by the shape of force pulses alone, "
                                      "which is right only for a buffer that is the model's; "
                                      "heights or speeds are surer");
    return STATUS_OK;
}

static Status warn_of_interval(Evaluation *evaluation) {
    if (evaluation->contact_time.count > 0)
        return STATUS_OK;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        char pointer[POINTER_SIZE];
        row_pointer(row, pointer, sizeof pointer);
        if (row->excluded == NULL && has(row->least_contact_time) && has(row->most_contact_time))
            return warnings_add(&evaluation->warnings, pointer,
                                "no trace gives a figure for the contact time; by %s it lies "
                                "between %.3g and %.3g s (%s)",
                                row->from, row->least_contact_time, row->most_contact_time,
                                row->note != NULL ? row->note : "no reason is known");
    }
    return STATUS_OK;
}

// Figures that a trace gives with a reservation count, but not in silence.
static Status warn_of_doubt(Evaluation *evaluation) {
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
    char pointer[POINTER_SIZE];
    row_pointer(first, pointer, sizeof pointer);
    return warnings_add(&evaluation->warnings, pointer,
                        "%zu contact%s of traces count%s though doubtful; %s: %s", count,
                        count == 1 ? "" : "s", count == 1 ? "s" : "", first->from, first->note);
}

static Status warn_of_outlier(const EvaluationRow *row, const char *name, double value,
                              double score, const Statistic *of, Evaluation *evaluation) {
    char pointer[POINTER_SIZE];
    row_pointer(row, pointer, sizeof pointer);
    return warnings_add(&evaluation->warnings, pointer,
                        "%s %.4g of %s lies %.1f robust deviations from the middle; it counts all "
                        "the same: the mean is %.4g with all readings and %.4g without outliers "
                        "(%llu); one that was seen to go wrong takes \"excluded\" with the reason",
                        name, value, row->from, fabs(score), of->mean, of->mean_without_outliers,
                        (unsigned long long)of->outliers);
}

static Status warn_of_outliers(Evaluation *evaluation) {
    int told[2] = {0, 0};
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row->restitution_is_outlier && told[0]++ < OUTLIERS_TOLD)
            TRY(warn_of_outlier(row, "restitution", row->restitution, row->restitution_score,
                                &evaluation->restitution, evaluation));
        if (row->contact_time_is_outlier && told[1]++ < OUTLIERS_TOLD)
            TRY(warn_of_outlier(row, "contact time", row->contact_time, row->contact_time_score,
                                &evaluation->contact_time, evaluation));
    }
    return STATUS_OK;
}

Status evaluation_warn(const Measurement *tests, size_t count, Evaluation *evaluation) {
    bool is_left_out = false;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        is_left_out = is_left_out || (row->restitution_by == RESTITUTION_BY_PULSE &&
                                      row->excluded == NULL && !row->restitution_counts);
    }
    for (size_t i = 0; i < count; i++) {
        TRY(warn_of_gravity(&tests[i], i, evaluation));
        TRY(warn_of_heights(&tests[i], i, evaluation));
    }
    TRY(warn_of_pairs(tests, count, evaluation));
    TRY(evaluation_warn_same(tests, count, evaluation));
    TRY(warn_of_pulses(evaluation, is_left_out));
    TRY(warn_of_interval(evaluation));
    TRY(warn_of_doubt(evaluation));
    return warn_of_outliers(evaluation);
}
