// Scenes drawn at random for the judges, and what the solvers make of them.
#include "tests/truth/drawn.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/excitation/recorded_motion.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"

uint64_t draws_bits(Draws *draws) {
    uint64_t z = draws->state += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
}

double draws_uniform(Draws *draws, double a, double b) {
    return a + (b - a) * (double)(draws_bits(draws) >> 11) * 0x1p-53;
}

double draws_scattered(Draws *draws, double a, double b) {
    return a * pow(b / a, draws_uniform(draws, 0, 1));
}

bool draws_chance(Draws *draws, double p) {
    return draws_uniform(draws, 0, 1) < p;
}

static const double TURN = 6.283185307179586;

void drawn_scene(ReferenceScene *scene, uint64_t number, double duration) {
    memset(scene, 0, sizeof *scene);
    Draws own = {number * 0x2545f4914f6cdd1dU}, *draws = &own;
    const double reach = draws_scattered(draws, 1e-3, 0.1),
                 omega = TURN * draws_scattered(draws, 0.3, 15);
    scene->mass = draws_scattered(draws, 0.1, 100);
    scene->stiffness = draws_chance(draws, 0.07) ? 0 : scene->mass * omega * omega;
    scene->damping = 2 * scene->mass * omega *
                     (draws_chance(draws, scene->stiffness == 0 ? 0.5 : 0.1) ? 0
                      : draws_chance(draws, 0.05) ? draws_uniform(draws, 1, 3)
                                                  : draws_scattered(draws, 1e-3, 0.2));
    scene->damper_mass = scene->mass * draws_scattered(draws, 1e-3, 10);
    scene->clearance = reach * draws_uniform(draws, 0.05, 2);
    scene->is_impulse = draws_chance(draws, 0.4);
    if (!scene->is_impulse && draws_chance(draws, 0.05))
        scene->clearance = 0;
    scene->offset = draws_chance(draws, 0.2) ? reach * draws_uniform(draws, -1, 1) : 0;
    scene->position =
        draws_chance(draws, 0.4) ? scene->clearance * draws_uniform(draws, -0.5, 0.5) : 0;
    scene->relative_velocity =
        draws_chance(draws, 0.4) ? reach * omega * draws_uniform(draws, -1, 1) : 0;
    const bool is_uneven = draws_chance(draws, 0.3);
    for (int side = 0; side < 2; side++) {
        scene->restitution[side] = draws_uniform(draws, 0.1, 0.97);
        scene->contact_time[side] = draws_scattered(draws, 3e-5, 5e-2);
        if (!is_uneven && side == 1) {
            scene->restitution[1] = scene->restitution[0];
            scene->contact_time[1] = scene->contact_time[0];
        }
    }
    const double rates[] = {1000, 1000, 1000, 1000, 200, 50, 20, 333, 5000, 1234.5};
    scene->sample_rate = rates[draws_bits(draws) % COUNT(rates)];
    scene->duration = duration;
    scene->base = (ReferenceBase)(draws_bits(draws) % 3);
    if (scene->base == REFERENCE_STILL || draws_chance(draws, 0.3)) {
        scene->displacement = reach * draws_uniform(draws, -1, 1);
        scene->velocity =
            draws_chance(draws, 0.5) ? reach * omega * draws_uniform(draws, -1, 1) : 0;
    }
    const double level = reach * omega * omega * draws_scattered(draws, 0.03, 2);
    if (scene->base == REFERENCE_SINE) {
        scene->frequency = draws_chance(draws, 0.1) ? draws_scattered(draws, 20, 400)
                                                    : draws_scattered(draws, 0.2, 20);
        scene->is_amplitude_displacement = draws_chance(draws, 0.4);
        scene->amplitude =
            scene->is_amplitude_displacement ? level / pow(TURN * scene->frequency, 2) : level;
    }
    if (scene->base == REFERENCE_RECORD) {
        const double intervals[] = {1e-3, 0.005, 0.01, 0.0123, 1 / 300.0, 0.0007, 0.02, 0.11};
        scene->interval = draws_chance(draws, 0.2)
                              ? 1 / scene->sample_rate
                              : intervals[draws_bits(draws) % COUNT(intervals)];
        const double length =
            draws_chance(draws, 0.4) ? duration * draws_uniform(draws, 0.07, 0.93) : duration + 0.1;
        scene->sample_count = (size_t)(length / scene->interval) + 2;
        double *samples = malloc(scene->sample_count * sizeof *samples);
        if (samples == NULL)
            abort();
        const double memory = exp(-scene->interval * omega);
        double value = 0;
        for (size_t i = 0; i < scene->sample_count; i++) {
            value =
                memory * value + sqrt(1 - memory * memory) * level *
                                     (draws_uniform(draws, -1, 1) + draws_uniform(draws, -1, 1));
            samples[i] = value;
        }
        scene->samples = samples;
    }
}

// SEPARATION_ZERO_FORCE by its name; -1 where the product does not offer it.
static int zero_force(void) {
    for (int i = 0; separation_names[i] != NULL; i++)
        if (strcmp(separation_names[i], "zero_force") == 0)
            return i;
    return -1;
}

bool drawn_zero_force(ReferenceScene *scene, uint64_t number) {
    Draws draws = {number * 0x9e3779b97f4a7c15U};
    scene->is_zero_force = !scene->is_impulse && zero_force() >= 0 && draws_chance(&draws, 0.5);
    return scene->is_zero_force;
}

