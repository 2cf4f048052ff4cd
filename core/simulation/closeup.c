// From one sample at which the base is known as such and no stop is touched, at or before the
// touch, the exact solver goes on with a finer clock:
//
//     samples      |.........|.........|.........|
//     contact                     [=========]
//     fine run               |''''''''''''''''|
//
// The ends are the contact law's own: a sample at a release shows the flight behind it, so the
// force there follows from the speed.
#include "core/simulation/closeup.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/keep.h"
#include "core/simulation/aim.h"
#include "core/simulation/choice.h"

enum { FINE_MOST = 1 << 22 };                      // samples of the fine run
enum { TIME, FORCE, PENETRATION, SPEED, COLUMNS }; // of the answer
enum { FINE_FORCE, FINE_PENETRATION, FINE_VELOCITY, FINE_DAMPER_VELOCITY, FINE_COLUMNS };

static const double states_most = 1e9; // bytes of the first run's columns

typedef struct Shot {
    Simulation simulation; // as it was run, but for its output
    Outcome *outcome;      // all states, by sample
    const Impact *impact;
    Plan *plan;          // of the fine run
    Base base;           // of the whole
    Base shifted;        // from the fine run's start on; its values are the other's
    size_t sample;       // there
    double start;        // of the fine run [s]
    Columns fine;        // FINE_COLUMNS
    Response response;   // of the fine run
    const Impact *again; // the impact in that
} Shot;

static void shot_clear(Shot *shot) {
    simulation_clear(&shot->simulation);
    outcome_drop(shot->outcome);
    plan_free(shot->plan);
    base_clear(&shot->base);
    columns_clear(&shot->fine);
    response_clear(&shot->response);
}

