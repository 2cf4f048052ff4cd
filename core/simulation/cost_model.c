// What a run will take, before anything runs: from what the scene says, without making its plan.
// The parts' costs are as measured; how many contacts there will be can only be guessed.
#include <math.h>

#include "core/simulation/internal.h"
#include "core/solve/exact_accuracy.h"
#include "core/solve/step_work.h"

static const double TURN = 6.28318530717958647693;

// In solver steps: a sample of the engine for one mass, an arc, and an impact, which is flight up
// to it, contact and flight after it.
static const double SAMPLE = 0.08, SAMPLE_NEAR_STOPS = 0.15, ARC = 8, IMPACT = 50;
static const double VALUE = 0.02;                   // of a channel, at one sample
static const double TRANSFORMED = 0.4;              // of a spectrum, once
static const double MODES = 2;                      // of a storey cubed
static const double RUN = 200;                      // plan, room and summary
static const double FRAME_ARCS = 14, BLOW_ARCS = 5; // of an impact in a frame, of one by impulse
static const double NEIGHBOUR = 1.6; // of a frame with dampers, and its neighbour until they part
static const double IMPACTS_A_CYCLE = 2;
static const double TRANSFORM = 8000; // the first time, because it is planned then
static const double REACHING = 0.3;   // of fast flight, where no bound keeps it from the stops
static const double FREE_CYCLES = 30; // after which free vibration does not reach the stops

// Of a contact under a power law, what it takes whatever its tolerance; and the digits of the
// whole.
static const double EASY = 0.3, DIGITS = 15;

static const double IMPACTS_KEPT = 1e5; // more are hardly meant

// What the exact solver will meet.
typedef struct Outlook {
    size_t modes; // of a frame
    double samples, arcs, impacts, digits;
    bool is_coupled;
} Outlook;

// Arcs of flight where a sample interval is longer than the fastest motion in it: there no bound
// shows that the stops are out of reach, and coupled modes have no closed form for a whole
// interval.
static double cost_flight_arcs(const Scene *scene, const StructureRates *rates) {
    const Excitation *excitation = scene_excitation(scene);
    double rate = rates->fastest;
    if (excitation_kind(excitation)->fastest != NULL)
        rate = fmax(rate, excitation_kind(excitation)->fastest(excitation));
    const Structure *structure = scene_structure(scene);
    const bool is_by_arcs = scene->dampers.count > 0 ||
                            (structure_storeys(structure) > 1 && isnan(structure->damping_ratio));
    return is_by_arcs && rate > scene->sample_rate ? REACHING * rate * scene->duration : 0;
}

// Samples of the base within the run.
static double cost_base_samples(const Simulation *simulation) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    const double interval = simulation_base_interval(simulation);
    if (!(interval > 0))
        return 0;
    const double lasts = kind->lasts != NULL ? kind->lasts(excitation) : INFINITY;
    return fmin(lasts, simulation->scene.duration) / interval;
}

// Kinks of the base that do not lie at samples end an arc each, and have another begin.
static double cost_base_arcs(const Simulation *simulation) {
    const double ratio =
        simulation_base_interval(simulation) * simulation->scene.sample_rate; // in sample intervals
    if (!(ratio > 0) || (ratio > 0.5 && fabs(ratio - nearbyint(ratio)) < 1e-9 * ratio))
        return 0;
    return cost_base_samples(simulation) * (ratio < 1 ? 1 + ratio : 2);
}

static double cost_impacts(const Scene *scene, const StructureRates *rates) {
    const bool is_free = excitation_kind(scene_excitation(scene)) == &excitation_free;
    // What has no spring moves with the duration.
    double rate = rates->slowest > 0 ? rates->slowest : TURN / scene->duration;
    const Excitation *excitation = scene_excitation(scene);
    if (excitation_kind(excitation)->fastest != NULL)
        rate = fmax(rate, fmin(excitation_kind(excitation)->fastest(excitation), 3 * rate));
    // Masses on a frame feel its higher modes as well.
    rate *= sqrt((double)structure_storeys(scene_structure(scene)));
    const double cycles = rate / TURN * scene->duration;
    return IMPACTS_A_CYCLE * (is_free ? fmin(cycles, FREE_CYCLES) : cycles) *
           (double)scene->dampers.count;
}

static double cost_frame_steps(const Scene *scene, const Outlook *outlook) {
    const size_t n = outlook->modes, m = scene->dampers.count;
    const bool is_coupled = outlook->is_coupled;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    const double arc = step_work_steps(STEP_WORK_ARC, n, m, is_coupled);
    const double event = step_work_steps(STEP_WORK_EVENT, n, m, is_coupled);
    const double flight = step_work_steps(STEP_WORK_FLIGHT, n, m, is_coupled);
    const double contact = law->form == CONTACT_POWER
                               ? step_work_steps(STEP_WORK_POWER, n, m, is_coupled) *
                                     (EASY + (1 - EASY) * outlook->digits / DIGITS)
                           : law->form == CONTACT_IMPULSIVE ? BLOW_ARCS * arc
                                                            : FRAME_ARCS * arc;
    return (m > 0 ? NEIGHBOUR : 1) * (outlook->samples * flight + outlook->arcs * arc +
                                      outlook->impacts * (contact + 2 * event + 2 * arc));
}