void drawn_clear(ReferenceScene *scene) {
    free((void *)(uintptr_t)scene->samples);
    scene->samples = NULL;
}

void drawn_print(const ReferenceScene *scene) {
    printf(
        "    M %.17g K %.17g C %.17g m %.17g d %.17g offset %.17g position %.17g velocity %.17g\n"
        "    %s e %.17g %.17g T_c %.17g %.17g x0 %.17g v0 %.17g\n"
        "    base %d frequency %.17g amplitude %.17g %d samples %zu interval %.17g rate %.17g\n",
        scene->mass, scene->stiffness, scene->damping, scene->damper_mass, scene->clearance,
        scene->offset, scene->position, scene->relative_velocity,
        scene->is_impulse      ? "impulse"
        : scene->is_zero_force ? "zero_force"
                               : "spring_damper",
        scene->restitution[0], scene->restitution[1], scene->contact_time[0],
        scene->contact_time[1], scene->displacement, scene->velocity, (int)scene->base,
        scene->frequency, scene->amplitude, scene->is_amplitude_displacement, scene->sample_count,
        scene->interval, scene->sample_rate);
}

static const char *const wanted[REFERENCE_CHANNELS] = {
    "displacement",        "velocity",        "acceleration",  "mean_acceleration",
    "damper_displacement", "damper_velocity", "contact_force",
};

void drawn_simulation(const ReferenceScene *scene, bool has_channels, Simulation *out) {
    Simulation simulation;
    paper_scene(&simulation, scene->restitution[0], scene->contact_time[0], scene->duration);
    SdofStructure *structure = (SdofStructure *)(void *)simulation.scene.structure;
    structure->mass = scene->mass;
    structure->stiffness = scene->stiffness;
    structure->damping = scene->damping;
    Damper *damper = &simulation.scene.dampers.at[0];
    damper->mass = scene->damper_mass;
    damper->clearance = scene->clearance;
    damper->offset = scene->offset;
    damper->position = scene->position;
    damper->velocity = scene->relative_velocity;
    damper->left_buffer = damper->buffer;
    damper->right_buffer = damper->buffer;
    damper->right_buffer.restitution = scene->restitution[1];
    damper->right_buffer.contact_time = scene->contact_time[1];
    damper->buffer.restitution = damper->buffer.contact_time = NAN;
    simulation.scene.sample_rate = scene->sample_rate;
    if (scene->base == REFERENCE_SINE) {
        paper_sine(&simulation, scene->amplitude, scene->frequency);
        ((ExcitationSine *)(void *)simulation.scene.excitation)->quantity =
            scene->is_amplitude_displacement ? SINE_DISPLACEMENT : SINE_ACCELERATION;
    } else if (scene->base == REFERENCE_RECORD) {
        variant_free(simulation.scene.excitation);
        ExcitationRecord *record = (ExcitationRecord *)(void *)variant_new(&excitation_record.kind);
        if (record == NULL ||
            (record->samples.at = malloc(scene->sample_count * sizeof(double))) == NULL)
            abort();
        memcpy(record->samples.at, scene->samples, scene->sample_count * sizeof(double));
        record->samples.count = scene->sample_count;
        record->interval = scene->interval;
        simulation.scene.excitation = (Variant *)(void *)record;
    }
    scene_start(&simulation, scene->displacement, scene->velocity);
    paper_model(&simulation, scene->is_impulse ? "impulse" : "spring_damper");
    if (scene->is_zero_force)
        ((Contact *)(void *)simulation.scene.contact)->separation = zero_force();
    paper_channels(&simulation, wanted, has_channels ? COUNT(wanted) : 0);
    paper_no_psd(&simulation);
    *out = simulation;
}

Outcome *drawn_run(const ReferenceScene *scene, bool has_channels) {
    static Problem problem;
    Simulation simulation;
    drawn_simulation(scene, has_channels, &simulation);
    Outcome *outcome = NULL;
    problem_clear(&problem);
    if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        printf("  refused: %s %s %s\n", problem.detail,
               problem.count > 0 ? problem.faults[0].pointer : "",
               problem.count > 0 ? problem.faults[0].detail : "");
    simulation_clear(&simulation);
    return outcome;
}

bool drawn_answer(const Outcome *outcome, ReferenceAnswer *answer) {
    memset(answer, 0, sizeof *answer);
    answer->count = outcome->response.count;
    for (size_t i = 0; i < REFERENCE_CHANNELS; i++) {
        const Column *column = columns_find(&outcome->response.series, wanted[i]);
        if (column == NULL ||
            (answer->channels[i] = malloc(answer->count * sizeof(double))) == NULL)
            return false;
        memcpy(answer->channels[i], column->values, answer->count * sizeof(double));
    }
    const Impacts *impacts = &outcome->response.impacts;
    if ((answer->impacts = calloc(impacts->count + 1, sizeof *answer->impacts)) == NULL)
        return false;
    answer->impact_count = impacts->count;
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *from = &impacts->at[i];
        answer->impacts[i] = (ReferenceImpact){from->kind == IMPACT_RESTING,
                                               from->side,
                                               from->start,
                                               from->end,
                                               from->approach_speed,
                                               from->separation_speed,
                                               from->peak_force,
                                               from->impulse,
                                               from->energy_lost};
    }
    answer->is_whole = true;
    return true;
}
