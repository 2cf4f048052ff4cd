// Standard uncertainties go by the rule of small errors: with e = sqrt(h_r / h_d) and v =
// sqrt(2 g h) a relative error of a height counts by half.
#include "core/drop_test/readings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/text_format.h"
#include "core/drop_test/gravity_correction.h"
#include "core/scene/material.h"

static bool has(double value) {
    return !isnan(value);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
}

void row_pointer(const EvaluationRow *row, char *pointer, size_t size) {
    char of[40] = "";
    if (row->measurement != COUNT_ABSENT)
        snprintf(of, sizeof of, "/measurements/%llu", (unsigned long long)row->measurement);
    snprintf(pointer, size, "%s/%s/%zu", of, row->is_of_trace ? "traces" : "drops", row->place);
}

// An empty row at the end.
static Status row_new(const Measurement *of, size_t index, Evaluation *evaluation,
                      EvaluationRow **row, Problem *problem) {
    EvaluationRows *rows = &evaluation->rows;
    const size_t count = rows->count;
    if (count == EVALUATION_ROWS_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "more than %d readings: evaluate fewer measurements at a time",
                           EVALUATION_ROWS_MAX);
    if (count == 0 || (count >= 16 && (count & (count - 1)) == 0)) {
        const size_t room = count == 0 ? 16 : 2 * count;
        EvaluationRow *at = realloc(rows->at, room * sizeof *at);
        if (at == NULL)
            return no_memory(problem);
        rows->at = at;
    }
    const double none = (double)NAN;
    rows->at[count] = (EvaluationRow){
        .measurement = of->number,
        .trace = COUNT_ABSENT,
        .approach_speed = none,
        .approach_speed_uncertainty = none,
        .restitution = none,
        .restitution_uncertainty = none,
        .restitution_by = CHOICE_ABSENT,
        .contact_time = none,
        .contact_time_uncertainty = none,
        .contact_time_by = CHOICE_ABSENT,
        .least_contact_time = none,
        .most_contact_time = none,
        .read_restitution = none,
        .read_contact_time = none,
        .restitution_score = none,
        .contact_time_score = none,
        .test = index,
    };
    *row = &rows->at[rows->count++];
    fields_clear(trace_detection_fields, &(*row)->contact);
    return STATUS_OK;
}

// Adds to what is said of a row.
static Status say(EvaluationRow *row, const char *text, Problem *problem) {
    return sentence(&row->note, "%s%s%s", row->note != NULL ? row->note : "",
                    row->note != NULL ? "; " : "", text)
               ? STATUS_OK
               : no_memory(problem);
}

static bool copy(const char *text, char **target) {
    return text == NULL || (*target = strdup(text)) != NULL;
}

// Relative, of a speed that was read or comes of a height.
static double speed_error(const DropTest *test, double speed, double height) {
    return has(speed) ? test->speed_uncertainty / speed : test->height_uncertainty / (2 * height);
}

static void read_restitution(const DropTest *test, const Drop *drop, EvaluationRow *row) {
    const double before = row->approach_speed, after = drop_rebound_speed(test, drop);
    if (!has(before) || !has(after))
        return;
    const bool is_by_height = !has(drop->rebound_speed);
    row->restitution = fmin(after / before, 1);
    row->restitution_by = is_by_height ? RESTITUTION_BY_HEIGHTS : RESTITUTION_BY_SPEEDS;
    // The impactor's own share of the speed of parting, which on a fixed base is all of it.
    double share = row->restitution;
    if (is_by_height && test->base == MATERIAL_BASE_FREE)
        share -= test->impactor_mass / test->base_mass;
    const double error =
        fabs(share) * hypot(speed_error(test, drop->approach_speed, drop->drop_height),
                            speed_error(test, drop->rebound_speed, drop->rebound_height));
    if (isfinite(error))
        row->restitution_uncertainty = error;
}

static Status add_drop(const Measurement *of, size_t index, size_t i, Evaluation *evaluation,
                       Problem *problem) {
    const DropTest *test = of->test;
    const Drop *drop = &test->drops.at[i];
    EvaluationRow *row = NULL;
    TRY(row_new(of, index, evaluation, &row, problem));
    row->place = i;
    row->approach_speed = drop_approach_speed(drop);
    row->approach_speed_uncertainty =
        row->approach_speed * speed_error(test, drop->approach_speed, drop->drop_height);
    read_restitution(test, drop, row);
    if (has(drop->contact_time)) {
        row->contact_time = drop->contact_time;
        row->contact_time_uncertainty = test->time_uncertainty;
        row->contact_time_by = CONTACT_TIME_BY_DURATION;
    }
    row->restitution_counts = drop->excluded == NULL && has(row->restitution);
    row->contact_time_counts = drop->excluded == NULL && has(row->contact_time);
    return sentence(&row->from, "drop %zu", i + 1) && copy(drop->excluded, &row->excluded) &&
                   copy(drop->note, &row->note)
               ? STATUS_OK
               : no_memory(problem);
}

