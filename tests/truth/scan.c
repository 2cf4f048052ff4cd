#include "tests/truth/scan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/side.h"

typedef long double Real;

enum { TERMS = 26 };
static const Real MISS = 1e-11L; // of the lengths there are
static const Real ULP = 2.3e-16L;
static const Real REACH = 0.5L; // longest piece, as an angle of the fastest motion

typedef enum Phase { FLIGHT, CONTACT, REST } Phase;
static const char *const phase_names[] = {"a gap closes", "a contact opens", "a rest is pulled at"};

// r is the free mass's displacement relative to the stop last touched, before that to the middle: a
// penetration of a stiff stop has no digits to lose.
typedef struct Walk {
    const ReferenceScene *scene;
    Scan *scan;
    Real omega2, damping, share, base_omega, base_amplitude;
    Real contact_omega2[2], contact_damping[2], rate[2], flight_rate;
    Real t, x, v, r, w;
    Real room[2]; // to either stop at r = 0
    Phase phase;
    int side;
    Real length, speed, push; // largest there are
} Walk;

// Coefficients in s = t / h, 0 <= s <= 1.
typedef struct Piece {
    Real x[TERMS], r[TERMS], push[TERMS];
} Piece;

static Real at(const Real *c, Real s) {
    Real sum = c[TERMS - 1];
    for (int i = TERMS - 1; i-- > 0;)
        sum = sum * s + c[i];
    return sum;
}

static Real slope_at_end(const Real *c) {
    Real sum = 0;
    for (int i = TERMS - 1; i > 0; i--)
        sum += (Real)i * c[i];
    return sum;
}

// How deep f falls below 0 on [a, b], where |f''| <= bend: 0 as soon as it is proved that it stays
// above -allowed. The parabola of that curvature through both ends lies below f.
static Real depth(const Real *f, Real a, Real b, Real fa, Real fb, Real bend, Real allowed) {
    if (fa < -allowed || fb < -allowed)
        return -fminl(fa, fb);
    const Real width = b - a, sag = bend * width * width;
    Real least = fminl(fa, fb);
    if (fabsl(fb - fa) < sag / 2) {
        const Real u = 0.5L - (fb - fa) / sag;
        least = fa + (fb - fa) * u - sag * u * (1 - u) / 2;
    }
    if (least >= -allowed)
        return 0;
    const Real middle = (a + b) / 2, fm = at(f, middle);
    const Real left = depth(f, a, middle, fa, fm, bend, allowed);
    return left > 0 ? left : depth(f, middle, b, fm, fb, bend, allowed);
}

// The base from now on, and until when it is smooth.
static Real base(const Walk *walk, Real *value, Real *slope) {
    const ReferenceScene *scene = walk->scene;
    *value = *slope = 0;
    if (scene->base == REFERENCE_SINE) {
        *value = walk->base_amplitude * sinl(walk->base_omega * walk->t);
        *slope = walk->base_amplitude * walk->base_omega * cosl(walk->base_omega * walk->t);
    }
    if (scene->base != REFERENCE_RECORD)
        return HUGE_VALL;
    const Real interval = scene->interval;
    size_t k = (size_t)(walk->t / interval);
    k += walk->t >= (Real)(k + 1) * interval;
    if (k + 1 >= scene->sample_count)
        return HUGE_VALL;
    *slope = ((Real)scene->samples[k + 1] - (Real)scene->samples[k]) / interval;
    *value = (Real)scene->samples[k] + *slope * (walk->t - (Real)k * interval);
    return (Real)(k + 1) * interval;
}

