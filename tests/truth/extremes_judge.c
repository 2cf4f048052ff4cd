#include "tests/truth/extremes_judge.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/simulation.h"
#include "core/solve/solver.h"
#include "core/solve/time_stepping.h"
#include "server/json/parse.h"
#include "server/util/clock.h"
#include "tests/support/doubles.h"
#include "tests/truth/frame_reference.h"

const char *const extremes_verdicts[EXTREME_VERDICTS] = {
    "kept", "unjudged", "untrusted", "refused", "failed", "SILENT", "NAN",
    "MUTE", "SLOW",     "DEAF",      "GREEDY",  "HANG",   "CRASH",
};
const char *const extremes_judges[EXTREMES_JUDGES] = {"nobody", "quad precision", "exact",
                                                      "adaptive 1e-13", "rk4"};

// What is stated holds if the truth is not further off than so many times that, or than this.
static const double TIMES = 10, LEAST = 1e-9;
// Stated errors of this and more say that only statistics hold.
static const double LARGE = 0.1;
// Where a horizon is told, it may be late by as much.
static const double EARLY = 0.7;

static double now(void) {
    return 1e-9 * (double)clock_thread_cpu_ns();
}

typedef struct Gaps {
    double last, longest;
} Gaps;

static bool look(void *context, double fraction) {
    Gaps *gaps = context;
    const double at = now();
    (void)fraction;
    gaps->longest = fmax(gaps->longest, at - gaps->last);
    gaps->last = at;
    return true;
}

// A sentence without its numbers, so that like reasons are one.
static void generalise(char target[EXTREMES_REASON], const char *pointer, const char *detail) {
    char text[2 * EXTREMES_REASON];
    size_t used = 0;
    snprintf(text, sizeof text, "%s%s%s", pointer, pointer[0] != '\0' ? ": " : "", detail);
    for (const char *c = text; *c != '\0' && used + 2 < EXTREMES_REASON;) {
        const bool is_name = c > text && (isalpha((unsigned char)c[-1]) || c[-1] == '_');
        char *end;
        if (!is_name &&
            (isdigit((unsigned char)*c) || (*c == '-' && isdigit((unsigned char)c[1])))) {
            (void)strtod(c, &end);
            target[used++] = '#';
            c = end;
        } else {
            target[used++] = *c++;
        }
    }
    target[used] = '\0';
}

// One run of a document, by its own solver or by another.
typedef struct Answer {
    Status status;
    Simulation simulation;
    Outcome *outcome; // or NULL
    double predicted, bytes, cpu, steps, gap;
} Answer;

static Problem problem;

static SimulationLimits limits_of(double seconds) {
    return (SimulationLimits){
        .samples = 1 << 22, .impacts = 1 << 20, .steps = seconds / SOLVER_STEP};
}

static void answer_clear(Answer *answer) {
    outcome_unref(answer->outcome);
    simulation_clear(&answer->simulation);
}

// Reads, judges and completes; `solver` NULL: the document's own.
static void answer_read(Answer *answer, const char *text, const Solver *solver, double seconds) {
    const SimulationLimits limits = limits_of(seconds);
    memset(answer, 0, sizeof *answer);
    problem_clear(&problem);
    answer->status =
        json_parse(text, strlen(text), simulation_fields, &answer->simulation, &problem);
    if (solver != NULL && answer->status == STATUS_OK) {
        variant_free(answer->simulation.accuracy);
        answer->simulation.accuracy = variant_new(&solver->kind);
        if (answer->simulation.accuracy == NULL)
            abort();
        if (solver == &solver_adaptive)
            ((AccuracyTolerance *)(void *)answer->simulation.accuracy)->tolerance = 1e-13;
    }
    if (answer->status == STATUS_OK)
        answer->status = simulation_complete(&answer->simulation, &limits, NULL, &problem);
}