static Status add_contact(const Measurement *of, size_t index, size_t i, size_t number,
                          TraceContact *contact, Evaluation *evaluation, Problem *problem) {
    const Trace *trace = &of->test->traces.at[i];
    EvaluationRow *row = NULL;
    TRY(row_new(of, index, evaluation, &row, problem));
    row->is_of_trace = true;
    row->place = i;
    row->trace = i + 1;
    row->contact = contact->seen;
    contact->seen.pulse = (Reals){NULL, 0};
    if (number < trace->approach_speed.count) {
        row->approach_speed = trace->approach_speed.at[number];
        row->approach_speed_uncertainty = of->test->speed_uncertainty;
    }
    row->contact_time = contact->contact_time;
    row->contact_time_uncertainty = contact->contact_time_uncertainty;
    row->least_contact_time = contact->least_contact_time;
    row->most_contact_time = contact->most_contact_time;
    row->restitution = contact->restitution;
    row->restitution_uncertainty = contact->restitution_uncertainty;
    row->contact_time_by = has(row->contact_time) ? CONTACT_TIME_BY_PULSE : CHOICE_ABSENT;
    row->restitution_by = has(row->restitution) ? RESTITUTION_BY_PULSE : CHOICE_ABSENT;
    row->restitution_counts = trace->excluded == NULL && has(row->restitution);
    row->contact_time_counts = trace->excluded == NULL && has(row->contact_time);
    return sentence(&row->from, "trace %zu, contact %zu", i + 1, number + 1) &&
                   copy(trace->excluded, &row->excluded) && copy(contact->why, &row->note)
               ? STATUS_OK
               : no_memory(problem);
}

// A trace that tells nothing is a row, too.
static Status add_silent(const Measurement *of, size_t index, size_t i, const char *why,
                         Evaluation *evaluation, Problem *problem) {
    EvaluationRow *row = NULL;
    TRY(row_new(of, index, evaluation, &row, problem));
    row->is_of_trace = true;
    row->place = i;
    row->trace = i + 1;
    return sentence(&row->from, "trace %zu", i + 1) &&
                   copy(of->test->traces.at[i].excluded, &row->excluded) &&
                   sentence(&row->note, "%s", why != NULL ? why : "no contact is seen in it")
               ? STATUS_OK
               : no_memory(problem);
}

static Status add_trace(const Measurement *of, size_t index, size_t i, const Progress *progress,
                        Evaluation *evaluation, Problem *problem) {
    const DropTest *test = of->test;
    const Trace *trace = &test->traces.at[i];
    const TraceOptions way = {
        .separation = evaluation->separation,
        .threshold = (double)NAN,
        .effective_mass = drop_test_effective_mass(test),
        .gravity = test->gravity > 0 ? test->gravity : 0,
        .approach_speeds = trace->approach_speed.at,
        .approach_speed_count = trace->approach_speed.count,
        .progress = progress,
    };
    char place[sizeof((Fault){0}.pointer)], pointer[sizeof((Fault){0}.pointer)];
    row_pointer(&(EvaluationRow){.measurement = of->number, .is_of_trace = true, .place = i}, place,
                sizeof place);
    pointer_join(pointer, sizeof pointer, place, "force");
    TraceAnalysis reading = {0};
    // What cannot be read at all may be why it is excluded.
    Status status = trace_analysis_run(trace->interval, &trace->force, &way, pointer, &reading,
                                       trace->excluded == NULL ? problem : NULL);
    if (status == STATUS_INVALID && trace->excluded != NULL)
        status = add_silent(of, index, i, "it cannot be read", evaluation, problem);
    else if (status == STATUS_OK && reading.contacts.count == 0)
        status = add_silent(of, index, i, reading.why, evaluation, problem);
    for (size_t k = 0; status == STATUS_OK && k < reading.contacts.count; k++)
        status = add_contact(of, index, i, k, &reading.contacts.at[k], evaluation, problem);
    trace_analysis_clear(&reading);
    return status;
}

Status rows_add(const Measurement *of, size_t index, const Progress *progress,
                Evaluation *evaluation, Problem *problem) {
    for (size_t i = 0; i < of->test->drops.count; i++)
        TRY(add_drop(of, index, i, evaluation, problem));
    for (size_t i = 0; i < of->test->traces.count; i++)
        TRY(add_trace(of, index, i, progress, evaluation, problem));
    return STATUS_OK;
}

