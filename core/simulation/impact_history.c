// From one sample at which the base is known as such and no stop is touched, at or before the
// touch, the exact solver goes on with a finer clock:
//
//     samples      |.........|.........|.........|
//     contact                     [=========]
//     fine run               |''''''''''''''''|
//
// The ends are the contact law's own: a sample at a release shows the flight behind it, so the
// force there follows from the speed.
#include "core/simulation/impact_history.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/mode_selection.h"
#include "core/simulation/accuracy_target.h"
#include "core/simulation/choice.h"
#include "core/simulation/closeup_points.h"

enum { FINE_MAX = 1 << 22 }; // samples of the fine run

static const double states_most = 1e9; // bytes of the first run's columns

static void shot_clear(Shot *shot) {
    simulation_clear(&shot->simulation);
    outcome_unref(shot->outcome);
    plan_free(shot->plan);
    base_clear(&shot->base);
    columns_clear(&shot->fine);
    response_clear(&shot->response);
}

// "velocity", or with several storeys or dampers "velocity_2".
static void name_state(char *target, size_t size, ChannelId channel, size_t index,
                       bool is_numbered) {
    if (is_numbered)
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
static Status add_channel(Texts *texts, ChannelId channel, size_t index, bool is_numbered) {
    char name[48];
    name_state(name, sizeof name, channel, index, is_numbered);
    if (has_text(texts, name))
        return STATUS_OK;
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    texts->at[texts->count++] = text;
    return STATUS_OK;
}

// Asks for all states besides. What was asked for stays: whether there is a mean acceleration
// decides how the solver goes, and with it a path's last digits. But spectra are not made again.
static Status ask_for_states(Output *output, size_t storeys, size_t dampers) {
    Texts *texts = &output->channels, *transformed = &output->psd.channels;
    const bool is_numbered = storeys > 1 || dampers > 1;
    char **room =
        realloc(texts->at, (texts->count + transformed->count + 2 * storeys + 2 * dampers) *
                               sizeof *texts->at);
    if (room == NULL)
        return STATUS_NO_MEMORY;
    texts->at = room;
    for (; transformed->count > 0; transformed->count--) {
        char *name = transformed->at[transformed->count - 1];
        if (has_text(texts, name))
            free(name);
        else
            texts->at[texts->count++] = name;
    }
    for (size_t i = 0; i < storeys; i++) {
        TRY(add_channel(texts, CHANNEL_DISPLACEMENT, i, is_numbered));
        TRY(add_channel(texts, CHANNEL_VELOCITY, i, is_numbered));
    }
    for (size_t i = 0; i < dampers; i++) {
        TRY(add_channel(texts, CHANNEL_DAMPER_DISPLACEMENT, i, is_numbered));
        TRY(add_channel(texts, CHANNEL_DAMPER_VELOCITY, i, is_numbered));
    }
    return STATUS_OK;
}

static double state_at(const Shot *shot, ChannelId channel, size_t index, size_t sample) {
    const Plan *plan = shot->plan;
    char name[48];
    name_state(name, sizeof name, channel, index, plan->storeys > 1 || plan->damper_count > 1);
    return columns_find(&shot->outcome->response.series, name)->values[sample];
}

// The scene as it was run. A target's way shows only by running it.
static Status settle(const Simulation *asked, const SimulationLimits *limits,
                     const Progress *progress, Workspace *workspace, Shot *shot, Problem *problem) {
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
        TRY(aim_settle(asked, limits, progress, workspace, &shot->simulation, problem));
    else if (fields_copy(simulation_fields, asked, &shot->simulation) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene");
    shot->simulation.output.impacts = true;
    shot->simulation.output.reduction = false;
    if (ask_for_states(&shot->simulation.output, storeys, dampers) != STATUS_OK)
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
    // A rest under impulses has a force all the same.
    return shot->plan->form == CONTACT_IMPULSIVE && shot->impact->kind == IMPACT_IMPACT
               ? refuse_impulse(problem)
               : STATUS_OK;
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
        const double u = state_at(shot, CHANNEL_DAMPER_DISPLACEMENT, i, sample) -
                         state_at(shot, CHANNEL_DISPLACEMENT, damper->storey, sample);
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
    return plan_keep(shot->plan, scene,
                     accuracy_modes(choice_common(simulation), shot->plan->storeys), problem);
}

static Status make_base(Shot *shot, const SimulationLimits *limits, const Progress *progress,
                        Workspace *workspace, Problem *problem) {
    const Scene *scene = &shot->simulation.scene;
    const Span span = {.duration = scene->duration,
                       .sample_rate = scene->sample_rate,
                       .most = limits == NULL ? 0 : limits->samples,
                       .transforms = workspace == NULL ? NULL : &workspace->transforms};
    const Excitation *excitation = scene_excitation(scene);
    return excitation_kind(excitation)->make(excitation, &span, progress, &shot->base, problem);
}

// The plan is this shot's own and nobody else has it yet: it goes on from the sample's state.
static void set_state(Shot *shot) {
    Plan *plan = shot->plan;
    if (shot->sample == 0)
        return;
    for (size_t i = 0; i < plan->storeys; i++) {
        plan->displacement[i] = state_at(shot, CHANNEL_DISPLACEMENT, i, shot->sample);
        plan->velocity[i] = state_at(shot, CHANNEL_VELOCITY, i, shot->sample);
    }
    for (size_t i = 0; i < plan->damper_count; i++) {
        PlanDamper *damper = &plan->dampers[i];
        damper->position = state_at(shot, CHANNEL_DAMPER_DISPLACEMENT, i, shot->sample) -
                           plan->displacement[damper->storey] - damper->offset;
        damper->velocity = state_at(shot, CHANNEL_DAMPER_VELOCITY, i, shot->sample) -
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
    const double left = total - shot->start;
    plan->sample_rate = (double)(points - 2) / length;
    plan->duration = fmin(end - shot->start + 2 / plan->sample_rate, left);
    // To the run's end the last sample must be at it.
    if (plan->duration == left)
        plan->sample_rate = ceil(left * plan->sample_rate) / left;
    const double samples = plan->duration * plan->sample_rate * (1 + 1e-12) + 1;
    if (samples > FINE_MAX)
        return problem_set(problem, STATUS_LIMIT,
                           "so short a contact, %.3g s, cannot be shown at %zu points from where a "
                           "run can begin, %.3g s before it: ask for fewer points",
                           length, points, shot->impact->start - shot->start);
    plan->count = (size_t)samples;
    return STATUS_OK;
}

static Status run_finely(Shot *shot, const SimulationLimits *limits, const Progress *progress,
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
               .progress = progress,
               .accuracy = is_exact ? choice_settings(&shot->simulation) : NULL,
               .workspace = workspace,
               .columns = columns,
               .column_count = COUNT(columns),
               .impacts_max = limits == NULL ? 0 : limits->impacts,
               .steps_max = limits == NULL ? 0 : SIMULATION_PATIENCE * limits->steps};
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

static Status take(Shot *shot, const Simulation *simulation, size_t number, size_t points,
                   const SimulationLimits *limits, const Progress *progress, Workspace *workspace,
                   Closeup *closeup, Problem *problem) {
    TRY(settle(simulation, limits, progress, workspace, shot, problem));
    TRY(make_plan(shot, problem));
    TRY(simulation_run(&shot->simulation, limits, progress, workspace, &shot->outcome, problem));
    TRY(find_impact(shot, number, problem));
    TRY(make_base(shot, limits, progress, workspace, problem));
    find_start(shot);
    shift_base(shot);
    set_state(shot);
    TRY(set_clock(shot, points, problem));
    TRY(run_finely(shot, limits, progress, workspace, problem));
    closeup->impact = *shot->impact;
    return closeup_points(shot, &closeup->columns, problem);
}

Status closeup_make(const Simulation *simulation, size_t number, size_t points,
                    const SimulationLimits *limits, const Progress *progress, Workspace *workspace,
                    Closeup *closeup, Problem *problem) {
    Shot shot;
    memset(&shot, 0, sizeof shot);
    memset(closeup, 0, sizeof *closeup);
    const Status status =
        take(&shot, simulation, number, points, limits, progress, workspace, closeup, problem);
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
