// Predicted cost of a run, from the scene alone: no plan is made. All coefficients are measured, in
// solver steps of SOLVER_STEP. The number of contacts can only be estimated.
#include <math.h>

#include "core/simulation/internal.h"

static const double TURN = 6.28318530717958647693;

// Steps of the engine for one mass: a sample, a Taylor step, and an impact with the flight before
// and after it.
static const double SAMPLE = 0.08, SAMPLE_NEAR_STOPS = 0.15, SAMPLE_OF_PULSE = 3.3, IMPACT = 50;
// A value of a channel: 1 ns a byte for memory that is new to the process, and its sum over modes.
static const double VALUE = 0.25, VALUE_MODE = 0.04;
// CPU time of a step that the solvers count, over SOLVER_STEP: exact, with several masses on
// one storey, with a power law, and solvers that step. Measured by tests/bench/bench_cost.c.
static const double EXACT_STEP = 0.65, MASSES_STEP = 1.2, POWER_STEP = 0.75, STEPPED_STEP = 1.15;
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
static const double REACHING = 0.6;  // share of fast flight that no bound keeps from the stops

// One mass over a sample interval too long for blocks, and pressed against a stiff stop.
static const double LONG_SAMPLE = 8, HELD_BLOCK = 0.6, HELD_PIECES = 16, HELD_SAMPLE = 90,
                    HELD_RADIAN = 1.7, PIECE = 5, LONG_FLIGHT = 2;
static const double FEW_RADIANS = 24; // of a sample interval in contact, without the event engine
static const double BLOCK_RADIANS = 0.125; // the longest interval for blocks (core/solve/lanes.c)
static const double RESONANT = 1.25;       // from a band's edge to a frequency that it excites
static const double CROSSED = 4;           // clearances that a motion crosses surely
static const double FREE_CYCLES = 30;      // vibration lasts at least so long
// An impulse is followed by others down to this speed, as a part of that of the motion.
static const double SLOWEST_BOUNCE = 1e-9;
static const double BOUNCES_MAX = 1e4;
static const double EARLIER = 0.7; // bounces end so, over those of the largest motion
static const double RINGING = 17;  // -log of the part of a contact's motion that is seen
// Steps for a radian of a contact's motion, under linear and power laws.
static const double HELD_ARCS = 1.2, HELD_POWER = 0.5;
static const double RINGING_ARC = 2; // with a long step tried in vain, over an arc
// Of more modes steps in contact have few lengths (core/solve/sustained_contact.c).
enum { FEW_MODES = 24 };
static const double EASY_STEP = 0.4;  // over a sample of an impact, over others under a power law
static const double DAMPED = 0.3;     // steps of a damped power law, per (1 - e) / e
static const double POWER_STEPS = 12; // of a contact under a power law

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

// Kinks of the base lie between samples.
static bool cost_is_kinked(const Simulation *simulation) {
    const double ratio =
        simulation_base_interval(simulation) * simulation->scene.sample_rate; // in sample intervals
    return ratio > 0 && !(ratio > 0.5 && fabs(ratio - nearbyint(ratio)) < 1e-9 * ratio);
}

// The highest of the base's main frequencies [rad/s]; 0: unknown.
static double cost_base_top(const Scene *scene) {
    const Excitation *excitation = scene_excitation(scene);
    double band[2] = {0};
    if (excitation_kind(excitation)->band != NULL)
        (void)excitation_kind(excitation)->band(excitation, band);
    return band[1];
}

// Of a sine [rad/s]; 0: another base.
static double cost_base_rate(const Scene *scene) {
    return excitation_kind(scene_excitation(scene)) == &excitation_sine ? cost_base_top(scene) : 0;
}

// The fastest motion in flight [rad/s].
static double cost_fastest(const Scene *scene, const StructureRates *rates) {
    return fmax(rates->fastest, cost_base_rate(scene));
}

