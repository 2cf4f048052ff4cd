// Force traces of simulated drop tests, read: what the simulation was given comes back. With
// arguments a campaign over a grid: trials, e, samples in contact, noise, baseline about it.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/base/philox.h"
#include "core/drop_test/force_trace.h"
#include "core/simulation/simulation.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"
#include "traces.h"

static const char *rule(int separation) {
    return separation == SEPARATION_ZERO_FORCE ? "zero force" : "zero penetration";
}

static void print_score(const TraceCell *cell, const TraceScore *score) {
    print_message("%-16s e %.2f, %6.2f samples%s, noise %.3f: covered %.3f of %zu figures, %.3f of "
                  "all; error of T_c %+.4f, rms %.4f, stated %.4f\n",
                  rule(cell->separation), cell->restitution, cell->samples,
                  cell->is_on_grid ? " on grid" : "", cell->noise, score->covered, score->figures,
                  score->covered_all, score->bias, score->rms, score->stated);
}

TEST(without_noise_five_samples_give_e_and_contact_time) {
    static const double restitutions[] = {0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 1};
    static const double samples[] = {5, 5.3, 5.9, 8, 11.2, 20, 33.3, 100, 5000};
    static const double times[] = {1e-4, 3e-2};
    double worst = 0;
    for (int separation = 0; separation < 2; separation++)
        for (size_t i = 0; i < COUNT(restitutions); i++)
            for (size_t j = 0; j < COUNT(samples); j++) {
                const TraceCell cell = {
                    .separation = separation,
                    .restitution = restitutions[i],
                    .contact_time = times[(i + j) % 2],
                    .samples = samples[j],
                    .before = j % 2 == 0 ? 4 : 0.5,
                    .offset = 0.7,
                    .scale = i % 2 == 0 ? 40 : -0.02,
                };
                const size_t trials = samples[j] < 50 ? 6 : 1;
                const TraceScore score = traces_score(&cell, 3, trials);
                if (!(score.figures == trials && score.doubtful == 0 && score.worst < 0.002 &&
                      score.worst_restitution < 0.01 && score.covered_all == 1)) {
                    print_score(&cell, &score);
                    fail_msg("worst %g, of e %g, doubtful %zu", score.worst,
                             score.worst_restitution, score.doubtful);
                }
                worst = fmax(worst, score.worst);
            }
    print_message("largest error of T_c %.1e\n", worst);
}

TEST(stated_intervals_cover_the_truth) {
    static const struct {
        int separation;
        double restitution, samples, noise;
        bool is_on_grid;
    } cells[] = {
        {0, 0.3, 8.4, 0.01, false}, {0, 0.5, 20, 0.02, true},    {0, 0.8, 120, 0.005, true},
        {1, 0.6, 8, 0.02, true},    {1, 0.7, 15.2, 0.03, false},
    };
    for (size_t i = 0; i < COUNT(cells); i++) {
        const TraceCell cell = {
            .separation = cells[i].separation,
            .restitution = cells[i].restitution,
            .contact_time = 2e-3,
            .samples = cells[i].samples,
            .noise = cells[i].noise,
            .before = 4,
            .offset = -0.4,
            .drift = 0.05,
            .scale = -12,
            .is_on_grid = cells[i].is_on_grid,
        };
        const TraceScore score = traces_score(&cell, 2009, 1000);
        print_score(&cell, &score);
        assert_true(score.covered >= 0.92 && score.covered <= 0.98);
        assert_true(score.figures >= 950);
        assert_true(score.doubtful <= 5 && score.found >= 995);
    }
}

TEST(too_few_samples_give_an_interval_that_holds_the_truth) {
    static const double restitutions[] = {0.1, 0.5, 0.95}, samples[] = {1.3, 2, 2.9};
    for (int separation = 0; separation < 2; separation++)
        for (size_t i = 0; i < COUNT(restitutions); i++)
            for (size_t j = 0; j < COUNT(samples); j++)
                for (int noisy = 0; noisy < 2; noisy++) {
                    const TraceCell cell = {
                        .separation = separation,
                        .restitution = restitutions[i],
                        .contact_time = 1e-3,
                        .samples = samples[j],
                        .noise = 0.01 * noisy,
                        .before = 12,
                    };
                    const TraceScore score = traces_score(&cell, 11, 100);
                    // Now and then nothing is seen at all.
                    if (score.figures > 0 ||
                        score.covered_all < 0.98 * (double)score.found / (double)score.trials) {
                        print_score(&cell, &score);
                        fail_msg("%zu figures, %.3f below, %.3f above, %zu found", score.figures,
                                 score.below, score.above, score.found);
                    }
                }
}

// The contact force of the first impact on the stop of a structure so slow that its spring
// does nothing in a contact, by the exact solver.
static void simulate(double restitution, double contact_time, int separation,
                     ImpactHistory *closeup) {
    Simulation simulation;
    scene_with_damper(&simulation, restitution, contact_time);
    Scene *scene = &simulation.scene;
    SdofStructure *sdof = (SdofStructure *)(void *)scene->structure;
    const double omega = 2 * 3.14159265358979 / (1e5 * contact_time);
    sdof->stiffness = sdof->mass * omega * omega;
    sdof->damping = 0;
    scene_choose(&scene->contact, &contact_kinds, "spring_damper");
    ((Contact *)(void *)scene->contact)->separation = separation;
    scene->duration = 25000 * contact_time;
    scene->sample_rate = 0.02 / contact_time;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(
        impact_history_make(&simulation, 1, 20001, NULL, NULL, NULL, closeup, &problem), STATUS_OK);
    fields_clear(simulation_fields, &simulation);
}

