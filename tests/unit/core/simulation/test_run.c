#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "core/math/fourier.h"
#include "tests/support/paper.h"

static Outcome *run(bool is_random, double duration, Workspace *workspace) {
    Simulation simulation;
    Problem problem;
    Outcome *outcome;
    problem_clear(&problem);
    paper_scene(&simulation, 0.61, 0.025, duration);
    if (is_random)
        paper_random(&simulation, 1, 1);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, workspace, &outcome, &problem),
                     STATUS_OK);
    simulation_clear(&simulation);
    return outcome;
}

static void assert_same(const Columns *a, const Columns *b) {
    assert_int_equal(a->count, b->count);
    assert_int_equal(a->rows, b->rows);
    for (size_t c = 0; c < a->count; c++)
        assert_memory_equal(a->at[c].values, b->at[c].values, a->rows * sizeof(double));
}

static void a_workspace_leaves_no_trace_in_a_run(void **state) {
    (void)state;
    Workspace workspace = {0};
    for (int i = 0; i < 6; i++) {
        const bool is_random = i % 2 == 1;
        const double duration = 3 + i / 2 % 2;
        Outcome *fresh = run(is_random, duration, NULL);
        Outcome *used = run(is_random, duration, &workspace);
        assert_same(&fresh->response.series, &used->response.series);
        assert_same(&fresh->spectrum.densities, &used->spectrum.densities);
        assert_int_equal(fresh->response.impacts.count, used->response.impacts.count);
        for (size_t k = 0; k < fresh->response.impacts.count; k++)
            assert_true(fresh->response.impacts.at[k].start == used->response.impacts.at[k].start &&
                        fresh->response.impacts.at[k].impulse ==
                            used->response.impacts.at[k].impulse);
        assert_memory_equal(&fresh->response.energy, &used->response.energy,
                            sizeof fresh->response.energy);
        outcome_drop(fresh);
        outcome_drop(used);
    }
    workspace_clear(&workspace);
}

int main(void) {
    fourier_start();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_workspace_leaves_no_trace_in_a_run),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
