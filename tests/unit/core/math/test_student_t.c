

#include <math.h>

#include "core/base/status.h"
#include "core/math/student_t.h"
#include "tests/support/test.h"

static void assert_near(double is, double should, double most) {
    if (!(fabs(is / should - 1) <= most))
        fail_msg("is %.17g, should be %.17g", is, should);
}

TEST(quantiles_of_one_and_two_degrees_are_their_closed_forms) {
    static const double shares[] = {1e-6, 0.1, 0.5, 0.95, 0.99, 0.9999};
    for (size_t i = 0; i < COUNT(shares); i++) {
        const double p = shares[i];
        assert_near(student_t_quantile(p, 1), tan(3.14159265358979323846 * p / 2), 1e-11);
        assert_near(student_t_quantile(p, 2), p * sqrt(2 / (1 - p * p)), 1e-11);
    }
}

TEST(quantiles_are_those_of_scipy) {
    // By scipy.special.betaincinv; scipy.stats.t.ppf misses some of them by 1e-9.
    static const struct {
        double share;
        size_t freedom;
        double quantile;
    } known[] = {
        {0.99, 7, 3.4994832973504932},    {0.95, 63, 1.9983405425207417},
        {0.99, 1000, 2.5807546980658573}, {0.5, 3, 0.7648923284043452},
        {0.999, 4, 8.610301581379272},    {0.95, 9999, 1.9602012636208985},
        {0.99, 0, 2.5758293035489004},
    };
    for (size_t i = 0; i < COUNT(known); i++)
        assert_near(student_t_quantile(known[i].share, known[i].freedom), known[i].quantile, 1e-12);
}

TEST(quantiles_are_where_the_share_is) {
    for (size_t n = 0; n < 200; n++)
        for (double p = 0.05; p < 1; p += 0.05)
            assert_true(fabs(student_t_probability(student_t_quantile(p, n), n) - p) < 1e-14);
    assert_true(student_t_probability(0, 5) == 0);
    assert_true(student_t_probability(1e300, 6) == 1);
}
