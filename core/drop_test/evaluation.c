// Uncertainties by the rule of small errors: with e = sqrt(h_r / h_d) and v = sqrt(2 g h) a
// relative error of a height counts half.
#include "core/drop_test/evaluation.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/json_pointer.h"
#include "core/drop_test/pulse_model.h"

enum { OUTLIERS_MAX = 5, SOURCE_MAX = 1000 };

static const double effect_min = 0.01;     // of gravity
static const double pair_tolerance = 0.02; // of effective masses that are considered equal

const char *const proposal_form_names[] = {"constant", "table", NULL};
static const char *const restitution_by_names[] = {"heights", "speeds", "pulse", NULL};
static const char *const contact_time_by_names[] = {"duration", "pulse", NULL};

// clang-format off
static const Field evaluation_row_fields[] = {
    FIELD_COUNT(EvaluationRow, measurement, NULL, AT_MIN(1), OPTIONAL, "number of the measurement"),
    FIELD_TEXT(EvaluationRow, from, 0, PRESENCE_OPTIONAL, 0, "the drop, or the trace and its contact, from 1"),
    FIELD_COUNT(EvaluationRow, trace, NULL, AT_MIN(1), OPTIONAL, "trace of its measurement, from 1; null: a drop"),
    FIELD_REAL(EvaluationRow, approach_speed, "m/s", ANY, OPTIONAL, "as given, else sqrt(2 g h)"),
    FIELD_REAL(EvaluationRow, approach_speed_uncertainty, "m/s", ANY, OPTIONAL, "its standard uncertainty"),
    FIELD_REAL(EvaluationRow, restitution, NULL, ANY, OPTIONAL, "e"),
    FIELD_REAL(EvaluationRow, restitution_uncertainty, NULL, ANY, OPTIONAL, "its standard uncertainty, from that of the instrument or of the fit"),
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
    FIELD_FLAG(EvaluationRow, restitution_is_outlier, 0, "an outlier: only one good sample in twenty contains such a reading; it counts"),
    FIELD_REAL(EvaluationRow, contact_time_score, NULL, ANY, OPTIONAL, "the same of T_c"),
    FIELD_FLAG(EvaluationRow, contact_time_is_outlier, 0, "the same of T_c"),
    FIELD_TEXT(EvaluationRow, excluded, 0, PRESENCE_OPTIONAL, 0, "reason why neither counts, as stated with the test"),
    FIELD_TEXT(EvaluationRow, note, 0, PRESENCE_OPTIONAL, 0, "further remarks"),
    FIELD_ITEM(EvaluationRow, contact, trace_detection_fields, NULL, PRESENCE_OPTIONAL, "the contact as detected in its trace; null: none was detected, or a drop"),
    FIELD_END
};

static const Field ranges_fields[] = {
    FIELD_REAL(Ranges, least_speed, "m/s", ANY, OPTIONAL, "slowest approach that counts"),
    FIELD_REAL(Ranges, most_speed, "m/s", ANY, OPTIONAL, "the fastest"),
    FIELD_REAL(Ranges, least_temperature, "degC", ANY, OPTIONAL, "coldest test with a reading that counts"),
    FIELD_REAL(Ranges, most_temperature, "degC", ANY, OPTIONAL, "the warmest"),
    FIELD_END
};

