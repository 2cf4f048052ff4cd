// Contacts in closed form, brief ones and such as go by eights, against arcs; and the same bytes
// with every width of vector.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/solve/exact_press.h"
#include "core/solve/exact_ride.h"
#include "core/solve/exact_stride.h"

enum { SAMPLES = 1200, FIRST = 7, COLUMNS = 4, ALL = SAMPLES - 1 - FIRST };
static const double RATE = 1000, MASS = 1.35, FREE_MASS = 0.1107, PI = 3.141592653589793;
static const ChannelId wanted[COLUMNS] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY,
                                          CHANNEL_PENETRATION, CHANNEL_CONTACT_FORCE};

typedef struct Case {
    double restitution, contact_time;
    BaseForm base;
    double pull; // of the base's mean [m/s^2]
    double part; // of an interval, at the touch
    Side side;
    bool has_means;
    size_t least; // samples that the contact lasts
} Case;

static const Case cases[] = {
    {0.46, 0.0003, BASE_STILL, 0, 0.2, SIDE_RIGHT, false, 0},
    {0.46, 0.0003, BASE_SAMPLED, 0, 0.9, SIDE_LEFT, false, 1},
    {0.46, 0.0003, BASE_SINE, 0, 0.81, SIDE_RIGHT, true, 1},
    {0.53, 0.004, BASE_SAMPLED, 0, 0.4, SIDE_LEFT, false, 4},
    {0.61, 0.025, BASE_STILL, 0, 0.99, SIDE_RIGHT, false, 20},
    {0.61, 0.025, BASE_SAMPLED, 0, 0.01, SIDE_RIGHT, false, 20},
    {0.61, 0.025, BASE_SAMPLED, 0, 0.3, SIDE_LEFT, true, 20},
    {0.61, 0.025, BASE_SINE, 0, 0.5, SIDE_LEFT, false, 20},
    {0.9, 0.06, BASE_SAMPLED, 12, 0.5, SIDE_LEFT, false, 60},
    {0.61, 0.025, BASE_SINE, 9, 0.5, SIDE_LEFT, false, 20},
};

// A contact from its touch on, with all that it needs; big, so not on the stack.
typedef struct Small {
    Exact exact;
    Plan plan;
    PlanDamper damper;
    Base base;
    Run run;
    Response response;
    double values[SAMPLES + 1], columns[COLUMNS + 1][SAMPLES];
    double stiffness, damping, mass;
    size_t passed;
} Small;

static const State touch = {0.004, -0.11, 0, 0.37};

static double sine_of(const Case *c) {
    return c->base == BASE_SINE ? 11 : 0;
}

