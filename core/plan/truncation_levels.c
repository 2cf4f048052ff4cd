// With q'' + 2 s q' + w^2 q = -share a_g, by kind of excitation:
//
//   start     q swings with sqrt(q0^2 + (p0 / w)^2) and dies away with s
//   sine      follows as share A / (w^2 - W^2 + 2 i s W), and swings with what that lacks at t = 0;
//             both together at most as resonance lets it grow in the time there is
//   pulses    follow as share A / w^2 where slow beside the mode, and leave it swinging with what
//             the pulse's spectrum has at w
//   random    the density G at w lets the variance grow to share^2 G / (8 s w^2), as
//             1 - exp(-2 s t); a mode beyond the band follows
//   chirp     swings as passing its frequency lets it: 3.67 f / sqrt(Hz / s) times the static
//             answer, at most 1 / (2 xi) times; a mode beyond follows
//   record    integrated, mode by mode (truncation_record.c)
#include "core/plan/truncation_levels.h"

#include <math.h>
#include <stdlib.h>

#include "core/excitation/chirp.h"
#include "core/excitation/pulse.h"
#include "core/excitation/random.h"
#include "core/excitation/sine.h"
#include "core/plan/truncation_mode.h"

static const double pi = 3.14159265358979323846;
static const double RARE = 0.1; // of all runs: beyond what is "seldom"

// So much swings on for `time` until the run's end.
static void swing(Level *level, const Mode *mode, double peak, double time) {
    const double omega = omega_of(mode, mode->time);
    const double rms = peak * sqrt(kept(mode->slack, time) * time / (2 * mode->time));
    level->peak += peak;
    level->rms = hypot(level->rms, rms);
    level->accelerated =
        hypot(level->accelerated, square(omega) * mean_of(omega, mode->interval) * rms);
}

static void start(Level *level, const Mode *mode, double q, double p) {
    const double omega = omega_of(mode, mode->time), turn = mode->omega * mode->time;
    const double speed = fabs(p) / fmax(omega, mode->slack);
    const double reached = turn < pi / 2 ? sin(turn) : 1;
    level->start = q;
    swing(level, mode, hypot(q, p / omega), mode->time);
    // The first sample has no interval to take a mean over: it is q'' itself.
    const double first = square(mode->omega) * fabs(q) + 2 * mode->slack * fabs(p);
    level->accelerated = hypot(level->accelerated, first / sqrt(1 + mode->time / mode->interval));
    level->least = fmax(fabs(q), speed * (mode->omega > 0 ? reached : 1) *
                                     exp(-fmin(mode->slack / omega, 1) * pi / 2));
}

static void sine(Level *level, Wave *wave, const Mode *mode, const ExcitationSine *base) {
    const double turning = 2 * pi * base->frequency;
    const double size = fabs(base->amplitude) *
                        (base->quantity == SINE_DISPLACEMENT ? square(turning) : 1) *
                        fabs(mode->share);
    const double omega = omega_of(mode, mode->time);
    const double elastic = square(omega) - square(turning), viscous = 2 * mode->slack * turning;
    const double below = square(elastic) + square(viscous);
    const double phases[2] = {size * elastic / below, -size * viscous / below};
    const double steady = size / sqrt(below);
    const double lacking = hypot(phases[1], turning / omega * phases[0]);
    // Neither can resonance go beyond its time, nor the answer to a slow base beyond its static
    // one.
    const double grown = size * (fmin(mode->time, 1 / fmax(mode->slack, 1e-300)) / (2 * omega) +
                                 1.5 / square(omega));
    const double sign = mode->share < 0 ? 1 : -1;
    wave->rms = sqrt(0.5);
    wave->least = 1;
    wave->accelerated = square(turning) * mean_of(turning, mode->interval);
    if (steady + lacking > grown) {
        swing(level, mode, grown, mode->time);
        level->least = fmax(level->least, 0.4 * fmin(grown, steady));
        return;
    }
    level->pushed[0] = sign * phases[0];
    level->pushed[1] = sign * phases[1];
    swing(level, mode, lacking, mode->time);
    const double turned = fmax(omega, turning) * mode->time;
    level->least = fmax(level->least, steady * (turned < pi / 2 ? square(turned) / 3 : 1));
}

