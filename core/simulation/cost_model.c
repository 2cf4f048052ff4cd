// Predicted cost of a run, from the scene alone: no plan is made. All coefficients are measured, in
// solver steps of SOLVER_STEP. The number of contacts can only be estimated.
#include <math.h>

#include "core/simulation/internal.h"

static const double TURN = 6.28318530717958647693;

// Steps of the engine for one mass: a sample, a Taylor step, and an impact with the flight before
// and after it.
static const double SAMPLE = 0.08, SAMPLE_NEAR_STOPS = 0.15, ARC = 8, IMPACT = 50;
// A value of a channel: 2 ns a byte for memory that is new to the process, and its sum over modes.
static const double VALUE = 0.5, VALUE_MODE = 0.04;
// CPU time of a step that the solvers count, over SOLVER_STEP: exact, exact with a power law, and
// solvers that step. Measured by tests/bench/bench_cost.c.
static const double EXACT_STEP = 0.65, POWER_STEP = 0.75, STEPPED_STEP = 1.15;
static const double MODES = 2, FRAME = 100; // storeys cubed, storeys

// A random base: a value of the fade, a bin, a sample in memory that is new to the process, and a
// value of the transform of a block, which does not fit in the caches above FAST_COARSE.
static const double FADE = 0.07, NORMAL_PAIR = 0.25, NEW_SAMPLE = 0.14, COARSE = 0.08,
                    COARSE_DOUBLING = 0.06, FAST_COARSE = 1 << 18;
// When a block is made by a transform that is shorter (core/math/sparse_spectrum.c).
static const double SPARSE_BINS = 16, SPARSE_RATIO_MIN = 8, SPARSE_RATIO_MAX = 1024;
static const double RUN = 200; // plan, memory and summary
static const double RUN_BYTES = 1e5;
static const double FRAME_ARCS = 14, BLOW_ARCS = 5; // Taylor steps of a contact, of an impulse
static const double NEIGHBOUR = 1.6; // a frame with dampers and its companion until they diverge
static const double IMPACTS_A_CYCLE = 2;
static const double REACHING = 0.6;   // share of fast flight that no bound keeps from the stops
static const double FREE_CYCLES = 30; // after these free vibration does not reach the stops

// Masses whose clearance is small beside the motion stay in contact: half of the time where it is
// 1 / SMALL of the motion. Steps for a radian of their fastest motion, under linear and power laws.
static const double SMALL = 500, HELD_ARCS = 1.2, HELD_POWER = 0.5;
static const double POWER_STEPS = 12;    // of a contact under a power law
static const double HELD_ADAPTIVE = 150; // steps of a radian by the adaptive solver

// A contact under a power law: the share that does not depend on the tolerance, and the digits of
// full accuracy.
static const double EASY = 0.3, DIGITS = 15;

// A segment of a spectrum, per sample: window, trend, sums and the transform. Lengths up to
// CACHED_LENGTH fit in the caches; FFTW takes 1 to 25 ns a sample of them, and 3 to 10 times as
// long above if the length has a prime factor that large.
static const double CACHED_LENGTH = 4096, SEGMENT_SAMPLE = 0.4, SEGMENT_DOUBLING = 0.05;
static const double PRIME_SAMPLE = 1, PRIME_DOUBLING = 1.1;
static const double PLANNING = 8000, PRIME_PLANNING = 0.5; // steps; share of a transform

// Bytes per sample of a segment without and with a large prime factor (FFTW, window and sums).
static const double SEGMENT_BYTES = 48, PRIME_BYTES = 96;
static const double IMPACTS_KEPT = 1e5; // limit of the estimate of memory for impacts

// Taylor steps of flight where the fastest motion is shorter than a sample interval. There no bound
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

