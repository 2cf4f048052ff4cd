// Random frames of 5 to 60 storeys with some of their modes left out, against the same run with all
// of them: how often the error predicted is exceeded, and by how much it is too large.
// `test_modes COUNT SEED [KIND]` runs a longer campaign and prints it.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "core/simulation/error_metrics.h"
#include "core/solve/solver.h"
#include "server/json/parse.h"
#include "tests/support/test.h"
#include "tests/truth/drawn.h"

static size_t scenes = 12;
static uint64_t seed = 1;
static int only = -1;
static bool is_verbose = false;

static Draws draws;
static size_t below(size_t count) {
    return (size_t)(draws_bits(&draws) % count);
}
static double uniform(double a, double b) {
    return draws_uniform(&draws, a, b);
}
static double scattered(double a, double b) {
    return draws_scattered(&draws, a, b);
}
static bool chance(double p) {
    return draws_chance(&draws, p);
}

static const double TURN = 6.283185307179586;

typedef struct Text {
    char at[1 << 17];
    size_t length;
} Text;

static void say(Text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(Text *text, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    text->length += (size_t)vsnprintf(text->at + text->length, sizeof text->at - text->length,
                                      format, arguments);
    va_end(arguments);
    if (text->length >= sizeof text->at)
        abort();
}

static void say_list(Text *text, const char *name, const double *values, size_t count) {
    say(text, "\"%s\": [", name);
    for (size_t i = 0; i < count; i++)
        say(text, "%s%.17g", i > 0 ? ", " : "", values[i]);
    say(text, "], ");
}

enum { FREE, SINE, RANDOM, HALF_SINE, TRIANGULAR, CHIRP, RECORD, KINDS };
static const char *const kind_names[KINDS] = {"free",       "sine",  "random", "half_sine",
                                              "triangular", "chirp", "record"};
enum { STOREYS = 60 };

typedef struct Drawn {
    Simulation simulation;
    size_t storeys, dampers;
    int kind;
} Drawn;

// About the first natural frequency [Hz].
static double say_structure(Text *text, size_t n) {
    double mass[STOREYS], stiffness[STOREYS], damping[STOREYS];
    const double first = scattered(0.1, 5), heavy = scattered(10, 1e5);
    const double omega = TURN * first / (2 * sin(TURN / 4 / (2 * (double)n + 1)));
    const size_t kind = below(4);
    for (size_t i = 0; i < n; i++) {
        const double taper = kind == 1 ? 1 - 0.7 * (double)i / (double)n : 1;
        mass[i] = heavy * (kind == 2 ? uniform(0.3, 3) : 1);
        stiffness[i] = heavy * omega * omega * taper * (kind == 2 ? uniform(0.3, 3) : 1);
    }
    if (kind == 3) {
        stiffness[below(n)] *= uniform(0.05, 0.5);
        mass[below(n)] *= uniform(2, 20);
    }
    const double ratio = chance(0.2) ? 0 : scattered(1e-3, 0.05);
    const double by_stiffness = 2 * ratio / (TURN * first);
    say(text, "\"structure\": {\"kind\": \"frame\", ");
    say_list(text, "masses", mass, n);
    const bool is_by_ratio = chance(0.5);
    for (size_t i = 0; i < n; i++)
        damping[i] = by_stiffness * stiffness[i] * (kind == 2 ? uniform(0.2, 2) : 1);
    if (!is_by_ratio)
        say_list(text, "dampings", damping, n);
    else
        say(text, "\"damping_ratio\": %.17g, ", ratio);
    say_list(text, "stiffnesses", stiffness, n);
    text->length -= 2; // its comma
    say(text, "}, ");
    return first;
}

static void say_start(Text *text, size_t n, double reach, double first) {
    double values[STOREYS];
    const size_t kind = below(4);
    for (size_t i = 0; i < n; i++)
        values[i] = reach * (kind == 0   ? uniform(-1, 1)
                             : kind == 1 ? (double)(i + 1) / (double)n
                                         : sin(TURN / 4 * (double)(i + 1) / (double)n));
    if (kind == 3)
        for (size_t i = 0; i + 1 < n; i++)
            values[i] = 0;
    const bool is_speed = chance(0.4);
    for (size_t i = 0; i < n && is_speed; i++)
        values[i] *= TURN * first;
    say_list(text, is_speed ? "velocity" : "displacement", values, n);
}

static void say_record(Text *text, double interval, double duration, double first, double level) {
    const size_t count = (size_t)(fmin(duration, 20 / first) * uniform(0.3, 1.2) / interval) + 2;
    const double memory = exp(-interval * TURN * first * scattered(1, 20));
    double value = 0;
    say(text, "\"interval\": %.17g, \"samples\": [", interval);
    for (size_t i = 0; i < count && i < 3000; i++) {
        const double at = (double)i / (double)count;
        value = memory * value + sqrt(1 - memory * memory) * level * uniform(-2, 2);
        say(text, "%s%.9g", i > 0 ? ", " : "", value * 4 * at * (1 - at));
    }
    say(text, "], ");
}

static void say_excitation(Text *text, int kind, size_t n, double first, double duration,
                           double rate, double reach) {
    const double level = reach * pow(TURN * first, 2);
    say(text, "\"excitation\": {");
    if (kind == FREE || chance(0.15))
        say_start(text, n, reach, first);
    if (kind == SINE)
        say(text, "\"frequency\": %.17g, \"amplitude\": %.17g, ",
            first * (chance(0.3) ? uniform(0.9, 1.1) : scattered(0.1, 10)), level);
    if (kind == RANDOM) {
        const double high = fmin(first * scattered(1, 30), rate / 2);
        say(text, "\"band\": [%.17g, %.17g], \"rms\": %.17g, \"seed\": %zu, ",
            chance(0.5) ? 0 : high * uniform(0, 0.5), high, level, below(1000));
    }
    if (kind == HALF_SINE || kind == TRIANGULAR)
        say(text, "\"amplitude\": %.17g, \"start\": %.17g, \"length\": %.17g, ", level,
            chance(0.5) ? 0 : duration * uniform(0, 0.3), scattered(0.02, 2) / first);
    if (kind == CHIRP)
        say(text, "\"start_frequency\": %.17g, \"end_frequency\": %.17g, \"amplitude\": %.17g, ",
            first * scattered(0.1, 5), first * scattered(0.1, 5), level);
    if (kind == RECORD)
        say_record(text, chance(0.5) ? 1 / rate : scattered(0.01, 0.05) / first, duration, first,
                   level);
    say(text, "\"kind\": \"%s\"}, ", kind_names[kind]);
}

static void say_dampers(Text *text, size_t n, size_t m, double mass, double reach, double first) {
    const bool is_impulse = chance(0.3);
    const double time = scattered(0.002, 0.1) / first;
    say(text, "\"dampers\": [");
    for (size_t d = 0; d < m; d++) {
        const size_t storey = chance(0.6) ? n : 1 + below(n);
        say(text,
            "%s{\"storey\": %zu, \"mass\": %.17g, \"clearance\": %.17g, \"buffer\": "
            "{\"restitution\": %.17g",
            d > 0 ? ", " : "", storey, mass * scattered(0.01, 0.3), reach * scattered(0.1, 4),
            uniform(0.2, 0.9));
        if (!is_impulse)
            say(text, ", \"contact_time\": %.17g", time);
        say(text, "}}");
    }
    say(text, "], ");
}

static Drawn draw(uint64_t number, bool has_dampers) {
    static Text text;
    static Problem problem;
    draws.state = number * 0x2545f4914f6cdd1dU + has_dampers;
    (void)draws_bits(&draws);
    const size_t n = 5 + below(chance(0.7) ? 16 : STOREYS - 4);
    Drawn drawn = {.storeys = n, .kind = (int)below(KINDS)};
    if (only >= 0)
        drawn.kind = only;
    if (has_dampers)
        drawn.dampers = 1 + below(2);
    text.length = 0;
    say(&text, "{");
    const double first = say_structure(&text, n);
    const double reach = scattered(1e-3, 0.1), duration = scattered(2, 60) / first;
    const double rate = first * scattered(20, 200);
    say_excitation(&text, drawn.kind, n, first, duration, rate, reach);
    if (drawn.dampers > 0) {
        double heavy = 100;
        const char *masses = strstr(text.at, "\"masses\": [");
        heavy = strtod(masses + strlen("\"masses\": ["), NULL) * (double)n * 0.3;
        say_dampers(&text, n, drawn.dampers, heavy, reach, first);
    }
    say(&text, "\"output\": {\"psd\": null}, \"duration\": %.17g, \"sample_rate\": %.17g}",
        duration, rate);
    problem_clear(&problem);
    (void)json_parse(text.at, text.length, simulation_fields, &drawn.simulation, &problem);
    if (simulation_complete(&drawn.simulation, NULL, NULL, &problem) != STATUS_OK ||
        error_metrics_request(&drawn.simulation, &problem) != STATUS_OK) {
        printf("%s: %s\n", problem.count > 0 ? problem.faults[0].pointer : "",
               problem.count > 0 ? problem.faults[0].detail : problem.detail);
        abort();
    }
    return drawn;
}

static Outcome *run(Drawn *drawn, size_t modes) {
    static Problem problem;
    Outcome *outcome;
    Accuracy *accuracy = (Accuracy *)(void *)drawn->simulation.accuracy;
    const SimulationLimits limits = {.impacts = 100000, .steps = 3e8};
    accuracy->modes = modes < drawn->storeys ? modes : COUNT_ABSENT;
    problem_clear(&problem);
    if (simulation_run(&drawn->simulation, &limits, NULL, NULL, &outcome, &problem) == STATUS_OK)
        return outcome;
    if (is_verbose)
        printf("  %s\n", problem.detail);
    return NULL;
}

// True errors over those predicted.
enum { PREDICTED = 3, MOST = 100000 };
static const char *const predicted_names[PREDICTED] = {"displacement", "mean_acceleration",
                                                       "rms_displacement"};
typedef struct Tally {
    double ratio[PREDICTED][MOST];
    size_t count[PREDICTED], over[PREDICTED];
    size_t estimates, short_estimates; // of the summary
} Tally;
static Tally tallies[2][KINDS];

static const double TOLD = 1e-10; // below it rounding answers

static void count_one(Tally *tally, int metric, double error, double predicted) {
    error = fmin(error, 1);
    if (!(fmax(error, predicted) > TOLD) || tally->count[metric] == MOST)
        return;
    tally->over[metric] += error > predicted;
    tally->ratio[metric][tally->count[metric]++] = error / predicted;
}

static void judge(uint64_t number, bool has_dampers) {
    static Problem problem;
    Drawn drawn = draw(number, has_dampers);
    const Scene *scene = &drawn.simulation.scene;
    Tally *tally = &tallies[has_dampers][drawn.kind];
    Plan *plan;
    TruncationError errors[STOREYS];
    problem_clear(&problem);
    assert_int_equal(plan_new(scene, "exact", "exact", &plan, &problem), STATUS_OK);
    assert_int_equal(truncation_predict(plan, scene, NULL, errors), STATUS_OK);
    const bool is_classical = plan->modes.is_classical;
    plan_free(plan);
    Outcome *all = run(&drawn, drawn.storeys);
    for (size_t part = 1; part < 6 && all != NULL; part++) {
        const size_t kept = part == 1 ? drawn.storeys - 1 : drawn.storeys >> (part - 1);
        Outcome *outcome = kept > 0 ? run(&drawn, kept) : NULL;
        if (outcome == NULL)
            continue;
        const Errors found = error_metrics_measure(all, outcome, true);
        const double errors_found[PREDICTED] = {found.displacement, found.mean_acceleration,
                                                found.rms_displacement};
        const TruncationError *one = &errors[kept - 1];
        const double told[PREDICTED] = {one->displacement, one->mean_acceleration,
                                        one->rms_displacement};
        for (int i = 0; i < PREDICTED; i++) {
            count_one(tally, i, errors_found[i], told[i]);
            if (is_verbose && fmin(errors_found[i], 1) > fmax(told[i], TOLD))
                printf(
                    "  %llu %s%s: %zu of %zu modes, %zu dampers, %zu impacts: %s %.2g, predicted "
                    "%.2g\n",
                    (unsigned long long)number, kind_names[drawn.kind],
                    is_classical ? "" : " coupled", kept, drawn.storeys, drawn.dampers,
                    all->response.impacts.count, predicted_names[i], errors_found[i], told[i]);
        }
        tally->estimates++;
        tally->short_estimates += !(outcome->summary.error_estimate >= fmin(found.displacement, 1));
        // One in some 100000 contacts leaves more than rounding, with all modes as with some.
        assert_true(outcome->response.energy.residual < 1e-6);
        outcome_unref(outcome);
    }
    outcome_unref(all);
    simulation_clear(&drawn.simulation);
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void tell(bool has_dampers) {
    printf("%-12s %-18s %6s %7s %9s %9s %9s %9s\n", has_dampers ? "dampers" : "no damper", "metric",
           "runs", "over", "median", "90 %", "97 %", "most");
    for (int kind = 0; kind < KINDS; kind++)
        for (int i = 0; i < PREDICTED; i++) {
            Tally *tally = &tallies[has_dampers][kind];
            const size_t count = tally->count[i];
            if (count == 0)
                continue;
            qsort(tally->ratio[i], count, sizeof(double), by_size);
            printf("%-12s %-18s %6zu %6.1f%% %9.2g %9.2g %9.2g %9.2g\n", kind_names[kind],
                   predicted_names[i], count, 100 * (double)tally->over[i] / (double)count,
                   tally->ratio[i][count / 2], tally->ratio[i][count * 9 / 10],
                   tally->ratio[i][count * 97 / 100], tally->ratio[i][count - 1]);
        }
}

// All kinds together.
static double over_of(bool has_dampers, int metric) {
    double over = 0, count = 0;
    for (int kind = 0; kind < KINDS; kind++) {
        over += (double)tallies[has_dampers][kind].over[metric];
        count += (double)tallies[has_dampers][kind].count[metric];
    }
    return count > 0 ? over / count : 0;
}

static void judge_all(bool has_dampers, double most) {
    double estimates = 0, missed = 0;
    for (uint64_t i = 0; i < scenes; i++)
        judge(seed * 1000000 + i, has_dampers);
    tell(has_dampers);
    for (int kind = 0; kind < KINDS; kind++) {
        estimates += (double)tallies[has_dampers][kind].estimates;
        missed += (double)tallies[has_dampers][kind].short_estimates;
    }
    printf("error_estimate is short in %.1f %%\n", 100 * missed / estimates);
    for (int i = 0; i < PREDICTED; i++) {
        printf("%s over in %.1f %%\n", predicted_names[i], 100 * over_of(has_dampers, i));
        assert_true(over_of(has_dampers, i) <= most);
    }
    assert_true(missed <= most * estimates);
}

TEST(without_dampers_the_error_predicted_is_seldom_exceeded) {
    judge_all(false, 0.03);
}

TEST(with_dampers_too) {
    judge_all(true, 0.1);
}

int main(int count, char **arguments) {
    if (count > 1) {
        scenes = strtoul(arguments[1], NULL, 10);
        is_verbose = true;
    }
    if (count > 2)
        seed = strtoul(arguments[2], NULL, 10);
    if (count > 3)
        only = atoi(arguments[3]);
    return test_run(0, NULL);
}
