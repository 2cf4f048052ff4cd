// The entry points, which decide between a plain scene, an accuracy target and a comparison with
// the scene without dampers, and the result of a run with its fields and reference count.
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/internal.h"

const char engine_version[] = "impactd-5";

// clang-format off
const Field summary_fields[] = {
    FIELD_REAL(Summary, peak_displacement, "m", ANY, OPTIONAL, "largest |displacement| over samples and events, of all storeys"),
    FIELD_REAL(Summary, rms_displacement, "m", ANY, OPTIONAL, "root mean square over samples, the largest of all storeys"),
    FIELD_REAL(Summary, peak_acceleration, "m/s^2", ANY, OPTIONAL, "largest |acceleration| over samples and events, of all storeys"),
    FIELD_REAL(Summary, rms_acceleration, "m/s^2", ANY, OPTIONAL, "root mean square over samples, the largest of all storeys"),
    FIELD_COUNT(Summary, impacts, NULL, AT_MIN(0), OPTIONAL, "number of impacts"),
    FIELD_REAL(Summary, peak_contact_force, "N", ANY, OPTIONAL, "largest |contact force| over events, of all dampers"),
    FIELD_REAL(Summary, energy_residual, NULL, ANY, OPTIONAL, "largest |balance| over the largest energy"),
    FIELD_REAL(Summary, error_estimate, NULL, ANY, OPTIONAL, "estimated largest error of displacement over its largest value, at most 1; unknown if the solver makes no estimate"),
    FIELD_REAL(Summary, trust_horizon, "s", ANY, OPTIONAL, "end of the predictable trajectory: here rounding, or the error of the solver's steps, reaches 1e-6 of the largest displacement, and beyond it only statistics are valid; null with an error_estimate: not within the run"),
    FIELD_END
};

const Field reduction_fields[] = {
    FIELD_REAL(Reduction, peak_displacement_reduction, NULL, ANY, OPTIONAL, "1 - peak_displacement over that without dampers"),
    FIELD_REAL(Reduction, rms_displacement_reduction, NULL, ANY, OPTIONAL, "1 - rms_displacement over that without dampers"),
    FIELD_REAL(Reduction, peak_acceleration_reduction, NULL, ANY, OPTIONAL, "1 - peak_acceleration over that without dampers"),
    FIELD_REAL(Reduction, rms_acceleration_reduction, NULL, ANY, OPTIONAL, "1 - rms_acceleration over that without dampers"),
    FIELD_END
};
// clang-format on

typedef struct OutcomeRef {
    Outcome outcome; // first, so that both have the same address
    atomic_size_t count;
} OutcomeRef;

Outcome *outcome_new(void) {
    OutcomeRef *ref = calloc(1, sizeof *ref);
    if (ref == NULL)
        return NULL;
    atomic_init(&ref->count, 1);
    return &ref->outcome;
}

Outcome *outcome_ref(Outcome *outcome) {
    atomic_fetch_add(&((OutcomeRef *)outcome)->count, 1);
    return outcome;
}

void outcome_unref(Outcome *outcome) {
    if (outcome == NULL || atomic_fetch_sub(&((OutcomeRef *)outcome)->count, 1) != 1)
        return;
    fields_clear(plan_report_fields, &outcome->plan);
    response_clear(&outcome->response);
    spectrum_clear(&outcome->spectrum);
    warnings_clear(&outcome->warnings);
    free(outcome);
}

size_t outcome_bytes(const Outcome *outcome) {
    const Columns *series = &outcome->response.series, *densities = &outcome->spectrum.densities;
    return sizeof(OutcomeRef) +
           sizeof(double) *
               (series->count * series->rows + (densities->count + 1) * densities->rows) +
           outcome->response.impacts.count * sizeof(Impact);
}

static void simulation_fill_restitution(const DerivedList *derived, Dampers *dampers) {
    for (size_t i = 0; i < derived->count; i++) {
        Damper *damper = &dampers->at[i / 2];
        Buffer *const own = i % 2 == SIDE_LEFT ? &damper->left_buffer : &damper->right_buffer;
        Buffer *buffer = buffer_is_given(own) ? own : &damper->buffer;
        if (buffer->table.count > 0 || !isnan(buffer->restitution))
            continue;
        buffer->restitution = derived->at[i].restitution;
        buffer->stiffness = buffer->damping = (double)NAN;
    }
}

