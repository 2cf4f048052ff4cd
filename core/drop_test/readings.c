// Uncertainties by the rule of small errors: with e = sqrt(h_r / h_d) and v = sqrt(2 g h) a
// relative error of a height counts half.
#include "core/drop_test/readings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/status.h"
#include "core/drop_test/gravity_correction.h"
#include "core/scene/material.h"

static const char *const restitution_by_names[] = {"heights", "speeds", "pulse", NULL};
static const char *const contact_time_by_names[] = {"duration", "pulse", NULL};

// clang-format off
const Field evaluation_row_fields[] = {
    FIELD_COUNT(EvaluationRow, measurement, NULL, AT_MIN(1), OPTIONAL, "number of the measurement"),
    FIELD_TEXT(EvaluationRow, from, 0, PRESENCE_OPTIONAL, 0, "which drop, or which contact of which trace, from 1"),
    FIELD_COUNT(EvaluationRow, trace, NULL, AT_MIN(1), OPTIONAL, "which trace of its measurement, from 1; null: a drop"),
    FIELD_REAL(EvaluationRow, approach_speed, "m/s", ANY, OPTIONAL, "as read, else sqrt(2 g h)"),
    FIELD_REAL(EvaluationRow, approach_speed_uncertainty, "m/s", ANY, OPTIONAL, "its standard uncertainty"),
    FIELD_REAL(EvaluationRow, restitution, NULL, ANY, OPTIONAL, "e"),
    FIELD_REAL(EvaluationRow, restitution_uncertainty, NULL, ANY, OPTIONAL, "its standard uncertainty, from the instrument's or the fit's"),
    FIELD_CHOICE(EvaluationRow, restitution_by, restitution_by_names, OPTIONAL, "its source"),
    FIELD_REAL(EvaluationRow, contact_time, "s", ANY, OPTIONAL, "T_c of the isolated pair"),
    FIELD_REAL(EvaluationRow, contact_time_uncertainty, "s", ANY, OPTIONAL, "its standard uncertainty"),
    FIELD_CHOICE(EvaluationRow, contact_time_by, contact_time_by_names, OPTIONAL, "its source"),
    FIELD_REAL(EvaluationRow, least_contact_time, "s", ANY, OPTIONAL, "of a trace: lower end of the 95 % interval of T_c, also where there is no value"),
    FIELD_REAL(EvaluationRow, most_contact_time, "s", ANY, OPTIONAL, "likewise"),
    FIELD_REAL(EvaluationRow, read_restitution, NULL, ANY, OPTIONAL, "e before the correction of gravity; null: none was made"),
    FIELD_REAL(EvaluationRow, read_contact_time, "s", ANY, OPTIONAL, "T_c before the correction of gravity; null: none was made"),
    FIELD_FLAG(EvaluationRow, restitution_counts, 0, "e is in the mean"),
    FIELD_FLAG(EvaluationRow, contact_time_counts, 0, "T_c is in the mean"),
    FIELD_REAL(EvaluationRow, restitution_score, NULL, ANY, OPTIONAL, "robust deviations of e from the median, or from the line where a trend is shown"),
    FIELD_FLAG(EvaluationRow, restitution_is_outlier, 0, "so far away that only one good sample in twenty has such a reading; it counts"),
    FIELD_REAL(EvaluationRow, contact_time_score, NULL, ANY, OPTIONAL, "the same of T_c"),
    FIELD_FLAG(EvaluationRow, contact_time_is_outlier, 0, "the same of T_c"),
    FIELD_TEXT(EvaluationRow, excluded, 0, PRESENCE_OPTIONAL, 0, "why neither counts, as stated with the test"),
    FIELD_TEXT(EvaluationRow, note, 0, PRESENCE_OPTIONAL, 0, "further remarks"),
    FIELD_ITEM(EvaluationRow, contact, trace_detection_fields, NULL, PRESENCE_OPTIONAL, "the contact as detected in its trace; null: none was detected, or a drop"),
    FIELD_END
};
// clang-format on

static Status reading_status(bool is_made, Problem *problem) {
    return is_made ? STATUS_OK
                   : problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
}

void measurement_pointer(uint64_t number, const char *rest, char *pointer, size_t size) {
    if (number == COUNT_ABSENT)
        snprintf(pointer, size, "%s", rest);
    else
        snprintf(pointer, size, "/measurements/%llu%s", (unsigned long long)number, rest);
}

