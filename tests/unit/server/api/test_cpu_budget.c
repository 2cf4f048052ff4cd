// How long handlers work on drop tests: by time spent, made by beginning in the past.
#include "server/api/cpu_budget.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static App app;
static Problem problem;

static void begin_before(double seconds, int others, CpuBudget *budget) {
    atomic_store(&app.evaluations, others);
    atomic_store(&app.is_stopping, false);
    problem_clear(&problem);
    cpu_budget_begin(&app, budget);
    budget->from_ns -= (int64_t)(1e9 * seconds);
}

static void what_is_quick_needs_no_place(void **state) {
    (void)state;
    CpuBudget budget;
    begin_before(0, 4, &budget);
    assert_true(cpu_budget_lasts(&budget, 0));
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 4);
}

static void what_takes_longer_has_a_place_until_it_ends(void **state) {
    (void)state;
    CpuBudget budget;
    begin_before(1, 3, &budget);
    assert_true(cpu_budget_lasts(&budget, 0));
    assert_true(cpu_budget_lasts(&budget, 0));
    assert_int_equal(atomic_load(&app.evaluations), 4);
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 3);
}

static void without_a_place_it_is_given_up(void **state) {
    (void)state;
    CpuBudget budget;
    begin_before(1, 4, &budget);
    assert_false(cpu_budget_lasts(&budget, 0));
    assert_int_equal(cpu_budget_report(&budget, &problem), STATUS_BUSY);
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 4);
}

static void nothing_goes_on_for_ever(void **state) {
    (void)state;
    CpuBudget budget;
    begin_before(100, 0, &budget);
    assert_false(cpu_budget_lasts(&budget, 0));
    assert_int_equal(cpu_budget_report(&budget, &problem), STATUS_LIMIT);
    cpu_budget_end(&budget);
    assert_int_equal(atomic_load(&app.evaluations), 0);
}

static void a_daemon_that_stops_waits_for_none(void **state) {
    (void)state;
    CpuBudget budget;
    begin_before(0, 0, &budget);
    atomic_store(&app.is_stopping, true);
    assert_false(cpu_budget_lasts(&budget, 0));
    assert_int_equal(cpu_budget_report(&budget, &problem), STATUS_BUSY);
    cpu_budget_end(&budget);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_quick_needs_no_place),
        cmocka_unit_test(what_takes_longer_has_a_place_until_it_ends),
        cmocka_unit_test(without_a_place_it_is_given_up),
        cmocka_unit_test(nothing_goes_on_for_ever),
        cmocka_unit_test(a_daemon_that_stops_waits_for_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