// Made as exact.c makes it, and carried through the contact.
static Small *press(const Case *c, LanesWidth width, size_t most) {
    const size_t room = (sizeof(Small) + 63) / 64 * 64; // vectors want their alignment
    Small *small = aligned_alloc(64, room);
    assert_non_null(small);
    memset(small, 0, room);
    Exact *exact = &small->exact;
    small->mass = MASS;
    small->stiffness = 865;
    small->damping = 1.092;
    const double effective = MASS * FREE_MASS / (MASS + FREE_MASS), loss = log(c->restitution);
    const PlanStop stop = {.stiffness = effective * (PI * PI + loss * loss) /
                                        (c->contact_time * c->contact_time),
                           .damping = -2 * effective * loss / c->contact_time};
    small->damper = (PlanDamper){.mass = FREE_MASS, .clearance = 0.015, .stops = {stop, stop}};
    small->plan = (Plan){.storeys = 1,
                         .mass = &small->mass,
                         .stiffness = &small->stiffness,
                         .damping = &small->damping,
                         .dampers = &small->damper,
                         .damper_count = 1,
                         .form = CONTACT_LINEAR,
                         .duration = SAMPLES / RATE,
                         .sample_rate = RATE,
                         .count = SAMPLES};
    for (size_t i = 0; i <= SAMPLES; i++)
        small->values[i] = c->pull + 2 * sin(0.09 * (double)i) + cos(1.3 * (double)(i * i % 23));
    small->base = (Base){.form = c->base, .amplitude = 3 + c->pull, .omega = sine_of(c)};
    if (c->base == BASE_SAMPLED) {
        small->base.values = small->values;
        small->base.count = SAMPLES + 1;
        small->base.interval = 1 / RATE;
    }
    RunColumn columns[COLUMNS + 1];
    for (size_t i = 0; i < COLUMNS; i++)
        columns[i] = (RunColumn){wanted[i], 0, small->columns[i]};
    columns[COLUMNS] = (RunColumn){CHANNEL_MEAN_ACCELERATION, 0, small->columns[COLUMNS]};
    small->run = (Run){.plan = &small->plan,
                       .base = &small->base,
                       .columns = columns,
                       .column_count = c->has_means ? COLUMNS + 1 : COLUMNS};
    exact->run = &small->run;
    exact->plan = &small->plan;
    exact->damper = &small->damper;
    exact->interval = 1 / RATE;
    const double share = FREE_MASS / (MASS + FREE_MASS);
    exact->flying = (Motion){
        .omega2 = small->stiffness / MASS, .damping = small->damping / MASS, .share = share};
    exact->flying.rate = sqrt(exact->flying.omega2);
    exact->resting = exact->flying;
    exact->resting.is_resting = true;
    for (int i = 0; i < 2; i++) {
        Motion *touching = &exact->touching[i];
        *touching = exact->flying;
        touching->contact_omega2 = stop.stiffness / effective;
        touching->contact_damping = stop.damping / effective;
        touching->rate += sqrt(touching->contact_omega2) + touching->contact_damping;
        exact->key.contact_omega2[i] = touching->contact_omega2;
        exact->key.contact_damping[i] = touching->contact_damping;
    }
    exact->key.base_omega = small->base.omega;
    base_cursor_make(&exact->base, &small->base, RATE);
    const EnergyState held = {0.2, 0}; // beside a base that jumps, closed forms want some
    impact_log_start(&exact->ledger, &small->response, 0, &held);
    exact_record_start(&exact->recorder, &small->run, &small->response);
    small->run.columns = NULL;
    exact_stride_start(exact);
    assert_true(exact->has_hops);
    exact->lanes.width = width;
    exact->state = touch;
    exact->state.w *= exact_sign(c->side);
    trust_start(&exact->trust, &exact->flying, exact->touching, &exact->resting, &exact->state,
                0.015, false, 1);
    exact->trust.is_wide = width != LANES_PLAIN;
    exact->sample = FIRST;
    exact->offset = c->part / RATE;
    exact->phase = CONTACT;
    exact->side = c->side;
    exact->origin = (Origin)c->side;
    impact_log_open(&exact->row, IMPACT_IMPACT, exact_time(exact), 0, c->side,
                    fabs(exact->state.w));
    impact_log_force(&exact->ledger, &exact->row, stop.damping * fabs(exact->state.w));
    small->passed = exact_stride_press(exact, most);
    return small;
}

static void drop(Small *small) {
    exact_forget(&small->exact);
    response_clear(&small->response);
    free(small);
}

static void assert_near(double value, double right, double most) {
    if (!(fabs(value - right) <= most))
        fail_msg("%.17g is not within %g of %.17g", value, most, right);
}