// A pulse whose spectrum leaves the mode swinging with `after`, and `within` while it lasts.
static void pulse(Level *level, Wave *wave, const Mode *mode, const ExcitationPulse *base,
                  double within, double after, bool is_slow) {
    const double time = mode->time - base->start, size = fabs(mode->share * base->amplitude);
    const double omega = omega_of(mode, mode->time), length = fmin(base->length, time);
    wave->rms = sqrt(fmax(length, 0) / (2 * mode->time));
    wave->least = length < base->length ? sin(pi / 2 * fmin(2 * length / base->length, 1)) : 1;
    wave->accelerated = square(pi / base->length);
    if (!(time > 0))
        return;
    if (is_slow)
        level->pushed[0] = -mode->share * base->amplitude / square(omega);
    const double swings = size * (time > base->length ? fmax(within, after) : within);
    swing(level, mode, swings, time);
    level->least =
        fmax(level->least, time > base->length
                               ? size * fmax(after, 0.5 / square(omega) * (is_slow ? 1 : 0))
                               : size * square(time) / 8);
}

static void half_sine(Level *level, Wave *wave, const Mode *mode, const ExcitationPulse *base) {
    const double omega = omega_of(mode, mode->time), turning = pi / base->length;
    const double ratio = turning / omega, impulse = 2 * base->length / (pi * omega);
    const bool is_slow = ratio < 0.8;
    const double lacking = ratio / fmax(fabs(square(omega) - square(turning)), 1e-300);
    const double after =
        fmin(2 * lacking * fabs(cos(omega * base->length / 2)), fmin(impulse, 1.8 / square(omega)));
    const double within =
        is_slow ? lacking + square(ratio) / square(omega) : fmin(1.8 / square(omega), impulse);
    pulse(level, wave, mode, base, within, after, is_slow);
}

static void triangle(Level *level, Wave *wave, const Mode *mode, const ExcitationPulse *base) {
    const double omega = omega_of(mode, mode->time), phase = omega * base->length / 2;
    const double kink = 2 / (base->length * omega * square(omega));
    const bool is_slow = phase > pi;
    const double after = fmin(4 * kink * square(sin(phase / 2)), base->length / (2 * omega));
    const double within = is_slow ? kink * fmax(1, hypot(1 - 2 * cos(phase), 2 * sin(phase)))
                                  : fmin(1.6 / square(omega), base->length / (2 * omega));
    pulse(level, wave, mode, base, within, after, is_slow);
}

// What lines between samples leave of a density at f, or make of one that they fold there.
static double folded(const ExcitationRandom *base, double f, double width) {
    const double away = fabs(f - base->rate * nearbyint(f / base->rate));
    const double turn = pi * f / base->rate, line = turn > 1e-6 ? sin(turn) / turn : 1;
    const double share =
        (atan((base->band.at[1] - away) / width) - atan((base->band.at[0] - away) / width)) / pi;
    return fmin(fmax(share, 0), 1) * square(square(line));
}

