#include "tests/truth/extremes.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

#include "core/base/status.h"
#include "tests/truth/drawn.h"

typedef struct Pen {
    char *text;
    size_t used;
    Draws draws;
} Pen;

static void put(Pen *pen, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void put(Pen *pen, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    pen->used +=
        (size_t)vsnprintf(pen->text + pen->used, EXTREMES_TEXT - pen->used, format, arguments);
    va_end(arguments);
    if (pen->used >= EXTREMES_TEXT)
        pen->used = EXTREMES_TEXT - 1;
}

static bool chance(Pen *pen, double p) {
    return draws_chance(&pen->draws, p);
}
static double uniform(Pen *pen, double a, double b) {
    return draws_uniform(&pen->draws, a, b);
}
static double scattered(Pen *pen, double a, double b) {
    return draws_scattered(&pen->draws, a, b);
}
static size_t below(Pen *pen, size_t count) {
    return (size_t)(draws_bits(&pen->draws) % count);
}

static const char *const laws[] = {
    "impulse", "spring_damper", "spring_damper\", \"separation\": \"zero_force",
    "hertz",   "hunt_crossley", "lankarani_nikravesh",
    "flores",  "jankowski",     "hunt_crossley_textbook"};
enum { IMPULSE, SPRING_DAMPER, ZERO_FORCE, POWER, HERTZ = POWER, CORNER_LAWS = 8 };
static const char *const solver_names[] = {"exact", "precise", "rk4", "newmark", "adaptive"};
enum { EXACT, PRECISE, RK4, NEWMARK, ADAPTIVE, SOLVERS };
static const char *const kinds[] = {"free",      "random",     "sine", "record",
                                    "half_sine", "triangular", "chirp"};
enum { FREE, RANDOM, SINE, RECORD, HALF_SINE, TRIANGULAR, CHIRP };

static const double TURN = 6.283185307179586;

// What the rest of a scene is drawn from.
typedef struct ModalState {
    size_t storeys, law, solver, kind;
    double mass, frequency, ratio; // of the structure [kg], [Hz], damping
    double rate, duration;
    double level, reach; // of the base [m/s^2], of the start [m]
} ModalState;

static void put_list(Pen *pen, const char *name, size_t count, const double *values) {
    put(pen, "\"%s\": [", name);
    for (size_t i = 0; i < count; i++)
        put(pen, "%s%.17g", i > 0 ? ", " : "", values[i]);
    put(pen, "]");
}

static void put_structure(Pen *pen, const ModalState *frame) {
    enum { MOST = 40 };
    const double omega = TURN * frame->frequency, stiffness = frame->mass * omega * omega;
    const double damping = 2 * frame->ratio * frame->mass * omega;
    if (frame->storeys == 1) {
        put(pen, "\"structure\": {\"mass\": %.17g, \"stiffness\": %.17g, \"damping\": %.17g}",
            frame->mass, stiffness, damping);
        return;
    }
    double masses[MOST], stiffnesses[MOST], dampings[MOST];
    for (size_t i = 0; i < frame->storeys; i++) {
        masses[i] = frame->mass * (chance(pen, 0.3) ? scattered(pen, 1e-3, 1e3) : 1);
        stiffnesses[i] = stiffness * (chance(pen, 0.3) ? scattered(pen, 1e-3, 1e3) : 1);
        dampings[i] = damping * uniform(pen, 0, 1);
    }
    put(pen, "\"structure\": {\"kind\": \"frame\", ");
    put_list(pen, "masses", frame->storeys, masses);
    put(pen, ", ");
    put_list(pen, "stiffnesses", frame->storeys, stiffnesses);
    put(pen, ", ");
    if (chance(pen, 0.5))
        put(pen, "\"damping_ratio\": %.17g", frame->ratio);
    else
        put_list(pen, "dampings", frame->storeys, dampings);
    put(pen, "}");
}

static void put_buffer(Pen *pen, const char *name, const ModalState *frame, double restitution,
                       double contact_time, bool is_plain) {
    if (frame->law == HERTZ && chance(pen, 0.95))
        restitution = 1; // another one is a fault
    const bool has_time = frame->law != IMPULSE;
    put(pen, ", \"%s\": {", name);
    if (!is_plain && frame->law != IMPULSE && frame->law < POWER && chance(pen, 0.1)) {
        const double rate = TURN / 2 / contact_time, mass = frame->mass * scattered(pen, 1e-3, 1);
        put(pen, "\"stiffness\": %.17g, \"damping\": %.17g}", mass * rate * rate,
            chance(pen, 0.2) ? 0 : mass * rate * scattered(pen, 1e-4, 2));
    } else if (!is_plain && chance(pen, 0.1)) {
        put(pen, "\"table\": [");
        for (int i = 0; i < 3; i++) {
            put(pen, "%s{\"approach_speed\": %.17g, \"restitution\": %.17g", i > 0 ? ", " : "",
                pow(10, i - 1), frame->law == HERTZ ? 1 : fmax(restitution * (1 - 0.3 * i), 1e-3));
            if (has_time)
                put(pen, ", \"contact_time\": %.17g", contact_time / (1 + i));
            put(pen, "}");
        }
        put(pen, "]}");
    } else {
        put(pen, "\"restitution\": %.17g", restitution);
        if (has_time)
            put(pen, ", \"contact_time\": %.17g", contact_time);
        put(pen, "}");
    }
}

static void put_excitation(Pen *pen, const ModalState *frame) {
    const double turn = fmax(frame->frequency, 1e-3);
    put(pen, ", \"excitation\": {\"kind\": \"%s\"", kinds[frame->kind]);
    switch (frame->kind) {
    case RANDOM:
        put(pen, ", \"band\": [0, %.17g], \"rms\": %.17g, \"seed\": %zu",
            fmin(frame->rate / 2, uniform(pen, 0.3, 5) * turn), frame->level, below(pen, 1000));
        break;
    case SINE:
        put(pen, ", \"frequency\": %.17g, \"amplitude\": %.17g", turn * scattered(pen, 0.1, 10),
            frame->level);
        break;
    case RECORD: {
        enum { SAMPLES = 50 };
        double samples[SAMPLES];
        for (size_t i = 0; i < SAMPLES; i++)
            samples[i] = frame->level * uniform(pen, -2, 2);
        put(pen, ", \"interval\": %.17g, ", frame->duration / scattered(pen, 5, 500));
        put_list(pen, "samples", SAMPLES, samples);
        break;
    }
    case HALF_SINE:
    case TRIANGULAR:
        put(pen, ", \"amplitude\": %.17g, \"length\": %.17g", frame->level,
            frame->duration * scattered(pen, 1e-4, 1));
        break;
    case CHIRP:
        put(pen, ", \"amplitude\": %.17g, \"start_frequency\": %.17g, \"end_frequency\": %.17g",
            frame->level, turn * 0.1, turn * 3);
        break;
    default:
        break;
    }
    if (frame->kind == FREE || chance(pen, 0.2)) {
        put(pen, ", \"displacement\": ");
        for (size_t i = 0; i < frame->storeys; i++)
            put(pen, "%s%.17g",
                i > 0                ? ", "
                : frame->storeys > 1 ? "["
                                     : "",
                i == 0 ? frame->reach : 0.0);
        put(pen, "%s", frame->storeys > 1 ? "]" : "");
    }
    put(pen, "}");
}

static void put_rest(Pen *pen, const ModalState *frame, bool is_plain) {
    put(pen, ", \"contact\": {\"model\": \"%s\"}", laws[frame->law]);
    put_excitation(pen, frame);
    const bool is_refused = frame->solver == PRECISE && frame->law >= POWER && chance(pen, 0.95);
    put(pen, ", \"accuracy\": {\"solver\": \"%s\"", solver_names[is_refused ? RK4 : frame->solver]);
    if (frame->solver == ADAPTIVE && !is_plain && chance(pen, 0.7))
        put(pen, ", \"tolerance\": %.17g", scattered(pen, 1e-13, 1e-2));
    if (frame->solver != ADAPTIVE && frame->solver != EXACT && !is_plain && chance(pen, 0.7))
        put(pen, ", \"step\": %.17g", scattered(pen, 1e-4, 2) / frame->rate);
    put(pen, "}, \"duration\": %.17g, \"sample_rate\": %.17g, \"output\": {", frame->duration,
        frame->rate);
    if (!is_plain && chance(pen, 0.2))
        put(pen, "\"statistics_from\": %.17g, ", frame->duration * uniform(pen, 0, 0.9));
    if (chance(pen, 0.6))
        put(pen, "\"psd\": null, ");
    put(pen, "\"channels\": [\"usual\"]}}");
}

static double pick(uint64_t *corner, double low, double high) {
    const bool is_high = *corner % 2 == 1;
    *corner /= 2;
    return is_high ? high : low;
}

static void draw_corner(Pen *pen, uint64_t corner) {
    ModalState frame = {.storeys = 1, .mass = 1, .reach = 0.1};
    frame.law = corner % CORNER_LAWS;
    corner /= CORNER_LAWS;
    frame.solver = corner % SOLVERS;
    corner /= SOLVERS;
    const double least = frame.law == IMPULSE ? 0 : frame.law < POWER ? 1e-6 : 1e-3;
    const double restitution = pick(&corner, least, 1), time = pick(&corner, 1e-9, 1);
    const double ratio = pick(&corner, 1e-6, 1e3), clearance = pick(&corner, 0, 1);
    frame.ratio = pick(&corner, 0, 5);
    frame.frequency = pick(&corner, 1e-3, 1e4);
    frame.level = pick(&corner, 0, 1e3);
    frame.kind = frame.level > 0 ? RANDOM + below(pen, CHIRP) : FREE;
    frame.rate = 20 * frame.frequency;
    frame.duration = 500 / frame.rate;
    put_structure(pen, &frame);
    put(pen, ", \"dampers\": [{\"mass\": %.17g, \"clearance\": %.17g", ratio,
        frame.law >= POWER ? fmax(clearance, 1e-6) : clearance);
    put_buffer(pen, "buffer", &frame, restitution, time, true);
    put(pen, "}]");
    put_rest(pen, &frame, true);
}

static void put_damper(Pen *pen, const ModalState *frame) {
    const double clearances[] = {0, scattered(pen, 1e-6, 1), frame->reach * uniform(pen, 0, 3)};
    double clearance = clearances[below(pen, COUNT(clearances))];
    if (frame->law >= POWER)
        clearance = fmax(clearance, 1e-6);
    double restitution[2], time[2];
    for (int side = 0; side < 2; side++) {
        const double any[] = {0, 1e-6, 1, 0.5, uniform(pen, 0, 1), uniform(pen, 0, 1)};
        restitution[side] = fmax(any[below(pen, COUNT(any))], frame->law == IMPULSE ? 0
                                                              : frame->law < POWER  ? 1e-6
                                                                                    : 1e-3);
        time[side] = scattered(pen, 1e-9, 1);
    }
    put(pen, "{\"mass\": %.17g, \"clearance\": %.17g", frame->mass * scattered(pen, 1e-6, 1e3),
        clearance);
    if (chance(pen, 0.2))
        put(pen, ", \"position\": %.17g, \"velocity\": %.17g", clearance * uniform(pen, -0.5, 0.5),
            frame->reach * frame->frequency * uniform(pen, -10, 10));
    if (chance(pen, 0.2))
        put(pen, ", \"offset\": %.17g", frame->reach * uniform(pen, -1, 1));
    if (frame->storeys > 1)
        put(pen, ", \"storey\": %zu", 1 + below(pen, frame->storeys));
    if (chance(pen, 0.2)) {
        put_buffer(pen, "left_buffer", frame, restitution[0], time[0], false);
        put_buffer(pen, "right_buffer", frame, restitution[1], time[1], false);
    } else {
        put_buffer(pen, "buffer", frame, restitution[0], time[0], false);
    }
    put(pen, "}");
}

static void draw_random(Pen *pen) {
    static const size_t storeys[] = {1, 1, 1, 1, 2, 3, 5, 10, 30};
    static const double rates[] = {5, 20, 50, 200, 1000}, samples[] = {50, 500, 3000, 20000};
    static const size_t several[] = {0, 1, 1, 1, 2, 3, 5}, few[] = {0, 1, 1, 1, 1, 1, 2};
    ModalState frame = {.storeys = storeys[below(pen, COUNT(storeys))],
                        .law = chance(pen, 0.6) ? below(pen, POWER) : below(pen, COUNT(laws)),
                        .solver = chance(pen, 0.5) ? EXACT : below(pen, SOLVERS),
                        .kind = below(pen, COUNT(kinds)),
                        .mass = scattered(pen, 1e-3, 1e6)};
    frame.frequency = chance(pen, 0.05) ? 0 : scattered(pen, 1e-3, 1e4);
    const double ratios[] = {0, 0.016, uniform(pen, 0, 5), scattered(pen, 1e-6, 5)};
    frame.ratio = ratios[below(pen, COUNT(ratios))];
    frame.rate = chance(pen, 0.8) ? rates[below(pen, COUNT(rates))] * fmax(frame.frequency, 1e-3)
                                  : scattered(pen, 1e-2, 1e5);
    frame.duration = fmin(samples[below(pen, COUNT(samples))] / frame.rate, 1e6);
    const double levels[] = {0, 1, 1e3, scattered(pen, 1e-3, 1e3)};
    frame.level = levels[below(pen, COUNT(levels))];
    frame.reach = scattered(pen, 1e-6, 1);
    const size_t dampers =
        frame.storeys > 1 ? several[below(pen, COUNT(several))] : few[below(pen, COUNT(few))];
    put_structure(pen, &frame);
    put(pen, ", \"dampers\": [");
    for (size_t i = 0; i < dampers; i++) {
        put(pen, "%s", i > 0 ? ", " : "");
        put_damper(pen, &frame);
    }
    put(pen, "]");
    put_rest(pen, &frame, false);
}

void extremes_scene(uint64_t seed, uint64_t number, char text[EXTREMES_TEXT]) {
    Pen pen = {.text = text, .draws = {(seed * 1000003 + number) * 0x2545f4914f6cdd1dU}};
    (void)draws_bits(&pen.draws);
    put(&pen, "{");
    // 1977 has no factor in common with the number of corners: any stretch of them is a mix.
    if (number % 2 == 0)
        draw_corner(&pen, (number / 2 * 1977 + seed) % EXTREMES_CORNERS);
    else
        draw_random(&pen);
}
