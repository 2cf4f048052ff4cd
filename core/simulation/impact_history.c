// The run keeps no history of its contacts. The scene is run again for the state at a sample before
// the impact, at which the base has a sample of its own and no stop is touched. From there the
// exact solver continues with a finer clock:
//
//     samples      |.........|.........|.........|
//     contact                     [=========]
//     fine run               |''''''''''''''''|
//
// Force and penetration at the ends follow from the contact law and the speed, because a sample at
// a release shows the flight after it.
#include "core/simulation/impact_history.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/channel_names.h"
#include "core/simulation/internal.h"

enum { FINE_MAX = 1 << 22 }; // samples of the fine run
enum { TIME, FORCE, PENETRATION, SPEED, COLUMNS };
enum { FINE_FORCE, FINE_PENETRATION, FINE_VELOCITY, FINE_DAMPER_VELOCITY, FINE_COLUMNS };

static const double states_bytes_max = 1e9; // columns of the first run

typedef struct ImpactRun {
    Simulation simulation; // with all states as channels
    Outcome *outcome;      // of the first run
    const Impact *impact;  // in it
    RunInputs inputs;      // of the first run; the plan is changed to that of the fine run
    Base shifted;          // the base from the fine run's start; borrows its samples
    size_t sample;         // at that start
    double start;          // the same [s]
    Columns fine;          // FINE_COLUMNS
    Response response;     // of the fine run
    const Impact *again;   // the impact in it, in its time
} ImpactRun;

typedef struct Point {
    double time, force, penetration, speed; // time of the fine run
} Point;

static Point impact_run_sample(const ImpactRun *run, size_t i) {
    const Column *fine = run->fine.at;
    const double sign = run->again->side == SIDE_RIGHT ? 1 : -1;
    return (Point){.time = (double)i / run->inputs.plan->sample_rate,
                   .force = sign * fine[FINE_FORCE].values[i],
                   .penetration = fine[FINE_PENETRATION].values[i],
                   .speed = sign *
                            (fine[FINE_DAMPER_VELOCITY].values[i] - fine[FINE_VELOCITY].values[i])};
}

// The contact's side of one of its ends; `near` is the nearest sample inside. The contact may have
// begun before a pause of its force, and its parameters are those of its beginning.
static Point impact_run_end(const ImpactRun *run, double time, double speed, bool has_force,
                            const Point *near) {
    const Plan *plan = run->inputs.plan;
    const Impact *first = run->again;
    for (const Impact *at = first; at > run->response.impacts.at && first->is_resumed; at--)
        if (at[-1].damper == first->damper && at[-1].side == first->side)
            first = &at[-1];
    const PlanStop *stop = &plan->dampers[first->damper - 1].stops[first->side];
    const ContactParameters own = contact_parameters_at(&stop->contact, first->approach_speed);
    Point point = {.time = time, .speed = speed};
    if (plan->form == CONTACT_LINEAR) {
        point.force = has_force ? own.damping * speed : 0;
        point.penetration = has_force ? 0 : fmax(-own.damping * speed / own.stiffness, 0);
    } else {
        point.penetration = fmax(near->penetration + near->speed * (time - near->time), 0);
        point.force = fmax(plan->law->force(&own, point.penetration, point.speed).value, 0);
    }
    return point;
}

// The vertex of the parabola through three points. Its force is the listed peak, which the solver
// has located.
static Point impact_run_vertex(const Point *a, const Point *b, const Point *c, double force) {
    const double left = a->time - b->time, right = c->time - b->time;
    const double low = (a->force - b->force) / left, high = (c->force - b->force) / right;
    const double bend = (high - low) / (right - left), slope = low - bend * left;
    const double t = bend != 0 ? fmin(fmax(-slope / (2 * bend), left), right) : 0;
    const double by_a = t * (t - right) / (left * (left - right)),
                 by_c = t * (t - left) / (right * (right - left)), by_b = 1 - by_a - by_c;
    return (Point){.time = b->time + t,
                   .force = copysign(force, b->force),
                   .penetration =
                       by_a * a->penetration + by_b * b->penetration + by_c * c->penetration,
                   .speed = by_a * a->speed + by_b * b->speed + by_c * c->speed};
}

