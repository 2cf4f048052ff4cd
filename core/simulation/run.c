// From a completed simulation to its outcome: plan, base, solver, spectra, summary.
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/mode_selection.h"
#include "core/simulation/accuracy_target.h"
#include "core/simulation/choice.h"
#include "core/simulation/omissions.h"
#include "core/simulation/result_warnings.h"
#include "core/simulation/simulation.h"
#include "core/simulation/undamped_baseline.h"
#include "core/solve/exact_accuracy.h"
#include "core/solve/rest.h"
#include "core/solve/solver.h"

// The part nobody outside sees: how many hold it.
typedef struct Held {
    Outcome outcome; // first, so that an Outcome's address is its Held's
    atomic_size_t holds;
} Held;

static Status make_plan(const Simulation *simulation, Plan **plan, Problem *problem) {
    const Solver *solver = choice_solver(simulation);
    TRY(plan_new(&simulation->scene, simulation->accuracy->kind->name, solver->kind.name, plan,
                 problem));
    Status status = plan_keep(*plan, &simulation->scene,
                              accuracy_modes(choice_common(simulation), (*plan)->storeys), problem);
    if (status == STATUS_OK && solver->decide != NULL)
        status = solver->decide(choice_settings(simulation), choice_base_interval(simulation),
                                *plan, problem);
    if (status == STATUS_OK)
        return STATUS_OK;
    plan_free(*plan);
    *plan = NULL;
    return status == STATUS_NO_MEMORY ? problem_set(problem, status, "no memory for the plan")
                                      : status;
}

// A base that never moves is a still one, however it is given.
static void still(Base *base) {
    bool moves = base->form == BASE_SINE && base->amplitude != 0;
    for (size_t i = 0; i < base->count && base->form == BASE_SAMPLED && !moves; i++)
        moves = base->values[i] != 0;
    for (size_t i = 0; i < base->piece_count && base->form == BASE_PIECES && !moves; i++)
        moves = base->pieces[i].value != 0 || base->pieces[i].slope != 0;
    if (!moves)
        base_clear(base);
}

