// One linear contact in closed form (contact_modes.h), from touch to release, stretch by stretch:
// as far as it is proved that nothing is missed. What is sure about a contact:
// - where the buffer is slow beside the sample interval, p cannot get back to 0 between two samples
//   against the bound of its curvature;
// - elsewhere, with q = e^(c t / 2) p and s the structure's push, q'' + w^2 q = e^(c t / 2) s, so
//   that by Sturm's comparison q stays positive up to pi - 2 S / (w p'(0)), S the most by which the
//   right side pulls; from there on p falls.
#include "core/solve/linear_contact.h"

#include <math.h>

// Of energies, over all samples of a contact: times DBL_EPSILON, what its closed form may lose.
static const double APART_MAX = 4e4;

enum { PRESS_FRESH = 64 }; // samples after which a sine is looked up again

typedef struct LinearContact {
    SingleMass *single;
    const ContactModes *modes;
    double sign;
    Four d; // at the beginning of the present stretch
    double a, slope;
    double elapsed;                      // since the touch [s]
    double lasts;                        // surely until then [s]
    double speed, absolute;              // at the touch: |w|, and the free mass's velocity
    double vv, ww, work, gained, length; // since then
} LinearContact;

// The base at t of the present stretch.
INLINE void linear_contact_base(const LinearContact *contact, double t, double *a, double *slope) {
    const double omega = contact->modes->base_omega;
    if (omega == 0) {
        *a = contact->a + contact->slope * t;
        *slope = contact->slope;
        return;
    }
    const Slice now = {contact->a, contact->slope, omega};
    Slice then;
    single_mass_turn(&now, t, &then);
    *a = then.value;
    *slope = then.slope;
}

// |r''| of oscillations is not larger, with what a sine makes of it.
INLINE double linear_contact_bend(const LinearContact *contact) {
    const ContactModes *p = contact->modes;
    const Four d = contact->d;
    return p->size2[0] * (fabs(d[0]) + fabs(d[1])) + p->size2[1] * (fabs(d[2]) + fabs(d[3])) +
           p->sway * contact->single->stretch.base_max;
}

// The integrals' parts that hang on the present instant alone, `sign` times; under a sine with what
// that adds, also steadily over `length`.
INLINE void linear_contact_ends(LinearContact *contact, double sign, double length) {
    const ContactModes *p = contact->modes;
    double vv = contact_modes_form(&p->vv, &contact->d),
           ww = contact_modes_form(&p->ww, &contact->d);
    if (p->base_omega > 0) {
        const double a = contact->a, s = contact->slope, total = (a * a + s * s) * length;
        vv += contact_modes_sine(&p->sine_vv, &contact->d, a, s) + total * p->sine_vv.steady;
        ww += contact_modes_sine(&p->sine_ww, &contact->d, a, s) + total * p->sine_ww.steady;
        contact->work -=
            sign * (contact->single->plan->mass[0] + contact->single->damper->mass) *
            (contact_modes_sine(&p->sine_work, &contact->d, a, s) + total * p->sine_work.steady);
    }
    contact->vv += sign * vv;
    contact->ww += sign * ww;
}

// Until when the contact surely lasts by comparison with the isolated one.
INLINE double linear_contact_surely_lasts(const LinearContact *contact) {
    const SingleMass *single = contact->single;
    const ContactModes *modes = contact->modes;
    const Motion *m = &single->touching[single->side];
    const double T = 1.3 * modes->time, w = contact->speed;
    // How fast the push can change: the structure's speed and acceleration, with room to spare.
    const double force = 2 * (modes->contact_omega + modes->damping) * w;
    const double omega = single->lanes.omega;
    const double own =
        (m->damping + omega) * (fabs(single->state.v) + omega * fabs(single->state.x) + w);
    const double bend = 2 * (own + single->stretch.base_max) + m->share * force;
    const double rate = m->omega2 * (fabs(single->state.v) + bend * T) + m->damping * bend;
    const double push = contact->sign * single_mass_push(single, &single->state) - rate * T;
    const double pull = push < 0 ? -push * modes->growth : 0;
    return modes->time - 2 * pull / (w * modes->contact_omega * modes->contact_omega);
}

// Surely no p = 0 between two samples, where both are inside.
INLINE bool linear_contact_stays_inside(const LinearContact *contact, double from, double w,
                                        double to, double w_to, double length) {
    const double bend = linear_contact_bend(contact);
    if (from == 0)
        return w > bend * length / 2;
    const double least = from < to ? from : to;
    return least > bend * length * length / 8 || fabs(w) > bend * length ||
           fabs(w_to) > bend * length;
}

// Whether p falls all the way to its zero: from `before` it, where w is `speed`.
INLINE bool linear_contact_falls(const LinearContact *contact, const State *end, double before,
                                 bool is_slow) {
    const ContactModes *p = contact->modes;
    const double w = -contact->sign * end->w;
    if (!(w > 0))
        return false;
    if (is_slow)
        return w > linear_contact_bend(contact) * before / 2; // backwards from there p rises
    if (before <= 0)
        return true;
    const Motion *m = &contact->single->flying;
    const double angle = p->fast * before;
    const double push = fabs(m->damping * end->v + m->omega2 * end->x);
    // angle (3 / 2 (c w + push) / (omega w) + 2 angle) < 0.66
    return angle * (1.5 * (p->damping * w + push) + 2 * angle * p->fast * w) < 0.66 * p->fast * w;
}