// All points but the peak. Returns their number.
static size_t impact_run_gather(const ImpactRun *run, Point *points) {
    const Impact *again = run->again;
    const Plan *plan = run->inputs.plan;
    const double rate = plan->sample_rate;
    const bool is_open = isnan(again->end), has_ends = again->kind == IMPACT_IMPACT;
    const double end = is_open ? plan->duration : again->end, edge = 1e-6 / rate;
    const size_t last = plan->count - 1;
    size_t count = has_ends ? 1 : 0, i = (size_t)fmax(ceil((again->start + edge) * rate), 0);
    for (; i <= last && ((double)i / rate < end - edge || (is_open && i == last)); i++)
        points[count++] = impact_run_sample(run, i);
    if (!has_ends)
        return count;
    const Point none = {.time = again->start};
    points[0] = impact_run_end(run, again->start, again->approach_speed, !again->is_resumed,
                               count > 1 ? &points[1] : &none);
    if (is_open)
        return count;
    const bool pulls = plan->separation == SEPARATION_ZERO_PENETRATION;
    points[count] = impact_run_end(run, end, -again->separation_speed, pulls, &points[count - 1]);
    return count + 1;
}

static size_t impact_run_add_peak(const ImpactRun *run, Point *points, size_t count) {
    size_t top = 0;
    for (size_t i = 1; i < count; i++)
        if (fabs(points[i].force) > fabs(points[top].force))
            top = i;
    if (top == 0 || top + 1 >= count || isnan(run->again->peak_force))
        return count;
    const Point peak =
        impact_run_vertex(&points[top - 1], &points[top], &points[top + 1], run->again->peak_force);
    const double apart = peak.time - points[top].time;
    if (fabs(apart) * run->inputs.plan->sample_rate < 1e-6) {
        points[top] = peak;
        return count;
    }
    const size_t at = apart > 0 ? top + 1 : top;
    memmove(&points[at + 1], &points[at], (count - at) * sizeof *points);
    points[at] = peak;
    return count + 1;
}

static Status impact_run_fill(const ImpactRun *run, Columns *columns, Problem *problem) {
    static const struct {
        const char *name, *unit;
    } names[COLUMNS] = {[TIME] = {"time", "s"},
                        [FORCE] = {"contact_force", "N"},
                        [PENETRATION] = {"penetration", "m"},
                        [SPEED] = {"approach_speed", "m/s"}};
    Point *points = malloc((run->inputs.plan->count + 3) * sizeof *points);
    if (points == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the contact");
    const size_t count = impact_run_add_peak(run, points, impact_run_gather(run, points));
    const Status status = columns_allocate(columns, COLUMNS, count, 0, problem);
    for (size_t c = 0; c < COLUMNS && status == STATUS_OK; c++)
        columns_name(columns, c, names[c].name, names[c].unit);
    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        columns->at[TIME].values[i] = run->start + points[i].time;
        columns->at[FORCE].values[i] = points[i].force;
        columns->at[PENETRATION].values[i] = points[i].penetration;
        columns->at[SPEED].values[i] = points[i].speed;
    }
    free(points);
    return status;
}

// Adds all states to the channels. Channels of spectra stay, because a mean acceleration changes
// the solver's path and with it the last digits; the spectra themselves are not made.
static Status impact_run_add_states(const Scene *scene, Output *output) {
    Texts *names = &output->channels, *transformed = &output->psd.channels;
    for (size_t i = 0; i < transformed->count; i++) {
        size_t number;
        const Channel *channel = channel_find(transformed->at[i], &number);
        TRY(channel_names_add(scene, (ChannelId)(channel - channels), number > 0 ? number : 1,
                              names));
    }
    channel_names_clear(transformed);
    for (size_t i = 1; i <= structure_storeys(scene_structure(scene)); i++) {
        TRY(channel_names_add(scene, CHANNEL_DISPLACEMENT, i, names));
        TRY(channel_names_add(scene, CHANNEL_VELOCITY, i, names));
    }
    for (size_t i = 1; i <= scene->dampers.count; i++) {
        TRY(channel_names_add(scene, CHANNEL_DAMPER_DISPLACEMENT, i, names));
        TRY(channel_names_add(scene, CHANNEL_DAMPER_VELOCITY, i, names));
    }
    return STATUS_OK;
}

// Value of a state of the first run; `index` is from 0.
static double impact_run_state(const ImpactRun *run, ChannelId channel, size_t index,
                               size_t sample) {
    char name[CHANNEL_NAME];
    channel_names_write(&run->simulation.scene, channel, index + 1, name);
    return columns_find(&run->outcome->response.series, name)->values[sample];
}

