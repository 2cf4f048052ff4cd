// A result keeps no history of its contacts. The scene is run again with all states as channels.
// From a sample before the impact at which no stop is touched, the event engine continues with an
// output window over the contact:
//
//     samples      |.........|.........|.........|
//     contact                     [=========]
//     window                      ''''''''''
//
// Force and penetration at the ends follow from the contact law and the speed, because an instant
// at a release shows the flight after it.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/internal.h"

enum { TIME, FORCE, PENETRATION, SPEED, COLUMNS };

typedef struct ImpactRun {
    Simulation simulation; // with all states as channels
    Outcome *outcome;      // of the run
    const Impact *impact;  // in it
    RunInputs inputs;      // of the run; the plan then starts at `sample`
    size_t sample;
    Impact again;              // the impact in the run from there
    ContactParameters contact; // of it
    ContactPoint *points;      // with room for two ends and the peak
    size_t count;
} ImpactRun;

// Adds all states to the channels. Channels of spectra stay, because a mean acceleration changes
// the solver's path and with it the last digits; the spectra themselves are not made.
static Status impact_run_add_states(const Scene *scene, Output *output) {
    static const ChannelId states[] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY,
                                       CHANNEL_DAMPER_DISPLACEMENT, CHANNEL_DAMPER_VELOCITY};
    Texts *names = &output->channels, *transformed = &output->psd.channels;
    for (size_t i = 0; i < transformed->count; i++) {
        size_t number;
        const Channel *channel = channel_find(transformed->at[i], &number);
        TRY(channel_names_add(scene, (ChannelId)(channel - channels), number > 0 ? number : 1,
                              names));
    }
    texts_clear(transformed);
    for (size_t k = 0; k < COUNT(states); k++) {
        const size_t count =
            k < 2 ? structure_storeys(scene_structure(scene)) : scene->dampers.count;
        for (size_t i = 1; i <= count; i++)
            TRY(channel_names_add(scene, states[k], i, names));
    }
    return STATUS_OK;
}

