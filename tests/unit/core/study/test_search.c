#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/search.h"
#include "tests/support/test.h"

typedef void Function(const double *point, double *results);

// Searches with so many candidates that are without results at a time.
static Search *search_run(const SearchSpace *space, Function *function, size_t pending) {
    Search *search;
    assert_int_equal(search_new(space, &search), STATUS_OK);
    while (search->added < search->space.candidates) {
        const size_t until = search->added + pending;
        while (search->proposed < search->space.candidates &&
               (search->proposed < search->sample || search->proposed < until))
            assert_int_equal(search_propose(search), STATUS_OK);
        double results[SEARCH_OBJECTIVES + SEARCH_CONSTRAINTS];
        function(search_point(search, search->added), results);
        search_add(search, results);
    }
    return search;
}

static double best_of(const Search *search) {
    const size_t best = search_best(search, 0);
    assert_true(best != SIZE_MAX);
    return search_results(search, best)[0];
}

// Branin's function has three equal minima of 0.397887.
static void branin(const double *point, double *results) {
    const double pi = 3.14159265358979, x = 15 * point[0] - 5, y = 15 * point[1];
    const double a = y - 5.1 / (4 * pi * pi) * x * x + 5 / pi * x - 6;
    results[0] = a * a + 10 * (1 - 1 / (8 * pi)) * cos(x) + 10;
}

TEST(the_minimum_of_a_smooth_function_needs_few_candidates) {
    for (uint64_t seed = 1; seed <= 3; seed++) {
        const SearchSpace space = {.variables = 2, .objectives = 1, .candidates = 60, .seed = seed};
        for (size_t pending = 1; pending <= 3; pending += 2) {
            Search *search = search_run(&space, branin, pending);
            assert_true(best_of(search) < 0.4);
            search_free(search);
        }
    }
}

static void branin_nearly_equal(const double *point, double *results) {
    branin(point, results);
    results[0] = 1 + 1e-10 * results[0];
}

TEST(values_that_agree_to_many_digits_are_searched_like_others) {
    const SearchSpace space = {.variables = 2, .objectives = 1, .candidates = 60, .seed = 1};
    Search *search = search_run(&space, branin_nearly_equal, 1);
    assert_true(best_of(search) < 1 + 0.4e-10);
    search_free(search);
}

TEST(the_same_seed_proposes_the_same_candidates_and_another_seed_others) {
    SearchSpace space = {.variables = 2, .objectives = 1, .candidates = 40, .seed = 5};
    Search *first = search_run(&space, branin, 2), *second = search_run(&space, branin, 2);
    space.seed = 6;
    Search *third = search_run(&space, branin, 2);
    const size_t size = 40 * 2 * sizeof(double);
    assert_memory_equal(search_point(first, 0), search_point(second, 0), size);
    assert_true(memcmp(search_point(first, 0), search_point(third, 0), size) != 0);
    search_free(first);
    search_free(second);
    search_free(third);
}

// The smallest x + y outside of a circle around the origin is at 45 degrees: sqrt(2) / 2.
static void corner(const double *point, double *results) {
    results[0] = -(point[0] + point[1]);
    results[1] = point[0] * point[0] + point[1] * point[1] - 0.25;
}

TEST(the_best_candidate_keeps_a_constraint_that_binds) {
    const SearchSpace space = {
        .variables = 2, .objectives = 1, .constraints = 1, .candidates = 60, .seed = 1};
    Search *search = search_run(&space, corner, 1);
    const size_t best = search_best(search, 0);
    assert_true(search_results(search, best)[1] <= 0);
    assert_true(best_of(search) < -0.99 * sqrt(0.5));
    search_free(search);
}

static void never(const double *point, double *results) {
    results[0] = point[0];
    results[1] = 1 + point[0] * point[0];
}

TEST(where_no_candidate_is_feasible_the_least_violation_is_searched) {
    const SearchSpace space = {
        .variables = 1, .objectives = 1, .constraints = 1, .candidates = 30, .seed = 1};
    Search *search = search_run(&space, never, 1);
    double least = INFINITY;
    assert_true(search_best(search, 0) == SIZE_MAX);
    for (size_t i = 0; i < 30; i++)
        least = fmin(least, search_violation(search, i));
    assert_true(least < 1.001);
    search_free(search);
}

static void failing(const double *point, double *results) {
    branin(point, results);
    if (point[0] > 0.5)
        results[0] = (double)NAN;
}

TEST(failed_candidates_are_infeasible_and_avoided) {
    const SearchSpace space = {.variables = 2, .objectives = 1, .candidates = 60, .seed = 1};
    Search *search = search_run(&space, failing, 1);
    size_t failed = 0;
    for (size_t i = search->sample; i < 60; i++)
        failed += search_violation(search, i) == (double)INFINITY;
    assert_true(failed < 15 && best_of(search) < 0.41);
    search_free(search);
}

static void all_fail(const double *point, double *results) {
    (void)point;
    results[0] = (double)NAN;
}

TEST(a_search_in_which_all_fail_ends) {
    const SearchSpace space = {.variables = 3, .objectives = 1, .candidates = 30, .seed = 1};
    Search *search = search_run(&space, all_fail, 2);
    assert_true(search_best(search, 0) == SIZE_MAX);
    search_free(search);
}

// Choice 3 of 6 is the best, and there at 0.7.
static void mixed(const double *point, double *results) {
    static const double levels[] = {3, 1, 2, 0, 4, 2};
    results[0] =
        levels[(size_t)point[0]] + (point[1] - 0.7) * (point[1] - 0.7) + 0.1 * fabs(point[2] - 4);
}

TEST(choices_with_and_without_order_are_found_beside_numbers) {
    const SearchSpace space = {.variable = {{6, false}, {0, false}, {9, true}},
                               .variables = 3,
                               .objectives = 1,
                               .candidates = 80,
                               .seed = 1};
    Search *search = search_run(&space, mixed, 1);
    const double *best = search_point(search, search_best(search, 0));
    assert_true(best[0] == 3 && best[2] == 4 && fabs(best[1] - 0.7) < 0.05);
    search_free(search);
}

TEST(few_combinations_are_all_tried_once) {
    const SearchSpace space = {.variable = {{6, false}, {1, false}, {9, true}},
                               .variables = 3,
                               .objectives = 1,
                               .candidates = 500,
                               .seed = 1};
    Search *search = search_run(&space, mixed, 1);
    bool is_tried[6][9] = {{false}};
    assert_int_equal(search->space.candidates, 54);
    for (size_t i = 0; i < 54; i++) {
        const double *point = search_point(search, i);
        bool *tried = &is_tried[(size_t)point[0]][(size_t)point[2]];
        assert_true(!*tried && point[1] == 0);
        *tried = true;
    }
    search_free(search);
}

// The front is the line between two corners.
static void two(const double *point, double *results) {
    const double a = point[0], b = point[1];
    results[0] = a * a + b * b;
    results[1] = (1 - a) * (1 - a) + b * b;
}

TEST(two_objectives_are_traded_along_the_whole_front) {
    const SearchSpace space = {.variables = 2, .objectives = 2, .candidates = 80, .seed = 1};
    Search *search = search_run(&space, two, 2);
    double widest = 0;
    for (double at = 0.05; at < 1; at += 0.05) {
        double nearest = INFINITY;
        for (size_t i = 0; i < 80; i++)
            nearest =
                fmin(nearest, hypot(search_point(search, i)[0] - at, search_point(search, i)[1]));
        widest = fmax(widest, nearest);
    }
    assert_true(widest < 0.12);
    search_free(search);
}