// Surely inside over a long stretch, because the slow part outweighs the fast.
INLINE bool linear_contact_is_pressed(const LinearContact *contact, const Four *end,
                                      double length) {
    const ContactModes *p = contact->modes;
    const Four d = contact->d;
    double last, slope;
    linear_contact_base(contact, length, &last, &slope);
    const double *a = p->see[MODES_A], *s = p->see[MODES_S];
    const double fast = fabs(d[2]) + fabs(d[3]), slow = fabs(d[0]) + fabs(d[1]);
    const double from =
        contact->sign * (d[0] + a[MODES_R] * contact->a + s[MODES_R] * contact->slope);
    const double to = contact->sign * ((*end)[0] + a[MODES_R] * last + s[MODES_R] * slope);
    const double bend = p->size2[0] * slow + p->sway * contact->single->stretch.base_max;
    return (from < to ? from : to) > fast + bend * length * length / 8;
}

// Whether the force has no peak within a long stretch that has not been seen: it stays below the
// last one, or the fast part has died and what is left only rises or only falls.
INLINE bool linear_contact_is_known(const LinearContact *contact, const Four *end, double length) {
    const ContactModes *p = contact->modes;
    const Four d = contact->d;
    double last, slope;
    linear_contact_base(contact, length, &last, &slope);
    double rows[4];
    for (int i = 0; i < 4; i++)
        rows[i] = fabs(p->see[i][MODES_N]);
    const double slow = (rows[0] + rows[1]) * (fabs(d[0]) + fabs(d[1]));
    const double fast = (rows[2] + rows[3]) * (fabs(d[2]) + fabs(d[3]));
    Four from, to;
    contact_modes_see(p, MODES_N, &d, contact->a, contact->slope, &from);
    contact_modes_see(p, MODES_N, end, last, slope, &to);
    const double one = fabs(from[0]), other = fabs(to[0]);
    const double bend = p->size2[0] * slow + p->n_sway * contact->single->stretch.base_max;
    const double most = (one > other ? one : other) + 2 * fast + bend * length * length / 8;
    if (single_mass_effective(contact->single) * most <=
        impact_log_least_force(&contact->single->impacts, &contact->single->row))
        return true;
    return fast <= 1e-13 * one && from[1] * to[1] > 0;
}

// How far the fast oscillation turns in one step of a walk, and steps to an interval: stiffer
// buffers are not for this.
static const double STEP = 0.6;
static const double LONG_STEP = 2;
static const double STEPS_MAX = 1024;
enum { SEARCH_STEPS = 12 };

// Angles of the fast oscillation: the square of the first is below rounding; what the second leaves
// of a largest force's fifth power is.
static const double HERE = 1e-8;
static const double NEAR = 4e-3;

typedef enum Outcome { GOES_ON, ENDS, UNCLEAR } Outcome;

#define NAME(name) name##_plain
#define TARGET
#include "core/solve/linear_contact.inc"

#define NAME(name) name##_wide
#define TARGET WIDE
#include "core/solve/linear_contact.inc"

// For how many samples the closed form keeps its digits. It counts the motion from where the base
// would hold it, each sample anew, and beside a soft structure that may be far from where it is.
static double linear_contact_keeps_digits(const SingleMass *single, const ContactModes *modes) {
    const double *a = modes->see[MODES_A], *s = modes->see[MODES_S];
    const double most = single->stretch.base_max, slope = single->base_slope;
    const double x = fabs(a[MODES_X]) * most + fabs(s[MODES_X]) * slope;
    const double v = fabs(a[MODES_V]) * most + fabs(s[MODES_V]) * slope;
    const double apart = single->plan->mass[0] * (v * v + single->flying.omega2 * x * x);
    const EnergyState now = single_mass_energy(single);
    const double held =
        single_mass_larger(single->impacts.largest_energy, now.kinetic + now.strain);
    return apart > 0 ? APART_MAX * held / apart : INFINITY;
}

static void linear_contact_make_modes(SingleMass *single, Side side) {
    const SingleMassKey *key = &single->key;
    const Side other = side == SIDE_LEFT ? SIDE_RIGHT : SIDE_LEFT;
    if (single->has_modes[other] && key->contact_omega2[0] == key->contact_omega2[1] &&
        key->contact_damping[0] == key->contact_damping[1])
        single->modes[side] = single->modes[other];
    else
        contact_modes_make(&single->modes[side], &single->touching[side], key->base_omega,
                           single->interval);
    single->has_modes[side] = true;
}

size_t linear_contact_run(SingleMass *single, size_t most) {
    const Side side = single->side;
    const ContactModes *modes = &single->modes[side];
    if (!single->has_modes[side])
        linear_contact_make_modes(single, side);
    const double samples = modes->is_usable ? linear_contact_keeps_digits(single, modes) : 0;
    if (!(samples >= 1))
        return 0;
    most = samples < (double)most ? (size_t)samples : most;
    return single->lanes.width == LANES_PLAIN ? follow_plain(single, most)
                                              : follow_wide(single, most);
}