static double sign_of(int side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// "velocity", or with several of its kind "velocity_2".
static void name_state(char *target, size_t size, ChannelId channel, size_t index, size_t count) {
    if (count > 1)
        snprintf(target, size, "%s_%zu", channels[channel].name, index + 1);
    else
        snprintf(target, size, "%s", channels[channel].name);
}

static bool has_text(const Texts *texts, const char *text) {
    for (size_t i = 0; i < texts->count; i++)
        if (strcmp(texts->at[i], text) == 0)
            return true;
    return false;
}

// Adds a channel to those asked for; the room is there.
static Status add_channel(Texts *texts, ChannelId channel, size_t index, size_t count) {
    char name[48];
    name_state(name, sizeof name, channel, index, count);
    if (has_text(texts, name))
        return STATUS_OK;
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    texts->at[texts->count++] = text;
    return STATUS_OK;
}

// The scene as it was run, with all states for its output.
static Status ask_for_states(Simulation *simulation, size_t storeys, size_t dampers) {
    Texts *texts = &simulation->output.channels;
    char **room =
        realloc(texts->at, (texts->count + 2 * storeys + 2 * dampers) * sizeof *texts->at);
    if (room == NULL)
        return STATUS_NO_MEMORY;
    texts->at = room;
    for (size_t i = 0; i < storeys; i++) {
        TRY(add_channel(texts, CHANNEL_DISPLACEMENT, i, storeys));
        TRY(add_channel(texts, CHANNEL_VELOCITY, i, storeys));
    }
    for (size_t i = 0; i < dampers; i++) {
        TRY(add_channel(texts, CHANNEL_DAMPER_DISPLACEMENT, i, dampers));
        TRY(add_channel(texts, CHANNEL_DAMPER_VELOCITY, i, dampers));
    }
    return STATUS_OK;
}

static double state_at(const Shot *shot, ChannelId channel, size_t index, size_t count,
                       size_t sample) {
    char name[48];
    name_state(name, sizeof name, channel, index, count);
    return columns_find(&shot->outcome->response.series, name)->values[sample];
}

// The scene as it was run. A target's way shows only by running it.
static Status settle(const Simulation *asked, const SimulationLimits *limits, const Watch *watch,
                     Workspace *workspace, Shot *shot, Problem *problem) {
    const Scene *scene = &asked->scene;
    const size_t storeys = scene_storeys(scene, NULL), dampers = scene->dampers.count;
    if ((double)(2 * (storeys + dampers)) * (double)scene_sample_count(scene) * sizeof(double) >
        states_most)
        return problem_set(problem, STATUS_LIMIT,
                           "the run is too long, or has too many storeys, for one of its impacts "
                           "to be shown in detail: its states would take more than %g bytes; "
                           "submit a shorter scene that holds the impact",
                           states_most);
    if (aim_is_asked(asked))
        TRY(aim_settle(asked, limits, watch, workspace, &shot->simulation, problem));
    else if (fields_copy(simulation_fields, asked, &shot->simulation) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene");
    Output *output = &shot->simulation.output;
    for (size_t i = 0; i < output->psd.channels.count; i++)
        free(output->psd.channels.at[i]);
    output->psd.channels.count = 0;
    output->impacts = true;
    if (ask_for_states(&shot->simulation, storeys, dampers) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    return STATUS_OK;
}

static Status refuse_impulse(Problem *problem) {
    return problem_set(problem, STATUS_NOT_FOUND,
                       "under the contact model impulse an impact takes no time and has no force: "
                       "its impulse stands in the ledger");
}

static Status find_impact(Shot *shot, size_t number, Problem *problem) {
    const Impacts *impacts = &shot->outcome->response.impacts;
    if (impacts->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the result has no impacts");
    if (number < 1 || number > impacts->count)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no impact %zu: they are numbered from 1 to %zu, as "
                           "impacts.json lists them",
                           number, impacts->count);
    shot->impact = &impacts->at[number - 1];
    return STATUS_OK;
}

// Where the base has a sample of its own at the output's sample, its number; else -1.
static double knot_at(const Shot *shot, size_t sample) {
    if (shot->base.form != BASE_SAMPLED)
        return 0;
    const double number =
        (double)sample / (shot->outcome->response.sample_rate * shot->base.interval);
    const double nearest = round(number);
    return fabs(number - nearest) <= 1e-9 ? nearest : -1;
}

// Whether all masses are between their stops.
static bool is_free(const Shot *shot, size_t sample) {
    for (size_t i = 0; i < shot->plan->damper_count; i++) {
        const PlanDamper *damper = &shot->plan->dampers[i];
        const double u =
            state_at(shot, CHANNEL_DAMPER_DISPLACEMENT, i, shot->plan->damper_count, sample) -
            state_at(shot, CHANNEL_DISPLACEMENT, damper->storey, shot->plan->storeys, sample);
        if (!(fabs(u - damper->offset) < 0.5 * damper->clearance))
            return false;
    }
    return true;
}

// The last sample from which a run can begin as this one went on. At the first it began.
static void find_start(Shot *shot) {
    const Impacts *impacts = &shot->outcome->response.impacts;
    const double rate = shot->outcome->response.sample_rate;
    size_t sample = (size_t)floor(shot->impact->start * rate);
    while (sample > 0) {
        const double time = (double)sample / rate;
        double earliest = time;
        for (const Impact *other = impacts->at;
             other < impacts->at + impacts->count && other->start < time; other++)
            if (!(other->end <= time) && other->start < earliest)
                earliest = other->start;
        if (earliest < time)
            sample = (size_t)floor(earliest * rate);
        else if (!is_free(shot, sample) || knot_at(shot, sample) < 0)
            sample--;
        else
            break;
    }
    shot->sample = sample;
    shot->start = (double)sample / rate;
}

// The value and slope of a piece so much after it begins.
static void piece_go(BasePiece *piece, double omega, double after) {
    const double value = piece->value, slope = piece->slope;
    const double c = cos(omega * after), s = sin(omega * after);
    piece->value = omega > 0 ? value * c + slope * s : value + slope * after;
    piece->slope = omega > 0 ? slope * c - value * s : slope;
}

// The base from the fine run's start on. Its samples stay the whole base's.
static void shift_base(Shot *shot) {
    const Base *base = &shot->base;
    Base *shifted = &shot->shifted;
    *shifted = *base;
    if (base->form == BASE_SAMPLED) {
        const size_t knot = (size_t)knot_at(shot, shot->sample);
        const size_t passed = knot < base->count ? knot : base->count;
        shifted->values += passed;
        shifted->count -= passed;
        if (shifted->count == 0)
            *shifted = (Base){.form = BASE_STILL};
    } else if (base->form == BASE_SINE) {
        shifted->form = BASE_PIECES;
        shifted->pieces[0] = (BasePiece){0, 0, base->amplitude};
        shifted->piece_count = 1;
        piece_go(&shifted->pieces[0], base->omega, shot->start);
    } else if (base->form == BASE_PIECES) {
        shifted->piece_count = 0;
        for (size_t i = 0; i < base->piece_count; i++) {
            BasePiece piece = base->pieces[i];
            piece.time -= shot->start;
            if (piece.time <= 0) {
                piece_go(&piece, base->omega, -piece.time);
                piece.time = 0;
                shifted->piece_count = 0;
            }
            shifted->pieces[shifted->piece_count++] = piece;
        }
    }
}

static Status make_plan(Shot *shot, Problem *problem) {
    const Simulation *simulation = &shot->simulation;
    const Scene *scene = &simulation->scene;
    TRY(plan_new(scene, simulation->accuracy->kind->name, solver_exact.kind.name, &shot->plan,
                 problem));
    if (shot->plan->form == CONTACT_IMPULSIVE)
        return refuse_impulse(problem);
    return plan_keep(shot->plan, scene,
                     accuracy_modes(choice_common(simulation), shot->plan->storeys), problem);
}

static Status make_base(Shot *shot, const SimulationLimits *limits, const Watch *watch,
                        Workspace *workspace, Problem *problem) {
    const Scene *scene = &shot->simulation.scene;
    const Span span = {.duration = scene->duration,
                       .sample_rate = scene->sample_rate,
                       .most = limits == NULL ? 0 : limits->samples,
                       .transforms = workspace == NULL ? NULL : &workspace->transforms};
    const Excitation *excitation = scene_excitation(scene);
    return excitation_kind(excitation)->make(excitation, &span, watch, &shot->base, problem);
}

// The plan is this shot's own and nobody else has it yet: it goes on from the sample's state.
static void set_state(Shot *shot) {
    Plan *plan = shot->plan;
    if (shot->sample == 0)
        return;
    for (size_t i = 0; i < plan->storeys; i++) {
        plan->displacement[i] =
            state_at(shot, CHANNEL_DISPLACEMENT, i, plan->storeys, shot->sample);
        plan->velocity[i] = state_at(shot, CHANNEL_VELOCITY, i, plan->storeys, shot->sample);
    }
    for (size_t i = 0; i < plan->damper_count; i++) {
        PlanDamper *damper = &plan->dampers[i];
        damper->position =
            state_at(shot, CHANNEL_DAMPER_DISPLACEMENT, i, plan->damper_count, shot->sample) -
            plan->displacement[damper->storey] - damper->offset;
        damper->velocity =
            state_at(shot, CHANNEL_DAMPER_VELOCITY, i, plan->damper_count, shot->sample) -
            plan->velocity[damper->storey];
    }
}

static Status set_clock(Shot *shot, size_t points, Problem *problem) {
    Plan *plan = shot->plan;
    const double total = shot->simulation.scene.duration;
    const double end = isnan(shot->impact->end) ? total : shot->impact->end;
    const double length = end - shot->impact->start;
    if (!(length > 0))
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the contact takes no time that could be shown: from %.17g s to %.17g s",
                           shot->impact->start, end);
    plan->sample_rate = (double)(points - 2) / length;
    plan->duration = fmin(end - shot->start + 2 / plan->sample_rate, total - shot->start);
    const double samples = plan->duration * plan->sample_rate * (1 + 1e-12) + 1;
    if (samples > FINE_MOST)
        return problem_set(problem, STATUS_LIMIT,
                           "so short a contact, %.3g s, cannot be shown at %zu points from where a "
                           "run can begin, %.3g s before it: ask for fewer points",
                           length, points, shot->impact->start - shot->start);
    plan->count = (size_t)samples;
    return STATUS_OK;
}

static Status run_finely(Shot *shot, const SimulationLimits *limits, const Watch *watch,
                         Workspace *workspace, Problem *problem) {
    const Plan *plan = shot->plan;
    const size_t number = (size_t)shot->impact->damper - 1;
    TRY(columns_make(&shot->fine, FINE_COLUMNS, plan->count, 0, problem));
    const RunColumn columns[FINE_COLUMNS] = {
        {CHANNEL_CONTACT_FORCE, number, shot->fine.at[FINE_FORCE].values},
        {CHANNEL_PENETRATION, number, shot->fine.at[FINE_PENETRATION].values},
        {CHANNEL_VELOCITY, plan->dampers[number].storey, shot->fine.at[FINE_VELOCITY].values},
        {CHANNEL_DAMPER_VELOCITY, number, shot->fine.at[FINE_DAMPER_VELOCITY].values}};
    const bool is_exact = choice_solver(&shot->simulation) == &solver_exact;
    Run run = {.plan = plan,
               .base = &shot->shifted,
               .watch = watch,
               .accuracy = is_exact ? choice_settings(&shot->simulation) : NULL,
               .workspace = workspace,
               .columns = columns,
               .column_count = COUNT(columns),
               .impacts_most = limits == NULL ? 0 : limits->impacts,
               .steps_most = limits == NULL ? 0 : SIMULATION_PATIENCE * limits->steps};
    TRY(solver_exact.run(&run, &shot->response, problem));
    const Impacts *impacts = &shot->response.impacts;
    const double wanted = shot->impact->start - shot->start;
    for (const Impact *at = impacts->at; at < impacts->at + impacts->count; at++)
        if (at->damper == shot->impact->damper && at->side == shot->impact->side &&
            at->kind == shot->impact->kind &&
            (shot->again == NULL || fabs(at->start - wanted) < fabs(shot->again->start - wanted)))
            shot->again = at;
    if (shot->again == NULL)
        return problem_set(problem, STATUS_UNSTABLE,
                           "the impact does not come again from the sample before it, at %.17g s: "
                           "the solver's steps were too coarse for it",
                           shot->start);
    return STATUS_OK;
}

// One row of the answer, in the fine run's time.
typedef struct Point {
    double time, force, penetration, speed;
} Point;

static Point sample_at(const Shot *shot, size_t i) {
    const Column *fine = shot->fine.at;
    const double sign = sign_of(shot->again->side);
    return (Point){.time = (double)i / shot->plan->sample_rate,
                   .force = sign * fine[FINE_FORCE].values[i],
                   .penetration = fine[FINE_PENETRATION].values[i],
                   .speed = sign *
                            (fine[FINE_DAMPER_VELOCITY].values[i] - fine[FINE_VELOCITY].values[i])};
}

// The parameters of the contact, which may have begun before a pause of its force.
static ContactParameters frozen(const Shot *shot) {
    const Impact *first = shot->again;
    for (const Impact *at = first; at > shot->response.impacts.at && first->is_resumed; at--)
        if (at[-1].damper == first->damper && at[-1].side == first->side)
            first = &at[-1];
    const PlanStop *stop = &shot->plan->dampers[first->damper - 1].stops[first->side];
    return contact_freeze(&stop->contact, first->approach_speed);
}

// The contact's side of an end of it, `near` being the nearest sample within.
static Point end_at(const Shot *shot, double time, double speed, bool has_force,
                    const Point *near) {
    const ContactParameters own = frozen(shot);
    Point point = {.time = time, .speed = speed};
    if (shot->plan->form == CONTACT_LINEAR) {
        point.force = has_force ? own.damping * speed : 0;
        point.penetration = has_force ? 0 : fmax(-own.damping * speed / own.stiffness, 0);
    } else {
        point.penetration = fmax(near->penetration + near->speed * (time - near->time), 0);
        point.force = fmax(shot->plan->law->force(&own, point.penetration, point.speed).value, 0);
    }
    return point;
}

// At the vertex of the parabola through three points; the force is the ledger's, which searched for
// it.
static Point peak_between(const Point *a, const Point *b, const Point *c, double force) {
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

// All rows but the peak's. Returns how many.
static size_t gather(const Shot *shot, Point *points) {
    const Impact *again = shot->again;
    const double rate = shot->plan->sample_rate;
    const bool is_open = isnan(again->end), has_ends = again->kind == IMPACT_IMPACT;
    const double end = is_open ? shot->plan->duration : again->end, edge = 1e-6 / rate;
    const size_t last = shot->plan->count - 1;
    size_t count = has_ends ? 1 : 0, i = (size_t)fmax(ceil((again->start + edge) * rate), 0);
    for (; i <= last && ((double)i / rate < end - edge || (is_open && i == last)); i++)
        points[count++] = sample_at(shot, i);
    if (!has_ends)
        return count;
    const Point none = {.time = again->start};
    const Point *first = count > 1 ? &points[1] : &none;
    points[0] = end_at(shot, again->start, again->approach_speed, !again->is_resumed, first);
    if (is_open)
        return count;
    const bool pulls = shot->plan->separation == SEPARATION_ZERO_PENETRATION;
    points[count] = end_at(shot, end, -again->separation_speed, pulls, &points[count - 1]);
    return count + 1;
}

static size_t add_peak(const Shot *shot, Point *points, size_t count) {
    size_t top = 0;
    for (size_t i = 1; i < count; i++)
        if (fabs(points[i].force) > fabs(points[top].force))
            top = i;
    if (top == 0 || top + 1 >= count || isnan(shot->again->peak_force))
        return count;
    const Point peak =
        peak_between(&points[top - 1], &points[top], &points[top + 1], shot->again->peak_force);
    const double apart = peak.time - points[top].time;
    if (fabs(apart) * shot->plan->sample_rate < 1e-6) {
        points[top] = peak;
        return count;
    }
    const size_t at = apart > 0 ? top + 1 : top;
    memmove(&points[at + 1], &points[at], (count - at) * sizeof *points);
    points[at] = peak;
    return count + 1;
}

static Status tell(const Shot *shot, Closeup *closeup, Problem *problem) {
    static const struct {
        const char *name, *unit;
    } names[COLUMNS] = {[TIME] = {"time", "s"},
                        [FORCE] = {"contact_force", "N"},
                        [PENETRATION] = {"penetration", "m"},
                        [SPEED] = {"approach_speed", "m/s"}};
    Point *points = malloc((shot->plan->count + 3) * sizeof *points);
    if (points == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the contact");
    const size_t count = add_peak(shot, points, gather(shot, points));
    const Status status = columns_make(&closeup->columns, COLUMNS, count, 0, problem);
    for (size_t c = 0; c < COLUMNS && status == STATUS_OK; c++)
        columns_name(&closeup->columns, c, names[c].name, names[c].unit);
    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        closeup->columns.at[TIME].values[i] = shot->start + points[i].time;
        closeup->columns.at[FORCE].values[i] = points[i].force;
        closeup->columns.at[PENETRATION].values[i] = points[i].penetration;
        closeup->columns.at[SPEED].values[i] = points[i].speed;
    }
    free(points);
    closeup->impact = *shot->impact;
    return status;
}

static Status take(Shot *shot, const Simulation *simulation, size_t number, size_t points,
                   const SimulationLimits *limits, const Watch *watch, Workspace *workspace,
                   Closeup *closeup, Problem *problem) {
    TRY(settle(simulation, limits, watch, workspace, shot, problem));
    TRY(make_plan(shot, problem));
    TRY(simulation_run(&shot->simulation, limits, watch, workspace, &shot->outcome, problem));
    TRY(find_impact(shot, number, problem));
    TRY(make_base(shot, limits, watch, workspace, problem));
    find_start(shot);
    shift_base(shot);
    set_state(shot);
    TRY(set_clock(shot, points, problem));
    TRY(run_finely(shot, limits, watch, workspace, problem));
    return tell(shot, closeup, problem);
}

Status closeup_make(const Simulation *simulation, size_t number, size_t points,
                    const SimulationLimits *limits, const Watch *watch, Workspace *workspace,
                    Closeup *closeup, Problem *problem) {
    Shot shot;
    memset(&shot, 0, sizeof shot);
    memset(closeup, 0, sizeof *closeup);
    const Status status =
        take(&shot, simulation, number, points, limits, watch, workspace, closeup, problem);
    shot_clear(&shot);
    if (status != STATUS_OK)
        closeup_clear(closeup);
    return status;
}

void closeup_clear(Closeup *closeup) {
    columns_clear(&closeup->columns);
    memset(closeup, 0, sizeof *closeup);
}

double closeup_steps(const Simulation *simulation) {
    return (aim_is_asked(simulation) ? 2 : 1) * simulation_cost(simulation).steps;
}