const Field evaluation_fields[] = {
    FIELD_CHOICE(Evaluation, separation, separation_names, OPTIONAL, "separation rule of the evaluation of traces and of the correction of gravity"),
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

static const Ranges ranges_unknown = {(double)NAN, (double)NAN, (double)NAN, (double)NAN};

static void ranges_extend(Ranges *ranges, const EvaluationRow *row, const Measurement *tests) {
    const double temperature = tests[row->test].test->temperature;
    ranges->least_speed = fmin(ranges->least_speed, row->approach_speed);
    ranges->most_speed = fmax(ranges->most_speed, row->approach_speed);
    ranges->least_temperature = fmin(ranges->least_temperature, temperature);
    ranges->most_temperature = fmax(ranges->most_temperature, temperature);
}

// The JSON Pointer of a measurement, with `rest` behind it: "/measurements/3/gravity"; without a
// number only the rest.
static JsonPointer measurement_pointer(uint64_t number, const char *rest) {
    JsonPointer pointer;
    if (number == COUNT_ABSENT)
        snprintf(pointer.at, sizeof pointer.at, "%s", rest);
    else
        snprintf(pointer.at, sizeof pointer.at, "/measurements/%llu%s", (unsigned long long)number,
                 rest);
    return pointer;
}

// The JSON Pointer of a row: "/drops/2", or "/measurements/3/traces/0".
static JsonPointer reading_pointer(const EvaluationRow *row) {
    char rest[40];
    snprintf(rest, sizeof rest, "/%s/%zu", row->is_of_trace ? "traces" : "drops", row->place);
    return measurement_pointer(row->measurement, rest);
}

// Whether e or T_c of a row counts.
static bool reading_counts(const EvaluationRow *row) {
    return row->restitution_counts || row->contact_time_counts;
}

// T_c or e of a row; false: it does not count.
static bool reading_get(const EvaluationRow *row, bool is_time, Reading *reading) {
    *reading = (Reading){
        .value = is_time ? row->contact_time : row->restitution,
        .uncertainty = is_time ? row->contact_time_uncertainty : row->restitution_uncertainty,
        .speed = row->approach_speed,
    };
    return is_time ? row->contact_time_counts : row->restitution_counts;
}

static bool reading_copy(const char *text, char **target) {
    return text == NULL || (*target = strdup(text)) != NULL;
}

static Status reading_add_note(EvaluationRow *row, const char *text) {
    return status_made(text_format(&row->note, "%s%s%s", row->note != NULL ? row->note : "",
                                   row->note != NULL ? "; " : "", text));
}

// A list of rows under construction, of one test.
typedef struct ReadingList {
    const Measurement *of;
    size_t test; // its index
    int separation;
    const Progress *progress;
    EvaluationRows *rows;
    Problem *problem;
} ReadingList;

// Appends a row without numbers: of a drop, of a trace, or of its contact `contact`, from 1.
static Status reading_new(const ReadingList *list, size_t place, bool is_of_trace, size_t contact,
                          const char *note, EvaluationRow **added) {
    EvaluationRows *rows = list->rows;
    const DropTest *test = list->of->test;
    const char *excluded =
        is_of_trace ? test->traces.at[place].excluded : test->drops.at[place].excluded;
    *added = NULL;
    if (rows->count == EVALUATION_ROWS_MAX)
        return problem_set(list->problem, STATUS_LIMIT,
                           "more than %d readings: evaluate fewer measurements at a time",
                           EVALUATION_ROWS_MAX);
    EvaluationRow *row = *added = list_grow(rows, sizeof *row);
    TRY(status_made(row != NULL));
    *row = (EvaluationRow){.is_of_trace = is_of_trace, .place = place, .test = list->test};
    fields_clear(evaluation_row_fields, row);
    row->measurement = list->of->number;
    if (is_of_trace)
        row->trace = place + 1;
    const bool is_made =
        contact > 0 ? text_format(&row->from, "trace %zu, contact %zu", place + 1, contact)
                    : text_format(&row->from, "%s %zu", is_of_trace ? "trace" : "drop", place + 1);
    return status_made(is_made && reading_copy(excluded, &row->excluded) &&
                       reading_copy(note, &row->note));
}

static void reading_set_counts(EvaluationRow *row) {
    row->restitution_counts = row->excluded == NULL && !isnan(row->restitution);
    row->contact_time_counts = row->excluded == NULL && !isnan(row->contact_time);
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

static Status reading_add_drop(const ReadingList *list, size_t place) {
    const DropTest *test = list->of->test;
    const Drop *drop = &test->drops.at[place];
    EvaluationRow *row;
    TRY(reading_new(list, place, false, 0, drop->note, &row));
    row->approach_speed = drop_approach_speed(drop);
    row->approach_speed_uncertainty =
        row->approach_speed * reading_speed_error(test, drop->approach_speed, drop->drop_height);
    reading_set_restitution(test, drop, row);
    if (!isnan(drop->contact_time)) {
        row->contact_time = drop->contact_time;
        row->contact_time_uncertainty = test->time_uncertainty;
        row->contact_time_by = CONTACT_TIME_BY_DURATION;
    }
    reading_set_counts(row);
    return STATUS_OK;
}

static Status reading_add_contact(const ReadingList *list, size_t place, size_t number,
                                  TraceContact *contact) {
    const DropTest *test = list->of->test;
    const Reals *speeds = &test->traces.at[place].approach_speed;
    EvaluationRow *row;
    TRY(reading_new(list, place, true, number + 1, contact->why, &row));
    row->contact = contact->seen;
    contact->seen.pulse = (Reals){NULL, 0};
    if (number < speeds->count) {
        row->approach_speed = speeds->at[number];
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
    reading_set_counts(row);
    return STATUS_OK;
}

static Status reading_add_trace(const ReadingList *list, size_t place) {
    const DropTest *test = list->of->test;
    const Trace *trace = &test->traces.at[place];
    const TraceOptions options = {
        .separation = list->separation,
        .threshold = (double)NAN,
        .effective_mass = drop_test_effective_mass(test),
        .gravity = test->gravity > 0 ? test->gravity : 0,
        .approach_speeds = trace->approach_speed.at,
        .approach_speed_count = trace->approach_speed.count,
        .progress = list->progress,
    };
    char rest[48];
    snprintf(rest, sizeof rest, "/traces/%zu/force", place);
    const JsonPointer pointer = measurement_pointer(list->of->number, rest);
    TraceAnalysis analysis = {0};
    EvaluationRow *row;
    // An unreadable trace may be excluded for that reason. A trace without a contact is a row too.
    Status status = trace_analysis_run(trace->interval, &trace->force, &options, pointer.at,
                                       &analysis, trace->excluded == NULL ? list->problem : NULL);
    if (status == STATUS_INVALID && trace->excluded != NULL)
        status = reading_new(list, place, true, 0, "it cannot be read", &row);
    else if (status == STATUS_OK && analysis.contacts.count == 0)
        status =
            reading_new(list, place, true, 0,
                        analysis.why != NULL ? analysis.why : "no contact is detected in it", &row);
    for (size_t k = 0; status == STATUS_OK && k < analysis.contacts.count; k++)
        status = reading_add_contact(list, place, k, &analysis.contacts.at[k]);
    trace_analysis_clear(&analysis);
    return status;
}

// Of a drop with both e and T_c.
static Status reading_correct_both(const GravityLoad *load, EvaluationRow *row) {
    const GravityCorrected read = {row->restitution, row->contact_time,
                                   row->restitution_uncertainty / row->restitution,
                                   row->contact_time_uncertainty / row->contact_time};
    GravityCorrected isolated;
    if (!(row->restitution > 0) || !gravity_correct(load, &read, &isolated)) {
        row->restitution_counts = row->contact_time_counts = false;
        return reading_add_note(row,
                                "does not count: no contact has this e and T_c under that gravity");
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
static Status reading_correct_one(const GravityLoad *load, double other, EvaluationRow *row) {
    const bool is_time = isnan(row->restitution), is_known = !isnan(other) && !isnan(load->speed);
    double *value = is_time ? &row->contact_time : &row->restitution;
    double *read = is_time ? &row->read_contact_time : &row->read_restitution;
    double isolated;
    if (!is_known || !gravity_correct_one(load, is_time, *value, other, &isolated))
        return reading_add_note(
            row, is_known  ? "gravity is not corrected: no contact has this value under it"
                 : is_time ? "gravity is not corrected: this needs a speed and a restitution"
                           : "gravity is not corrected: this needs a contact time");
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

// Corrects all drops whose test states gravity; the fit of a trace has corrected its contacts. A
// drop with only one of e and T_c borrows the mean of the other from its test's readings without
// gravity.
static Status readings_correct_gravity(const Measurement *tests, size_t count, int separation,
                                       const Progress *progress, EvaluationRows *rows) {
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
                TRY(pass == 0 ? reading_correct_both(&load, row)
                              : reading_correct_one(&load, isnan(row->restitution) ? e : T, row));
            }
        }
    return STATUS_OK;
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
static Status evaluation_set_statistic(bool is_time, Reading *readings, Evaluation *evaluation) {
    EvaluationRow *rows = evaluation->rows.at;
    Statistic *statistic = is_time ? &evaluation->contact_time : &evaluation->restitution;
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (reading_get(&rows[i], is_time, &readings[count]))
            readings[count++].row = i;
    TRY(reading_statistics_run(readings, count, is_time ? "contact time" : "restitution",
                               is_time ? " s" : "", statistic));
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

static Status evaluation_warn_of_gravity(const Measurement *of, size_t test,
                                         Evaluation *evaluation) {
    const EvaluationRow *row = NULL; // the slowest one that counts
    for (size_t i = 0; i < evaluation->rows.count && isnan(of->test->gravity); i++) {
        const EvaluationRow *at = &evaluation->rows.at[i];
        if (at->test == test && reading_counts(at) && !isnan(at->approach_speed) &&
            (row == NULL || at->approach_speed < row->approach_speed))
            row = at;
    }
    if (row == NULL)
        return STATUS_OK;
    Warnings *warnings = &evaluation->warnings;
    const double e = row->restitution_counts ? row->restitution : evaluation->restitution.mean;
    const double T = row->contact_time_counts ? row->contact_time : evaluation->contact_time.mean;
    if (isnan(T))
        return warnings_add(warnings, measurement_pointer(of->number, "/gravity").at,
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
        return warnings_add(warnings, measurement_pointer(of->number, "/gravity").at,
                            "gravity during contact is not corrected: in a vertical drop at the "
                            "slowest %.3g m/s a contact with this e and T_c would not end; %s",
                            row->approach_speed, advice);
    const double longer = with.contact_time / T - 1, lower = 1 - with.restitution / e;
    if (!(fmax(longer, lower) > effect_min))
        return STATUS_OK;
    return warnings_add(
        warnings, measurement_pointer(of->number, "/gravity").at,
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
    return !is_by_height
               ? STATUS_OK
               : warnings_add(&evaluation->warnings, measurement_pointer(of->number, "/gravity").at,
                              "gravity during contact is %.4g m/s^2, but speeds follow from "
                              "heights by %.6g m/s^2: where the impactor fell by another gravity, "
                              "give approach_speed and rebound_speed",
                              gravity, STANDARD_GRAVITY);
}

static Status evaluation_warn_of_pairs(const Measurement *tests, size_t count, Warnings *warnings) {
    for (size_t i = 1; i < count; i++) {
        const double first = drop_test_effective_mass(tests[0].test);
        const double other = drop_test_effective_mass(tests[i].test);
        if (fabs(other - first) > pair_tolerance * first)
            TRY(warnings_add(warnings, measurement_pointer(tests[i].number, "").at,
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
    Status status = status_made(sums != NULL);
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
        char other[40] = "a test before it";
        if (tests[k].number != COUNT_ABSENT)
            snprintf(other, sizeof other, "measurement %llu", (unsigned long long)tests[k].number);
        status = warnings_add(&evaluation->warnings, measurement_pointer(tests[i].number, "").at,
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
        if (row->excluded == NULL && !isnan(row->least_contact_time) &&
            !isnan(row->most_contact_time))
            return warnings_add(&evaluation->warnings, reading_pointer(row).at,
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
    return warnings_add(&evaluation->warnings, reading_pointer(first).at,
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
        TRY(warnings_add(
            &evaluation->warnings, reading_pointer(row).at,
            "%s %.4g of %s is %.1f robust deviations from the median. It counts: the mean is %.4g "
            "with all readings and %.4g without outliers (%llu). A reading that is known to be "
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

static Status evaluation_make(const Measurement *tests, size_t count, const Progress *progress,
                              Evaluation *evaluation, Problem *problem) {
    const int separation = evaluation->separation;
    EvaluationRows *rows = &evaluation->rows;
    for (size_t i = 0; i < count; i++) {
        const ReadingList list = {&tests[i], i, separation, progress, rows, problem};
        for (size_t k = 0; k < tests[i].test->drops.count; k++)
            TRY(reading_add_drop(&list, k));
        for (size_t k = 0; k < tests[i].test->traces.count; k++)
            TRY(reading_add_trace(&list, k));
    }
    TRY(readings_correct_gravity(tests, count, separation, progress, rows));
    evaluation_choose_restitutions(rows);
    for (size_t i = 0; i < rows->count; i++)
        if (reading_counts(&rows->at[i]))
            ranges_extend(&evaluation->ranges, &rows->at[i], tests);
    Reading *readings = calloc(rows->count + 1, sizeof *readings);
    Status status = status_made(readings != NULL);
    for (int is_time = 0; is_time < 2 && status == STATUS_OK; is_time++)
        status = evaluation_set_statistic(is_time == 1, readings, evaluation);
    free(readings);
    return status == STATUS_OK ? evaluation_warn(tests, count, evaluation) : status;
}

Status evaluation_run(const Measurement *tests, size_t count, Separation separation,
                      const Progress *progress, Evaluation *evaluation, Problem *problem) {
    *evaluation = (Evaluation){.separation = (int)separation,
                               .confidence = EVALUATION_CONFIDENCE,
                               .ranges = ranges_unknown};
    const size_t samples = evaluation_sample_count(tests, count);
    if (samples > EVALUATION_SAMPLES_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "more than %d samples in traces, %zu: evaluate fewer measurements at a "
                           "time",
                           EVALUATION_SAMPLES_MAX, samples);
    const Status status = evaluation_make(tests, count, progress, evaluation, problem);
    return status == STATUS_NO_MEMORY ? problem_set(problem, status, "no memory for the evaluation")
                                      : status;
}

void material_proposal_clear(MaterialProposal *proposal) {
    fields_clear(material_fields, &proposal->material);
    free(proposal->why);
    proposal->why = NULL;
}

// The description of the material without its figures and their source.
static Status proposal_describe(const Material *before, Material *material) {
    Material described = {.name = NULL};
    fields_clear(material_fields, &described);
    described.name = before->name;
    described.kind = before->kind;
    described.thickness = before->thickness;
    described.hardness = before->hardness;
    described.supplier = before->supplier;
    described.notes = before->notes;
    described.tags = before->tags;
    return fields_copy(material_fields, &described, material);
}

// A proposal in progress. The lists have room for all rows of the evaluation, or all tests.
typedef struct Proposal {
    Evaluation *evaluation;
    const Measurement *tests;
    size_t test_count;
    const EvaluationRow **rows; // that the revision is based on; of a table by rising speed
    size_t row_count;
    const Measurement **sources; // the tests of these rows, in order
    size_t source_count;
    Reading *readings; // scratch
    MaterialProposal *result;
} Proposal;

// Impactor and base, if all tests have the same.
static Status proposal_set_pair(const Proposal *proposal) {
    Material *material = &proposal->result->material;
    const DropTest *first = proposal->sources[0]->test;
    for (size_t i = 1; i < proposal->source_count; i++) {
        const DropTest *test = proposal->sources[i]->test;
        if (!text_same(test->impactor, first->impactor) || test->base != first->base ||
            !real_same(test->impactor_mass, first->impactor_mass) ||
            !real_same(test->base_mass, first->base_mass))
            return warnings_add(&proposal->evaluation->warnings, "/revision/impactor_mass",
                                "impactor and base are left out: the measurements were made with "
                                "different ones");
    }
    material->impactor_mass = first->impactor_mass;
    material->base = first->base;
    material->base_mass = first->base_mass;
    return first->impactor == NULL || (material->impactor = strdup(first->impactor)) != NULL
               ? STATUS_OK
               : STATUS_NO_MEMORY;
}

// The different sources of the tests, else their numbers.
static Status proposal_set_source(const Proposal *proposal) {
    Material *material = &proposal->result->material;
    const Measurement *const *sources = proposal->sources;
    const size_t count = proposal->source_count;
    char text[SOURCE_MAX + 1] = "", number[32];
    for (size_t i = 0; i < count; i++) {
        size_t first = 0;
        while (!text_same(sources[first]->test->source, sources[i]->test->source))
            first++;
        if (sources[i]->test->source != NULL && first == i)
            text_list(text, sizeof text, sources[i]->test->source);
    }
    if (text[0] == '\0') {
        snprintf(text, sizeof text, "measurements of this material:");
        for (size_t i = 0; i < count && sources[i]->number != COUNT_ABSENT; i++) {
            snprintf(number, sizeof number, "%s%llu", i > 0 ? ", " : " ",
                     (unsigned long long)sources[i]->number);
            if (strlen(text) + strlen(number) < sizeof text)
                memcpy(text + strlen(text), number, strlen(number) + 1);
        }
    }
    material->source = strdup(text);
    TRY(status_made(material->source != NULL && reals_allocate(&material->measurements, count)));
    for (size_t i = 0; i < count; i++)
        material->measurements.at[i] = (double)sources[i]->number;
    return STATUS_OK;
}

// Ranges, separation rule, pair and source.
static Status proposal_set_basis(Proposal *proposal) {
    Material *material = &proposal->result->material;
    Ranges ranges = ranges_unknown;
    for (size_t i = 0; i < proposal->row_count; i++) {
        const EvaluationRow *row = proposal->rows[i];
        ranges_extend(&ranges, row, proposal->tests);
        if (row->contact_time_counts && row->contact_time_by == (int)CONTACT_TIME_BY_PULSE)
            material->separation = proposal->evaluation->separation;
    }
    for (size_t test = 0; test < proposal->test_count; test++) {
        size_t i = 0;
        while (i < proposal->row_count && proposal->rows[i]->test != test)
            i++;
        if (i < proposal->row_count)
            proposal->sources[proposal->source_count++] = &proposal->tests[test];
    }
    material->least_speed = ranges.least_speed;
    material->most_speed = ranges.most_speed;
    material->least_temperature = ranges.least_temperature;
    material->most_temperature = ranges.most_temperature;
    TRY(proposal_set_pair(proposal));
    return proposal_set_source(proposal);
}

static Status proposal_set_constant(Proposal *proposal) {
    Material *material = &proposal->result->material;
    Warnings *warnings = &proposal->evaluation->warnings;
    const Statistic *e = &proposal->evaluation->restitution,
                    *T = &proposal->evaluation->contact_time;
    if (e->count == 0)
        return status_made(text_format(&proposal->result->why,
                                       "no reading that counts gives the restitution, which a "
                                       "revision needs: add a measurement with heights or speeds"));
    material->restitution = e->mean;
    material->restitution_deviation = e->spread;
    material->contact_time = T->mean;
    material->contact_time_deviation = T->spread;
    if (e->trend.verdict == TREND_NOT_CONSTANT)
        TRY(warnings_add(warnings, "/revision/restitution", "%s", e->trend.detail));
    if (T->trend.verdict == TREND_NOT_CONSTANT)
        TRY(warnings_add(warnings, "/revision/contact_time", "%s", T->trend.detail));
    return T->count > 0 ? STATUS_OK
                        : warnings_add(warnings, "/revision/contact_time",
                                       "no contact time is known: the material can be used with "
                                       "impulsive contact only");
}

static int proposal_compare(const void *a, const void *b) {
    const double left = (*(const EvaluationRow *const *)a)->approach_speed;
    const double right = (*(const EvaluationRow *const *)b)->approach_speed;
    return (left > right) - (left < right);
}

// Collects the rows that count, for a table those with a speed, in its order.
static void proposal_collect_rows(Proposal *proposal, bool is_table) {
    const EvaluationRows *rows = &proposal->evaluation->rows;
    for (size_t i = 0; i < rows->count; i++)
        if (reading_counts(&rows->at[i]) && !(is_table && isnan(rows->at[i].approach_speed)))
            proposal->rows[proposal->row_count++] = &rows->at[i];
    if (is_table && proposal->row_count > 0)
        qsort(proposal->rows, proposal->row_count, sizeof *proposal->rows, proposal_compare);
}

// Number of rows from `first` on whose speeds make one row of the table.
static size_t proposal_bin(const Proposal *proposal, size_t first) {
    size_t end = first;
    while (end < proposal->row_count && !(proposal->rows[end]->approach_speed >
                                          PROPOSAL_BIN * proposal->rows[first]->approach_speed))
        end++;
    return end - first;
}

// Mean and deviation of T_c or e of rows, by the same rule as over all readings.
static Status proposal_mean(const Proposal *proposal, size_t first, size_t count, bool is_time,
                            double *mean, double *deviation) {
    size_t found = 0;
    for (size_t i = first; i < first + count; i++)
        found += reading_get(proposal->rows[i], is_time, &proposal->readings[found]);
    Statistic statistic;
    const Status status =
        reading_statistics_run(proposal->readings, found, "reading", "", &statistic);
    *mean = statistic.mean;
    *deviation = statistic.spread;
    fields_clear(reading_statistic_fields, &statistic);
    return status;
}

// A row of the table for each bin. Every row needs e, and T_c if any has it: the other bins are
// left out with their readings. `*all` is the number of bins.
static Status proposal_fill_table(Proposal *proposal, bool has_time, size_t *all) {
    MaterialRows *table = &proposal->result->material.table;
    size_t kept = 0;
    *all = 0;
    table->at = calloc(proposal->row_count + 1, sizeof *table->at);
    TRY(status_made(table->at != NULL));
    for (size_t first = 0, count; first < proposal->row_count; first += count, ++*all) {
        MaterialRow row = {0};
        count = proposal_bin(proposal, first);
        for (size_t i = first; i < first + count; i++)
            row.approach_speed += proposal->rows[i]->approach_speed;
        row.approach_speed /= (double)count;
        TRY(proposal_mean(proposal, first, count, false, &row.restitution,
                          &row.restitution_deviation));
        TRY(proposal_mean(proposal, first, count, true, &row.contact_time,
                          &row.contact_time_deviation));
        if (isnan(row.restitution) || (has_time && isnan(row.contact_time)))
            continue;
        memmove(&proposal->rows[kept], &proposal->rows[first], count * sizeof *proposal->rows);
        kept += count;
        table->at[table->count++] = row;
    }
    proposal->row_count = kept;
    return STATUS_OK;
}

static Status proposal_set_table(Proposal *proposal) {
    Warnings *warnings = &proposal->evaluation->warnings;
    const size_t *kept = &proposal->result->material.table.count;
    bool has_time = false;
    size_t all;
    for (size_t i = 0; i < proposal->row_count; i++)
        has_time = has_time || proposal->rows[i]->contact_time_counts;
    TRY(proposal_fill_table(proposal, has_time, &all));
    if (*kept < 2 || *kept > MATERIAL_ROWS)
        return status_made(text_format(
            &proposal->result->why,
            "a table needs e%s at two approach speeds at least (%g times one another), %d at most; "
            "the readings have %zu",
            has_time ? " and T_c" : "", PROPOSAL_BIN, MATERIAL_ROWS, *kept));
    if (*kept < all)
        TRY(warnings_add(warnings, "/revision/table",
                         "%zu of %zu speeds are left out: e%s is not known there", all - *kept, all,
                         has_time ? " or T_c" : ""));
    return has_time ? STATUS_OK
                    : warnings_add(warnings, "/revision/table",
                                   "no contact time is known at any speed: the material can be "
                                   "used with impulsive contact only");
}

Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *result,
                             Problem *problem) {
    *result = (MaterialProposal){.why = NULL};
    const size_t room = evaluation->rows.count + 1;
    Proposal proposal = {.evaluation = evaluation,
                         .tests = tests,
                         .test_count = count,
                         .rows = calloc(room, sizeof *proposal.rows),
                         .sources = calloc(count + 1, sizeof *proposal.sources),
                         .readings = calloc(room, sizeof *proposal.readings),
                         .result = result};
    Status status = proposal.rows != NULL && proposal.sources != NULL && proposal.readings != NULL
                        ? proposal_describe(before, &result->material)
                        : STATUS_NO_MEMORY;
    if (status == STATUS_OK) {
        proposal_collect_rows(&proposal, form == PROPOSAL_TABLE);
        status = form == PROPOSAL_TABLE ? proposal_set_table(&proposal)
                                        : proposal_set_constant(&proposal);
    }
    if (status == STATUS_OK && result->why == NULL)
        status = proposal_set_basis(&proposal);
    free(proposal.rows);
    free(proposal.sources);
    free(proposal.readings);
    if (status != STATUS_OK || result->why != NULL)
        fields_clear(material_fields, &result->material);
    return status == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the proposal");
}
