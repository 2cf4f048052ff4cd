// From a completed simulation to its outcome: plan, base motion, solver, spectra and summary. What
// the scene does not require is left out and reported as a decision, with the number that decided.
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/internal.h"
#include "core/solve/cycle_flow.h"

const char engine_version[] = "impactd-8";

// clang-format off
const Field summary_fields[] = {
    FIELD_REAL(Summary, peak_displacement, "m", ANY, OPTIONAL, "largest |displacement| over samples and events, of all storeys"),
    FIELD_REAL(Summary, rms_displacement, "m", ANY, OPTIONAL, "root mean square over samples, the largest of all storeys"),
    FIELD_REAL(Summary, peak_acceleration, "m/s^2", ANY, OPTIONAL, "largest |acceleration| over samples and events, of all storeys"),
    FIELD_REAL(Summary, rms_acceleration, "m/s^2", ANY, OPTIONAL, "root mean square over samples, the largest of all storeys"),
    FIELD_COUNT(Summary, impacts, NULL, AT_MIN(0), OPTIONAL, "number of impacts"),
    FIELD_REAL(Summary, peak_contact_force, "N", ANY, OPTIONAL, "largest |contact force| over events, of all dampers"),
    FIELD_REAL(Summary, peak_storey_drift, "m", ANY, OPTIONAL, "largest |storey drift| over samples and events, of all storeys; unknown if the structure is no frame"),
    FIELD_REAL(Summary, peak_base_shear, "N", ANY, OPTIONAL, "largest |base shear| over samples and events"),
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
    FIELD_REAL(Reduction, peak_storey_drift_reduction, NULL, ANY, OPTIONAL, "1 - peak_storey_drift over that without dampers"),
    FIELD_REAL(Reduction, peak_base_shear_reduction, NULL, ANY, OPTIONAL, "1 - peak_base_shear over that without dampers"),
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

bool outcome_has_force(const Outcome *outcome) {
    const ContactLaw *law =
        (const ContactLaw *)(const void *)kind_find(&contact_kinds, outcome->plan.contact_model);
    return law != NULL && law->form != CONTACT_IMPULSIVE;
}

static const double IMPACT_ROWS = 7; // of a damper in a second, about

static Status omissions_of_output(const Simulation *simulation, const Plan *plan,
                                  Decisions *decisions) {
    const Output *output = &simulation->output;
    const size_t usual = channel_names_usual_count(&simulation->scene), samples = plan->count;
    const size_t segment = samples < SPECTRUM_SEGMENT ? samples : SPECTRUM_SEGMENT;
    if (output->channels.count < usual)
        TRY(decisions_add(decisions, "channels", "left_out",
                          (double)(usual - output->channels.count) * (double)samples, "values",
                          "%zu of the %zu usual channels are requested", output->channels.count,
                          usual));
    if (output->psd.channels.count == 0)
        TRY(decisions_add(decisions, "psd", "left_out",
                          floor((double)(samples - segment / 2) / (double)(segment - segment / 2)),
                          "segments", "no spectrum is requested"));
    if (!output->impacts && plan->damper_count > 0)
        TRY(decisions_add(decisions, "impacts", "left_out",
                          IMPACT_ROWS * plan->duration * (double)plan->damper_count, "rows",
                          "no list of impacts is requested: impacts are counted, not listed"));
    return STATUS_OK;
}

// Adds what a run leaves out to the plan's decisions. `regime` NULL: the base is not made yet, and
// what depends on it is reported as open.
static Status omissions_add(const Simulation *simulation, Plan *plan, const Regime *regime) {
    Decisions *decisions = &plan->report.decisions;
    const bool has_dampers = plan->damper_count > 0;
    TRY(omissions_of_output(simulation, plan, decisions));
    if (regime == NULL)
        return has_dampers ? decisions_add(decisions, "contacts", "open", NAN, NULL,
                                           "whether a mass can reach a stop is determined when "
                                           "the base's motion is made")
                           : STATUS_OK;
    if (regime->is_at_rest)
        return decisions_add(decisions, "motion", "left_out", 0, "J",
                             "nothing moves and nothing excites a motion");
    if (has_dampers && regime->is_clear)
        TRY(decisions_add(decisions, "contacts", "left_out", regime->reach, NULL,
                          "%s at most %.3g of the distance to a stop",
                          plan->damper_count == 1 ? "the mass moves" : "the masses move",
                          regime->reach));
    // Solvers with fixed steps make them in any case.
    const bool has_closed_form =
        simulation_solver(simulation) == &solver_exact &&
        (plan_is_single(plan) || (regime->is_clear && plan_is_single_in_flight(plan)));
    return regime->is_unforced && has_closed_form
               ? decisions_add(decisions, "forcing", "left_out", 0, "m/s^2",
                               "the base is still: flight has a closed form")
               : STATUS_OK;
}

static Status run_make_plan(const Simulation *simulation, const Progress *progress, Plan **plan,
                            Problem *problem) {
    const Solver *solver = simulation_solver(simulation);
    TRY(plan_new(&simulation->scene, simulation->accuracy->kind->name, solver->kind.name, plan,
                 problem));
    Status status = plan_keep(*plan, &simulation->scene,
                              simulation_modes(simulation, (*plan)->storeys), progress, problem);
    if (status == STATUS_OK && solver->decide != NULL)
        status = solver->decide(solver, simulation_settings(simulation),
                                simulation_base_interval(simulation), *plan, problem);
    if (status == STATUS_OK)
        return STATUS_OK;
    plan_free(*plan);
    *plan = NULL;
    return status == STATUS_NO_MEMORY ? problem_set(problem, status, "no memory for the plan")
                                      : status;
}

// A base without motion becomes BASE_STILL, whatever its kind.
static Status run_make_base(const Simulation *simulation, size_t samples_max, FftCache *transforms,
                            const Progress *progress, Base *base, Problem *problem) {
    const Scene *scene = &simulation->scene;
    const Span span = {.duration = scene->duration,
                       .sample_rate = scene->sample_rate,
                       .most = samples_max,
                       .transforms = transforms};
    const Excitation *excitation = scene_excitation(scene);
    TRY(excitation_make(excitation, &span, progress, base, problem));
    bool moves = base->form == BASE_SINE && base->amplitude != 0;
    for (size_t i = 0; i < base->count && base->form == BASE_SAMPLED && !moves; i++)
        moves = base->values[i] != 0;
    for (size_t i = 0; i < base->piece_count && base->form == BASE_PIECES && !moves; i++)
        moves = base->pieces[i].value != 0 || base->pieces[i].slope != 0;
    if (!moves)
        base_clear(base);
    return STATUS_OK;
}

Status plan_scene(const Simulation *simulation, PlanReport *report, Problem *problem) {
    Plan *plan;
    Base base = {0};
    Regime regime = {0};
    TRY(run_make_plan(simulation, NULL, &plan, problem));
    // A base in closed form costs nothing to make.
    const bool has_base = excitation_kind(scene_excitation(&simulation->scene))->interval == NULL;
    Status status = has_base ? run_make_base(simulation, 0, NULL, NULL, &base, problem) : STATUS_OK;
    if (status == STATUS_OK && has_base)
        regime = regime_find(plan, &base);
    base_clear(&base);
    if (status == STATUS_OK &&
        omissions_add(simulation, plan, has_base ? &regime : NULL) != STATUS_OK)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    if (status == STATUS_OK) {
        *report = plan->report;
        plan->report = (PlanReport){0};
    }
    plan_free(plan);
    return status;
}

// Resources of one run, released by run_scene().
typedef struct RunContext {
    const Simulation *simulation;
    const SimulationLimits *limits;
    const Progress *progress;
    FftCache *transforms; // or NULL
    Plan *plan;
    Base base;
    bool has_base;
    Columns hidden;      // channels that only a spectrum needs
    Columns transformed; // the spectrum's channels; values are borrowed from the other columns
    const char **units;  // of their densities
    RunColumn *wanted;   // with room for all requested names
    size_t wanted_count;
    Outcome *outcome;
} RunContext;

// The channel of a name. A name without a number means the first storey or damper.
static RunColumn run_column(const char *name) {
    size_t number;
    const Channel *channel = channel_find(name, &number);
    return (RunColumn){(ChannelId)(channel - channels), number > 0 ? number - 1 : 0, NULL};
}

static const RunColumn *run_find_column(const RunContext *context, const char *name) {
    const RunColumn asked = run_column(name);
    for (size_t i = 0; i < context->wanted_count; i++)
        if (context->wanted[i].channel == asked.channel &&
            context->wanted[i].number == asked.number)
            return &context->wanted[i];
    return NULL;
}

// Makes columns for those of `names` that have none yet and adds them to the list.
static Status run_make_columns(RunContext *context, const Texts *names, Columns *columns,
                               Problem *problem) {
    size_t count = 0;
    for (size_t i = 0; i < names->count; i++)
        count += run_find_column(context, names->at[i]) == NULL;
    if (count == 0)
        return STATUS_OK;
    TRY(columns_allocate(columns, count, context->plan->count, 0, problem));
    for (size_t i = 0, made = 0; i < names->count; i++) {
        if (run_find_column(context, names->at[i]) != NULL)
            continue;
        RunColumn *wanted = &context->wanted[context->wanted_count++];
        *wanted = run_column(names->at[i]);
        columns_name(columns, made, names->at[i], channels[wanted->channel].unit);
        wanted->values = columns->at[made++].values;
    }
    return STATUS_OK;
}

static double run_steps_max(const SimulationLimits *limits) {
    return limits == NULL ? 0 : SIMULATION_PATIENCE * limits->steps;
}

// Impacts whose list fits into the memory of a run.
static size_t run_impacts_max(const SimulationLimits *limits) {
    if (limits == NULL || !(limits->bytes > 0))
        return limits == NULL ? 0 : limits->impacts;
    const size_t fit = (size_t)fmin(limits->bytes / sizeof(Impact), (double)(SIZE_MAX / 2)) + 1;
    return limits->impacts > 0 && limits->impacts < fit ? limits->impacts : fit;
}

// The predicted steps of the spectra count like those of the solver, so that the same scene stops
// at the same place on any machine.
static Status run_spectrum(RunContext *context, Problem *problem) {
    const SpectrumRequest *request = &context->simulation->output.psd;
    if (request->channels.count == 0)
        return STATUS_OK;
    const double steps_max = run_steps_max(context->limits);
    if (steps_max > 0 &&
        context->outcome->steps + cost_spectra(request, context->plan->count) > steps_max)
        return problem_set(problem, STATUS_LIMIT, SOLVER_STOPPED "the spectra", steps_max,
                           steps_max * SOLVER_STEP);
    Columns *columns = &context->transformed;
    columns->at = calloc(request->channels.count, sizeof *columns->at);
    const char **units = calloc(request->channels.count, sizeof *units);
    context->units = units;
    if (columns->at == NULL || units == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the spectra");
    columns->count = request->channels.count;
    columns->rows = context->plan->count;
    for (size_t i = 0; i < columns->count; i++) {
        const RunColumn *wanted = run_find_column(context, request->channels.at[i]);
        const Channel *channel = &channels[wanted->channel];
        columns_name(columns, i, request->channels.at[i], channel->unit);
        columns->at[i].values = wanted->values;
        units[i] = channel->psd_unit;
    }
    const Progress progress = progress_range_view(&(ProgressRange){context->progress, 0.9, 0.1, 0});
    const WelchSettings settings = {(size_t)request->segment, (size_t)request->overlap,
                                    request->window, request->detrend};
    Spectrum *spectrum = &context->outcome->spectrum;
    TRY(welch_spectrum(columns, units, context->plan->sample_rate, &settings, &progress,
                       context->transforms, spectrum, problem));
    context->outcome->work.spectrum_segments = spectrum->segments * spectrum->densities.count;
    return STATUS_OK;
}

// The error of modes left out is predicted, because the run cannot measure it.
static void run_add_given_up(const Plan *plan, Response *response) {
    response->truncation_error = plan->given_up;
    if (!plan->is_truncated || !response->has_trust)
        return;
    response->error_estimate = fmin(response->error_estimate + plan->given_up, 1);
    if (plan->given_up > RESPONSE_DIVERGENCE)
        response->trust_horizon = 0;
}

// Finite inputs may have products that overflow.
static Status run_summarize(const Plan *plan, Outcome *outcome, Problem *problem) {
    const Response *response = &outcome->response;
    const Peaks *peaks = &response->peaks;
    const double drift = plan->storeys == 1 ? peaks->displacement : peaks->storey_drift;
    const double count = (double)response->statistics_count;
    Summary *summary = &outcome->summary;
    *summary = (Summary){.peak_displacement = peaks->displacement,
                         .rms_displacement = sqrt(response->sum_squares_displacement / count),
                         .peak_acceleration = peaks->acceleration,
                         .rms_acceleration = sqrt(response->sum_squares_acceleration / count),
                         .impacts = response->impact_count,
                         .peak_contact_force = peaks->contact_force,
                         .peak_storey_drift = plan->has_drifts ? drift : NAN,
                         .peak_base_shear = peaks->base_shear,
                         .energy_residual = response->energy.residual,
                         .error_estimate = response->has_trust ? response->error_estimate : NAN,
                         .trust_horizon = response->has_trust ? response->trust_horizon : NAN};
    if (isfinite(summary->peak_displacement + summary->rms_displacement +
                 summary->peak_acceleration + summary->rms_acceleration +
                 summary->peak_contact_force + drift + summary->peak_base_shear +
                 summary->energy_residual))
        return STATUS_OK;
    return problem_set(problem, STATUS_UNSTABLE,
                       "the scene's numbers are too large: peaks or energies overflow double "
                       "precision");
}

// Counters of approach speeds, for stops whose buffer was measured over a range of speeds.
static Status run_make_approaches(const Scene *scene, Response *response, Problem *problem) {
    const size_t stops = 2 * scene->dampers.count;
    for (size_t i = 0; i < stops; i++) {
        double from, to;
        buffer_speed_range(damper_buffer(&scene->dampers.at[i / 2], (Side)(i % 2)), &from, &to);
        if (isnan(from) && isnan(to))
            continue;
        if (response->approaches == NULL)
            response->approaches = calloc(stops, sizeof *response->approaches);
        if (response->approaches == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the impacts");
        response->approaches[i] = (ApproachSpeeds){.is_ranged = true, .from = from, .to = to};
    }
    return STATUS_OK;
}

static Status run_solve(RunContext *context, const Regime *regime, Workspace *workspace,
                        Problem *problem) {
    const Simulation *simulation = context->simulation;
    const SimulationLimits *limits = context->limits;
    Outcome *outcome = context->outcome;
    // Where nothing moves the exact solver is the fastest.
    const Solver *solver = regime->is_at_rest ? &solver_exact : simulation_solver(simulation);
    const Progress progress = progress_range_view(&(ProgressRange){context->progress, 0.2, 0.7, 0});
    Run run = {.plan = context->plan,
               .base = &context->base,
               .progress = &progress,
               .accuracy = regime->is_at_rest ? NULL : simulation_settings(simulation),
               .workspace = workspace,
               .columns = context->wanted,
               .column_count = context->wanted_count,
               .statistics_from = simulation->output.statistics_from,
               .impacts_max = run_impacts_max(limits),
               .steps_max = run_steps_max(limits),
               .is_clear = regime->is_clear};
    TRY(solver->run(solver, &run, &outcome->response, problem));
    outcome->steps = run.steps * cost_step(simulation);
    outcome->work = run.work;
    outcome->work.base_samples = context->base.count;
    outcome->work.channel_values = run.column_count * context->plan->count;
    return STATUS_OK;
}

static Status run_all(RunContext *context, Workspace *workspace, Problem *problem) {
    const Simulation *simulation = context->simulation;
    const Output *output = &simulation->output;
    Outcome *outcome = context->outcome;
    TRY(run_make_plan(simulation, context->progress, &context->plan, problem));
    const Progress progress = progress_range_view(&(ProgressRange){context->progress, 0, 0.2, 0});
    if (!context->has_base)
        TRY(run_make_base(simulation, context->limits == NULL ? 0 : context->limits->samples,
                          context->transforms, &progress, &context->base, problem));
    context->has_base = true;
    const Regime regime = regime_find(context->plan, &context->base);
    context->wanted =
        calloc(output->channels.count + output->psd.channels.count + 1, sizeof *context->wanted);
    if (context->wanted == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    TRY(run_make_columns(context, &output->channels, &outcome->response.series, problem));
    TRY(run_make_columns(context, &output->psd.channels, &context->hidden, problem));
    outcome->response.is_unlisted = !output->impacts;
    TRY(run_make_approaches(&simulation->scene, &outcome->response, problem));
    TRY(run_solve(context, &regime, workspace, problem));
    run_add_given_up(context->plan, &outcome->response);
    TRY(run_summarize(context->plan, outcome, problem));
    PlanReport *report = &context->plan->report;
    if (scene_warnings_of_result(&simulation->scene, &report->derived, outcome) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a warning");
    TRY(run_spectrum(context, problem));
    if (omissions_add(simulation, context->plan, &regime) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    outcome->plan = *report;
    *report = (PlanReport){0};
    return STATUS_OK;
}

Status run_scene(const Simulation *simulation, const SimulationLimits *limits,
                 const Progress *progress, Workspace *workspace, RunInputs *inputs,
                 Outcome **outcome, Problem *problem) {
    RunContext context = {.simulation = simulation,
                          .limits = limits,
                          .progress = progress,
                          .transforms = workspace == NULL ? NULL : &workspace->transforms,
                          .outcome = outcome_new()};
    if (inputs != NULL && inputs->has_base) {
        context.base = inputs->base;
        context.has_base = true;
    }
    const Status status = context.outcome == NULL
                              ? problem_set(problem, STATUS_NO_MEMORY, "no memory for an outcome")
                              : run_all(&context, workspace, problem);
    free(context.transformed.at); // its values belong to the other columns
    free(context.units);
    free(context.wanted);
    columns_clear(&context.hidden);
    const RunInputs made = {context.plan, context.base, context.has_base};
    if (inputs != NULL)
        *inputs = made;
    else
        run_inputs_clear(&(RunInputs){made.plan, made.base, true});
    if (status == STATUS_OK)
        *outcome = context.outcome;
    else
        outcome_unref(context.outcome);
    return status;
}

void run_inputs_clear(RunInputs *inputs) {
    plan_free(inputs->plan);
    base_clear(&inputs->base);
}

Status simulation_cycle_flow(const Simulation *simulation, const SimulationLimits *limits,
                             const Progress *progress, const CycleFlow *from, CycleFlow **flow,
                             Problem *problem) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    *flow = NULL;
    if (excitation_kind(excitation) != &excitation_sine)
        return problem_add(problem, STATUS_INVALID, "/excitation/kind",
                           "must be sine, is %s: only a sine has cycles",
                           excitation_kind(excitation)->kind.name);
    const double frequency = ((const ExcitationSine *)(const void *)excitation)->frequency;
    Base base;
    Plan *plan;
    const Run run = {.base = &base,
                     .accuracy = simulation_solver(simulation) == &solver_exact
                                     ? simulation_settings(simulation)
                                     : NULL,
                     .steps_max = run_steps_max(limits),
                     .progress = progress};
    TRY(run_make_base(simulation, 0, NULL, progress, &base, problem));
    TRY(run_make_plan(simulation, progress, &plan, problem));
    return cycle_flow_new(plan, &run, 1 / frequency, from, flow, problem);
}