void reading_pointer(const EvaluationRow *row, char *pointer, size_t size) {
    char rest[40];
    snprintf(rest, sizeof rest, "/%s/%zu", row->is_of_trace ? "traces" : "drops", row->place);
    measurement_pointer(row->measurement, rest, pointer, size);
}

bool reading_counts(const EvaluationRow *row) {
    return row->restitution_counts || row->contact_time_counts;
}

bool reading_get(const EvaluationRow *row, bool is_time, Reading *reading) {
    *reading = (Reading){
        .value = is_time ? row->contact_time : row->restitution,
        .uncertainty = is_time ? row->contact_time_uncertainty : row->restitution_uncertainty,
        .speed = row->approach_speed,
    };
    return is_time ? row->contact_time_counts : row->restitution_counts;
}

// Appends an empty row.
static Status reading_new(const Measurement *tests, size_t index, size_t place, bool is_of_trace,
                          EvaluationRows *rows, EvaluationRow **row, Problem *problem) {
    const size_t count = rows->count;
    if (count == EVALUATION_ROWS_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "more than %d readings: evaluate fewer measurements at a time",
                           EVALUATION_ROWS_MAX);
    if (count == 0 || (count >= 16 && (count & (count - 1)) == 0)) {
        EvaluationRow *at = realloc(rows->at, (count == 0 ? 16 : 2 * count) * sizeof *at);
        TRY(reading_status(at != NULL, problem));
        rows->at = at;
    }
    *row = &rows->at[rows->count++];
    **row = (EvaluationRow){.is_of_trace = is_of_trace, .place = place, .test = index};
    fields_clear(evaluation_row_fields, *row);
    (*row)->measurement = tests[index].number;
    if (is_of_trace)
        (*row)->trace = place + 1;
    return STATUS_OK;
}

static Status reading_add_note(EvaluationRow *row, const char *text, Problem *problem) {
    return reading_status(text_format(&row->note, "%s%s%s", row->note != NULL ? row->note : "",
                                      row->note != NULL ? "; " : "", text),
                          problem);
}

static bool reading_copy(const char *text, char **target) {
    return text == NULL || (*target = strdup(text)) != NULL;
}

// The relative uncertainty of a speed that was read, or that follows from a height.
static double reading_speed_error(const DropTest *test, double speed, double height) {
    return !isnan(speed) ? test->speed_uncertainty / speed
                         : test->height_uncertainty / (2 * height);
}

static void reading_set_restitution(const DropTest *test, const Drop *drop, EvaluationRow *row) {
    const double before = row->approach_speed, after = drop_rebound_speed(test, drop);
    if (isnan(before) || isnan(after))
        return;
    const bool is_by_height = isnan(drop->rebound_speed);
    row->restitution = fmin(after / before, 1);
    row->restitution_by = is_by_height ? RESTITUTION_BY_HEIGHTS : RESTITUTION_BY_SPEEDS;
    // The impactor's part of the separation speed, which on a fixed base is the whole.
    double share = row->restitution;
    if (is_by_height && test->base == MATERIAL_BASE_FREE)
        share -= test->impactor_mass / test->base_mass;
    const double error =
        fabs(share) * hypot(reading_speed_error(test, drop->approach_speed, drop->drop_height),
                            reading_speed_error(test, drop->rebound_speed, drop->rebound_height));
    if (isfinite(error))
        row->restitution_uncertainty = error;
}

static Status reading_add_drop(const Measurement *tests, size_t index, size_t i,
                               EvaluationRows *rows, Problem *problem) {
    const DropTest *test = tests[index].test;
    const Drop *drop = &test->drops.at[i];
    EvaluationRow *row = NULL;
    TRY(reading_new(tests, index, i, false, rows, &row, problem));
    row->approach_speed = drop_approach_speed(drop);
    row->approach_speed_uncertainty =
        row->approach_speed * reading_speed_error(test, drop->approach_speed, drop->drop_height);
    reading_set_restitution(test, drop, row);
    if (!isnan(drop->contact_time)) {
        row->contact_time = drop->contact_time;
        row->contact_time_uncertainty = test->time_uncertainty;
        row->contact_time_by = CONTACT_TIME_BY_DURATION;
    }
    row->restitution_counts = drop->excluded == NULL && !isnan(row->restitution);
    row->contact_time_counts = drop->excluded == NULL && !isnan(row->contact_time);
    return reading_status(text_format(&row->from, "drop %zu", i + 1) &&
                              reading_copy(drop->excluded, &row->excluded) &&
                              reading_copy(drop->note, &row->note),
                          problem);
}