static void piece_make(const Walk *walk, Real h, Real value, Real slope, Piece *piece) {
    const Real k = walk->phase == CONTACT ? walk->contact_omega2[walk->side] : 0;
    const Real c = walk->phase == CONTACT ? walk->contact_damping[walk->side] : 0;
    Real *x = piece->x, *r = piece->r, a[TERMS + 2] = {value, slope * h};
    memset(piece, 0, sizeof *piece);
    x[0] = walk->x, x[1] = walk->v * h, r[0] = walk->r, r[1] = walk->w * h;
    for (int i = 0; i < TERMS; i++) {
        const Real next = (Real)(i + 1);
        const Real v = i + 1 < TERMS ? next * x[i + 1] / h : 0;
        const Real w = i + 1 < TERMS ? next * r[i + 1] / h : 0;
        const Real push = walk->omega2 * x[i] + walk->damping * v;
        const Real press = walk->phase == REST ? push : k * r[i] + c * w;
        piece->push[i] = push;
        if (i + 2 >= TERMS)
            break;
        const Real over = h * h / (next * (next + 1));
        a[i + 2] = -walk->base_omega * walk->base_omega * over * a[i];
        x[i + 2] = over * (walk->share * press - push - a[i]);
        r[i + 2] = walk->phase == REST ? 0 : over * (push - press);
    }
}

static void piece_end(Walk *walk, const Piece *piece, Real h) {
    walk->x = at(piece->x, 1);
    walk->v = slope_at_end(piece->x) / h;
    walk->r = at(piece->r, 1);
    walk->w = slope_at_end(piece->r) / h;
}

// A little further, or back.
static void step(Walk *walk, Real h) {
    Real value, slope;
    Piece piece;
    base(walk, &value, &slope);
    piece_make(walk, h, value, slope, &piece);
    piece_end(walk, &piece, h);
}

// What must stay positive: the gap to a stop, the penetration, or the push into the stop.
static void guard(const Walk *walk, const Piece *piece, int side, Real *f) {
    const Real sign = side == SIDE_RIGHT ? 1 : -1;
    for (int i = 0; i < TERMS; i++)
        f[i] = sign * (walk->phase == FLIGHT    ? -piece->r[i]
                       : walk->phase == CONTACT ? piece->r[i]
                                                : piece->push[i]);
    if (walk->phase == FLIGHT)
        f[0] += walk->room[side];
}

// Of a gap or a penetration, or of a push.
static Real allowed(const Walk *walk) {
    if (walk->phase == REST)
        return MISS * walk->push;
    return MISS * walk->length + 4 * ULP * (Real)walk->scene->duration * walk->speed;
}

static bool prove(Walk *walk, const Piece *piece, int side) {
    Real f[TERMS], bend = 0, most = 0;
    guard(walk, piece, side, f);
    for (int i = 1; i < TERMS; i++) {
        most += fabsl(f[i]);
        bend += (Real)(i * (i - 1)) * fabsl(f[i]);
    }
    if (f[0] >= most)
        return true;
    // No finer than the coefficients are known.
    const Real limit = allowed(walk) + 1e-17L * (fabsl(f[0]) + most);
    if (limit == 0)
        return true;
    const Real deep = depth(f, 0, 1, f[0], at(f, 1), bend, limit);
    if (deep == 0)
        return true;
    snprintf(walk->scan->why, sizeof walk->scan->why,
             "%s on side %d near %.17Lg s, by %.3Lg, allowed %.3Lg", phase_names[walk->phase], side,
             walk->t, deep, limit);
    return false;
}

// Goes to `until`, proving all the way.
static bool advance(Walk *walk, Real until) {
    const Real rate = walk->phase == CONTACT ? walk->rate[walk->side] : walk->flight_rate;
    while (walk->t < until) {
        Real value, slope;
        const Real kink = base(walk, &value, &slope);
        const Real target = fminl(kink, until), reach = REACH / rate;
        const bool is_cut = target - walk->t > reach;
        const Real h = is_cut ? reach : target - walk->t;
        Piece piece;
        piece_make(walk, h, value, slope, &piece);
        walk->scan->pieces++;
        if (walk->phase == FLIGHT
                ? !prove(walk, &piece, SIDE_LEFT) || !prove(walk, &piece, SIDE_RIGHT)
                : !prove(walk, &piece, walk->side))
            return false;
        piece_end(walk, &piece, h);
        walk->t = is_cut ? walk->t + h : target;
        walk->push =
            fmaxl(walk->push, fabsl(walk->omega2 * walk->x) + fabsl(walk->damping * walk->v));
        walk->speed = fmaxl(walk->speed, fabsl(walk->w));
    }
    return true;
}

