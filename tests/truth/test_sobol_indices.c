// Confidence intervals of Sobol indices: how many of them contain the index, over many seeds. Of
// the Ishigami function, which tests the estimator, and of a scene with known variances.
//
//   truth_test_sobol_indices_c [TRIALS [SEED]]

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/study/ensemble.h"
#include "tests/support/ishigami.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

enum { SAMPLES = 1024 };

static unsigned long trials = 10;
static uint64_t first_seed = 1;
static Problem problem;
static double first[INPUTS], total[INPUTS]; // of the case
static size_t inside[2 * INPUTS];

static void note(size_t input, const SobolIndex *index) {
    bool contains[2];
    (void)index_contains(index, first[input], total[input], contains);
    inside[input] += contains[0];
    inside[INPUTS + input] += contains[1];
}

// Prints the shares and returns whether all are near 95 %: within 92 and 98 %, and in few trials
// within four standard deviations of 95 %.
static bool report(const char *name) {
    const double n = (double)trials, slack = fmax(0.03, 4 * sqrt(0.05 * 0.95 / n));
    bool is_kept = true;
    size_t all = 0;
    printf("%s, %d base samples, %lu trials: intervals that contain first and total indices [%%]:",
           name, SAMPLES, trials);
    for (size_t i = 0; i < COUNT(inside); i++) {
        const double share = (double)inside[i] / n;
        printf(" %.1f", 100 * share);
        is_kept = is_kept && fabs(share - 0.95) <= slack;
        all += inside[i];
        inside[i] = 0;
    }
    printf(", together %.2f\n", 100 * (double)all / n / COUNT(inside));
    return is_kept;
}

static bool try_ishigami(void) {
    ishigami_indices(first, total);
    for (uint64_t seed = first_seed; seed < first_seed + trials; seed++) {
        SobolIndex indices[INPUTS];
        indices_estimate(ishigami, SAMPLING_RANDOM, seed, SAMPLES, indices);
        for (size_t i = 0; i < INPUTS; i++)
            note(i, &indices[i]);
        indices_clear(indices);
    }
    return report("Ishigami function");
}

// Free vibration without dampers: the acceleration at the start, k x / m, is the largest. Of a
// product of log-normal numbers, q_i = exp(s_i^2) and Q the product of all q, the indices are
// (q_i - 1) / (Q - 1) and (q_i - 1) Q / q_i / (Q - 1).
static bool try_scene(void) {
    static const char *const pointers[] = {"/structure/stiffness", "/structure/mass",
                                           "/excitation/displacement"};
    static const double medians[] = {865, 1.35, 0.01}, s[] = {0.15, 0.1, 0.2};
    StudyRequest request = {0};
    scene_without_damper(&request.simulation);
    request.simulation.scene.duration = 0.02;
    request.study = variant_new(&study_ensemble.kind);
    assert_non_null(request.study);
    EnsembleStudy *study = (EnsembleStudy *)(void *)request.study;
    study->runs = SAMPLES;
    study->sobol_indices = true;
    double q = 1;
    for (size_t i = 0; i < INPUTS; i++) {
        UncertainInput *input = list_append(&study->inputs, sizeof *input);
        assert_non_null(input);
        assert_int_equal(fields_default(uncertain_input_fields, input), STATUS_OK);
        assert_int_equal(text_copy(pointers[i], &input->axis.pointer), STATUS_OK);
        input->distribution = INPUT_LOGNORMAL;
        input->median = medians[i];
        input->log_deviation = s[i];
        q *= exp(s[i] * s[i]);
    }
    for (size_t i = 0; i < INPUTS; i++) {
        const double own = exp(s[i] * s[i]);
        first[i] = (own - 1) / (q - 1);
        total[i] = (own - 1) * q / own / (q - 1);
    }
    if (study_request_complete(&request, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    Workspace workspace = {0};
    for (uint64_t seed = first_seed; seed < first_seed + trials; seed++) {
        const StudyTools tools = {.workspace = &workspace};
        Variant *answer;
        study->first_seed = seed;
        assert_int_equal(study_run(request.study, &request.simulation, &tools, &answer, &problem),
                         STATUS_OK);
        const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
        for (size_t i = 0, found = 0; i < ensemble->indices.count; i++) {
            const EnsembleIndex *index = &ensemble->indices.at[i];
            if (index->metric == STATISTICS_PEAK_ACCELERATION)
                note(found++, &index->sobol);
        }
        variant_free(answer);
    }
    workspace_clear(&workspace);
    study_request_clear(&request);
    return report("Scene with known variances");
}

int main(int argc, char **argv) {
    if (argc > 1)
        trials = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        first_seed = strtoull(argv[2], NULL, 10);
    const bool is_estimator = try_ishigami(), is_scene = try_scene();
    return is_estimator && is_scene ? 0 : 1;
}