static void answer_run(Answer *answer, double seconds) {
    const SimulationLimits limits = limits_of(seconds);
    const Cost cost = simulation_cost(&answer->simulation);
    Gaps gaps = {.last = now()};
    const Progress progress = {&gaps, look};
    const double start = gaps.last;
    answer->predicted = cost.cpu_seconds;
    answer->bytes = cost.bytes;
    answer->status =
        simulation_run(&answer->simulation, &limits, &progress, NULL, &answer->outcome, &problem);
    (void)look(&gaps, 1);
    answer->cpu = gaps.last - start;
    answer->gap = gaps.longest;
    answer->steps = answer->outcome != NULL ? answer->outcome->steps : (double)NAN;
}

// Displacements of all storeys at all samples, and how far they can be trusted.
typedef struct Opinion {
    const double *storeys[40];
    size_t storey_count, count;
    double error, horizon, largest;
} Opinion;

// Peaks of the summary may be those of a part of the run.
static void opinion_measure(Opinion *opinion) {
    for (size_t j = 0; j < opinion->storey_count; j++)
        opinion->largest =
            fmax(opinion->largest, doubles_largest(opinion->storeys[j], opinion->count));
}

static Opinion opinion_of(const Outcome *outcome, size_t storeys) {
    Opinion opinion = {.storey_count = storeys, .count = outcome->response.count};
    const Columns *series = &outcome->response.series;
    const Column *bare = columns_find(series, "displacement");
    for (size_t i = 0; i < storeys; i++) {
        char name[48];
        snprintf(name, sizeof name, "displacement_%zu", i + 1);
        const Column *column = bare != NULL ? bare : columns_find(series, name);
        if (column == NULL)
            abort();
        opinion.storeys[i] = column->values;
    }
    const Summary *summary = &outcome->summary;
    opinion.error = summary->error_estimate;
    opinion.horizon = isnan(summary->trust_horizon) ? INFINITY : summary->trust_horizon;
    opinion_measure(&opinion);
    return opinion;
}

// The largest difference to where both can be trusted, of the largest displacement.
static double difference(const Opinion *a, const Opinion *b, double rate) {
    const double until = EARLY * fmin(a->horizon, b->horizon);
    const double largest = fmax(a->largest, b->largest);
    double most = 0;
    if (!(largest > 0))
        return 0;
    for (size_t i = 0; i < a->count && i < b->count && (double)i / rate < until; i++)
        for (size_t j = 0; j < a->storey_count; j++) {
            const double apart = fabs(a->storeys[j][i] - b->storeys[j][i]);
            most = apart > most || isnan(apart) ? apart : most;
        }
    return most / largest;
}

// What an opinion states for the time before its horizon.
static double stated(const Opinion *opinion) {
    return isinf(opinion->horizon) ? opinion->error : fmin(opinion->error, RESPONSE_DIVERGENCE);
}

static bool quad_serves(const Plan *plan, const Base *base) {
    if (plan->storeys > TRUTH_STOREYS || plan->damper_count > TRUTH_DAMPERS ||
        plan->form == CONTACT_POWER || base->form == BASE_PIECES)
        return false;
    for (size_t d = 0; d < plan->damper_count; d++)
        for (int side = 0; side < 2; side++) {
            const ContactStop *stop = &plan->dampers[d].stops[side];
            if (plan->form == CONTACT_LINEAR ? isnan(stop->parameters.stiffness)
                                             : isnan(stop->parameters.restitution))
                return false; // it depends on the speed
        }
    return true;
}

static const double QUAD_STEPS = 2e4; // a second of work of the limit

static bool ask_quad(const Answer *answer, const Opinion *own, double seconds, double *apart) {
    const Scene *scene = &answer->simulation.scene;
    Plan *plan;
    Base base = {0};
    FrameTruth truth;
    bool is_whole = false;
    if (plan_new(scene, "exact", "exact", &plan, NULL) != STATUS_OK)
        return false;
    const Span span = {.duration = scene->duration, .sample_rate = scene->sample_rate};
    const Excitation *excitation = scene_excitation(scene);
    if (excitation_make(excitation, &span, NULL, &base, NULL) == STATUS_OK &&
        quad_serves(plan, &base) && (double)plan->count < QUAD_STEPS * seconds) {
        frame_truth(plan, &base, QUAD_STEPS * seconds, &truth);
        is_whole = truth.is_whole;
        Opinion quad = {.storey_count = own->storey_count,
                        .count = truth.count,
                        .error = 0,
                        .horizon = INFINITY};
        for (size_t i = 0; i < quad.storey_count; i++)
            quad.storeys[i] = truth.x + i * truth.count;
        opinion_measure(&quad);
        if (is_whole)
            *apart = difference(own, &quad, scene->sample_rate);
        frame_truth_clear(&truth);
    }
    base_clear(&base);
    plan_free(plan);
    return is_whole;
}

