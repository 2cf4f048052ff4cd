// Solvers tell by their own rows what they trade: a row "step" or "tolerance" makes points of them,
// whatever the solver is called.
#include "core/study/candidate_settings.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/impulse_variant.h"
#include "core/solve/solvers.h"

enum {
    DECADES = 8,      // of steps at most, from the sample interval down
    SEGMENT_MIN = 16, // samples of a segment
    RATES = 3,
    SHARES = 2,
    STOREYS_MIN = 4, // of a structure whose modes are worth leaving out
};
// The finest step wanted: this part of the shortest contact, or of a radian of the fastest mode.
static const double contact_part = 3e-3, radian_part = 1e-3;
static const double tolerance_max = 1e-3, tolerance_min = 1e-14, tolerance_factor = 1e-2;
static const double rate_divisors[RATES] = {2, 4, 8}; // powers of 2, so that samples coincide
static const uint64_t spectrum_divisors[SHARES] = {4, 16};
static const double duration_divisors[SHARES] = {2, 4};

const Kind *candidate_settings_reference(void) {
    size_t i = 0;
    while (solvers[i]->run == NULL)
        i++;
    return &solvers[i]->kind;
}

static const Field *candidate_field(const Kind *solver, const char *name, size_t *offset) {
    return fields_find(solver->fields, name, offset);
}

// A point with nothing but its solver and name; NULL without memory.
static TradeoffPoint *candidate_add(TradeoffPoints *points, const Kind *solver, const char *format,
                                    ...) __attribute__((format(printf, 3, 4)));

static TradeoffPoint *candidate_add(TradeoffPoints *points, const Kind *solver, const char *format,
                                    ...) {
    TradeoffPoint *at = realloc(points->at, (points->count + 1) * sizeof *at);
    if (at == NULL)
        return NULL;
    points->at = at;
    TradeoffPoint *point = &at[points->count++];
    char name[96];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(name, sizeof name, format, arguments);
    va_end(arguments);
    (void)fields_default(tradeoff_point_fields, point); // absent and 0: nothing to allocate
    point->name = strdup(name);
    point->solver = strdup(solver->name);
    return point->name == NULL || point->solver == NULL ? NULL : point;
}

static const double pi = 3.14159265358979324;

// The shortest contact that a buffer's numbers tell, about, for a free mass [s]; NAN: none.
static double candidate_contact_time(const Buffer *buffer, double mass) {
    double shortest = buffer->contact_time;
    if (isnan(shortest) && buffer->stiffness > 0)
        shortest = pi * sqrt(mass / buffer->stiffness);
    for (size_t i = 0; i < buffer->table.count; i++)
        shortest = fmin(shortest, buffer->table.at[i].contact_time);
    return shortest;
}