static GravityLoad pull_of(const Measurement *tests, const EvaluationRow *row, int separation) {
    return (GravityLoad){tests[row->test].test->gravity, row->approach_speed,
                         (Separation)separation, row->restitution_by == RESTITUTION_BY_HEIGHTS};
}

static bool is_pulled(const Measurement *tests, const EvaluationRow *row) {
    return !row->is_of_trace && tests[row->test].test->gravity > 0 &&
           (has(row->restitution) || has(row->contact_time));
}

// Of a drop that tells both.
static Status unpull(const GravityLoad *pull, EvaluationRow *row, Problem *problem) {
    const GravityCorrected read = {row->restitution, row->contact_time,
                                   row->restitution_uncertainty / row->restitution,
                                   row->contact_time_uncertainty / row->contact_time};
    GravityCorrected isolated;
    if (!(row->restitution > 0) || !gravity_correct(pull, &read, &isolated)) {
        row->restitution_counts = row->contact_time_counts = false;
        return say(row, "does not count: no contact comes to this e and T_c under that gravity",
                   problem);
    }
    row->read_restitution = row->restitution;
    row->read_contact_time = row->contact_time;
    row->restitution = isolated.restitution;
    row->contact_time = isolated.contact_time;
    row->restitution_uncertainty = isolated.restitution * isolated.restitution_uncertainty;
    row->contact_time_uncertainty = isolated.contact_time * isolated.contact_time_uncertainty;
    return STATUS_OK;
}

// The means of a test's readings that are free of gravity.
static void means_of(const Evaluation *evaluation, size_t test, double *restitution,
                     double *contact_time) {
    double e = 0, T = 0, of_e = 0, of_T = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        const bool is_free = row->is_of_trace || has(row->read_contact_time);
        if (row->test != test || !is_free)
            continue;
        if (row->restitution_counts) {
            e += row->restitution;
            of_e++;
        }
        if (row->contact_time_counts) {
            T += row->contact_time;
            of_T++;
        }
    }
    *restitution = e / of_e; // NAN of none
    *contact_time = T / of_T;
}

// Of a drop that tells one of the two.
static Status unpull_one(const GravityLoad *pull, double restitution, double contact_time,
                         EvaluationRow *row, Problem *problem) {
    const bool wants_e = has(row->restitution);
    const double known = wants_e ? contact_time : restitution;
    const bool can_tell = has(known) && has(pull->speed);
    double value = (double)NAN;
    const bool is_found =
        can_tell &&
        (wants_e ? gravity_correct_restitution(pull, row->restitution, known, &value)
                 : gravity_correct_contact_time(pull, row->contact_time, known, &value));
    if (!is_found)
        return say(row,
                   can_tell  ? "gravity is not taken out: no contact comes to this under it"
                   : wants_e ? "gravity is not taken out: this needs a contact time"
                             : "gravity is not taken out: this needs a speed and a restitution",
                   problem);
    // Errors grow with what is taken out.
    if (wants_e) {
        row->restitution_uncertainty *= value / row->restitution;
        row->read_restitution = row->restitution;
        row->restitution = value;
    } else {
        row->contact_time_uncertainty *= value / row->contact_time;
        row->read_contact_time = row->contact_time;
        row->contact_time = value;
    }
    return STATUS_OK;
}

Status rows_unpull(const Measurement *tests, size_t count, const Progress *progress,
                   Evaluation *evaluation, Problem *problem) {
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        EvaluationRow *row = &evaluation->rows.at[i];
        if (!is_pulled(tests, row) || !has(row->restitution) || !has(row->contact_time))
            continue;
        if (!progress_advance(progress, 1))
            return STATUS_CANCELLED;
        const GravityLoad pull = pull_of(tests, row, evaluation->separation);
        TRY(unpull(&pull, row, problem));
    }
    for (size_t test = 0; test < count; test++) {
        double restitution, contact_time;
        means_of(evaluation, test, &restitution, &contact_time);
        for (size_t i = 0; i < evaluation->rows.count; i++) {
            EvaluationRow *row = &evaluation->rows.at[i];
            if (row->test != test || !is_pulled(tests, row) ||
                (has(row->restitution) && has(row->contact_time)))
                continue;
            if (!progress_advance(progress, 1))
                return STATUS_CANCELLED;
            const GravityLoad pull = pull_of(tests, row, evaluation->separation);
            TRY(unpull_one(&pull, restitution, contact_time, row, problem));
        }
    }
    return STATUS_OK;
}