// The base's motion beside its samples: a random one is made of blocks (core/excitation/random.c),
// two at least, however short the run is.
static double cost_base(const Simulation *simulation, double *bytes) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const double samples = cost_base_samples(simulation);
    *bytes = 0;
    if (excitation_kind(excitation) != &excitation_random || samples == 0)
        return samples * excitation_kind(excitation)->effort;
    const RandomBlocks blocks = random_blocks((const ExcitationRandom *)(const void *)excitation);
    const double hop = (double)blocks.length / 2, bins = (double)(blocks.first_bin + blocks.bins);
    double coarse = (double)blocks.length;
    while (coarse >= SPARSE_BINS * bins && 2 * hop / coarse < SPARSE_RATIO_MAX)
        coarse /= 2;
    if (2 * hop / coarse < SPARSE_RATIO_MIN)
        coarse = 2 * hop;
    const double transform =
        coarse * (COARSE + COARSE_DOUBLING * fmax(log2(coarse / FAST_COARSE), 0));
    *bytes = sizeof(double) * (3 * coarse + hop + bins);
    return samples * excitation_kind(excitation)->effort + hop * FADE +
           NEW_SAMPLE * fmax(samples - FAST_COARSE / 2, 0) +
           (ceil(samples / hop) + 1) * ((double)blocks.bins * NORMAL_PAIR + transform);
}

// Each kink of the base between samples ends a Taylor step and starts another.
static double cost_base_arcs(const Simulation *simulation) {
    const double ratio =
        simulation_base_interval(simulation) * simulation->scene.sample_rate; // in sample intervals
    if (!(ratio > 0) || (ratio > 0.5 && fabs(ratio - nearbyint(ratio)) < 1e-9 * ratio))
        return 0;
    return cost_base_samples(simulation) * (ratio < 1 ? 1 + ratio : 2);
}

static double cost_impacts(const Scene *scene, const StructureRates *rates) {
    const bool is_free = excitation_kind(scene_excitation(scene)) == &excitation_free;
    // Without a spring there is one slow movement.
    double rate = rates->slowest > 0 ? rates->slowest : TURN / scene->duration;
    const Excitation *excitation = scene_excitation(scene);
    if (excitation_kind(excitation)->fastest != NULL)
        rate = fmax(rate, fmin(excitation_kind(excitation)->fastest(excitation), 3 * rate));
    // Masses on a frame respond to its higher modes too.
    rate *= sqrt((double)structure_storeys(scene_structure(scene)));
    const double cycles = rate / TURN * scene->duration;
    return IMPACTS_A_CYCLE * (is_free ? fmin(cycles, FREE_CYCLES) : cycles) *
           (double)scene->dampers.count;
}