// What the finest step is to resolve [s].
static Status candidate_finest_step(const Simulation *simulation, double *finest) {
    StructureRates rates;
    TRY(structure_rates(scene_structure(&simulation->scene), &rates));
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

static bool candidate_add_steps(TradeoffPoints *points, const Kind *solver,
                                const Simulation *simulation, double finest) {
    double step = 1 / simulation->scene.sample_rate;
    for (int i = 0; i < DECADES; i++, step /= 10) {
        TradeoffPoint *point = candidate_add(points, solver, "%s, step %.4g s", solver->name, step);
        if (point == NULL)
            return false;
        point->step = step;
        if (step <= finest)
            break;
    }
    return true;
}

static bool candidate_add_tolerances(TradeoffPoints *points, const Kind *solver,
                                     const Range *range) {
    for (double tolerance = fmin(tolerance_max, range->most);
         tolerance >= fmax(range->least, tolerance_min) * (1 - 1e-9);
         tolerance *= tolerance_factor) {
        TradeoffPoint *point =
            candidate_add(points, solver, "%s, tolerance %.3g", solver->name, tolerance);
        if (point == NULL)
            return false;
        point->tolerance = tolerance;
    }
    return true;
}

// What may be given up without giving up exactness.
static bool candidate_add_outputs(TradeoffPoints *points, const Kind *solver,
                                  const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const SpectrumRequest *psd = &simulation->output.psd;
    TradeoffPoint *point;
    for (size_t i = 0; i < RATES; i++) {
        const double rate = scene->sample_rate / rate_divisors[i];
        if (rate * scene->duration < SEGMENT_MIN)
            break;
        if ((point = candidate_add(points, solver, "%s, sampled at %.6g Hz", solver->name, rate)) ==
            NULL)
            return false;
        point->sample_rate = rate;
    }
    for (size_t i = 0; i < SHARES && psd->channels.count > 0; i++) {
        const uint64_t segment = psd->segment / spectrum_divisors[i];
        if (segment < SEGMENT_MIN)
            break;
        if ((point = candidate_add(points, solver, "%s, segments of %llu", solver->name,
                                   (unsigned long long)segment)) == NULL)
            return false;
        point->segment = segment;
    }
    for (size_t i = 0; i < SHARES && psd->channels.count > 0; i++) {
        const double duration = scene->duration / duration_divisors[i];
        if (duration * scene->sample_rate < (double)psd->segment)
            break;
        if ((point = candidate_add(points, solver, "%s, %.6g s long", solver->name, duration)) ==
            NULL)
            return false;
        point->duration = duration;
    }
    return true;
}

// Half the modes, and half of these, down to one.
static bool candidate_add_modes(TradeoffPoints *points, const Kind *solver,
                                const Simulation *simulation) {
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    for (size_t modes = storeys / 2; storeys >= STOREYS_MIN && modes > 0; modes /= 2) {
        TradeoffPoint *point = candidate_add(points, solver, "%s, %zu mode%s", solver->name, modes,
                                             modes == 1 ? "" : "s");
        if (point == NULL)
            return false;
        point->modes = modes;
    }
    return true;
}

static bool candidate_has_power_law(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    return scene->dampers.count > 0 && law->form == CONTACT_POWER;
}

static bool candidate_is_requested(const TradeoffStudy *study, const char *name) {
    bool is_named = study->solvers.count == 0;
    for (size_t i = 0; i < study->solvers.count; i++)
        is_named = is_named || strcmp(study->solvers.at[i], name) == 0;
    return is_named;
}

// Whether the solver's settings change anything of this scene.
static bool candidate_is_useful(const Kind *kind, const Simulation *simulation) {
    const Solver *solver = (const Solver *)(const void *)kind;
    return solver->forget_unused == NULL || candidate_has_power_law(simulation);
}

static bool candidate_add_solver(TradeoffPoints *points, const Kind *solver,
                                 const Simulation *simulation, double finest) {
    const Field *tolerance =
        candidate_is_useful(solver, simulation) ? candidate_field(solver, "tolerance", NULL) : NULL;
    if (candidate_field(solver, "step", NULL) != NULL)
        return candidate_add_steps(points, solver, simulation, finest);
    if (tolerance != NULL && !candidate_add_tolerances(points, solver, &tolerance->range))
        return false;
    // A tolerance that may be left out is none then.
    if (tolerance != NULL && tolerance->presence != PRESENCE_OPTIONAL)
        return true;
    return candidate_add(points, solver, "%s", solver->name) != NULL;
}

static bool candidate_add_reference(TradeoffPoints *points, const Kind *solver,
                                    const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    if (scene->dampers.count > 0 && law->form == CONTACT_LINEAR) {
        const char *model = contact_impulse.kind.name;
        TradeoffPoint *point = candidate_add(points, solver, "%s, contact %s", solver->name, model);
        if (point == NULL || (point->contact_model = strdup(model)) == NULL)
            return false;
    }
    return candidate_add_modes(points, solver, simulation) &&
           candidate_add_outputs(points, solver, simulation);
}

Status candidate_settings_list(const TradeoffStudy *study, const Simulation *simulation,
                               TradeoffPoints *points, Problem *problem) {
    double finest;
    *points = (TradeoffPoints){NULL, 0};
    bool is_whole = candidate_finest_step(simulation, &finest) == STATUS_OK;
    for (size_t i = 0; solvers[i] != NULL && is_whole; i++)
        if (solvers[i]->run != NULL && candidate_is_requested(study, solvers[i]->kind.name))
            is_whole = candidate_add_solver(points, &solvers[i]->kind, simulation, finest);
    if (is_whole && candidate_is_requested(study, candidate_settings_reference()->name))
        is_whole = candidate_add_reference(points, candidate_settings_reference(), simulation);
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's points");
}

static void candidate_set_real(Variant *variant, const char *name, double value) {
    size_t offset = 0;
    const Field *row = candidate_field(variant->kind, name, &offset);
    if (row != NULL && !isnan(value))
        *(double *)(void *)((char *)variant + offset + row->offset) = value;
}

static void candidate_set_count(Variant *variant, const char *name, uint64_t value) {
    size_t offset = 0;
    const Field *row = candidate_field(variant->kind, name, &offset);
    if (row != NULL && value != COUNT_ABSENT)
        *(uint64_t *)(void *)((char *)variant + offset + row->offset) = value;
}

static Status candidate_apply_solver(const TradeoffPoint *point, Simulation *target) {
    const Kind *kind = kind_find(&solver_kinds, point->solver);
    Variant *accuracy = variant_new(kind);
    if (accuracy == NULL)
        return STATUS_NO_MEMORY;
    variant_free(target->accuracy);
    target->accuracy = accuracy;
    candidate_set_real(accuracy, "step", point->step);
    candidate_set_real(accuracy, "tolerance", point->tolerance);
    candidate_set_count(accuracy, "modes", point->modes);
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
    target->output.impacts = true; // errors are counted from ledgers
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
        status = impulses_take(target, problem);
    if (status == STATUS_NO_MEMORY)
        return problem_set(problem, status, "no memory for a point of the study");
    TRY(status);
    candidate_apply_output(point, target);
    return simulation_complete(target, limits, NULL, problem);
}

double candidate_settings_cost(const Simulation *simulation, const TradeoffPoint *point) {
    Simulation view = *simulation; // borrows all but what the point changes
    view.accuracy = NULL;
    if (candidate_apply_solver(point, &view) != STATUS_OK)
        return 0; // a guess without memory: the run will tell
    candidate_apply_output(point, &view);
    const double steps = simulation_cost(&view).steps;
    variant_free(view.accuracy);
    return steps;
}