// Another solver on the same scene; false if it came to no end, or knows no better.
static bool ask_solver(const char *text, const Solver *solver, const Opinion *own, double seconds,
                       double *apart, double *theirs) {
    Answer other;
    bool is_closer = false;
    answer_read(&other, text, solver, seconds);
    if (other.status == STATUS_OK)
        answer_run(&other, seconds);
    if (other.outcome != NULL) {
        const Opinion opinion = opinion_of(other.outcome, own->storey_count);
        *theirs = stated(&opinion);
        is_closer = *theirs <= fmax(stated(own), LEAST);
        *apart = difference(own, &opinion, other.simulation.scene.sample_rate);
    }
    answer_clear(&other);
    return is_closer;
}

static void judge_error(const Answer *answer, const char *text, double seconds,
                        ExtremesRecord *record) {
    const size_t storeys = structure_storeys(scene_structure(&answer->simulation.scene));
    const Opinion own = opinion_of(answer->outcome, storeys);
    const bool is_exact = strcmp(answer->outcome->plan.solver, "exact") == 0;
    double theirs = 0;
    record->told = stated(&own);
    if (isnan(own.error) || record->told >= LARGE) {
        record->verdict = EXTREME_UNTRUSTED;
        snprintf(record->reason, sizeof record->reason, "%s",
                 isnan(own.error)     ? "the error is not known"
                 : own.error >= LARGE ? "the error stated is a tenth or more"
                                      : "");
        return;
    }
    if (is_exact) {
        if (ask_quad(answer, &own, seconds, &record->found))
            record->judge = EXTREMES_QUAD;
        else if (ask_solver(text, &solver_adaptive, &own, seconds, &record->found, &theirs))
            record->judge = EXTREMES_ADAPTIVE;
        else if (ask_solver(text, &solver_rk4, &own, seconds, &record->found, &theirs))
            record->judge = EXTREMES_RK4;
    } else if (ask_solver(text, &solver_exact, &own, seconds, &record->found, &theirs)) {
        record->judge = EXTREMES_EXACT;
    }
    const double allowed = fmax(TIMES * (record->told + theirs), LEAST);
    record->verdict = record->judge == EXTREMES_NOBODY ? EXTREME_UNJUDGED : EXTREME_KEPT;
    if (record->judge != EXTREMES_NOBODY && !(record->found <= allowed)) {
        record->verdict = EXTREME_SILENT;
        snprintf(record->reason, sizeof record->reason,
                 "more than %g times what %s states against %s", TIMES,
                 answer->outcome->plan.solver, extremes_judges[record->judge]);
    } else if (is_exact && !(answer->outcome->summary.energy_residual <=
                             fmax(1e-6, TIMES * answer->outcome->summary.error_estimate))) {
        record->verdict = EXTREME_SILENT;
        snprintf(record->reason, sizeof record->reason, "the energies do not balance");
        record->found = answer->outcome->summary.energy_residual;
    }
}

static bool has_nan(const Columns *columns) {
    for (size_t i = 0; i < columns->count; i++)
        for (size_t row = 0; row < columns->rows; row++)
            if (!isfinite(columns->at[i].values[row]))
                return true;
    return false;
}

