// Short series of free flight against arcs.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/solve/hop.h"

static void assert_hop_is_arc(const Slice *slice) {
    const Motion motion = {.omega2 = 640, .damping = 0.81, .share = 0.0758, .rate = 25.3};
    const State start = {0.007, -0.2, 0.001, 0.3};
    Hop hop;
    Arc arc;
    HopTable table;
    hop_table_make(&table, &motion, slice->omega, 1e-3);
    hop_make(&hop, &table, &start, slice);
    for (int i = 1; i <= 10; i++) {
        const double s = 0.1 * i;
        arc_make(&arc, &motion, &start, slice, s * 1e-3);
        const State at = arc_end(&arc);
        State got;
        hop_at(&hop, s, &got);
        const double push = motion.damping * at.v + motion.omega2 * at.x;
        double slope, bend;
        const double r = hop_gap(&hop, s, &slope, &bend);
        assert_true(fabs(got.x - at.x) < 1e-17);
        assert_true(fabs(got.v - at.v) < 1e-15);
        assert_true(fabs(got.r - at.r) < 1e-17 && fabs(r - at.r) < 1e-17);
        assert_true(fabs(got.w - at.w) < 1e-15 && fabs(slope - 1e-3 * at.w) < 1e-18);
        assert_true(fabs(bend - 1e-6 * push / 2) < 1e-3 * fabs(bend));
        const ArcIntegrals its = arc_integrals(&arc);
        ArcIntegrals mine;
        hop_integrals(&hop, s, &mine);
        assert_true(fabs(mine.vv - its.vv) < 1e-13 * its.vv);
        assert_true(fabs(mine.av - its.av) < 1e-13 * fabs(its.av));
        assert_true(fabs(mine.aw - its.aw) < 1e-13 * fabs(its.aw));
        assert_true(fabs(mine.a - its.a) < (slice->omega > 0 ? 4e-14 : 1e-15) * fabs(its.a));
    }
}

static void a_hop_agrees_with_an_arc(void **state) {
    (void)state;
    static const Slice slices[] = {{1.5, -200, 0}, {1.5, -0.7, 6.3}, {0.4, 2.1, 40}};
    for (int i = 0; i < 3; i++)
        assert_hop_is_arc(&slices[i]);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_hop_agrees_with_an_arc)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