// The scene as it was run. The settings of an accuracy target are known only after a run.
static Status impact_run_settle(ImpactRun *run, const Simulation *asked,
                                const SimulationLimits *limits, const Progress *progress,
                                Workspace *workspace, Problem *problem) {
    const Scene *scene = &asked->scene;
    const size_t states = 2 * (structure_storeys(scene_structure(scene)) + scene->dampers.count);
    if ((double)states * (double)scene_sample_count(scene) * sizeof(double) > states_bytes_max)
        return problem_set(problem, STATUS_LIMIT,
                           "the run is too long, or has too many storeys, for one of its impacts "
                           "to be shown in detail: its states would take more than %g bytes; "
                           "submit a shorter scene that holds the impact",
                           states_bytes_max);
    if (simulation_has_target(asked)) {
        Outcome *outcome = NULL;
        TRY(accuracy_target_run(asked, limits, progress, workspace, &run->simulation, &outcome,
                                problem));
        outcome_unref(outcome);
    } else if (fields_copy(simulation_fields, asked, &run->simulation) != STATUS_OK) {
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene");
    }
    run->simulation.output.impacts = true;
    if (impact_run_add_states(scene, &run->simulation.output) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
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

// Number of the base's own sample at a sample of the output; -1: it has none there.
static double impact_run_base_sample(const ImpactRun *run, size_t sample) {
    const Base *base = &run->inputs.base;
    if (base->form != BASE_SAMPLED)
        return 0;
    const double number = (double)sample / (run->outcome->response.sample_rate * base->interval);
    const double nearest = round(number);
    return fabs(number - nearest) <= 1e-9 ? nearest : -1;
}

static bool impact_run_is_free(const ImpactRun *run, size_t sample) {
    for (size_t i = 0; i < run->inputs.plan->damper_count; i++) {
        const PlanDamper *damper = &run->inputs.plan->dampers[i];
        const double u = impact_run_state(run, CHANNEL_DAMPER_DISPLACEMENT, i, sample) -
                         impact_run_state(run, CHANNEL_DISPLACEMENT, damper->storey, sample);
        if (!(fabs(u - damper->offset) < 0.5 * damper->clearance))
            return false;
    }
    return true;
}

// The last sample before the impact from which a run can start: no contact is open, all masses are
// between their stops and the base has a sample. Sample 0 always serves.
static void impact_run_find_start(ImpactRun *run) {
    const Impacts *impacts = &run->outcome->response.impacts;
    const double rate = run->outcome->response.sample_rate;
    size_t sample = (size_t)floor(run->impact->start * rate);
    while (sample > 0) {
        const double time = (double)sample / rate;
        double earliest = time;
        for (const Impact *other = impacts->at;
             other < impacts->at + impacts->count && other->start < time; other++)
            if (!(other->end <= time) && other->start < earliest)
                earliest = other->start;
        if (earliest < time)
            sample = (size_t)floor(earliest * rate);
        else if (!impact_run_is_free(run, sample) || impact_run_base_sample(run, sample) < 0)
            sample--;
        else
            break;
    }
    run->sample = sample;
    run->start = (double)sample / rate;
}

// Moves the start of a piece by `after` [s].
static void impact_run_shift_piece(BasePiece *piece, double omega, double after) {
    const double value = piece->value, slope = piece->slope;
    const double c = cos(omega * after), s = sin(omega * after);
    piece->value = omega > 0 ? value * c + slope * s : value + slope * after;
    piece->slope = omega > 0 ? slope * c - value * s : slope;
}

static void impact_run_shift_base(ImpactRun *run) {
    const Base *base = &run->inputs.base;
    Base *shifted = &run->shifted;
    *shifted = *base;
    if (base->form == BASE_SAMPLED) {
        const size_t first = (size_t)impact_run_base_sample(run, run->sample);
        const size_t passed = first < base->count ? first : base->count;
        shifted->values += passed;
        shifted->count -= passed;
        if (shifted->count == 0)
            *shifted = (Base){.form = BASE_STILL};
    } else if (base->form == BASE_SINE) {
        shifted->form = BASE_PIECES;
        shifted->pieces[0] = (BasePiece){0, 0, base->amplitude};
        shifted->piece_count = 1;
        impact_run_shift_piece(&shifted->pieces[0], base->omega, run->start);
    } else if (base->form == BASE_PIECES) {
        shifted->piece_count = 0;
        for (size_t i = 0; i < base->piece_count; i++) {
            BasePiece piece = base->pieces[i];
            piece.time -= run->start;
            if (piece.time <= 0) {
                impact_run_shift_piece(&piece, base->omega, -piece.time);
                piece.time = 0;
                shifted->piece_count = 0;
            }
            shifted->pieces[shifted->piece_count++] = piece;
        }
    }
}

// The plan belongs to this run alone: it continues from the state at the sample.
static void impact_run_set_state(const ImpactRun *run) {
    Plan *plan = run->inputs.plan;
    for (size_t i = 0; i < plan->storeys && run->sample > 0; i++) {
        plan->displacement[i] = impact_run_state(run, CHANNEL_DISPLACEMENT, i, run->sample);
        plan->velocity[i] = impact_run_state(run, CHANNEL_VELOCITY, i, run->sample);
    }
    for (size_t i = 0; i < plan->damper_count && run->sample > 0; i++) {
        PlanDamper *damper = &plan->dampers[i];
        damper->position = impact_run_state(run, CHANNEL_DAMPER_DISPLACEMENT, i, run->sample) -
                           plan->displacement[damper->storey] - damper->offset;
        damper->velocity = impact_run_state(run, CHANNEL_DAMPER_VELOCITY, i, run->sample) -
                           plan->velocity[damper->storey];
    }
}

static Status impact_run_set_clock(const ImpactRun *run, size_t points, Problem *problem) {
    Plan *plan = run->inputs.plan;
    const double total = run->simulation.scene.duration;
    const double end = isnan(run->impact->end) ? total : run->impact->end;
    const double length = end - run->impact->start;
    if (!(length > 0))
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the contact has no duration: from %.17g s to %.17g s",
                           run->impact->start, end);
    const double left = total - run->start;
    plan->sample_rate = (double)(points - 2) / length;
    plan->duration = fmin(end - run->start + 2 / plan->sample_rate, left);
    // At the end of the run the last sample must be at its end.
    if (plan->duration == left)
        plan->sample_rate = ceil(left * plan->sample_rate) / left;
    const double samples = plan->duration * plan->sample_rate * (1 + 1e-12) + 1;
    if (samples > FINE_MAX)
        return problem_set(
            problem, STATUS_LIMIT,
            "a contact of %.3g s is too short for %zu points, because the run has to "
            "start %.3g s before it: ask for fewer points",
            length, points, run->impact->start - run->start);
    plan->count = (size_t)samples;
    return STATUS_OK;
}

static Status impact_run_fine(ImpactRun *run, const SimulationLimits *limits,
                              const Progress *progress, Workspace *workspace, Problem *problem) {
    const Plan *plan = run->inputs.plan;
    const size_t number = (size_t)run->impact->damper - 1;
    TRY(columns_allocate(&run->fine, FINE_COLUMNS, plan->count, 0, problem));
    const Column *fine = run->fine.at;
    const RunColumn columns[FINE_COLUMNS] = {
        {CHANNEL_CONTACT_FORCE, number, fine[FINE_FORCE].values},
        {CHANNEL_PENETRATION, number, fine[FINE_PENETRATION].values},
        {CHANNEL_VELOCITY, plan->dampers[number].storey, fine[FINE_VELOCITY].values},
        {CHANNEL_DAMPER_VELOCITY, number, fine[FINE_DAMPER_VELOCITY].values}};
    const bool is_exact = simulation_solver(&run->simulation) == &solver_exact;
    Run solver_run = {.plan = plan,
                      .base = &run->shifted,
                      .progress = progress,
                      .accuracy = is_exact ? simulation_settings(&run->simulation) : NULL,
                      .workspace = workspace,
                      .columns = columns,
                      .column_count = COUNT(columns),
                      .impacts_max = limits == NULL ? 0 : limits->impacts,
                      .steps_max = limits == NULL ? 0 : SIMULATION_PATIENCE * limits->steps};
    TRY(solver_exact.run(&solver_exact, &solver_run, &run->response, problem));
    const Impacts *impacts = &run->response.impacts;
    const double wanted = run->impact->start - run->start;
    for (const Impact *at = impacts->at; at < impacts->at + impacts->count; at++)
        if (at->damper == run->impact->damper && at->side == run->impact->side &&
            at->kind == run->impact->kind &&
            (run->again == NULL || fabs(at->start - wanted) < fabs(run->again->start - wanted)))
            run->again = at;
    if (run->again == NULL)
        return problem_set(problem, STATUS_UNSTABLE,
                           "the impact does not occur again in a run from the sample before it, "
                           "at %.17g s: the solver's steps were too coarse",
                           run->start);
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
    impact_run_find_start(run);
    impact_run_shift_base(run);
    impact_run_set_state(run);
    TRY(impact_run_set_clock(run, points, problem));
    TRY(impact_run_fine(run, limits, progress, workspace, problem));
    history->impact = *run->impact;
    return impact_run_fill(run, &history->columns, problem);
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
    columns_clear(&run.fine);
    response_clear(&run.response);
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
