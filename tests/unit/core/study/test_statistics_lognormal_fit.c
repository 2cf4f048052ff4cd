// Lognormal distributions of censored numbers: exact cases, cases without a maximum, and how often
// the intervals contain what the numbers were drawn from.
#include "core/study/statistics.h"

#include <math.h>

#include "core/base/philox.h"
#include "core/base/status.h"
#include "tests/support/test.h"

static const double NONE = (double)INFINITY;

// Of numbers below 2 a quarter, of those below 8 three quarters: Phi((ln 8 - mu) / beta) = 3/4.
TEST(two_fractions_fix_the_distribution) {
    CensoredNumber numbers[40];
    for (size_t i = 0; i < 40; i++)
        numbers[i] = i < 10   ? (CensoredNumber){0, 2}
                     : i < 30 ? (CensoredNumber){2, 8}
                              : (CensoredNumber){8, NONE};
    LognormalFit fit;
    assert_true(lognormal_fit(numbers, 40, 0.95, &fit));
    assert_true(fabs(fit.median - 4) < 1e-12);
    assert_true(fabs(fit.dispersion - log(2) / 0.67448975019608174) < 1e-12);
    assert_true(fit.median_interval[0] < 4 && fit.median_interval[1] > 4);
    assert_true(fabs(fit.median_interval[0] * fit.median_interval[1] - 16) < 1e-10);
    assert_true(fit.dispersion_interval[0] < fit.dispersion &&
                fit.dispersion_interval[1] > fit.dispersion);
}

// The scale of the numbers does not matter, nor does that of their logarithm.
TEST(a_fit_follows_units_and_powers) {
    CensoredNumber numbers[30], powers[30];
    double normal[30];
    philox_normal_pairs(3, 0, 0, 15, normal);
    for (size_t i = 0; i < 30; i++) {
        const double low = floor(2 * exp(0.5 * normal[i]) * 4) / 4;
        numbers[i] = (CensoredNumber){low, low + 0.25};
        powers[i] = (CensoredNumber){1e-6 * pow(low, 3), 1e-6 * pow(low + 0.25, 3)};
    }
    LognormalFit a, b;
    assert_true(lognormal_fit(numbers, 30, 0.95, &a) && lognormal_fit(powers, 30, 0.95, &b));
    assert_true(fabs(b.median / (1e-6 * pow(a.median, 3)) - 1) < 1e-9);
    assert_true(fabs(b.dispersion / (3 * a.dispersion) - 1) < 1e-9);
}

TEST(numbers_that_fix_nothing_have_no_fit) {
    static const struct {
        CensoredNumber numbers[4];
        size_t count;
    } cases[] = {
        {{{0, NONE}}, 0},                         // none
        {{{1, NONE}, {2, NONE}}, 2},              // all beyond
        {{{0, 1}, {0, 1}}, 2},                    // all before
        {{{0, 1}, {0, 1}, {1, NONE}}, 3},         // one bound alone
        {{{1, 2}, {1, 2}, {1, 2}}, 3},            // all in one interval
        {{{1, 3}, {2, 4}, {0, 3}, {1, NONE}}, 4}, // 2 to 3 is in all of them
    };
    LognormalFit fit;
    for (size_t i = 0; i < COUNT(cases); i++)
        assert_false(lognormal_fit(cases[i].numbers, cases[i].count, 0.95, &fit));
}

// 1,000 suites of 40 records at 12 levels.
TEST(intervals_contain_what_the_numbers_were_drawn_from) {
    enum { SUITES = 1000, RECORDS = 40, LEVELS = 12 };
    const double median = 3, dispersion = 0.45;
    size_t fits = 0, medians = 0, dispersions = 0;
    for (size_t k = 0; k < SUITES; k++) {
        CensoredNumber numbers[RECORDS];
        double normal[RECORDS];
        philox_normal_pairs(17, k, 0, RECORDS / 2, normal);
        for (size_t i = 0; i < RECORDS; i++) {
            const double capacity = median * exp(dispersion * normal[i]);
            numbers[i] = (CensoredNumber){0, NONE};
            for (size_t l = 1; l <= LEVELS && isinf(numbers[i].high); l++) {
                const double level = 0.75 * (double)l;
                *(level < capacity ? &numbers[i].low : &numbers[i].high) = level;
            }
        }
        LognormalFit fit;
        if (!lognormal_fit(numbers, RECORDS, 0.95, &fit))
            continue;
        fits++;
        medians += fit.median_interval[0] <= median && median <= fit.median_interval[1];
        dispersions +=
            fit.dispersion_interval[0] <= dispersion && dispersion <= fit.dispersion_interval[1];
    }
    print_message("%zu fits of %d; the median is within %.1f %% of its intervals, the dispersion "
                  "within %.1f %%\n",
                  fits, (int)SUITES, 100 * (double)medians / (double)fits,
                  100 * (double)dispersions / (double)fits);
    assert_true(fits == SUITES);
    assert_true(medians >= 920 && medians <= 980 && dispersions >= 920 && dispersions <= 980);
}