// The scene as it was run. The settings of an accuracy target are known only after a run.
static Status impact_run_settle(ImpactRun *run, const Simulation *asked,
                                const SimulationLimits *limits, const Progress *progress,
                                Workspace *workspace, Problem *problem) {
    if (simulation_has_target(asked)) {
        Outcome *outcome = NULL;
        TRY(accuracy_target_run(asked, limits, progress, workspace, &run->simulation, &outcome,
                                problem));
        outcome_unref(outcome);
    } else if (fields_copy(simulation_fields, asked, &run->simulation) != STATUS_OK) {
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene");
    }
    run->simulation.output.impacts = true;
    if (impact_run_add_states(&asked->scene, &run->simulation.output) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    const double bytes = cost_scene(&run->simulation).bytes;
    if (limits != NULL && limits->bytes > 0 && !(bytes <= limits->bytes))
        return problem_set(problem, STATUS_LIMIT,
                           "the run is too long, or has too many storeys, to show one impact in "
                           "detail. With all its states it would take about %.3g MB of memory, at "
                           "most %.4g MB are allowed. Submit a shorter scene that contains the "
                           "impact",
                           1e-6 * bytes, 1e-6 * limits->bytes);
    return STATUS_OK;
}

static Status impact_run_find(ImpactRun *run, size_t number, Problem *problem) {
    const Impacts *impacts = &run->outcome->response.impacts;
    if (impacts->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the result has no impacts");
    if (number < 1 || number > impacts->count)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no impact %zu: they are numbered from 1 to %zu, as "
                           "impacts.json lists them",
                           number, impacts->count);
    run->impact = &impacts->at[number - 1];
    // Under impulses an interval of resting contact has a force.
    if (run->inputs.plan->form != CONTACT_IMPULSIVE || run->impact->kind != IMPACT_IMPACT)
        return STATUS_OK;
    return problem_set(problem, STATUS_NOT_FOUND,
                       "under the contact model impulse an impact takes no time and has no force: "
                       "its impulse is in the list of impacts");
}

// Value of a state at run->sample; `index` is from 0.
static double impact_run_state(const ImpactRun *run, ChannelId channel, size_t index) {
    char name[CHANNEL_NAME];
    channel_names_write(&run->simulation.scene, channel, index + 1, name);
    return columns_find(&run->outcome->response.series, name)->values[run->sample];
}

static bool impact_run_is_free(const ImpactRun *run) {
    for (size_t i = 0; i < run->inputs.plan->damper_count; i++) {
        const PlanDamper *damper = &run->inputs.plan->dampers[i];
        const double u = impact_run_state(run, CHANNEL_DAMPER_DISPLACEMENT, i) -
                         impact_run_state(run, CHANNEL_DISPLACEMENT, damper->storey);
        if (!(fabs(u - damper->offset) < 0.5 * damper->clearance))
            return false;
    }
    return true;
}

// The last sample before the impact at which no contact is open and all masses are between their
// stops, and the plan from there. Sample 0 always serves.
static void impact_run_start(ImpactRun *run) {
    const Impacts *impacts = &run->outcome->response.impacts;
    Plan *plan = run->inputs.plan;
    run->sample = (size_t)floor(run->impact->start * plan->sample_rate);
    while (run->sample > 0) {
        const double time = (double)run->sample / plan->sample_rate;
        double earliest = time;
        for (const Impact *other = impacts->at;
             other < impacts->at + impacts->count && other->start < time; other++)
            if (!(other->end <= time) && other->start < earliest)
                earliest = other->start;
        if (earliest < time)
            run->sample = (size_t)floor(earliest * plan->sample_rate);
        else if (!impact_run_is_free(run))
            run->sample--;
        else
            break;
    }
    for (size_t i = 0; i < plan->storeys && run->sample > 0; i++) {
        plan->displacement[i] = impact_run_state(run, CHANNEL_DISPLACEMENT, i);
        plan->velocity[i] = impact_run_state(run, CHANNEL_VELOCITY, i);
    }
    for (size_t i = 0; i < plan->damper_count && run->sample > 0; i++) {
        PlanDamper *damper = &plan->dampers[i];
        damper->position = impact_run_state(run, CHANNEL_DAMPER_DISPLACEMENT, i) -
                           plan->displacement[damper->storey] - damper->offset;
        damper->velocity =
            impact_run_state(run, CHANNEL_DAMPER_VELOCITY, i) - plan->velocity[damper->storey];
    }
}

// Finds the impact in the run from the sample on. It may have begun before a pause of its force;
// its contact parameters are those of its beginning.
static Status impact_run_recognise(ImpactRun *run, const Impacts *impacts, Problem *problem) {
    const Impact *impact = run->impact, *again = NULL;
    for (const Impact *at = impacts->at; at < impacts->at + impacts->count; at++)
        if (at->damper == impact->damper && at->side == impact->side && at->kind == impact->kind &&
            (again == NULL || fabs(at->start - impact->start) < fabs(again->start - impact->start)))
            again = at;
    if (again == NULL)
        return problem_set(problem, STATUS_UNSTABLE,
                           "the impact does not occur again in a run from the sample before it, "
                           "at %.17g s: the solver's steps were too coarse",
                           (double)run->sample / run->inputs.plan->sample_rate);
    const Impact *first = again;
    for (const Impact *at = again; at > impacts->at && first->is_resumed; at--)
        if (at[-1].damper == first->damper && at[-1].side == first->side)
            first = &at[-1];
    run->again = *again;
    run->contact = contact_parameters_at(
        &run->inputs.plan->dampers[again->damper - 1].stops[again->side], first->approach_speed);
    return STATUS_OK;
}

// The contact's side of one of its ends; `near` is the nearest point inside.
static ContactPoint impact_run_end(const ImpactRun *run, double time, double speed, bool has_force,
                                   const ContactPoint *near) {
    const Plan *plan = run->inputs.plan;
    const ContactParameters *own = &run->contact;
    ContactPoint point = {.time = time, .speed = speed};
    if (plan->form == CONTACT_LINEAR) {
        point.force = has_force ? own->damping * speed : 0;
        point.penetration = has_force ? 0 : fmax(-own->damping * speed / own->stiffness, 0);
    } else {
        point.penetration = fmax(near->penetration + near->speed * (time - near->time), 0);
        point.force = fmax(plan->law->force(own, point.penetration, point.speed).value, 0);
    }
    return point;
}

// Runs from the sample on, first for the impact and then for points inside it.
static Status impact_run_sample(ImpactRun *run, size_t points, const SimulationLimits *limits,
                                const Progress *progress, Workspace *workspace, Problem *problem) {
    const double total = run->simulation.scene.duration;
    const double end = isnan(run->impact->end) ? total : run->impact->end;
    const double length = end - run->impact->start;
    if (!(length > 0))
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the contact has no duration: from %.17g s to %.17g s",
                           run->impact->start, end);
    const bool is_exact = simulation_solver(&run->simulation) == &solver_exact;
    const Run from = {.plan = run->inputs.plan,
                      .base = &run->inputs.base,
                      .progress = progress,
                      .accuracy = is_exact ? simulation_settings(&run->simulation) : NULL,
                      .workspace = workspace,
                      .impacts_max = limits == NULL ? 0 : limits->impacts,
                      .steps_max = limits == NULL ? 0 : SIMULATION_PATIENCE * limits->steps};
    Run search = from, sampled = from;
    Response response = {0};
    OutputWindow window = {.first = run->sample, .end = fmin(end + length, total)};
    Status status = exact_run_window(&search, &window, &response, problem);
    if (status == STATUS_OK)
        status = impact_run_recognise(run, &response.impacts, problem);
    response_clear(&response);
    TRY(status);
    const Impact *again = &run->again;
    const bool is_open = isnan(again->end);
    window.start = again->start;
    window.end = is_open ? total : again->end;
    window.interval = (window.end - window.start) / (double)(points - 1);
    window.count = is_open ? points - 1 : points - 2;
    window.damper = (size_t)again->damper - 1;
    window.side = (Side)again->side;
    if ((run->points = malloc((points + 2) * sizeof *run->points)) == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the contact");
    const bool has_ends = again->kind == IMPACT_IMPACT;
    window.points = run->points + has_ends;
    status = exact_run_window(&sampled, &window, &response, problem);
    response_clear(&response);
    TRY(status);
    ContactPoint *const last = &window.points[window.count - 1];
    const bool pulls = run->inputs.plan->separation == SEPARATION_ZERO_PENETRATION;
    if (has_ends)
        run->points[0] = impact_run_end(run, again->start, again->approach_speed,
                                        !again->is_resumed, &window.points[0]);
    if (has_ends && !is_open)
        last[1] = impact_run_end(run, again->end, -again->separation_speed, pulls, last);
    run->count = window.count + has_ends + (has_ends && !is_open);
    return STATUS_OK;
}

// The vertex of the parabola through three points. Its force is the listed peak, which the solver
// has located.
static ContactPoint impact_run_vertex(const ContactPoint *a, const ContactPoint *b,
                                      const ContactPoint *c, double force) {
    const double left = a->time - b->time, right = c->time - b->time;
    const double low = (a->force - b->force) / left, high = (c->force - b->force) / right;
    const double bend = (high - low) / (right - left), slope = low - bend * left;
    const double t = bend != 0 ? fmin(fmax(-slope / (2 * bend), left), right) : 0;
    const double by_a = t * (t - right) / (left * (left - right)),
                 by_c = t * (t - left) / (right * (right - left)), by_b = 1 - by_a - by_c;
    return (ContactPoint){.time = b->time + t,
                          .force = copysign(force, b->force),
                          .penetration =
                              by_a * a->penetration + by_b * b->penetration + by_c * c->penetration,
                          .speed = by_a * a->speed + by_b * b->speed + by_c * c->speed};
}

static void impact_run_add_peak(ImpactRun *run) {
    ContactPoint *points = run->points;
    size_t top = 0;
    for (size_t i = 1; i < run->count; i++)
        if (fabs(points[i].force) > fabs(points[top].force))
            top = i;
    if (top == 0 || top + 1 >= run->count || isnan(run->again.peak_force) ||
        !(points[top - 1].time < points[top].time && points[top].time < points[top + 1].time))
        return;
    const ContactPoint peak =
        impact_run_vertex(&points[top - 1], &points[top], &points[top + 1], run->again.peak_force);
    const double apart = peak.time - points[top].time;
    if (fabs(apart) < 1e-6 * (points[top].time - points[top - 1].time)) {
        points[top] = peak;
        return;
    }
    top += apart > 0;
    memmove(&points[top + 1], &points[top], (run->count++ - top) * sizeof *points);
    points[top] = peak;
}

static Status impact_run_write(const ImpactRun *run, Columns *columns, Problem *problem) {
    static const struct {
        const char *name, *unit;
    } names[COLUMNS] = {[TIME] = {"time", "s"},
                        [FORCE] = {"contact_force", "N"},
                        [PENETRATION] = {"penetration", "m"},
                        [SPEED] = {"approach_speed", "m/s"}};
    TRY(columns_allocate(columns, COLUMNS, run->count, 0, problem));
    for (size_t c = 0; c < COLUMNS; c++)
        columns_name(columns, c, names[c].name, names[c].unit);
    for (size_t i = 0; i < run->count; i++) {
        columns->at[TIME].values[i] = run->points[i].time;
        columns->at[FORCE].values[i] = run->points[i].force;
        columns->at[PENETRATION].values[i] = run->points[i].penetration;
        columns->at[SPEED].values[i] = run->points[i].speed;
    }
    return STATUS_OK;
}

static Status impact_run_all(ImpactRun *run, const Simulation *simulation, size_t number,
                             size_t points, const SimulationLimits *limits,
                             const Progress *progress, Workspace *workspace, ImpactHistory *history,
                             Problem *problem) {
    TRY(impact_run_settle(run, simulation, limits, progress, workspace, problem));
    TRY(run_scene(&run->simulation, limits, progress, workspace, &run->inputs, &run->outcome,
                  problem));
    TRY(impact_run_find(run, number, problem));
    impact_run_start(run);
    TRY(impact_run_sample(run, points, limits, progress, workspace, problem));
    impact_run_add_peak(run);
    history->impact = *run->impact;
    return impact_run_write(run, &history->columns, problem);
}

Status impact_history_make(const Simulation *simulation, size_t number, size_t points,
                           const SimulationLimits *limits, const Progress *progress,
                           Workspace *workspace, ImpactHistory *history, Problem *problem) {
    ImpactRun run;
    memset(&run, 0, sizeof run);
    memset(history, 0, sizeof *history);
    const Status status = impact_run_all(&run, simulation, number, points, limits, progress,
                                         workspace, history, problem);
    simulation_clear(&run.simulation);
    outcome_unref(run.outcome);
    run_inputs_clear(&run.inputs);
    free(run.points);
    if (status != STATUS_OK)
        impact_history_clear(history);
    return status;
}

void impact_history_clear(ImpactHistory *history) {
    columns_clear(&history->columns);
    memset(history, 0, sizeof *history);
}

double impact_history_steps(const Simulation *simulation) {
    return (simulation_has_target(simulation) ? 2 * accuracy_target_cost(simulation).steps
                                              : cost_scene(simulation).steps);
}