Status simulation_use_impulses(Simulation *simulation, Problem *problem) {
    Plan *plan;
    const char *solver = simulation->accuracy->kind->name;
    TRY(plan_new(&simulation->scene, solver, solver, &plan, problem));
    simulation_fill_restitution(&plan->report.derived, &simulation->scene.dampers);
    plan_free(plan);
    Variant *contact = variant_new(&contact_impulse.kind);
    if (contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a contact model");
    variant_free(simulation->scene.contact);
    simulation->scene.contact = contact;
    return STATUS_OK;
}

// The scene without its dampers, run for comparison. It samples no channels, because only its
// summary is used. An accuracy target is about the dampers, so without them the exact solver runs.
// The view borrows its members from `simulation`.
static Simulation undamped_baseline_view(const Simulation *simulation) {
    Simulation view = *simulation;
    view.scene.dampers = (Dampers){NULL, 0};
    view.output = (Output){.statistics_from = simulation->output.statistics_from,
                           .psd = {.window = simulation->output.psd.window,
                                   .detrend = simulation->output.psd.detrend}};
    view.output.psd.segment = view.output.psd.overlap = COUNT_ABSENT;
    view.title = NULL;
    view.labels = (Texts){NULL, 0};
    return view;
}

// A completed copy, whose contact is that of a scene without dampers.
static Status undamped_baseline_make(const Simulation *simulation, Simulation *undamped,
                                     Problem *problem) {
    const Simulation view = undamped_baseline_view(simulation);
    if (fields_copy(simulation_fields, &view, undamped) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene without dampers");
    if (simulation_has_target(simulation)) {
        Variant *accuracy = variant_new(&solver_exact.kind);
        if (accuracy == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for a solver's settings");
        variant_free(undamped->accuracy);
        undamped->accuracy = accuracy;
    }
    return simulation_validate(undamped, NULL, NULL, problem);
}

static double undamped_baseline_reduction(double with, double without) {
    return without > 0 ? 1 - with / without : (double)NAN;
}

// Runs the scene without its dampers, compares the outcome's summary with it and adds its work.
static Status undamped_baseline_run(const Simulation *simulation, const SimulationLimits *limits,
                                    const Progress *progress, Workspace *workspace,
                                    Outcome *outcome, Problem *problem) {
    Simulation undamped;
    Outcome *other = NULL;
    memset(&undamped, 0, sizeof undamped);
    Status status = undamped_baseline_make(simulation, &undamped, problem);
    if (status == STATUS_OK)
        status = run_scene(&undamped, limits, progress, workspace, NULL, &other, problem);
    if (status == STATUS_OK) {
        const Summary *with = &outcome->summary, *without = &other->summary;
        outcome->has_reduction = true;
        outcome->reduction = (Reduction){
            undamped_baseline_reduction(with->peak_displacement, without->peak_displacement),
            undamped_baseline_reduction(with->rms_displacement, without->rms_displacement),
            undamped_baseline_reduction(with->peak_acceleration, without->peak_acceleration),
            undamped_baseline_reduction(with->rms_acceleration, without->rms_acceleration),
        };
        outcome->steps += other->steps;
        work_counters_add(&outcome->work, &other->work);
    }
    outcome_unref(other);
    simulation_clear(&undamped);
    return status;
}

static Status simulation_refuse_time(const Simulation *simulation, const Cost *cost,
                                     const SimulationLimits *limits, Problem *problem) {
    const Solver *solver = (const Solver *)(const void *)simulation->accuracy->kind;
    const double most = limits->steps * SOLVER_STEP;
    static const char format[] =
        "would take about %.2g s of CPU%s%s, at most %.4g s are allowed: %s";
    if (2 * cost->spectra > cost->steps)
        return problem_add(problem, STATUS_INVALID, "/output/psd", format, cost->cpu_seconds,
                           ", most of it for spectra", "", most,
                           "ask for fewer channels, less overlap, or a segment without large "
                           "prime factors");
    if (2 * cost->base > cost->steps)
        return problem_add(problem, STATUS_INVALID, "/excitation", format, cost->cpu_seconds,
                           ", most of it to make the base's motion", "", most,
                           "take fewer samples of it, or a shorter duration");
    if (solver->cost != NULL)
        return problem_add(problem, STATUS_INVALID, "/accuracy", format, cost->cpu_seconds, " by ",
                           solver->kind.name, most,
                           "take longer steps or a larger tolerance, or the solver exact");
    return problem_add_real(problem, STATUS_INVALID, "/duration", simulation->scene.duration, "s",
                            format, cost->cpu_seconds, "", "", most,
                            cost->is_fast ? "take a shorter one; the structure or the base moves "
                                            "many times within a sample interval"
                                          : "take a shorter one, or fewer samples");
}

static Status simulation_refuse_bytes(const Simulation *simulation, const Cost *cost,
                                      const SimulationLimits *limits, Problem *problem) {
    static const char format[] =
        "would take about %.3g MB of memory, at most %.4g MB are allowed: %s";
    if (2 * cost->spectra_bytes > cost->bytes)
        return problem_add(problem, STATUS_INVALID, "/output/psd", format, 1e-6 * cost->bytes,
                           1e-6 * limits->bytes, "ask for shorter segments or fewer channels");
    return problem_add_real(problem, STATUS_INVALID, "/output/channels",
                            (double)simulation->output.channels.count, NULL, format,
                            1e-6 * cost->bytes, 1e-6 * limits->bytes,
                            "ask for fewer channels or samples");
}

// Refuses a scene that is predicted to exceed the limits.
static Status simulation_check_cost(const Simulation *simulation, const SimulationLimits *limits,
                                    Problem *problem) {
    if (limits == NULL)
        return STATUS_OK;
    const Cost cost = simulation_cost(simulation);
    if (limits->steps > 0 && !(cost.steps <= limits->steps))
        return simulation_refuse_time(simulation, &cost, limits, problem);
    if (limits->document_bytes > 0 && !(cost.document_bytes <= limits->document_bytes))
        return problem_add(problem, STATUS_INVALID, "/output/psd",
                           "would make a document of about %.3g MB, at most %.4g MB can be kept: "
                           "ask for shorter segments or fewer channels",
                           1e-6 * cost.document_bytes, 1e-6 * limits->document_bytes);
    if (limits->bytes > 0 && !(cost.bytes <= limits->bytes))
        return simulation_refuse_bytes(simulation, &cost, limits, problem);
    return STATUS_OK;
}

Status simulation_complete(Simulation *simulation, const SimulationLimits *limits,
                           Warnings *warnings, Problem *problem) {
    TRY(simulation_validate(simulation, limits, warnings, problem));
    TRY(simulation_check_cost(simulation, limits, problem));
    return warnings == NULL || scene_warnings_of_input(simulation, warnings) == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for warnings");
}

Status simulation_plan(const Simulation *simulation, PlanReport *report, Problem *problem) {
    *report = (PlanReport){0};
    return simulation_has_target(simulation) ? accuracy_target_plan(simulation, report, problem)
                                             : plan_scene(simulation, report, problem);
}

Cost simulation_cost(const Simulation *simulation) {
    Cost cost = simulation_has_target(simulation) ? accuracy_target_cost(simulation)
                                                  : cost_scene(simulation);
    if (!simulation->output.reduction)
        return cost;
    const Simulation view = undamped_baseline_view(simulation);
    const Cost undamped = cost_scene(&view);
    cost.steps += undamped.steps;
    cost.cpu_seconds += undamped.cpu_seconds;
    cost.base += undamped.base;
    cost.bytes += undamped.bytes; // the first outcome is still in memory
    return cost;
}

static Status simulation_run_damped(const Simulation *simulation, const SimulationLimits *limits,
                                    const Progress *progress, Workspace *workspace,
                                    Outcome **outcome, Problem *problem) {
    return simulation_has_target(simulation)
               ? accuracy_target_run(simulation, limits, progress, workspace, NULL, outcome,
                                     problem)
               : run_scene(simulation, limits, progress, workspace, NULL, outcome, problem);
}

Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem) {
    static const double share = 0.8; // of the progress, if the undamped scene follows
    *outcome = NULL;
    if (!simulation->output.reduction)
        return simulation_run_damped(simulation, limits, progress, workspace, outcome, problem);
    ProgressRange first = progress_range(progress, 0, share),
                  second = progress_range(progress, share, 1 - share);
    const Progress damped = progress_range_view(&first), undamped = progress_range_view(&second);
    TRY(simulation_run_damped(simulation, limits, &damped, workspace, outcome, problem));
    const Status status =
        undamped_baseline_run(simulation, limits, &undamped, workspace, *outcome, problem);
    if (status != STATUS_OK) {
        outcome_unref(*outcome);
        *outcome = NULL;
    }
    return status;
}