static Status reading_add_contact(const Measurement *tests, size_t index, size_t i, size_t number,
                                  TraceContact *contact, EvaluationRows *rows, Problem *problem) {
    const DropTest *test = tests[index].test;
    const Trace *trace = &test->traces.at[i];
    EvaluationRow *row = NULL;
    TRY(reading_new(tests, index, i, true, rows, &row, problem));
    row->contact = contact->seen;
    contact->seen.pulse = (Reals){NULL, 0};
    if (number < trace->approach_speed.count) {
        row->approach_speed = trace->approach_speed.at[number];
        row->approach_speed_uncertainty = test->speed_uncertainty;
    }
    row->contact_time = contact->contact_time;
    row->contact_time_uncertainty = contact->contact_time_uncertainty;
    row->least_contact_time = contact->least_contact_time;
    row->most_contact_time = contact->most_contact_time;
    row->restitution = contact->restitution;
    row->restitution_uncertainty = contact->restitution_uncertainty;
    if (!isnan(row->contact_time))
        row->contact_time_by = CONTACT_TIME_BY_PULSE;
    if (!isnan(row->restitution))
        row->restitution_by = RESTITUTION_BY_PULSE;
    row->restitution_counts = trace->excluded == NULL && !isnan(row->restitution);
    row->contact_time_counts = trace->excluded == NULL && !isnan(row->contact_time);
    return reading_status(text_format(&row->from, "trace %zu, contact %zu", i + 1, number + 1) &&
                              reading_copy(trace->excluded, &row->excluded) &&
                              reading_copy(contact->why, &row->note),
                          problem);
}

// A trace without a contact is a row too.
static Status reading_add_empty(const Measurement *tests, size_t index, size_t i, const char *why,
                                EvaluationRows *rows, Problem *problem) {
    EvaluationRow *row = NULL;
    TRY(reading_new(tests, index, i, true, rows, &row, problem));
    return reading_status(
        text_format(&row->from, "trace %zu", i + 1) &&
            reading_copy(tests[index].test->traces.at[i].excluded, &row->excluded) &&
            text_format(&row->note, "%s", why != NULL ? why : "no contact is detected in it"),
        problem);
}

static Status reading_add_trace(const Measurement *tests, size_t index, size_t i, int separation,
                                const Progress *progress, EvaluationRows *rows, Problem *problem) {
    const DropTest *test = tests[index].test;
    const Trace *trace = &test->traces.at[i];
    const TraceOptions options = {
        .separation = separation,
        .threshold = (double)NAN,
        .effective_mass = drop_test_effective_mass(test),
        .gravity = test->gravity > 0 ? test->gravity : 0,
        .approach_speeds = trace->approach_speed.at,
        .approach_speed_count = trace->approach_speed.count,
        .progress = progress,
    };
    char place[sizeof((Fault){0}.pointer)], pointer[sizeof((Fault){0}.pointer)];
    const EvaluationRow at = {.measurement = tests[index].number, .is_of_trace = true, .place = i};
    reading_pointer(&at, place, sizeof place);
    json_pointer_join(pointer, sizeof pointer, place, "force");
    TraceAnalysis analysis = {0};
    // An unreadable trace may be excluded for that reason.
    Status status = trace_analysis_run(trace->interval, &trace->force, &options, pointer, &analysis,
                                       trace->excluded == NULL ? problem : NULL);
    if (status == STATUS_INVALID && trace->excluded != NULL)
        status = reading_add_empty(tests, index, i, "it cannot be read", rows, problem);
    else if (status == STATUS_OK && analysis.contacts.count == 0)
        status = reading_add_empty(tests, index, i, analysis.why, rows, problem);
    for (size_t k = 0; status == STATUS_OK && k < analysis.contacts.count; k++)
        status = reading_add_contact(tests, index, i, k, &analysis.contacts.at[k], rows, problem);
    trace_analysis_clear(&analysis);
    return status;
}

