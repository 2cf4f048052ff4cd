// The rows of a solver's settings say what it can trade: a row "step" or "tolerance" makes
// candidates, whatever the solver is called.
#include "core/study/candidate_settings.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/solvers.h"
#include "core/study/study_run.h"

enum {
    DECADES_MAX = 8,  // of steps, from the sample interval down
    SEGMENT_MIN = 16, // samples of a segment
    RATES = 3,
    SHARES = 2,
    STOREYS_MIN = 4, // of a structure with modes to leave out
};
// The finest step: this part of the shortest contact, or of a radian of the fastest mode.
static const double contact_part = 3e-3, radian_part = 1e-3;
static const double tolerance_max = 1e-3, tolerance_min = 1e-14, tolerance_factor = 1e-2;
static const double rate_divisors[RATES] = {2, 4, 8}; // powers of 2, so that samples coincide
static const uint64_t spectrum_divisors[SHARES] = {4, 16};
static const double duration_divisors[SHARES] = {2, 4};

const char *const tradeoff_status_names[] = {"measured", "refused", "failed", NULL};

// clang-format off
const Field tradeoff_point_fields[] = {
    FIELD_TEXT(TradeoffPoint, name, 0, PRESENCE_OPTIONAL, 0, "name for display"),
    FIELD_TEXT(TradeoffPoint, solver, 0, PRESENCE_OPTIONAL, 0, "solver"),
    FIELD_REAL(TradeoffPoint, step, "s", ANY, OPTIONAL, "its step"),
    FIELD_REAL(TradeoffPoint, tolerance, NULL, ANY, OPTIONAL, "its tolerance"),
    FIELD_TEXT(TradeoffPoint, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model in place of the scene's"),
    FIELD_REAL(TradeoffPoint, sample_rate, "Hz", ANY, OPTIONAL, "sample rate in place of the scene's; the base keeps its own"),
    FIELD_REAL(TradeoffPoint, duration, "s", ANY, OPTIONAL, "duration in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, segment, "samples", AT_MIN(1), OPTIONAL, "segment of the spectra in place of the scene's"),
    FIELD_COUNT(TradeoffPoint, modes, NULL, AT_MIN(1), OPTIONAL, "number of modes kept; all if absent"),
    FIELD_CHOICE(TradeoffPoint, status, tradeoff_status_names, TRADEOFF_MEASURED, "measured; refused: too expensive or invalid; failed: the run ended early"),
    FIELD_TEXT(TradeoffPoint, why, 0, PRESENCE_OPTIONAL, 0, "why it was not measured"),
    FIELD_REAL(TradeoffPoint, cpu_minimum, "s", ANY, OPTIONAL, "CPU time of a run with the scene's own output, the smallest timing; a measurement, not repeatable"),
    FIELD_REAL(TradeoffPoint, cpu_median, "s", ANY, OPTIONAL, "median of the timings; a measurement"),
    FIELD_COUNT(TradeoffPoint, runs, NULL, AT_MIN(0), 0, "number of timed runs: short ones are timed many at once"),
    FIELD_REAL(TradeoffPoint, steps, NULL, ANY, OPTIONAL, "solver steps"),
    FIELD_ITEM(TradeoffPoint, errors, error_fields, NULL, PRESENCE_DEFAULT, "differences from the reference"),
    FIELD_FLAG(TradeoffPoint, is_best, false, "no other point is both cheaper and closer by the metric; follows from measured times"),
    FIELD_END
};
// clang-format on

const Kind *candidate_settings_reference(void) {
    size_t i = 0;
    while (solvers[i]->run == NULL)
        i++;
    return &solvers[i]->kind;
}

// A list under construction, all of the same simulation.
typedef struct Candidates {
    TradeoffPoints *points;
    const Simulation *simulation;
    bool is_whole;       // false: without memory
    TradeoffPoint spare; // takes the settings of a point for which there is no memory
} Candidates;

// Adds a point with nothing but its solver and name.
__attribute__((format(printf, 3, 4))) static TradeoffPoint *
candidate_add(Candidates *list, const Kind *solver, const char *format, ...) {
    TradeoffPoint *point = study_list_add(list->points, sizeof *point, NULL);
    if (point == NULL) {
        list->is_whole = false;
        return &list->spare;
    }
    va_list arguments;
    char name[96];
    va_start(arguments, format);
    vsnprintf(name, sizeof name, format, arguments);
    va_end(arguments);
    (void)fields_default(tradeoff_point_fields, point); // absent and 0: nothing to allocate
    point->name = strdup(name);
    point->solver = strdup(solver->name);
    list->is_whole = list->is_whole && point->name != NULL && point->solver != NULL;
    return point;
}

// Duration of the shortest contact of a buffer, about, for a free mass [s]; NAN: none.
static double candidate_contact_time(const Buffer *buffer, double mass) {
    static const double pi = 3.14159265358979324;
    double shortest = buffer->contact_time;
    if (isnan(shortest) && buffer->stiffness > 0)
        shortest = pi * sqrt(mass / buffer->stiffness);
    for (size_t i = 0; i < buffer->table.count; i++)
        shortest = fmin(shortest, buffer->table.at[i].contact_time);
    return shortest;
}

static Status candidate_finest_step(const Simulation *simulation, double *finest) {
    StructureRates rates;
    TRY(structure_rates(scene_structure(&simulation->scene), SIZE_MAX, &rates));
    *finest = rates.fastest > 0 ? radian_part / rates.fastest : (double)INFINITY;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++) {
        const Damper *damper = &simulation->scene.dampers.at[i];
        for (int side = SIDE_LEFT; side <= SIDE_RIGHT; side++) {
            const Buffer *buffer = damper_buffer(damper, (Side)side);
            *finest = fmin(*finest, contact_part * candidate_contact_time(buffer, damper->mass));
        }
    }
    return STATUS_OK;
}

static void candidate_add_steps(Candidates *list, const Kind *solver, double finest) {
    double step = 1 / list->simulation->scene.sample_rate;
    for (int i = 0; i < DECADES_MAX; i++, step /= 10) {
        candidate_add(list, solver, "%s, step %.4g s", solver->name, step)->step = step;
        if (step <= finest)
            break;
    }
}

static void candidate_add_tolerances(Candidates *list, const Kind *solver, const Range *range) {
    const double min = fmax(range->min, tolerance_min) * (1 - 1e-9);
    for (double own = fmin(tolerance_max, range->max); own >= min; own *= tolerance_factor)
        candidate_add(list, solver, "%s, tolerance %.3g", solver->name, own)->tolerance = own;
}

// Less output at full accuracy.
static void candidate_add_outputs(Candidates *list, const Kind *solver) {
    const Scene *scene = &list->simulation->scene;
    const SpectrumRequest *psd = &list->simulation->output.psd;
    const size_t shares = psd->channels.count > 0 ? SHARES : 0;
    for (size_t i = 0; i < RATES; i++) {
        const double rate = scene->sample_rate / rate_divisors[i];
        if (rate * scene->duration < SEGMENT_MIN)
            break;
        candidate_add(list, solver, "%s, sampled at %.6g Hz", solver->name, rate)->sample_rate =
            rate;
    }
    for (size_t i = 0; i < shares; i++) {
        const uint64_t segment = psd->segment / spectrum_divisors[i];
        if (segment < SEGMENT_MIN)
            break;
        candidate_add(list, solver, "%s, segments of %llu", solver->name,
                      (unsigned long long)segment)
            ->segment = segment;
    }
    for (size_t i = 0; i < shares; i++) {
        const double duration = scene->duration / duration_divisors[i];
        if (duration * scene->sample_rate < (double)psd->segment)
            break;
        candidate_add(list, solver, "%s, %.6g s long", solver->name, duration)->duration = duration;
    }
}

// Half the modes, a quarter, and so on down to one.
static void candidate_add_modes(Candidates *list, const Kind *solver) {
    const size_t storeys = structure_storeys(scene_structure(&list->simulation->scene));
    for (size_t modes = storeys / 2; storeys >= STOREYS_MIN && modes > 0; modes /= 2)
        candidate_add(list, solver, "%s, %zu mode%s", solver->name, modes, modes == 1 ? "" : "s")
            ->modes = modes;
}

static bool candidate_has_form(const Simulation *simulation, ContactForm form) {
    const Scene *scene = &simulation->scene;
    return scene->dampers.count > 0 &&
           dampers_contact_law(&scene->dampers, scene_contact(scene))->form == form;
}

static bool candidate_is_requested(const Texts *names, const char *name) {
    bool is_named = names->count == 0;
    for (size_t i = 0; i < names->count; i++)
        is_named = is_named || strcmp(names->at[i], name) == 0;
    return is_named;
}

static void candidate_add_solver(Candidates *list, const Solver *solver, double finest) {
    const Kind *kind = &solver->kind;
    // Some solvers use their settings under power laws alone.
    const bool is_used =
        solver->forget_unused == NULL || candidate_has_form(list->simulation, CONTACT_POWER);
    const Field *tolerance = is_used ? fields_find(kind->fields, "tolerance", NULL) : NULL;
    if (fields_find(kind->fields, "step", NULL) != NULL) {
        candidate_add_steps(list, kind, finest);
        return;
    }
    if (tolerance != NULL)
        candidate_add_tolerances(list, kind, &tolerance->range);
    // Without its tolerance, if that may be left out.
    if (tolerance == NULL || tolerance->presence == PRESENCE_OPTIONAL)
        candidate_add(list, kind, "%s", kind->name);
}

static void candidate_add_reference(Candidates *list, const Kind *solver) {
    if (candidate_has_form(list->simulation, CONTACT_LINEAR)) {
        const char *model = contact_impulse.kind.name;
        char **own =
            &candidate_add(list, solver, "%s, contact %s", solver->name, model)->contact_model;
        *own = strdup(model);
        list->is_whole = list->is_whole && *own != NULL;
    }
    candidate_add_modes(list, solver);
    candidate_add_outputs(list, solver);
}

Status candidate_settings_list(const Texts *names, const Simulation *simulation,
                               TradeoffPoints *points, Problem *problem) {
    const Kind *reference = candidate_settings_reference();
    Candidates list = {.points = points, .simulation = simulation};
    double finest = 0;
    *points = (TradeoffPoints){NULL, 0};
    list.is_whole = candidate_finest_step(simulation, &finest) == STATUS_OK;
    for (size_t i = 0; solvers[i] != NULL && list.is_whole; i++)
        if (solvers[i]->run != NULL && candidate_is_requested(names, solvers[i]->kind.name))
            candidate_add_solver(&list, solvers[i], finest);
    if (list.is_whole && candidate_is_requested(names, reference->name))
        candidate_add_reference(&list, reference);
    for (size_t i = 0; i < points->count && list.is_whole; i++)
        points->at[i].estimate = candidate_settings_cost(simulation, &points->at[i]);
    free(list.spare.contact_model);
    return list.is_whole ? STATUS_OK : study_no_memory(problem);
}

// Sets a member of a solver's settings, if it has one of this name.
static void candidate_set(Variant *accuracy, const char *name, double real, uint64_t count) {
    size_t offset = 0;
    const Field *row = fields_find(accuracy->kind->fields, name, &offset);
    if (row == NULL)
        return;
    void *member = (char *)accuracy + offset + row->offset;
    if (row->kind == FIELD_KIND_COUNT && count != COUNT_ABSENT)
        *(uint64_t *)member = count;
    else if (row->kind == FIELD_KIND_REAL && !isnan(real))
        *(double *)member = real;
}

static Status candidate_apply_solver(const TradeoffPoint *point, Simulation *target) {
    Variant *accuracy = variant_new(kind_find(&solver_kinds, point->solver));
    if (accuracy == NULL)
        return STATUS_NO_MEMORY;
    variant_free(target->accuracy);
    target->accuracy = accuracy;
    candidate_set(accuracy, "step", point->step, COUNT_ABSENT);
    candidate_set(accuracy, "tolerance", point->tolerance, COUNT_ABSENT);
    candidate_set(accuracy, "modes", (double)NAN, point->modes);
    return STATUS_OK;
}

// A coarser spectrum keeps its share of overlap.
static void candidate_apply_output(const TradeoffPoint *point, Simulation *target) {
    SpectrumRequest *psd = &target->output.psd;
    double share = 1;
    if (!isnan(point->sample_rate)) {
        share = point->sample_rate / target->scene.sample_rate;
        target->scene.sample_rate = point->sample_rate;
    }
    if (!isnan(point->duration))
        target->scene.duration = point->duration;
    if (point->segment != COUNT_ABSENT && psd->channels.count > 0)
        share = (double)point->segment / (double)psd->segment;
    if (psd->channels.count > 0 && share != 1) {
        psd->segment = (uint64_t)fmax(1, floor((double)psd->segment * share));
        psd->overlap = (uint64_t)floor((double)psd->overlap * share);
        if (psd->overlap >= psd->segment)
            psd->overlap = psd->segment - 1;
    }
    target->output.impacts = true; // errors are counted from them
    const double last = floor(target->scene.duration * target->scene.sample_rate * (1 + 1e-12)) /
                        target->scene.sample_rate;
    target->output.statistics_from = fmin(target->output.statistics_from, last);
}

Status candidate_settings_apply(const Simulation *simulation, const TradeoffPoint *point,
                                const SimulationLimits *limits, Simulation *target,
                                Problem *problem) {
    Status status = fields_copy(simulation_fields, simulation, target);
    if (status == STATUS_OK)
        status = candidate_apply_solver(point, target);
    if (status == STATUS_OK && point->contact_model != NULL)
        status = simulation_use_impulses(target, problem);
    if (status == STATUS_NO_MEMORY)
        return study_no_memory(problem);
    TRY(status);
    candidate_apply_output(point, target);
    return simulation_complete(target, limits, NULL, problem);
}

double candidate_settings_cost(const Simulation *simulation, const TradeoffPoint *point) {
    Simulation view = *simulation; // borrows all but what the point changes
    view.accuracy = NULL;
    if (candidate_apply_solver(point, &view) != STATUS_OK)
        return 0; // the run will fail
    candidate_apply_output(point, &view);
    const double steps = simulation_cost(&view).steps;
    variant_free(view.accuracy);
    return steps;
}