static const char *find_nan(const Outcome *outcome) {
    const Summary *summary = &outcome->summary;
    const Energy *energy = &outcome->response.energy;
    if (has_nan(&outcome->response.series))
        return "a series";
    if (has_nan(&outcome->spectrum.densities))
        return "a spectrum";
    if (!isfinite(summary->peak_displacement + summary->rms_displacement +
                  summary->peak_acceleration + summary->rms_acceleration +
                  summary->peak_contact_force + summary->energy_residual) ||
        isinf(summary->error_estimate) || isinf(summary->trust_horizon))
        return "the summary";
    if (!isfinite(energy->initial + energy->input + energy->structural_damping + energy->contact +
                  energy->kinetic + energy->strain))
        return "the energies";
    for (size_t i = 0; i < outcome->response.impacts.count; i++) {
        const Impact *impact = &outcome->response.impacts.at[i];
        const bool is_over = !isnan(impact->end), is_contact = impact->kind == IMPACT_IMPACT;
        if (!isfinite(impact->start) || isinf(impact->end) || isinf(impact->restitution) ||
            isinf(impact->peak_force) || !isfinite(impact->energy_lost) ||
            !isfinite(impact->impulse) || (is_contact && !isfinite(impact->approach_speed)) ||
            (is_over && (!isfinite(impact->duration) || impact->duration < 0)))
            return "the ledger";
    }
    return NULL;
}

static void fill(const Answer *answer, ExtremesRecord *record) {
    const Scene *scene = &answer->simulation.scene;
    const size_t storeys = structure_storeys(scene_structure(scene));
    record->predicted = answer->predicted;
    record->cpu = answer->cpu;
    record->steps = answer->steps;
    record->gap = answer->gap;
    record->bytes = answer->bytes;
    record->samples = (double)scene_sample_count(scene);
    if (answer->outcome != NULL)
        record->impacts = (double)answer->outcome->response.impacts.count;
    snprintf(record->solver, sizeof record->solver, "%s", answer->simulation.accuracy->kind->name);
    snprintf(record->what, sizeof record->what, "%zu %zu %s %s", storeys, scene->dampers.count,
             dampers_contact_law(&scene->dampers, scene_contact(scene))->kind.name,
             scene->excitation->kind->name);
}

static bool is_busy(const Answer *answer) {
    return answer->outcome != NULL || answer->status == STATUS_LIMIT;
}

static const double SLOW_TIMES = 10, SLOW_MIN = 0.05, GAP_MAX = 0.3;

void extremes_judge(const char *text, uint64_t number, double most_seconds,
                    ExtremesRecord *record) {
    Answer answer;
    const char *bad = NULL;
    memset(record, 0, sizeof *record);
    record->number = number;
    record->verdict = EXTREME_MUTE;
    answer_read(&answer, text, NULL, most_seconds);
    const bool is_refused = answer.status != STATUS_OK;
    if (is_refused) {
        if (problem.count > 0 && problem.faults[0].detail[0] != '\0') {
            record->verdict = EXTREME_REFUSED;
            generalise(record->reason, problem.faults[0].pointer, problem.faults[0].detail);
        }
        snprintf(record->solver, sizeof record->solver, "%s",
                 answer.simulation.accuracy != NULL ? answer.simulation.accuracy->kind->name : "-");
        answer_clear(&answer);
        return;
    }
    answer_run(&answer, most_seconds);
    fill(&answer, record);
    if (answer.outcome == NULL && problem.detail[0] != '\0') {
        record->verdict = EXTREME_FAILED;
        generalise(record->reason, "", problem.detail);
    } else if (answer.outcome != NULL && (bad = find_nan(answer.outcome)) != NULL) {
        record->verdict = EXTREME_NAN;
        snprintf(record->reason, sizeof record->reason, "%s", bad);
    } else if (answer.outcome != NULL) {
        judge_error(&answer, text, most_seconds, record);
    }
    if (record->verdict < EXTREME_FIRST_DEFECT && is_busy(&answer) &&
        answer.cpu > SLOW_MIN + SLOW_TIMES * most_seconds) {
        record->verdict = EXTREME_SLOW;
        snprintf(record->reason, sizeof record->reason, "more CPU than allowed");
    }
    if (record->verdict < EXTREME_FIRST_DEFECT && answer.gap > GAP_MAX) {
        record->verdict = EXTREME_DEAF;
        snprintf(record->reason, sizeof record->reason, "asked too rarely whether to stop");
    }
    answer_clear(&answer);
}