// About the largest displacement, if dampers did not change it.
static double cost_motion(const Scene *scene, const StructureRates *rates) {
    const Excitation *excitation = scene_excitation(scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    const double slowest = fmax(rates->slowest, 1 / scene->duration);
    double motion = 0, amplitude = 1;
    for (size_t i = 0; i < excitation->displacement.count; i++)
        motion = fmax(motion, fabs(excitation->displacement.at[i]));
    for (size_t i = 0; i < excitation->velocity.count; i++)
        motion = fmax(motion, fabs(excitation->velocity.at[i]) / slowest);
    if (kind->amplitude != 0)
        amplitude = *(const double *)(const void *)((const char *)excitation + kind->amplitude);
    return kind == &excitation_free ? motion : fmax(motion, fabs(amplitude) / (slowest * slowest));
}

// The fastest motion in contacts of a damper [rad/s]; 0: it is unknown.
static double cost_contact_rate(const Damper *damper, Side side) {
    const Buffer *buffer = damper_buffer(damper, side);
    if (buffer->contact_time > 0)
        return TURN / 2 / buffer->contact_time;
    return buffer->stiffness > 0 ? sqrt(buffer->stiffness / damper->mass) : 0;
}

// Time in contact as a share of the run, of the mass that is in contact longest, and the radians of
// its motion in a second.
static double cost_held(const Scene *scene, const StructureRates *rates, double *radians) {
    const double motion = cost_motion(scene, rates);
    double longest = 0;
    *radians = 0;
    for (size_t i = 0; i < scene->dampers.count && motion > 0; i++) {
        const Damper *damper = &scene->dampers.at[i];
        const double ratio = SMALL * damper->clearance / motion;
        const double share = 1 / (1 + ratio * ratio);
        longest = fmax(longest, share);
        for (Side side = SIDE_LEFT; side <= SIDE_RIGHT; side++)
            *radians = fmax(*radians, share * cost_contact_rate(damper, side));
    }
    return longest;
}

// plan_is_single() without a plan.
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

double cost_step(const Simulation *simulation) {
    if (simulation_solver(simulation)->cost != NULL)
        return STEPPED_STEP;
    return simulation->scene.dampers.count > 0 && simulation_law(simulation)->form == CONTACT_POWER
               ? POWER_STEP
               : EXACT_STEP;
}

// Steps that the exact solver counts.
static double cost_exact_steps(const Simulation *simulation, bool *is_fast) {
    const Scene *scene = &simulation->scene;
    const Structure *structure = scene_structure(scene);
    const size_t n = simulation_modes(simulation, structure_storeys(structure)),
                 m = scene->dampers.count;
    const bool is_coupled = n > 1 && isnan(structure->damping_ratio);
    StructureRates rates;
    if (structure_rates(structure, n, &rates) != STATUS_OK)
        rates = (StructureRates){0}; // without memory: the run reports it
    const double samples = (double)scene_sample_count(scene);
    double radians;
    const double held = cost_held(scene, &rates, &radians);
    const ContactForm form = simulation_law(simulation)->form;
    double arcs = cost_flight_arcs(scene, &rates) + cost_base_arcs(simulation);
    // One mass in contact has a closed form for each sample interval.
    if (form == CONTACT_LINEAR)
        arcs += cost_is_single(scene) ? held * samples : HELD_ARCS * radians * scene->duration;
    const double impacts = cost_impacts(scene, &rates);
    *is_fast = arcs > samples;
    if (cost_is_single(scene))
        return samples * (m > 0 ? SAMPLE_NEAR_STOPS : SAMPLE) + ARC * arcs + IMPACT * impacts;
    const double digits = -log10(exact_tolerance(simulation_settings(simulation)));
    const double arc = step_work_steps(STEP_WORK_ARC, n, m, is_coupled);
    const double event = step_work_steps(STEP_WORK_EVENT, n, m, is_coupled);
    const double flight = step_work_steps(STEP_WORK_FLIGHT, n, m, is_coupled);
    const double contact = form == CONTACT_POWER
                               ? step_work_steps(STEP_WORK_POWER, n, m, is_coupled) *
                                     (EASY + (1 - EASY) * digits / DIGITS)
                           : form == CONTACT_IMPULSIVE ? BLOW_ARCS * arc
                                                       : FRAME_ARCS * arc;
    const double steps =
        form == CONTACT_POWER ? held * samples + HELD_POWER * radians * scene->duration : 0;
    return (m > 0 ? NEIGHBOUR : 1) *
           (steps * step_work_steps(STEP_WORK_POWER, n, m, is_coupled) / POWER_STEPS +
            samples * flight + arcs * arc + impacts * (contact + 2 * event + 2 * arc));
}

double cost_truncation(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const Excitation *excitation = scene_excitation(scene);
    const Structure *structure = scene_structure(scene);
    StructureRates rates;
    if (structure_rates(structure, SIZE_MAX, &rates) != STATUS_OK)
        rates = (StructureRates){0}; // without memory: the run reports it
    const double own = excitation_kind(excitation)->fastest != NULL
                           ? excitation_kind(excitation)->fastest(excitation)
                           : 0;
    return truncation_cost(scene->duration, scene->sample_rate,
                           simulation_base_interval(simulation), fmax(own, rates.fastest),
                           structure_storeys(structure)) +
           cost_base(simulation, &(double){0});
}

// Steps of a solver with its own cost function.
static double cost_own_steps(const Simulation *simulation) {
    Plan *plan;
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (plan_sketch(&simulation->scene, simulation_modes(simulation, storeys), &plan) != STATUS_OK)
        return 0; // the run reports why
    const Solver *solver = simulation_solver(simulation);
    double steps = solver->cost(solver, simulation_settings(simulation),
                                simulation_base_interval(simulation), plan);
    plan_free(plan);
    StructureRates rates;
    if (solver == &solver_adaptive &&
        structure_rates(scene_structure(&simulation->scene), SIZE_MAX, &rates) == STATUS_OK) {
        // The others take steps of the same length in a contact.
        double radians;
        (void)cost_held(&simulation->scene, &rates, &radians);
        steps += HELD_ADAPTIVE * radians * simulation->scene.duration;
    }
    return steps;
}

// The largest prime factor of a length over CACHED_LENGTH, at least 1.
static double cost_prime_ratio(uint64_t length) {
    uint64_t left = length;
    for (uint64_t factor = 2; factor * factor <= left; factor++)
        while (left % factor == 0 && left > factor)
            left /= factor;
    return fmax((double)left / CACHED_LENGTH, 1);
}

double cost_spectra(const SpectrumRequest *psd, size_t samples) {
    if (psd->channels.count == 0 || psd->segment <= psd->overlap)
        return 0;
    const double length = (double)psd->segment, prime = cost_prime_ratio(psd->segment);
    const double doublings = fmax(log2(length / CACHED_LENGTH), 0);
    double sample = SEGMENT_SAMPLE + SEGMENT_DOUBLING * doublings, planning = PLANNING;
    if (prime > 1) {
        const double own = PRIME_SAMPLE + PRIME_DOUBLING * (1 + log2(prime));
        sample += own;
        planning += PRIME_PLANNING * own * length;
    }
    const double transformed =
        (double)psd->channels.count * length / (length - (double)psd->overlap);
    return (double)samples * sample * transformed + planning;
}

// Memory of series and hidden columns, of the base and its refinement, matrices, impacts, spectra
// and their stored form.
static void cost_add_bytes(const Simulation *simulation, Cost *cost) {
    const Scene *scene = &simulation->scene;
    const Output *output = &simulation->output;
    const SpectrumRequest *psd = &output->psd;
    const double samples = (double)scene_sample_count(scene), base = cost_base_samples(simulation);
    const double columns = (double)(output->channels.count + psd->channels.count);
    const double refined = base > 0 && base < samples ? samples : 0;
    const double size =
        (double)structure_storeys(scene_structure(scene)) + (double)scene->dampers.count;
    StructureRates rates;
    if (structure_rates(scene_structure(scene), SIZE_MAX, &rates) != STATUS_OK)
        rates = (StructureRates){0};
    cost->bytes = RUN_BYTES +
                  sizeof(double) * (samples * columns + base + refined + 60 * size * size) +
                  sizeof(Impact) * fmin(cost_impacts(scene, &rates), IMPACTS_KEPT);
    if (psd->channels.count == 0)
        return;
    const double values = (double)(psd->channels.count + 1) * (double)(psd->segment / 2 + 1);
    cost->document_bytes = sizeof(double) * values;
    cost->spectra_bytes =
        (cost_prime_ratio(psd->segment) > 1 ? PRIME_BYTES : SEGMENT_BYTES) * (double)psd->segment +
        sizeof(double) * values + cost->document_bytes;
    cost->bytes += cost->spectra_bytes;
}

Cost cost_scene(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const Output *output = &simulation->output;
    const double samples = (double)scene_sample_count(scene);
    const double storeys = (double)structure_storeys(scene_structure(scene));
    const double modes = storeys > 1 ? storeys : 0;
    const double channel = samples * (VALUE + VALUE_MODE * modes);
    Cost cost = {.spectra = cost_spectra(&output->psd, scene_sample_count(scene)) +
                            channel * (double)output->psd.channels.count,
                 .output = channel * (double)output->channels.count};
    double base_bytes;
    cost.base = cost_base(simulation, &base_bytes);
    cost_add_bytes(simulation, &cost);
    cost.bytes += base_bytes;
    if (simulation_modes(simulation, structure_storeys(scene_structure(scene))) <
        structure_storeys(scene_structure(scene)))
        cost.steps = cost_truncation(simulation);
    cost.steps += RUN + cost.output + cost.spectra + cost.base + FRAME * modes +
                  MODES * modes * modes * modes +
                  cost_step(simulation) * (simulation_solver(simulation)->cost != NULL
                                               ? cost_own_steps(simulation)
                                               : cost_exact_steps(simulation, &cost.is_fast));
    cost.cpu_seconds = cost.steps * SOLVER_STEP;
    return cost;
}