Status readings_add(const Measurement *tests, size_t index, int separation,
                    const Progress *progress, EvaluationRows *rows, Problem *problem) {
    for (size_t i = 0; i < tests[index].test->drops.count; i++)
        TRY(reading_add_drop(tests, index, i, rows, problem));
    for (size_t i = 0; i < tests[index].test->traces.count; i++)
        TRY(reading_add_trace(tests, index, i, separation, progress, rows, problem));
    return STATUS_OK;
}

// Of a drop with both e and T_c.
static Status reading_correct_both(const GravityLoad *load, EvaluationRow *row, Problem *problem) {
    const GravityCorrected read = {row->restitution, row->contact_time,
                                   row->restitution_uncertainty / row->restitution,
                                   row->contact_time_uncertainty / row->contact_time};
    GravityCorrected isolated;
    if (!(row->restitution > 0) || !gravity_correct(load, &read, &isolated)) {
        row->restitution_counts = row->contact_time_counts = false;
        return reading_add_note(
            row, "does not count: no contact has this e and T_c under that gravity", problem);
    }
    row->read_restitution = row->restitution;
    row->read_contact_time = row->contact_time;
    row->restitution = isolated.restitution;
    row->contact_time = isolated.contact_time;
    row->restitution_uncertainty = isolated.restitution * isolated.restitution_uncertainty;
    row->contact_time_uncertainty = isolated.contact_time * isolated.contact_time_uncertainty;
    return STATUS_OK;
}

// Of a drop with one of e and T_c; `other` is the mean of the other one, NAN: unknown.
static Status reading_correct_one(const GravityLoad *load, double other, EvaluationRow *row,
                                  Problem *problem) {
    const bool is_time = isnan(row->restitution), is_known = !isnan(other) && !isnan(load->speed);
    double *value = is_time ? &row->contact_time : &row->restitution;
    double *read = is_time ? &row->read_contact_time : &row->read_restitution;
    double isolated;
    if (!is_known || !gravity_correct_one(load, is_time, *value, other, &isolated))
        return reading_add_note(
            row,
            is_known  ? "gravity is not corrected: no contact has this value under it"
            : is_time ? "gravity is not corrected: this needs a speed and a restitution"
                      : "gravity is not corrected: this needs a contact time",
            problem);
    // Errors grow with the correction.
    *(is_time ? &row->contact_time_uncertainty : &row->restitution_uncertainty) *=
        isolated / *value;
    *read = *value;
    *value = isolated;
    return STATUS_OK;
}

// The mean T_c or e of a test's readings without gravity; NAN: there are none.
static double reading_mean(const EvaluationRows *rows, size_t test, bool is_time) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < rows->count; i++) {
        const EvaluationRow *row = &rows->at[i];
        Reading reading;
        if (row->test == test && (row->is_of_trace || !isnan(row->read_contact_time)) &&
            reading_get(row, is_time, &reading)) {
            sum += reading.value;
            count++;
        }
    }
    return sum / count;
}

Status readings_correct_gravity(const Measurement *tests, size_t count, int separation,
                                const Progress *progress, EvaluationRows *rows, Problem *problem) {
    for (int pass = 0; pass < 2; pass++)
        for (size_t test = 0; test < count; test++) {
            // First drops with both, from which the others borrow.
            const double e = pass > 0 ? reading_mean(rows, test, false) : 0;
            const double T = pass > 0 ? reading_mean(rows, test, true) : 0;
            for (size_t i = 0; i < rows->count; i++) {
                EvaluationRow *row = &rows->at[i];
                const int known = !isnan(row->restitution) + !isnan(row->contact_time);
                if (row->test != test || row->is_of_trace || !(tests[test].test->gravity > 0) ||
                    known != 2 - pass)
                    continue;
                if (!progress_advance(progress, 1))
                    return STATUS_CANCELLED;
                const GravityLoad load = {tests[test].test->gravity, row->approach_speed,
                                          (Separation)separation,
                                          row->restitution_by == RESTITUTION_BY_HEIGHTS};
                TRY(pass == 0 ? reading_correct_both(&load, row, problem)
                              : reading_correct_one(&load, isnan(row->restitution) ? e : T, row,
                                                    problem));
            }
        }
    return STATUS_OK;
}