// Taylor steps of flight. Kinks between samples end a step and start another, and then no interval
// is taken as a whole; nor is it where the fastest motion is shorter than an interval: there no
// bound shows that the stops are out of reach, and coupled modes have no closed form.
static double cost_flight_arcs(const Simulation *simulation, const StructureRates *rates) {
    const Scene *scene = &simulation->scene;
    const double rate = cost_fastest(scene, rates);
    if (cost_is_kinked(simulation))
        return 2 * cost_base_samples(simulation) + scene->duration * fmax(scene->sample_rate, rate);
    const Structure *structure = scene_structure(scene);
    const bool is_by_arcs = scene->dampers.count > 0 ||
                            (structure_storeys(structure) > 1 && isnan(structure->damping_ratio));
    return is_by_arcs && rate > scene->sample_rate ? REACHING * rate * scene->duration : 0;
}

// A motion as one sine.
typedef struct CostMotion {
    double amplitude; // without dampers [m]
    double rate;      // [rad/s]
    double lasts;     // [s]
} CostMotion;

// The structure's own vibration, and the base's as it carries the structure along.
static void cost_motions(const Scene *scene, const StructureRates *rates, double base,
                         const double band[2], CostMotion motions[2]) {
    const Excitation *excitation = scene_excitation(scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    const double damping = rates->damping_ratio, duration = scene->duration;
    const double own = fmax(rates->slowest, 1 / duration), start = fmin(rates->slowest / own, 1);
    const bool is_driven = kind->interval != NULL || kind == &excitation_sine;
    double amplitude = 0;
    for (size_t i = 0; i < excitation->displacement.count; i++)
        amplitude = fmax(amplitude, fabs(excitation->displacement.at[i]));
    for (size_t i = 0; i < excitation->velocity.count; i++)
        amplitude = fmax(amplitude, fabs(excitation->velocity.at[i]) / own);
    // The root mean square of its frequencies.
    const double pace = sqrt((band[0] * band[0] + band[0] * band[1] + band[1] * band[1]) / 3);
    double gain = own / fmax(pace, own);
    if (is_driven && band[0] < RESONANT * own &&
        own < RESONANT * band[1]) // as far as there is time
        gain = sqrt(gain * fmax(fmin(damping > 0 ? 1 / damping : INFINITY, own * duration), 1));
    motions[0] =
        (CostMotion){fmax(amplitude, start * start * gain * base / (own * own)), own, duration};
    if (!is_driven && damping > 0) { // it dies away
        double least = INFINITY;
        for (size_t i = 0; i < scene->dampers.count; i++)
            least = fmin(least, scene->dampers.at[i].clearance);
        const double fades = log(fmax(motions[0].amplitude / least, 1)) / (damping * own);
        motions[0].lasts = fmin(duration, fmax(fades, FREE_CYCLES * TURN / own));
    }
    const double carried = pow(fmin(own / pace, 1), 2);
    motions[1] = pace > 0 ? (CostMotion){carried * base / (pace * pace), pace,
                                         is_driven ? duration : fmin(duration, TURN / 2 / pace)}
                          : (CostMotion){0};
}

// The part of an irregular base that is just slow enough to push a mass through this clearance (of
// a flat band, X = a sqrt(w / width) / w^2), for its share of the acceleration.
static CostMotion cost_slow_motion(const Scene *scene, double base, const double band[2],
                                   double clearance) {
    const ExcitationKind *kind = excitation_kind(scene_excitation(scene));
    if (kind != &excitation_random && kind != &excitation_record)
        return (CostMotion){0};
    const double density = base / sqrt(band[1] - band[0]);
    const double rate = fmin(pow(density / (CROSSED * clearance), 2. / 3), band[1]);
    return rate > fmax(band[0], 1 / scene->duration)
               ? (CostMotion){density / pow(rate, 1.5), rate,
                              scene->duration * sqrt(rate / (band[1] - band[0]))}
               : (CostMotion){0};
}

// Work of contacts.
typedef struct CostContacts {
    double impacts; // of all masses
    // Of the mass with the most:
    double pressed; // time pressed against a stop [s]
    double touched; // time of impacts [s]
    double radians; // of the contact's motion
    double ringing; // of these, until what is left of the approach is below rounding
} CostContacts;

// A mass against the stop that pushes it leaves when the motion X sin(p) slows down, crosses to the
// other stop, where X (p - sin(p)) = 2 c, and bounces there until it rests: all in phases p, of
// which half a cycle has PI. Speeds are relative to that of the motion, whose acceleration pushes.
static CostContacts cost_contact(const Damper *damper, Side side, ContactForm form,
                                 const CostMotion *motion) {
    const Buffer *buffer = damper_buffer(damper, side);
    const double half = TURN / 2, e = fmin(fmax(buffer->restitution, 1e-3), 1 - 1e-6);
    const double crossing = cbrt(12 * damper->clearance / motion->amplitude);
    if (!(motion->amplitude > 0) || !(motion->rate > 0) || crossing > 2 * half)
        return (CostContacts){0};
    const double contact = form == CONTACT_IMPULSIVE  ? 0
                           : buffer->contact_time > 0 ? half / buffer->contact_time
                           : buffer->stiffness > 0    ? sqrt(buffer->stiffness / damper->mass)
                                                      : 0;
    const double speed = fmin(crossing * crossing / 2, 2); // of approach
    // A bounce takes longer than a contact, or the mass stays in contact.
    const double slowest = contact > 0 ? motion->rate / contact : SLOWEST_BOUNCE;
    const double room = fmax(half - crossing, 0);
    const double first = EARLIER * 2 * speed * e / (1 - e); // time of all bounces
    const double all = first * fmax(1 - slowest / speed, 0);
    double bounces = speed > slowest ? log(speed / slowest) / -log(e) : 0;
    if (all > room)
        bounces = fmin(bounces, log(1 - room / first) / log(e));
    const double halves = motion->rate * motion->lasts / half;
    const double impacts = halves * (1 + fmin(bounces, BOUNCES_MAX)) / 2;
    const double touched = contact > 0 ? impacts * half / contact : 0;
    const double pressed =
        fmax(fmin((room - all) / half * motion->lasts, motion->lasts - touched), 0);
    const double damped = form == CONTACT_POWER ? 1 + DAMPED * (1 / e - 1) : 1;
    return (CostContacts){.impacts = 2 * impacts,
                          .pressed = pressed,
                          .touched = touched,
                          .radians = (pressed + touched) * contact * damped,
                          .ringing = halves * half * RINGING / -log(e)};
}

static CostContacts cost_contacts(const Simulation *simulation, const StructureRates *rates) {
    const Scene *scene = &simulation->scene;
    const ContactForm form = simulation_law(simulation)->form;
    CostMotion motions[3];
    CostContacts sum = {0};
    // Once: a record looks at all of its samples.
    const Excitation *excitation = scene_excitation(scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    double band[2] = {0};
    const double base =
        scene->dampers.count > 0 && kind->band != NULL ? kind->band(excitation, band) : 0;
    cost_motions(scene, rates, base, band, motions);
    // Masses on a frame respond to its higher modes too.
    const double modes = sqrt((double)structure_storeys(scene_structure(scene)));
    for (size_t i = 0; i < scene->dampers.count; i++) {
        const Damper *damper = &scene->dampers.at[i];
        double impacts = 0, radians = 0;
        motions[2] = cost_slow_motion(scene, base, band, damper->clearance);
        for (size_t k = 0; k < 2 * COUNT(motions); k++) {
            const CostContacts one = cost_contact(damper, (Side)(k % 2), form, &motions[k / 2]);
            impacts = fmax(impacts, one.impacts);
            radians = fmax(radians, one.radians);
            sum.pressed = fmax(sum.pressed, one.pressed);
            sum.touched = fmax(sum.touched, one.touched);
            sum.ringing = fmax(sum.ringing, one.ringing);
        }
        sum.impacts += modes * impacts;
        sum.radians = hypot(sum.radians, radians); // steps are shared, but masses excite others
    }
    return sum;
}

// The share of the run during which a pulse acts.
static double cost_pulse(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const Excitation *excitation = scene_excitation(scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    const Base base = kind->form != NULL ? kind->form(excitation) : (Base){0};
    if (base.form != BASE_PIECES)
        return 0;
    const double end = fmin(base.pieces[base.piece_count - 1].time, scene->duration);
    return fmax(end - base.pieces[0].time, 0) / scene->duration;
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
    const size_t dampers = simulation->scene.dampers.count;
    if (dampers > 0 && simulation_law(simulation)->form == CONTACT_POWER)
        return POWER_STEP;
    return dampers > 1 && structure_storeys(scene_structure(&simulation->scene)) == 1 ? MASSES_STEP
                                                                                      : EXACT_STEP;
}

// Steps that the exact solver counts.
static double cost_exact_steps(const Simulation *simulation, const StructureRates *rates,
                               const CostContacts *work, bool *is_fast) {
    const Scene *scene = &simulation->scene;
    const Structure *structure = scene_structure(scene);
    const size_t n = simulation_modes(simulation, structure_storeys(structure)),
                 m = scene->dampers.count;
    const bool is_coupled = n > 1 && isnan(structure->damping_ratio);
    const double samples = (double)scene_sample_count(scene), rate = scene->sample_rate;
    const double fast = cost_fastest(scene, rates) / rate; // radians of a sample
    // Intervals between samples and kinks in which a mass is pressed.
    const double kinks = cost_is_kinked(simulation) ? 1 / simulation_base_interval(simulation) : 0;
    const double held = work->pressed * (rate + kinks);
    const ContactForm form = simulation_law(simulation)->form;
    double arcs = cost_flight_arcs(simulation, rates);
    *is_fast = arcs > samples;
    const double arc = step_work_steps(STEP_WORK_ARC, n, m, is_coupled);
    const double event = step_work_steps(STEP_WORK_EVENT, n, m, is_coupled);
    const double flight = step_work_steps(STEP_WORK_FLIGHT, n, m, is_coupled);
    if (cost_is_single(scene)) {
        const bool has_blocks = fast < BLOCK_RADIANS;
        const double sample = has_blocks ? (m == 0 ? SAMPLE : SAMPLE_NEAR_STOPS)
                                         : (m == 0 ? LONG_FLIGHT * flight : LONG_SAMPLE);
        const double stiff = held > 0 ? work->radians / held : 0; // radians of a sample in contact
        const double pressed = form == CONTACT_IMPULSIVE ? HELD_SAMPLE
                               : stiff < 1               ? HELD_BLOCK
                               : stiff < FEW_RADIANS     ? HELD_PIECES
                                                         : HELD_SAMPLE * (1 + HELD_RADIAN * fast);
        const double pulse = has_blocks ? cost_pulse(simulation) : 0;
        return samples * (sample + pulse * SAMPLE_OF_PULSE) + held * pressed +
               (m > 0 || has_blocks ? PIECE : arc) * arcs + IMPACT * work->impacts;
    }
    // One mass in contact has a closed form for an interval in which it does not ring.
    const double closed = RINGING_ARC * HELD_ARCS * work->ringing +
                          HELD_SAMPLE / arc * (1 + HELD_RADIAN * fast) * held;
    const double open = HELD_ARCS * work->radians;
    // A fast structure may excite the contact for ever: for many modes the lengths of the steps are
    // too long then, for few it is something between the two.
    if (form == CONTACT_LINEAR && m == 1 && closed < open)
        arcs += fmax(fast < 1 ? closed : n > FEW_MODES ? open : sqrt(closed * open), held);
    else if (form == CONTACT_LINEAR)
        arcs += fmax(open, held);
    else if (form == CONTACT_IMPULSIVE)
        arcs += held;
    const double digits = -log10(exact_tolerance(simulation_settings(simulation)));
    const double contact = form == CONTACT_POWER
                               ? step_work_steps(STEP_WORK_POWER, n, m, is_coupled) *
                                     (EASY + (1 - EASY) * digits / DIGITS)
                           : form == CONTACT_IMPULSIVE ? BLOW_ARCS * arc
                                                       : FRAME_ARCS * arc;
    const double touched = fmin(work->touched * rate, samples); // samples
    const double steps =
        form == CONTACT_POWER ? EASY_STEP * touched + held + HELD_POWER * work->radians : 0;
    return (m > 0 ? NEIGHBOUR : 1) *
           (steps * step_work_steps(STEP_WORK_POWER, n, m, is_coupled) / POWER_STEPS +
            samples * flight + arcs * arc + work->impacts * (contact + 2 * event + 2 * arc));
}

double cost_truncation(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    const Excitation *excitation = scene_excitation(scene);
    const Structure *structure = scene_structure(scene);
    StructureRates rates;
    if (structure_rates(structure, SIZE_MAX, &rates) != STATUS_OK)
        rates = (StructureRates){0}; // without memory: the run reports it
    const bool has_form = excitation_kind(excitation)->interval == NULL;
    return truncation_cost(scene->duration, scene->sample_rate,
                           simulation_base_interval(simulation),
                           fmax(has_form ? cost_base_top(scene) : 0, rates.fastest),
                           structure_storeys(structure)) +
           cost_base(simulation, &(double){0});
}

// Steps of a solver with its own cost function.
static double cost_own_steps(const Simulation *simulation, const CostContacts *work) {
    Plan *plan;
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (plan_sketch(&simulation->scene, simulation_modes(simulation, storeys), &plan) != STATUS_OK)
        return 0; // the run reports why
    const Solver *solver = simulation_solver(simulation);
    const SolverDemand demand = {.base_interval = simulation_base_interval(simulation),
                                 .base_rate = cost_base_rate(&simulation->scene),
                                 .impacts = work->impacts,
                                 .pressed = work->pressed,
                                 .radians = work->radians};
    const double steps = solver->cost(solver, simulation_settings(simulation), &demand, plan);
    plan_free(plan);
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
static void cost_add_bytes(const Simulation *simulation, double impacts, Cost *cost) {
    const Scene *scene = &simulation->scene;
    const Output *output = &simulation->output;
    const SpectrumRequest *psd = &output->psd;
    const double samples = (double)scene_sample_count(scene), base = cost_base_samples(simulation);
    const double columns = (double)(output->channels.count + psd->channels.count);
    const double refined = base > 0 && base < samples ? samples : 0;
    const double size =
        (double)structure_storeys(scene_structure(scene)) + (double)scene->dampers.count;
    cost->bytes = RUN_BYTES +
                  sizeof(double) * (samples * columns + base + refined + 60 * size * size) +
                  (output->impacts ? sizeof(Impact) * fmin(impacts, IMPACTS_KEPT) : 0);
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
    const size_t all = structure_storeys(scene_structure(scene)),
                 kept = simulation_modes(simulation, all);
    StructureRates rates;
    if (structure_rates(scene_structure(scene), kept, &rates) != STATUS_OK)
        rates = (StructureRates){0}; // without memory: the run reports it
    const CostContacts work = cost_contacts(simulation, &rates);
    double base_bytes;
    cost.base = cost_base(simulation, &base_bytes);
    cost_add_bytes(simulation, work.impacts, &cost);
    cost.bytes += base_bytes;
    const double solver = simulation_solver(simulation)->cost != NULL
                              ? cost_own_steps(simulation, &work)
                              : cost_exact_steps(simulation, &rates, &work, &cost.is_fast);
    cost.steps = RUN + cost.output + cost.spectra + cost.base + FRAME * modes +
                 MODES * modes * modes * modes + cost_step(simulation) * solver +
                 (kept < all ? cost_truncation(simulation) : 0);
    cost.cpu_seconds = cost.steps * SOLVER_STEP;
    return cost;
}