// The same by arcs, checking every sample on the way and all that is left at the end.
static void assert_is_arcs(const Case *c, const Small *small) {
    const Exact *exact = &small->exact;
    const Motion *m = &exact->touching[c->side];
    const double sign = exact_sign(c->side), total = MASS + FREE_MASS;
    const double mass = exact_effective_mass(exact), omega = sqrt(m->contact_omega2);
    State at = touch;
    at.w *= sign;
    double offset = c->part / RATE, length = 0, impulse = 0, vv = 0, ww = 0, work = 0;
    double peak = m->contact_damping * touch.w;
    size_t sample = FIRST;
    for (bool is_over = false; !is_over;) {
        Slice slice;
        (void)base_cursor_slice(&exact->base, sample, offset, &slice);
        const double left = 1 / RATE - offset, step = fmin(left, 0.3 / m->rate);
        Arc arc;
        arc_make(&arc, m, &at, &slice, step);
        double gap[ROOT_DEGREE + 1] = {0}, s;
        for (size_t k = 0; k <= arc.degree; k++)
            gap[k] = sign * arc.r[k];
        gap[0] = fmax(gap[0], 0);
        is_over = root_first_crossing(gap, arc.degree, &s);
        if (is_over)
            arc_cut(&arc, s);
        const ArcIntegrals integrals = arc_integrals(&arc);
        double where;
        peak = arc_peak_force(&arc, peak, &where);
        at = arc_end(&arc);
        offset += arc.length;
        length += arc.length;
        impulse += arc_impulse(&arc);
        vv += integrals.vv;
        ww += integrals.ww;
        work -= MASS * integrals.av + FREE_MASS * (integrals.av + integrals.aw);
        if (is_over || step < left)
            continue;
        sample++;
        offset = 0;
        assert_true(sample < SAMPLES - 1);
        const double n = m->contact_damping * at.w + m->contact_omega2 * at.r;
        assert_near(small->columns[0][sample], at.x, 1e-14);
        assert_near(small->columns[1][sample], at.v, 1e-12);
        assert_near(small->columns[2][sample], sign * at.r, 1e-13 / omega);
        assert_near(small->columns[3][sample], mass * n, 1e-12 * mass * omega);
    }
    const Impact *impact = &small->response.impacts.at[0];
    assert_int_equal(small->response.impacts.count, 1);
    assert_int_equal(exact->phase, FLIGHT);
    assert_int_equal(exact->sample, sample);
    assert_int_equal(small->passed, sample - FIRST);
    assert_true(small->passed >= c->least);
    assert_near(exact->offset, offset, 1e-13 / omega + 1e-18 * (double)sample);
    assert_near(exact->state.x, at.x, 1e-14);
    assert_near(exact->state.v, at.v, 1e-12);
    assert_near(exact->state.w, at.w, 1e-12);
    assert_true(exact->state.r == 0);
    assert_near(impact->duration, length, 1e-13 / omega + 1e-15 * length);
    assert_near(impact->impulse, fabs(mass * impulse), 1e-12 * fabs(mass * impulse));
    assert_near(impact->peak_force, mass * peak, 1e-12 * mass * peak);
    assert_near(impact->energy_lost, small->damper.stops[0].damping * ww, 2e-12 * total);
    assert_near(exact->ledger.energy.structural_damping, small->damping * vv, 2e-12 * total);
    assert_near(exact->ledger.energy.input, work, 2e-12 * total);
}

static void a_contact_in_closed_form_is_what_arcs_make_of_it(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Small *small = press(&cases[i], lanes_widest(), ALL);
        assert_is_arcs(&cases[i], small);
        drop(small);
    }
}

static void every_width_gives_the_same_bytes(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        Small *plain = press(&cases[i], LANES_PLAIN, ALL);
        for (LanesWidth width = LANES_AVX2; width <= lanes_widest(); width++) {
            Small *wide = press(&cases[i], width, ALL);
            assert_int_equal(wide->passed, plain->passed);
            assert_memory_equal(wide->columns, plain->columns, sizeof plain->columns);
            assert_memory_equal(wide->response.impacts.at, plain->response.impacts.at,
                                sizeof *plain->response.impacts.at);
            assert_memory_equal(&wide->response.peaks, &plain->response.peaks, sizeof(Peaks));
            assert_memory_equal(&wide->exact.ledger.energy, &plain->exact.ledger.energy,
                                sizeof(Energy));
            assert_memory_equal(&wide->exact.state, &plain->exact.state, sizeof(State));
            assert_memory_equal(wide->exact.trust.y, plain->exact.trust.y,
                                sizeof plain->exact.trust.y);
            drop(wide);
        }
        drop(plain);
    }
}

static void a_contact_stops_where_it_is_told_to(void **state) {
    (void)state;
    const Case *c = &cases[8];
    Small *whole = press(c, lanes_widest(), ALL), *part = press(c, lanes_widest(), 42);
    assert_int_equal(part->passed, 42);
    assert_int_equal(part->exact.phase, CONTACT);
    assert_true(part->exact.row.is_open && part->exact.offset == 0);
    assert_int_equal(part->response.impacts.count, 0);
    const double h = 1 / RATE;
    assert_near(part->exact.row.impact.duration, (42 - c->part) * h, 1e-15);
    for (size_t j = FIRST; j <= FIRST + 42; j++)
        assert_near(part->columns[0][j], whole->columns[0][j], 1e-15);
    assert_true(part->columns[0][FIRST + 43] == 0 && whole->columns[0][FIRST + 43] != 0);
    drop(part);
    drop(whole);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_contact_in_closed_form_is_what_arcs_make_of_it),
        cmocka_unit_test(every_width_gives_the_same_bytes),
        cmocka_unit_test(a_contact_stops_where_it_is_told_to),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
