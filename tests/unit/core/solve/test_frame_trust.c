// How far a run of the general engine can be trusted, against runs whose inputs are one rounding
// apart.
#include <math.h>
#include <stdlib.h>

#include "core/solve/exact.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

enum { STOREYS = 3, NEIGHBOURS = 4, SAMPLES = 30001 };

typedef struct Choice {
    double restitution, contact_time; // NAN: impulse
    double amplitude, frequency;      // of the base [m/s^2], [Hz]
} Choice;

static const Choice choices[] = {
    {0.61, 0.025, 1, 1}, {0.46, 0.0003, 1, 1}, {0.61, 0.025, 3, 4},
    {0.61, NAN, 2, 3},   {0.49, 0.003, 1, 3},
};

static void solve(const Choice *choice, int ulps, double *values, Response *response) {
    Plan *plan = frames_new(STOREYS, 2, 30, 1000);
    frames_uniform(plan, 10, 10 * 40 * 40, 0.01);
    frames_damper(plan, 0, 2, 1, 0.01, choice->restitution, choice->contact_time);
    frames_damper(plan, 1, 1, 0.5, 0.008, choice->restitution, choice->contact_time);
    for (int i = 0; i < ulps; i++) {
        plan->dampers[0].clearance = nextafter(plan->dampers[0].clearance, 1);
        plan->dampers[1].mass = nextafter(plan->dampers[1].mass, 0);
    }
    const Base base = {.form = BASE_SINE,
                       .amplitude = choice->amplitude,
                       .omega = 6.283185307179586 * choice->frequency};
    RunColumn columns[STOREYS];
    for (size_t i = 0; i < STOREYS; i++)
        columns[i] = (RunColumn){CHANNEL_DISPLACEMENT, i, values + i * SAMPLES};
    Run run = {.plan = plan, .base = &base, .columns = columns, .column_count = STOREYS};
    Problem problem;
    problem_clear(&problem);
    if (exact_run_engine(&run, response, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    plan_free(plan);
}

TEST(the_horizon_is_where_neighbours_part) {
    double *own = calloc(2 * STOREYS * SAMPLES, sizeof *own), *other = own + STOREYS * SAMPLES;
    assert_non_null(own);
    size_t parted = 0;
    for (size_t c = 0; c < COUNT(choices); c++) {
        Response response = {0};
        solve(&choices[c], 0, own, &response);
        size_t first = SIZE_MAX;
        for (int ulps = 1; ulps <= NEIGHBOURS; ulps++) {
            Response neighbours = {0};
            solve(&choices[c], ulps, other, &neighbours);
            for (size_t i = 0; i < STOREYS * SAMPLES; i++)
                if (i % SAMPLES < first &&
                    fabs(own[i] - other[i]) > 1e-6 * response.peaks.displacement)
                    first = i % SAMPLES;
            response_clear(&neighbours);
        }
        assert_true(response.has_trust);
        const double seen = first == SIZE_MAX ? INFINITY : (double)first / 1000;
        const double told = response.trust_horizon, estimate = response.error_estimate;
        if (isfinite(seen)) {
            parted++;
            assert_true(told >= 0.5 * seen && told <= 1.3 * seen);
            assert_true(estimate >= 1e-6 && estimate <= 1);
        } else if (!isnan(told)) { // as near to it as that
            assert_true(told >= 15);
        } else {
            assert_true(estimate > 0 && estimate < 1e-6);
        }
        response_clear(&response);
    }
    assert_true(parted >= 3);
    free(own);
}

TEST(without_dampers_only_the_phase_drifts) {
    Plan *plan = frames_new(STOREYS, 0, 10, 100);
    frames_uniform(plan, 10, 10 * 40 * 40, 0.01);
    plan->displacement[2] = 0.1;
    const Base still = {.form = BASE_STILL};
    Run run = {.plan = plan, .base = &still};
    Response response = {0};
    assert_int_equal(exact_run_engine(&run, &response, NULL), STATUS_OK);
    assert_true(response.has_trust && isnan(response.trust_horizon));
    assert_true(response.error_estimate > 1e-15 && response.error_estimate < 1e-12);
    response_clear(&response);
    plan_free(plan);
}