static bool meets(Walk *walk, const char *what, Real miss, Real limit) {
    walk->scan->worst = fmax(walk->scan->worst, (double)(miss / limit));
    if (miss <= limit)
        return true;
    snprintf(walk->scan->why, sizeof walk->scan->why,
             "%s at %.17Lg s is missed by %.3Lg, allowed %.3Lg", what, walk->t, miss, limit);
    return false;
}

static bool event(Walk *walk, const Impact *impact) {
    const int side = impact->side;
    const Real sign = side == SIDE_RIGHT ? 1 : -1, e = walk->scene->restitution[side];
    const Real end = isnan(impact->end) ? (Real)walk->scene->duration : (Real)impact->end;
    if (!advance(walk, impact->start) ||
        !meets(walk, "the stop", fabsl(sign * walk->r - walk->room[side]), allowed(walk)))
        return false;
    walk->r = 0;
    walk->room[side] = 0;
    walk->room[1 - side] = walk->scene->clearance;
    walk->side = side;
    if (impact->kind == IMPACT_RESTING) {
        // All bounces that are left, at once.
        walk->v += walk->share * walk->w;
        walk->w = 0;
        walk->phase = REST;
    } else {
        if (!meets(walk, "the approach speed", fabsl(sign * walk->w - (Real)impact->approach_speed),
                   1e-9L * walk->speed))
            return false;
        if (walk->scene->is_impulse) {
            walk->v += walk->share * (1 + e) * walk->w;
            walk->w = -e * walk->w;
            return true;
        }
        walk->phase = CONTACT;
    }
    if (!advance(walk, end))
        return false;
    if (walk->phase == CONTACT && !isnan(impact->end)) {
        if (!meets(walk, "the end of the contact", fabsl(walk->r), allowed(walk)))
            return false;
        // An ulp of the time is much in a short contact: go on to where p is 0 and call that the
        // end.
        for (int i = 0; i < 4; i++) {
            const Real late = -walk->r / walk->w;
            if (late != 0 && fabsl(late) < 4 * ULP * end)
                step(walk, late);
        }
        walk->t = end;
        walk->r = 0;
    }
    walk->phase = FLIGHT;
    return true;
}

void scan_run(const ReferenceScene *scene, const Impacts *impacts, double reach, Scan *scan) {
    const Real M = scene->mass, m = scene->damper_mass, pi = acosl(-1);
    Walk walk = {.scene = scene,
                 .scan = scan,
                 .omega2 = (Real)scene->stiffness / M,
                 .damping = (Real)scene->damping / M,
                 .share = m / (M + m),
                 .room = {(Real)scene->clearance / 2, (Real)scene->clearance / 2},
                 .x = scene->displacement,
                 .v = scene->velocity,
                 .r = scene->position,
                 .w = scene->relative_velocity,
                 .phase = FLIGHT,
                 .length = fmaxl(scene->clearance, reach),
                 .speed = fabsl(scene->relative_velocity)};
    memset(scan, 0, sizeof *scan);
    if (scene->base == REFERENCE_SINE) {
        walk.base_omega = 2 * pi * (Real)scene->frequency;
        walk.base_amplitude = scene->amplitude;
        if (scene->is_amplitude_displacement)
            walk.base_amplitude *= -walk.base_omega * walk.base_omega;
    }
    walk.flight_rate = sqrtl(walk.omega2) + walk.damping + walk.base_omega + 1e-3L;
    for (int side = 0; side < 2 && !scene->is_impulse; side++) {
        const Real loss = logl((Real)scene->restitution[side]), T = scene->contact_time[side];
        walk.contact_omega2[side] = (pi * pi + loss * loss) / (T * T);
        walk.contact_damping[side] = -2 * loss / T;
        walk.rate[side] =
            walk.flight_rate + sqrtl(walk.contact_omega2[side]) + walk.contact_damping[side];
    }
    for (size_t i = 0; i < impacts->count; i++)
        walk.speed = fmaxl(walk.speed, impacts->at[i].approach_speed);
    for (size_t i = 0; i < impacts->count; i++)
        if (!event(&walk, &impacts->at[i])) {
            const size_t used = strlen(scan->why);
            snprintf(scan->why + used, sizeof scan->why - used, "; row %zu of %zu", i,
                     impacts->count);
            return;
        }
    scan->is_whole = advance(&walk, scene->duration);
}