static double force_at(const ImpactHistory *closeup, double time) {
    const double *times = closeup->columns.at[0].values, *force = closeup->columns.at[1].values;
    size_t low = 0, high = closeup->columns.rows - 1;
    if (time < times[0] || time > times[high])
        return 0;
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        *(times[middle] <= time ? &low : &high) = middle;
    }
    return force[low] +
           (force[high] - force[low]) * (time - times[low]) / (times[high] - times[low]);
}

TEST(what_the_core_simulates_is_read_back) {
    static const double restitutions[] = {0.1, 0.3, 0.5, 0.7, 0.95}, times[] = {1e-4, 2e-3, 3e-2};
    static const double rates[] = {5.2, 8, 20, 60};
    double worst = 0;
    for (int separation = 0; separation < 2; separation++)
        for (size_t i = 0; i < COUNT(restitutions); i++)
            for (size_t j = 0; j < COUNT(times); j++) {
                ImpactHistory closeup;
                simulate(restitutions[i], times[j], separation, &closeup);
                for (size_t k = 0; k < COUNT(rates); k++) {
                    double values[400];
                    const Reals force = {values, (size_t)(5 * rates[k]) + 20};
                    const double interval = times[j] / rates[k];
                    const double start =
                        closeup.impact.start - interval * (10.1 + 0.23 * (double)(i + j + k));
                    for (size_t n = 0; n < force.count; n++)
                        values[n] = force_at(&closeup, start + (double)n * interval);
                    const TraceOptions way = {.separation = separation, .threshold = (double)NAN};
                    TraceAnalysis reading;
                    assert_int_equal(trace_analysis_run(interval, &force, &way, "", &reading, NULL),
                                     STATUS_OK);
                    assert_int_equal(reading.contacts.count, 1);
                    const TraceContact *contact = &reading.contacts.at[0];
                    if (contact->why != NULL)
                        fail_msg("%s", contact->why);
                    const double off = fabs(contact->contact_time / times[j] - 1);
                    if (!(off < 0.003 && fabs(contact->restitution - restitutions[i]) < 0.01))
                        fail_msg("%s, e %g, T_c %g at %g samples: %g, %g", rule(separation),
                                 restitutions[i], times[j], rates[k], contact->contact_time,
                                 contact->restitution);
                    if (!(fabs(fabs(contact->seen.impulse) / closeup.impact.impulse - 1) < 0.005))
                        fail_msg("%s, e %g, T_c %g at %g samples: impulse %g is %g",
                                 rule(separation), restitutions[i], times[j], rates[k],
                                 closeup.impact.impulse, contact->seen.impulse);
                    worst = fmax(worst, off);
                    trace_analysis_clear(&reading);
                }
                impact_history_clear(&closeup);
            }
    print_message("largest error of T_c %.1e\n", worst);
}

// trials, e from 0.1 to 0.95 ..., all cells of a grid; those outside 92 to 98 % are marked.
static int campaign(size_t trials, uint64_t seed) {
    static const double restitutions[] = {0.1, 0.2, 0.3, 0.5, 0.7, 0.85, 0.95};
    static const double samples[] = {5.5, 8, 8.5, 12.25, 20, 20.4, 50, 50.5, 200};
    static const double noises[] = {0.005, 0.01, 0.02, 0.05};
    size_t cells = 0, outside = 0, refused = 0;
    for (int separation = 0; separation < 2; separation++)
        for (size_t i = 0; i < COUNT(restitutions); i++)
            for (size_t j = 0; j < COUNT(samples); j++)
                for (size_t k = 0; k < COUNT(noises); k++) {
                    const TraceCell cell = {
                        .separation = separation,
                        .restitution = restitutions[i],
                        .contact_time = 1e-3,
                        .samples = samples[j],
                        .noise = noises[k],
                        .before = 4,
                        .offset = 1,
                        .drift = 0.1,
                        .scale = 3,
                        .is_on_grid = samples[j] == floor(samples[j]),
                    };
                    const TraceScore score = traces_score(&cell, seed, trials);
                    const bool is_refused = score.figures < trials / 2;
                    const bool is_outside =
                        !is_refused && !(score.covered >= 0.92 && score.covered <= 0.98);
                    cells++;
                    refused += is_refused;
                    outside += is_outside;
                    print_score(&cell, &score);
                    if (is_outside || is_refused)
                        print_message("    ^ %s\n", is_outside ? "outside 92 to 98 %" : "refused");
                }
    print_message("%zu cells, %zu of them mostly without a figure, %zu outside 92 to 98 %%\n",
                  cells, refused, outside);
    return 0;
}

int main(int argc, char **argv) {
    if (argc > 2)
        return campaign((size_t)strtoul(argv[1], NULL, 10), strtoull(argv[2], NULL, 10));
    return test_run(0, NULL);
}