// Whether the engine for one mass serves, as plan_is_single will say.
static bool cost_is_single(const Scene *scene) {
    const Structure *structure = scene_structure(scene);
    if (structure_storeys(structure) > 1 || scene->dampers.count > 1)
        return false;
    if (scene->dampers.count == 0)
        return true;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    const Damper *damper = &scene->dampers.at[0];
    return law->form != CONTACT_POWER &&
           (law->form == CONTACT_IMPULSIVE ||
            scene_contact(scene)->separation == SEPARATION_ZERO_PENETRATION) &&
           damper_buffer(damper, SIDE_LEFT)->table.count == 0 &&
           damper_buffer(damper, SIDE_RIGHT)->table.count == 0;
}

// Steps of the exact solver.
static double cost_exact_steps(const Simulation *simulation, bool *is_fast) {
    const Scene *scene = &simulation->scene;
    const Structure *structure = scene_structure(scene);
    const size_t modes = simulation_modes(simulation, structure_storeys(structure));
    StructureRates rates;
    if (structure_rates_of(structure, modes, &rates) != STATUS_OK)
        rates = (StructureRates){0}; // a guess without memory: the run will tell
    const Outlook outlook = {.modes = modes,
                             .digits = -log10(exact_tolerance(simulation_settings(simulation))),
                             .samples = (double)scene_sample_count(scene),
                             .arcs = cost_flight_arcs(scene, &rates) + cost_base_arcs(simulation),
                             .impacts = cost_impacts(scene, &rates),
                             .is_coupled = modes > 1 && isnan(structure->damping_ratio)};
    *is_fast = outlook.arcs > outlook.samples;
    if (!cost_is_single(scene))
        return cost_frame_steps(scene, &outlook);
    return outlook.samples * (scene->dampers.count > 0 ? SAMPLE_NEAR_STOPS : SAMPLE) +
           ARC * outlook.arcs + IMPACT * outlook.impacts;
}

// Steps of a solver that knows its own cost.
static double cost_own_steps(const Simulation *simulation) {
    Plan *plan;
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (plan_sketch(&simulation->scene, simulation_modes(simulation, storeys), &plan) != STATUS_OK)
        return 0; // the run will tell why
    const double steps =
        simulation_solver(simulation)
            ->cost(simulation_settings(simulation), simulation_base_interval(simulation), plan);
    plan_free(plan);
    return steps;
}

// How often Welch's method cost_transforms a sample.
static double cost_transforms(const SpectrumRequest *psd) {
    if (psd->channels.count == 0 || psd->segment <= psd->overlap)
        return 0;
    return (double)psd->channels.count * (double)psd->segment /
           (double)(psd->segment - psd->overlap);
}

// Series and hidden columns, the base and what a coarse one is refined to, matrices, the ledger.
static double cost_bytes(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const Output *output = &simulation->output;
    const double samples = (double)scene_sample_count(scene), base = cost_base_samples(simulation);
    const double columns = (double)(output->channels.count + output->psd.channels.count);
    const double refined = base > 0 && base < samples ? samples : 0;
    const double size =
        (double)structure_storeys(scene_structure(scene)) + (double)scene->dampers.count;
    StructureRates rates;
    if (structure_rates(scene_structure(scene), &rates) != STATUS_OK)
        rates = (StructureRates){0};
    return sizeof(Outcome) +
           sizeof(double) * (samples * columns + base + refined + 60 * size * size) +
           sizeof(Impact) * fmin(cost_impacts(scene, &rates), IMPACTS_KEPT);
}

Cost cost_scene(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const Output *output = &simulation->output;
    const double samples = (double)scene_sample_count(scene);
    const double storeys = (double)structure_storeys(scene_structure(scene));
    const double columns = (double)(output->channels.count + output->psd.channels.count);
    Cost cost = {.bytes = cost_bytes(simulation)};
    cost.spectra = samples * TRANSFORMED * cost_transforms(&output->psd) +
                   (output->psd.channels.count > 0 ? TRANSFORM : 0);
    cost.base = cost_base_samples(simulation) * excitation_kind(scene_excitation(scene))->effort;
    cost.steps =
        RUN + samples * VALUE * columns + cost.spectra + cost.base +
        (storeys > 1 ? MODES * storeys * storeys * storeys : 0) +
        (simulation_solver(simulation)->cost != NULL ? cost_own_steps(simulation)
                                                     : cost_exact_steps(simulation, &cost.is_fast));
    cost.cpu_seconds = cost.steps * SOLVER_STEP;
    return cost;
}