static void random_level(Level *level, Wave *wave, const Mode *mode, const ExcitationRandom *base) {
    enum { PARTS = 32 };
    const double f0 = base->band.at[0], f1 = base->band.at[1], wide = f1 - f0;
    const double omega = omega_of(mode, mode->time), f = omega / (2 * pi);
    const double width = (mode->slack + 1 / mode->time) / (2 * pi);
    const double density = square(base->rms) / wide, s = fmax(mode->slack, 1e-9 / mode->time);
    const bool is_beyond = f > f1 + width;
    double follows = 0, fourth = 0;
    for (int i = 0; i < PARTS; i++) {
        const double at = f0 + wide * (i + 0.5) / PARTS, w = 2 * pi * at;
        fourth += square(square(w)) / PARTS;
        if (!is_beyond && fabs(at - f) < fmax(0.3 * f, wide / PARTS))
            continue;
        follows += 1 / (square(square(omega) - square(w)) + square(4 * pi * width * w)) / PARTS;
    }
    const double share = square(mode->share), decay = 2 * s * mode->time;
    const double grows = share * density * folded(base, f, width) / (4 * square(omega)) / (2 * s);
    const double last = grows * -expm1(-decay);
    const double mean = grows * (1 - kept(s, mode->time));
    const double draws = 1 + decay, cycles = fmax(f1 * mode->time, 1);
    const double most = sqrt(2 * log(draws / RARE));
    const double least = sqrt(-2 * log1p(-pow(RARE, 1 / draws)));
    const double wave_max = sqrt(2 * log(cycles / RARE));
    const double behind = sqrt(share * follows) * base->rms; // rms of what follows
    // A short run has an rms of its own.
    const double chance = 0.7 / sqrt(draws);
    const double rms = (1 + chance) * sqrt(mean + (is_beyond ? 0 : square(behind)));
    // What a mode that the band does not reach takes at the base's start alone may be much less.
    const bool is_reached = f > f0 - width && !is_beyond;
    const double lasts =
        is_reached || is_beyond ? 1 : behind / fmax(hypot(behind, sqrt(mean)), 1e-300);
    level->sure = fmin(level->sure, lasts * (1 - chance) / (1 + chance));
    wave->rms = 1 / wave_max;
    wave->least = sqrt(-2 * log1p(-pow(RARE, 1 / cycles))) / wave_max;
    wave->accelerated = sqrt(fourth);
    if (is_beyond)
        level->pushed[0] = -mode->share / fabs(mode->share + 1e-300) * behind * wave_max;
    level->peak += hypot(most * sqrt(last), is_beyond ? 0 : wave_max * behind);
    level->rms = hypot(level->rms, rms);
    level->accelerated =
        hypot(level->accelerated, square(omega) * mean_of(omega, mode->interval) * rms);
    level->least = fmax(
        level->least, hypot(is_reached ? least * sqrt(last) : 0, wave->least * wave_max * behind));
}

static void chirp(Level *level, Wave *wave, const Mode *mode, const ExcitationChirp *base) {
    const double omega = omega_of(mode, mode->time), f = omega / (2 * pi);
    const double time = fmin(mode->time, base->sweep_time),
                 size = fabs(mode->share * base->amplitude);
    const double climb = (base->end_frequency - base->start_frequency) / base->sweep_time;
    const double end = base->start_frequency + climb * time;
    const double low = fmin(base->start_frequency, end), high = fmax(base->start_frequency, end);
    const double still = size / square(omega), edge = 2 / time;
    const double grown = fmin(pi * fmin(f * time, omega / fmax(4 * pi * mode->slack, 1e-300)),
                              3.67 * f / sqrt(fmax(fabs(climb), 1e-300)));
    wave->rms = sqrt(time / (2 * mode->time));
    wave->least = 0.7;
    wave->accelerated = square(2 * pi * high) * mean_of(2 * pi * high, mode->interval);
    if (f <= high * 1.1 + edge && f >= low / 1.1 - edge) {
        swing(level, mode, still * fmax(grown, 2), mode->time);
        level->sure = 0.25; // it passes at some time
        level->least = fmax(level->least, 0.5 * still * fmin(grown, 2));
        return;
    }
    if (f > high) {
        const double follows = 1 / (1 - square(high / f));
        level->pushed[0] = (mode->share < 0 ? still : -still) * follows;
        // It begins with a kink, and may end with a jump.
        swing(level, mode,
              still * follows *
                  (base->start_frequency / f + climb / square(f) +
                   (base->sweep_time < mode->time ? 1 : high / f * 0.2)),
              mode->time);
        level->least = fmax(level->least, 0.5 * still);
        return;
    }
    swing(level, mode, size / (omega * 2 * pi * fmax(low, f)), mode->time);
    level->least = fmax(level->least, size / (omega * 2 * pi * fmax(low, f)) / 2);
}