// Tells what a plan leaves out as far as it is known before the run: a base in closed form costs
// nothing to make.
static Status foretell(const Simulation *simulation, Plan *plan, Problem *problem) {
    const Scene *scene = &simulation->scene;
    const Excitation *excitation = scene_excitation(scene);
    const bool is_known = excitation_kind(excitation)->interval == NULL;
    const Span span = {.duration = scene->duration, .sample_rate = scene->sample_rate};
    Base base = {0};
    Regime regime = {0};
    if (is_known) {
        TRY(excitation_kind(excitation)->make(excitation, &span, NULL, &base, problem));
        still(&base);
        regime = regime_find(plan, &base);
        base_clear(&base);
    }
    if (omissions_tell(simulation, choice_solver(simulation), plan, is_known ? &regime : NULL,
                       &plan->report.decisions) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    return STATUS_OK;
}

Status simulation_plan(const Simulation *simulation, PlanReport *report, Problem *problem) {
    Plan *plan;
    memset(report, 0, sizeof *report);
    if (aim_is_asked(simulation))
        return aim_plan(simulation, report, problem);
    TRY(make_plan(simulation, &plan, problem));
    const Status status = foretell(simulation, plan, problem);
    if (status == STATUS_OK) {
        *report = plan->report;
        memset(&plan->report, 0, sizeof plan->report);
    }
    plan_free(plan);
    return status;
}

// The journey's luggage: everything that must be put down again at its end.
typedef struct Journey {
    const Simulation *simulation;
    const SimulationLimits *limits;
    const Progress *progress;
    Workspace *workspace; // or NULL
    Plan *plan;
    Base base;
    Columns hidden;      // channels that only a spectrum wants
    Columns transformed; // borrowed values of the spectrum's channels
    const char **units;  // of their densities
    RunColumn *wanted;   // room for all names that ask for one
    size_t wanted_count;
    Outcome *outcome;
} Journey;

static FourierStock *stock(const Journey *journey) {
    return journey->workspace == NULL ? NULL : &journey->workspace->transforms;
}

// What a name asks for; a bare one is of the first storey or damper.
static RunColumn column_of(const char *name) {
    size_t number;
    const Channel *channel = channel_find(name, &number);
    return (RunColumn){(ChannelId)(channel - channels), number > 0 ? number - 1 : 0, NULL};
}

static const RunColumn *find_column(const Journey *journey, const char *name) {
    const RunColumn asked = column_of(name);
    for (size_t i = 0; i < journey->wanted_count; i++)
        if (journey->wanted[i].channel == asked.channel &&
            journey->wanted[i].number == asked.number)
            return &journey->wanted[i];
    return NULL;
}

// Columns for `names` that no earlier request has, entered into the journey's list.
static Status make_columns(Journey *journey, const Texts *names, Columns *columns,
                           Problem *problem) {
    size_t count = 0;
    for (size_t i = 0; i < names->count; i++)
        count += find_column(journey, names->at[i]) == NULL;
    if (count == 0)
        return STATUS_OK;
    TRY(columns_make(columns, count, journey->plan->count, 0, problem));
    for (size_t i = 0, made = 0; i < names->count; i++) {
        if (find_column(journey, names->at[i]) != NULL)
            continue;
        RunColumn *wanted = &journey->wanted[journey->wanted_count++];
        *wanted = column_of(names->at[i]);
        columns_name(columns, made, names->at[i], channels[wanted->channel].unit);
        wanted->values = columns->at[made++].values;
    }
    return STATUS_OK;
}

static Status make_spectrum(Journey *journey, Problem *problem) {
    const SpectrumRequest *request = &journey->simulation->output.psd;
    if (request->channels.count == 0)
        return STATUS_OK;
    Columns *columns = &journey->transformed;
    columns->at = calloc(request->channels.count, sizeof *columns->at);
    const char **units = calloc(request->channels.count, sizeof *units);
    journey->units = units;
    if (columns->at == NULL || units == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the spectra");
    columns->count = request->channels.count;
    columns->rows = journey->plan->count;
    for (size_t i = 0; i < columns->count; i++) {
        const RunColumn *wanted = find_column(journey, request->channels.at[i]);
        const Channel *channel = &channels[wanted->channel];
        columns_name(columns, i, request->channels.at[i], channel->unit);
        columns->at[i].values = wanted->values;
        units[i] = channel->psd_unit;
    }
    ProgressRange range = progress_range(journey->progress, 0.9, 0.1);
    const Progress progress = progress_range_view(&range);
    const SpectrumSettings settings = {(size_t)request->segment, (size_t)request->overlap,
                                       request->window, request->detrend};
    return spectrum_welch(columns, units, journey->plan->sample_rate, &settings, &progress,
                          stock(journey), &journey->outcome->spectrum, problem);
}

// Modes left out are wrong from the start; by how much is only foretold.
static void add_given_up(const Plan *plan, Response *response) {
    response->given_up = plan->given_up;
    if (!plan->is_truncated || !response->has_trust)
        return;
    response->error_estimate = fmin(response->error_estimate + plan->given_up, 1);
    if (plan->given_up > RESPONSE_PARTING)
        response->trust_horizon = 0;
}

static void summarize(Outcome *outcome) {
    const Response *response = &outcome->response;
    const double count = (double)response->statistics_count;
    outcome->summary =
        (Summary){.peak_displacement = response->peaks.displacement,
                  .rms_displacement = sqrt(response->sum_squares_displacement / count),
                  .peak_acceleration = response->peaks.acceleration,
                  .rms_acceleration = sqrt(response->sum_squares_acceleration / count),
                  .impacts = response->impact_count,
                  .peak_contact_force = response->peaks.contact_force,
                  .energy_residual = response->energy.residual,
                  .error_estimate = response->has_trust ? response->error_estimate : NAN,
                  .trust_horizon = response->has_trust ? response->trust_horizon : NAN};
}

// Finite inputs can still be too large for their products.
static Status check_finite(const Outcome *outcome, Problem *problem) {
    const Summary *summary = &outcome->summary;
    const double all = summary->peak_displacement + summary->rms_displacement +
                       summary->peak_acceleration + summary->rms_acceleration +
                       summary->peak_contact_force + summary->energy_residual;
    if (isfinite(all))
        return STATUS_OK;
    return problem_set(problem, STATUS_UNSTABLE,
                       "the scene's numbers are too large: peaks or energies leave what double "
                       "precision can hold");
}

// Where the speeds are counted that meet stops with a range of them.
static Status make_approaches(const Scene *scene, Response *response, Problem *problem) {
    const size_t stops = 2 * scene->dampers.count;
    for (size_t i = 0; i < stops; i++) {
        double from, to;
        buffer_speeds(damper_buffer(&scene->dampers.at[i / 2], (Side)(i % 2)), &from, &to);
        if (isnan(from) && isnan(to))
            continue;
        if (response->approaches == NULL)
            response->approaches = calloc(stops, sizeof *response->approaches);
        if (response->approaches == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the impacts");
        response->approaches[i] = (Approaches){.is_ranged = true, .from = from, .to = to};
    }
    return STATUS_OK;
}

// By the solver, or without it where nothing moves.
static Status solve(Journey *journey, Run *run, const Regime *regime, Problem *problem) {
    const Solver *solver = choice_solver(journey->simulation);
    Outcome *outcome = journey->outcome;
    run->is_clear = regime->is_clear;
    if (regime->is_at_rest)
        TRY(rest_run(run, &outcome->response, problem));
    else
        TRY(solver->run(run, &outcome->response, problem));
    outcome->steps = run->steps;
    outcome->work = run->work;
    outcome->work.base_samples = journey->base.count;
    outcome->work.channel_values = run->column_count * journey->plan->count;
    return STATUS_OK;
}

static Status travel(Journey *journey, Problem *problem) {
    const Simulation *simulation = journey->simulation;
    const Scene *scene = &simulation->scene;
    Outcome *outcome = journey->outcome;
    TRY(make_plan(simulation, &journey->plan, problem));
    const Span span = {.duration = scene->duration,
                       .sample_rate = scene->sample_rate,
                       .most = journey->limits == NULL ? 0 : journey->limits->samples,
                       .transforms = stock(journey)};
    const Excitation *excitation = scene_excitation(scene);
    ProgressRange making = progress_range(journey->progress, 0, 0.2),
                  solving = progress_range(journey->progress, 0.2, 0.7);
    const Progress making_watch = progress_range_view(&making),
                   solving_watch = progress_range_view(&solving);
    TRY(excitation_kind(excitation)
            ->make(excitation, &span, &making_watch, &journey->base, problem));
    still(&journey->base);
    const Regime regime = regime_find(journey->plan, &journey->base);
    Run run = {.plan = journey->plan,
               .base = &journey->base,
               .progress = &solving_watch,
               .accuracy = choice_settings(simulation),
               .workspace = journey->workspace,
               .statistics_from = simulation->output.statistics_from,
               .impacts_max = journey->limits == NULL ? 0 : journey->limits->impacts,
               .steps_max =
                   journey->limits == NULL ? 0 : SIMULATION_PATIENCE * journey->limits->steps};
    journey->wanted =
        calloc(simulation->output.channels.count + simulation->output.psd.channels.count + 1,
               sizeof *journey->wanted);
    if (journey->wanted == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    TRY(make_columns(journey, &simulation->output.channels, &outcome->response.series, problem));
    TRY(make_columns(journey, &simulation->output.psd.channels, &journey->hidden, problem));
    run.columns = journey->wanted;
    run.column_count = journey->wanted_count;
    outcome->response.is_unlisted = !simulation->output.impacts;
    TRY(make_approaches(scene, &outcome->response, problem));
    TRY(solve(journey, &run, &regime, problem));
    add_given_up(journey->plan, &outcome->response);
    summarize(outcome);
    TRY(check_finite(outcome, problem));
    if (caution_warn(scene, &journey->plan->report.derived, outcome) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
    TRY(make_spectrum(journey, problem));
    outcome->work.spectrum_segments =
        outcome->spectrum.segments * outcome->spectrum.densities.count;
    if (omissions_tell(simulation, choice_solver(simulation), journey->plan, &regime,
                       &journey->plan->report.decisions) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    outcome->plan = journey->plan->report;
    memset(&journey->plan->report, 0, sizeof journey->plan->report);
    return STATUS_OK;
}

static Status run_once(const Simulation *simulation, const SimulationLimits *limits,
                       const Progress *progress, Workspace *workspace, Outcome **outcome,
                       Problem *problem) {
    if (aim_is_asked(simulation))
        return aim_run(simulation, limits, progress, workspace, outcome, problem);
    Outcome *made = outcome_new();
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for an outcome");
    Journey journey = {.simulation = simulation,
                       .limits = limits,
                       .progress = progress,
                       .workspace = workspace,
                       .outcome = made};
    const Status status = travel(&journey, problem);
    free(journey.transformed.at); // its values are the other columns'
    free(journey.units);
    free(journey.wanted);
    columns_clear(&journey.hidden);
    base_clear(&journey.base);
    plan_free(journey.plan);
    if (status != STATUS_OK) {
        outcome_unref(made);
        return status;
    }
    *outcome = made;
    return STATUS_OK;
}

Outcome *outcome_new(void) {
    Held *held = calloc(1, sizeof *held);
    if (held == NULL)
        return NULL;
    atomic_init(&held->holds, 1);
    return &held->outcome;
}

Status simulation_run(const Simulation *simulation, const SimulationLimits *limits,
                      const Progress *progress, Workspace *workspace, Outcome **outcome,
                      Problem *problem) {
    static const double share = 0.8; // of the whole, where the scene without dampers follows
    *outcome = NULL;
    if (!simulation->output.reduction)
        return run_once(simulation, limits, progress, workspace, outcome, problem);
    ProgressRange first = progress_range(progress, 0, share),
                  second = progress_range(progress, share, 1 - share);
    const Progress own = progress_range_view(&first), bare = progress_range_view(&second);
    TRY(run_once(simulation, limits, &own, workspace, outcome, problem));
    const Status status = bare_compare(simulation, limits, &bare, workspace, *outcome, problem);
    if (status != STATUS_OK) {
        outcome_unref(*outcome);
        *outcome = NULL;
    }
    return status;
}

Outcome *outcome_ref(Outcome *outcome) {
    atomic_fetch_add(&((Held *)outcome)->holds, 1);
    return outcome;
}

void outcome_unref(Outcome *outcome) {
    if (outcome == NULL || atomic_fetch_sub(&((Held *)outcome)->holds, 1) != 1)
        return;
    fields_clear(plan_report_fields, &outcome->plan);
    response_clear(&outcome->response);
    spectrum_clear(&outcome->spectrum);
    warnings_clear(&outcome->warnings);
    free(outcome);
}

size_t outcome_bytes(const Outcome *outcome) {
    const Columns *series = &outcome->response.series, *densities = &outcome->spectrum.densities;
    return sizeof(Held) +
           sizeof(double) *
               (series->count * series->rows + (densities->count + 1) * densities->rows) +
           outcome->response.impacts.count * sizeof(Impact);
}
