// The energy balance as a judge: what was gained from nowhere fails the run, what was lost does
// not.
#include <math.h>
#include <string.h>

#include "core/solve/impact_log.h"
#include "tests/support/test.h"

static Problem problem;

// A run that starts with 2 J and ends with `end`, of which the base gave `input`.
static Status balance(double end, double input, double gain_max) {
    Response response = {0};
    ImpactLog ledger;
    WorkCounters work;
    const EnergyState first = {1.5, 0.5}, last = {end, 0};
    problem_clear(&problem);
    impact_log_start(&ledger, &response, 0, &first);
    ledger.gain_max = gain_max;
    impact_log_work(&ledger, input, 0);
    const Status status = impact_log_finish(&ledger, 0, &last, &work, &problem);
    response_clear(&response);
    return status;
}

TEST(a_gain_that_nothing_explains_fails_with_both_numbers) {
    assert_int_equal(balance(2.5, 0, 1e-6), STATUS_UNSTABLE);
    assert_non_null(strstr(problem.detail, "gained 0.5 J"));
    assert_non_null(strstr(problem.detail, "largest energy, 2.5 J"));
    assert_int_equal(balance(2 + 1e-5, 0, 1e-6), STATUS_UNSTABLE);
}

TEST(a_gain_from_the_base_is_explained) {
    assert_int_equal(balance(2.5, 0.5, 1e-6), STATUS_OK);
}

TEST(a_loss_and_rounding_do_not_fail) {
    assert_int_equal(balance(1, 0, 1e-6), STATUS_OK);
    assert_int_equal(balance(2 + 1e-7, 0, 1e-6), STATUS_OK);
}

TEST(a_gain_on_the_way_fails_even_if_it_is_lost_again) {
    Response response = {0};
    ImpactLog ledger;
    WorkCounters work;
    const EnergyState first = {2, 0}, middle = {3, 0};
    problem_clear(&problem);
    impact_log_start(&ledger, &response, 0, &first);
    ledger.gain_max = 1e-6;
    assert_int_equal(impact_log_status(&ledger, &problem), STATUS_OK);
    impact_log_balance(&ledger, &middle);
    assert_int_equal(impact_log_status(&ledger, &problem), STATUS_UNSTABLE);
    assert_int_equal(impact_log_finish(&ledger, 0, &first, &work, &problem), STATUS_UNSTABLE);
    response_clear(&response);
}

TEST(a_solver_that_does_not_ask_is_not_judged) {
    assert_int_equal(balance(20, 0, 0), STATUS_OK);
}
