// How long handlers work on drop tests: by time spent, made by beginning in the past.
#include "server/api/cpu_budget.h"
#include "tests/support/test.h"

static App app;
static Problem problem;

static void begin_before(double seconds, int others, CpuBudget *budget) {
    atomic_store(&app.evaluations, others);
    atomic_store(&app.is_stopping, false);
    problem_clear(&problem);
    cpu_budget_begin(&app, budget);
    budget->from_ns -= (int64_t)(1e9 * seconds);
}

TEST(what_is_quick_needs_no_place) {
    CpuBudget budget;
    begin_before(0, 4, &budget);
    assert_true(cpu_budget_lasts(&budget, 0));
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 4);
}

TEST(what_takes_longer_has_a_place_until_it_ends) {
    CpuBudget budget;
    begin_before(1, 3, &budget);
    assert_true(cpu_budget_lasts(&budget, 0));
    assert_true(cpu_budget_lasts(&budget, 0));
    assert_int_equal(atomic_load(&app.evaluations), 4);
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 3);
}

TEST(without_a_place_it_is_given_up) {
    CpuBudget budget;
    begin_before(1, 4, &budget);
    assert_false(cpu_budget_lasts(&budget, 0));
    assert_int_equal(cpu_budget_report(&budget, &problem), STATUS_BUSY);
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 4);
}

TEST(nothing_goes_on_for_ever) {
    CpuBudget budget;
    begin_before(100, 0, &budget);
    assert_false(cpu_budget_lasts(&budget, 0));
    assert_int_equal(cpu_budget_report(&budget, &problem), STATUS_LIMIT);
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 0);
}

TEST(a_daemon_that_stops_waits_for_none) {
    CpuBudget budget;
    begin_before(0, 0, &budget);
    atomic_store(&app.is_stopping, true);
    assert_false(cpu_budget_lasts(&budget, 0));
    assert_int_equal(cpu_budget_report(&budget, &problem), STATUS_BUSY);
    cpu_budget_end(&budget);
}
