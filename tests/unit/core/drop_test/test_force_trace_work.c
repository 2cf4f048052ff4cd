// How much work a trace is under gravity: counted, not timed.
#include <math.h>

#include "core/base/philox.h"
#include "core/base/status.h"
#include "core/drop_test/force_trace.h"
#include "core/drop_test/pulse_model.h"
#include "tests/support/test.h"

// In place of the library's: each look at a pulse takes one.
static size_t looks;
double exp(double x) {
    looks++;
    return (double)expl(x);
}

enum { COUNT_MAX = 600 };
static const double interval = 1e-3, T_c = 0.02, m_e = 0.1, v0 = 0.5;

// One contact of 20 samples and more; how many looks reading it takes.
static size_t work(double pull, int separation, bool by_mass) {
    double values[COUNT_MAX];
    philox_normal_pairs(5, 7, 0, COUNT_MAX / 2, values);
    const PulseModel shape = pulse_model_make(0.25, pull, false, separation);
    for (size_t i = 0; i < COUNT_MAX; i++) {
        const double s = ((double)i - 290.37) * interval / T_c;
        values[i] *= 0.02;
        if (s >= 0 && s <= shape.length)
            values[i] += m_e * v0 / T_c * pulse_model_force(&shape, s);
    }
    const TraceOptions way = {
        .separation = separation,
        .threshold = (double)NAN,
        .gravity = pull * v0 / T_c,
        .effective_mass = by_mass ? m_e : (double)NAN,
        .approach_speeds = &v0,
        .approach_speed_count = by_mass ? 0 : 1,
    };
    TraceAnalysis reading;
    const size_t before = looks;
    assert_int_equal(
        trace_analysis_run(interval, &(Reals){values, COUNT_MAX}, &way, "/force", &reading, NULL),
        STATUS_OK);
    assert_int_equal(reading.contacts.count, 1);
    if (reading.contacts.at[0].why != NULL)
        fail_msg("%s", reading.contacts.at[0].why);
    assert_true(fabs(reading.contacts.at[0].contact_time / T_c - 1) < 0.03);
    trace_analysis_clear(&reading);
    return looks - before;
}

TEST(gravity_does_not_make_a_fit_much_dearer) {
    static const double pulls[] = {0.2, 0.6, 1.5};
    for (int rule = 0; rule < 2; rule++) {
        const size_t without = work(0, rule, false);
        assert_in_range(without, 1000, 10000000);
        for (size_t i = 0; i < COUNT(pulls); i++)
            for (int by_mass = 0; by_mass < 2; by_mass++) {
                const size_t with = work(pulls[i], rule, by_mass == 1);
                if (with > 5 * without)
                    fail_msg("rule %d, pull %g, %s: %zu looks, %zu without", rule, pulls[i],
                             by_mass == 1 ? "by mass" : "by speed", with, without);
            }
    }
}
