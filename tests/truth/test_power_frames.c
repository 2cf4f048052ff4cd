// Random frames of 1 to 5 storeys with 1 to 3 dampers under power laws, some of them twins that
// touch at one instant: the exact solver beside the solver adaptive, which goes in plain time by
// SUNDIALS and says itself how far it can be believed. `test_power_frames COUNT SEED` runs more.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "core/solve/exact.h"
#include "core/solve/solver.h"
#include "core/solve/time_stepping.h"
#include "tests/support/document.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"
#include "tests/truth/drawn.h"

static size_t scenes = 10;
static uint64_t seed = 9;

static Draws draws;

static const char *const laws[] = {"hertz",  "hunt_crossley", "lankarani_nikravesh",
                                   "flores", "jankowski",     "hunt_crossley_textbook"};

static int print_damper(char *text, size_t room, size_t storeys, bool has_restitution) {
    static const double exponents[] = {1.5, 1.5, 1, 2, 2.5, 1.37};
    char restitution[40] = "";
    if (has_restitution)
        snprintf(restitution, sizeof restitution, ", \"restitution\": %.3f",
                 draws_uniform(&draws, 0.15, 1));
    return snprintf(text, room,
                    "{\"mass\": %.4g, \"clearance\": %.4g, \"storey\": %d, \"buffer\": "
                    "{\"contact_time\": %.4g, \"exponent\": %.4g%s}}",
                    draws_scattered(&draws, 1, 30), draws_scattered(&draws, 1e-3, 0.03),
                    1 + (int)(draws_bits(&draws) % storeys), draws_scattered(&draws, 2e-4, 0.03),
                    exponents[draws_bits(&draws) % 6], restitution);
}

static void draw(Simulation *simulation, uint64_t number) {
    draws.state = number * 0x2545f4914f6cdd1dU;
    const size_t n = 1 + draws_bits(&draws) % 5, m = 1 + draws_bits(&draws) % 3;
    const char *law = laws[draws_bits(&draws) % 6];
    const bool are_twins = draws_chance(&draws, 0.3);
    char masses[200] = "", stiffnesses[200] = "", damper[300], dampers[1000] = "", text[2400];
    for (size_t i = 0; i < n; i++) {
        const char *comma = i > 0 ? ", " : "";
        size_t used = strlen(masses);
        snprintf(masses + used, sizeof masses - used, "%s%.4g", comma,
                 draws_uniform(&draws, 50, 150));
        used = strlen(stiffnesses);
        snprintf(stiffnesses + used, sizeof stiffnesses - used, "%s%.4g", comma,
                 draws_scattered(&draws, 1e4, 3e5));
    }
    for (size_t d = 0; d < m; d++) {
        const size_t used = strlen(dampers);
        if (d == 0 || !are_twins)
            print_damper(damper, sizeof damper, n, strcmp(law, "hertz") != 0);
        snprintf(dampers + used, sizeof dampers - used, "%s%s", d > 0 ? ", " : "", damper);
    }
    snprintf(text, sizeof text,
             "\"structure\": {\"kind\": \"frame\", \"masses\": [%s], \"stiffnesses\": [%s], "
             "\"damping_ratio\": 0.02}, \"dampers\": [%s], \"contact\": {\"model\": \"%s\"}, "
             "\"excitation\": {\"kind\": \"random\", \"band\": [0.2, 15], \"rms\": %.3g, \"seed\": "
             "%d}, \"output\": {\"channels\": [\"%s\"], \"psd\": null}",
             masses, stiffnesses, dampers, law, draws_scattered(&draws, 1, 8), (int)number,
             n > 1 || m > 1 ? "displacement_1" : "displacement");
    document_pass(simulation, text);
}

// NULL: it took too long.
static Outcome *run(Simulation *simulation, const char *solver) {
    Problem problem;
    Outcome *outcome;
    problem_clear(&problem);
    scene_choose(&simulation->accuracy, &solver_kinds, solver);
    if (strcmp(solver, "adaptive") == 0)
        ((AccuracyTolerance *)(void *)simulation->accuracy)->tolerance = 1e-13;
    const SimulationLimits limits = {.steps = 2e7};
    const Status status = simulation_run(simulation, &limits, NULL, NULL, &outcome, &problem);
    if (status != STATUS_OK && status != STATUS_LIMIT)
        fail_msg("%s: %s", solver, problem.detail);
    return outcome;
}

TEST(frames_agree_with_another_integrator) {
    size_t judged = 0, impacts = 0;
    for (uint64_t number = seed; number < seed + scenes; number++) {
        Simulation simulation;
        draw(&simulation, number);
        Outcome *exact = run(&simulation, "exact"), *adaptive = run(&simulation, "adaptive");
        assert_non_null(exact);
        assert_true(exact->summary.energy_residual < 1e-11);
        const double allowed = adaptive == NULL ? 1 : 3 * adaptive->summary.error_estimate + 1e-10;
        if (allowed < 1e-5) {
            const Columns *a = &exact->response.series, *b = &adaptive->response.series;
            double error = 0;
            for (size_t i = 0; i < a->rows; i++)
                error = fmax(error, fabs(a->at[0].values[i] - b->at[0].values[i]));
            error /= exact->summary.peak_displacement;
            if (!(error <= allowed))
                fail_msg("frame %llu: error %.2e, allowed %.2e, estimate %.2e",
                         (unsigned long long)number, error, allowed, exact->summary.error_estimate);
            judged++;
            impacts += exact->summary.impacts;
        }
        outcome_unref(exact);
        if (adaptive != NULL)
            outcome_unref(adaptive);
        simulation_clear(&simulation);
    }
    print_message("%zu of %zu judged, %zu impacts\n", judged, scenes, impacts);
    assert_true(2 * judged > scenes);
}

int main(int argc, char **argv) {
    fft_start();
    if (argc > 2) {
        scenes = (size_t)strtoul(argv[1], NULL, 10);
        seed = strtoull(argv[2], NULL, 10);
    }
    return test_run(0, NULL);
}
