// When a pulse ends under a pull, against the motion in small steps.
#include <math.h>

#include "core/base/status.h"
#include "core/drop_test/pulse_model.h"
#include "tests/support/test.h"

static const double decays[] = {-0.3, 0.02, 0.3, 0.7, 1.3, 2, 3};
static const double pulls[] = {1e-12, 1e-6, 0.05, 0.3, 1, 2, 5, 20};

// y'' + 2 L y' + (turn + L^2) y = pull from y = 0, y' = 1 by Runge and Kutta's method, until y or
// the force is back at 0; INFINITY: not within 8 T_c.
static double last(const PulseModel *shape, int separation) {
    const double h = 1e-4, c = 2 * shape->decay;
    const double k = shape->turn + shape->decay * shape->decay, g = shape->pull;
    double y = 0, v = 1, before = 0;
    for (int i = 0; i < 80000; i++) {
        const double rest = separation == SEPARATION_ZERO_FORCE ? k * y + c * v : y;
        if (i > 5000 && rest < 0)
            return h * (i - 1 + before / (before - rest));
        before = rest;
        const double a = g - k * y - c * v;
        const double v1 = v + h / 2 * a, a1 = g - k * (y + h / 2 * v) - c * v1;
        const double v2 = v + h / 2 * a1, a2 = g - k * (y + h / 2 * v1) - c * v2;
        const double v3 = v + h * a2, a3 = g - k * (y + h * v2) - c * v3;
        y += h / 6 * (v + 2 * v1 + 2 * v2 + v3);
        v += h / 6 * (a + 2 * a1 + 2 * a2 + a3);
    }
    return (double)INFINITY;
}

TEST(a_pull_lengthens_a_pulse_as_the_motion_says) {
    int endless = 0;
    for (int rule = 0; rule < 2; rule++)
        for (size_t i = 0; i < COUNT(decays); i++)
            for (size_t j = 0; j < COUNT(pulls); j++) {
                const PulseModel shape = pulse_model_make(decays[i], pulls[j], false, rule);
                const double should = last(&shape, rule);
                if (isinf(should)) {
                    assert_true(isinf(shape.length));
                    endless++;
                } else if (!(fabs(shape.length - should) < 1e-6)) {
                    fail_msg("rule %d, L = %g, pull %g: %.12g should be %.12g", rule, decays[i],
                             pulls[j], shape.length, should);
                }
            }
    assert_in_range(endless, 10, 60);
}

TEST(the_pull_is_known_by_how_long_the_pulse_lasts) {
    for (int rule = 0; rule < 2; rule++)
        for (size_t i = 0; i < COUNT(decays); i++)
            for (size_t j = 0; j < COUNT(pulls); j++) {
                const PulseModel shape = pulse_model_make(decays[i], pulls[j], false, rule);
                if (isinf(shape.length))
                    continue;
                const PulseModel same =
                    pulse_model_make(decays[i], pulls[j] * shape.length, true, rule);
                if (!(fabs(same.length - shape.length) < 1e-9))
                    fail_msg("rule %d, L = %g, pull %g: %.12g should be %.12g", rule, decays[i],
                             pulls[j], same.length, shape.length);
                assert_true(fabs(same.pull / shape.pull - 1) < 1e-9);
            }
    assert_true(isinf(pulse_model_make(0.7, 100, true, SEPARATION_ZERO_PENETRATION).length));
    assert_true(isinf(pulse_model_make(0.7, 100, true, SEPARATION_ZERO_FORCE).length));
}