static void base_level(Level *level, Wave *wave, const Mode *mode, const Variant *of) {
    const void *any = of;
    if (of->kind == &excitation_sine.kind)
        sine(level, wave, mode, any);
    else if (of->kind == &excitation_random.kind)
        random_level(level, wave, mode, any);
    else if (of->kind == &excitation_chirp.kind)
        chirp(level, wave, mode, any);
    else if (of->kind == &excitation_half_sine.kind)
        half_sine(level, wave, mode, any);
    else if (of->kind == &excitation_triangular.kind)
        triangle(level, wave, mode, any);
}

// phi' M of a start.
static double modal(const Plan *plan, size_t k, const double *carried) {
    long double sum = 0;
    for (size_t j = 0; j < plan->storeys; j++)
        sum += (long double)plan->modes.shapes[j * plan->modes.count + k] * carried[j];
    return (double)sum;
}

// What coupled damping makes of a mode: it follows the others' speeds, about as it would follow one
// of them alone. `room` holds a number for each mode.
static void couple(const Plan *plan, const Wave *wave, Level *levels, double *room) {
    const Modes *modes = &plan->modes;
    const size_t n = modes->count;
    const double turning = sqrt(wave->accelerated);
    for (size_t j = 0; j < n; j++) {
        const double omega = fmax(modes->omega[j], 1 / plan->duration);
        room[j] =
            levels[j].peak * omega + hypot(levels[j].pushed[0], levels[j].pushed[1]) * turning;
        room[n + j] = levels[j].peak > 0 ? levels[j].rms / levels[j].peak : wave->rms;
    }
    for (size_t k = 0; k < n; k++) {
        const double own = fmax(modes->omega[k], 1 / plan->duration);
        double peaks = 0, squares = 0, pulls = 0;
        for (size_t j = 0; j < n; j++) {
            const double other = fmax(modes->omega[j], 1 / plan->duration);
            const double away = fabs(own - other) * (own + other) +
                                fmax(modes->damping[k * (n + 1)], 1 / plan->duration) * other;
            const double peak = fabs(modes->damping[k * n + j]) * room[j] / away;
            if (j == k)
                continue;
            peaks += peak * peak;
            squares += pow(peak * room[n + j], 2);
            pulls +=
                pow(peak * room[n + j] * square(other) * mean_of(other, 1 / plan->sample_rate), 2);
        }
        levels[k].peak += 2 * sqrt(peaks);
        levels[k].rms = hypot(levels[k].rms, sqrt(squares));
        levels[k].accelerated = hypot(levels[k].accelerated, sqrt(pulls));
    }
}

Status levels_make(const Plan *plan, const Scene *scene, Level *levels, Wave *wave) {
    const size_t n = plan->storeys;
    const bool is_still = excitation_is_still(scene_excitation(scene));
    double *carried = calloc(n, 2 * sizeof *carried);
    if (carried == NULL)
        return STATUS_NO_MEMORY;
    for (size_t j = 0; j < n; j++)
        for (size_t l = 0; l < n; l++) {
            carried[j] += plan->mass[j * n + l] * plan->displacement[l];
            carried[n + j] += plan->mass[j * n + l] * plan->velocity[l];
        }
    *wave = (Wave){0};
    for (size_t k = 0; k < plan->modes.count; k++) {
        const Mode mode = mode_of(plan, k);
        levels[k] = (Level){.sure = 1};
        start(&levels[k], &mode, modal(plan, k, carried), modal(plan, k, carried + n));
        if (!is_still)
            base_level(&levels[k], wave, &mode, scene->excitation);
    }
    if (scene->excitation->kind == &excitation_record.kind)
        levels_of_record(plan, (const void *)scene->excitation, levels, wave);
    if (!plan->modes.is_classical)
        couple(plan, wave, levels, carried);
    free(carried);
    return STATUS_OK;
}
