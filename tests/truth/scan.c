#include "tests/truth/scan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/result/response.h"

typedef long double Real;

enum { TERMS = 26 };
static const Real MISS = 1e-11L; // of the lengths there are
static const Real ULP = 2.3e-16L;
static const Real REACH = 0.5L; // longest piece, as an angle of the fastest motion

// INSIDE: let go by zero_force and not yet out of the buffer.
typedef enum ExactPhase { FLIGHT, INSIDE, CONTACT, REST } ExactPhase;
static const char *const phase_names[] = {"a gap closes", "a buffer presses again",
                                          "a contact opens", "a rest is pulled at"};

// r is the free mass's displacement relative to the stop last touched, before that to the middle: a
// penetration of a stiff stop has no digits to lose.
typedef struct ImportContext {
    const ReferenceScene *scene;
    Scan *scan;
    Real omega2, damping, share, base_omega, base_amplitude;
    Real contact_omega2[2], contact_damping[2], rate[2], flight_rate;
    Real t, x, v, r, w;
    Real room[2]; // to either stop at r = 0
    ExactPhase phase;
    int side;
    Real length, speed, push; // largest there are
} ImportContext;

// Coefficients in s = t / h, 0 <= s <= 1.
typedef struct Piece {
    Real x[TERMS], r[TERMS], push[TERMS], press[TERMS];
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

// Whether f or g stays above its limit at every point of [a, b]: outside the buffer its force would
// mean nothing.
static bool either(const Real *f, const Real *g, Real a, Real b, const Real *bends,
                   const Real *limits) {
    const Real fa = at(f, a), fb = at(f, b), ga = at(g, a), gb = at(g, b);
    if ((fa < -limits[0] && ga < -limits[1]) || (fb < -limits[0] && gb < -limits[1]))
        return false;
    const Real sag = (b - a) * (b - a) / 8;
    if (fminl(fa, fb) - sag * bends[0] >= -limits[0] ||
        fminl(ga, gb) - sag * bends[1] >= -limits[1])
        return true;
    const Real middle = (a + b) / 2;
    // Where one takes over from the other, a point is as good as a proof.
    if (b - a < 1e-12L)
        return true;
    return either(f, g, a, middle, bends, limits) && either(f, g, middle, b, bends, limits);
}

// The base from now on, and until when it is smooth.
static Real base(const ImportContext *walk, Real *value, Real *slope) {
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

static void piece_make(const ImportContext *walk, Real h, Real value, Real slope, Piece *piece) {
    const bool is_near = walk->phase == CONTACT || walk->phase == INSIDE;
    const Real k = is_near ? walk->contact_omega2[walk->side] : 0;
    const Real c = is_near ? walk->contact_damping[walk->side] : 0;
    Real *x = piece->x, *r = piece->r, a[TERMS + 2] = {value, slope * h};
    memset(piece, 0, sizeof *piece);
    x[0] = walk->x, x[1] = walk->v * h, r[0] = walk->r, r[1] = walk->w * h;
    for (int i = 0; i < TERMS; i++) {
        const Real next = (Real)(i + 1);
        const Real v = i + 1 < TERMS ? next * x[i + 1] / h : 0;
        const Real w = i + 1 < TERMS ? next * r[i + 1] / h : 0;
        const Real push = walk->omega2 * x[i] + walk->damping * v;
        const Real press = walk->phase == REST ? push : k * r[i] + c * w;
        const Real force = walk->phase == INSIDE ? 0 : press;
        piece->push[i] = push;
        piece->press[i] = press;
        if (i + 2 >= TERMS)
            break;
        const Real over = h * h / (next * (next + 1));
        a[i + 2] = -walk->base_omega * walk->base_omega * over * a[i];
        x[i + 2] = over * (walk->share * force - push - a[i]);
        r[i + 2] = walk->phase == REST ? 0 : over * (push - force);
    }
}

static void piece_end(ImportContext *walk, const Piece *piece, Real h) {
    walk->x = at(piece->x, 1);
    walk->v = slope_at_end(piece->x) / h;
    walk->r = at(piece->r, 1);
    walk->w = slope_at_end(piece->r) / h;
}

// A little further, or back.
static void step(ImportContext *walk, Real h) {
    Real value, slope;
    Piece piece;
    base(walk, &value, &slope);
    piece_make(walk, h, value, slope, &piece);
    piece_end(walk, &piece, h);
}

// What must stay positive: the gap to a stop, the penetration or the force, the push into the stop.
static void guard(const ImportContext *walk, const Piece *piece, int side, Real *f) {
    const Real sign = side == SIDE_RIGHT ? 1 : -1;
    const bool is_force = walk->phase == CONTACT && walk->scene->is_zero_force;
    const bool is_gap = walk->phase == FLIGHT || walk->phase == INSIDE;
    for (int i = 0; i < TERMS; i++)
        f[i] = sign * (is_gap                ? -piece->r[i]
                       : is_force            ? piece->press[i]
                       : walk->phase == REST ? piece->push[i]
                                             : piece->r[i]);
    if (is_gap)
        f[0] += walk->room[side];
}

static Real allowed_length(const ImportContext *walk) {
    return MISS * walk->length + 4 * ULP * (Real)walk->scene->duration * walk->speed;
}

// What that length presses.
static Real allowed_force(const ImportContext *walk, int side) {
    return walk->contact_omega2[side] * allowed_length(walk) +
           walk->contact_damping[side] * MISS * walk->speed;
}

static Real allowed(const ImportContext *walk) {
    if (walk->phase == REST)
        return MISS * walk->push;
    const bool is_force = walk->phase == CONTACT && walk->scene->is_zero_force;
    return is_force ? allowed_force(walk, walk->side) : allowed_length(walk);
}

static Real bend_of(const Real *f) {
    Real bend = 0;
    for (int i = 2; i < TERMS; i++)
        bend += (Real)(i * (i - 1)) * fabsl(f[i]);
    return bend;
}

// A buffer that let go does not press again: outside of it, or no force.
static bool prove_inside(ImportContext *walk, const Piece *piece) {
    Real force[TERMS], gap[TERMS];
    for (int i = 0; i < TERMS; i++) {
        force[i] = walk->side == SIDE_RIGHT ? -piece->press[i] : piece->press[i];
        gap[i] = walk->side == SIDE_RIGHT ? -piece->r[i] : piece->r[i];
    }
    const Real bends[2] = {bend_of(force), bend_of(gap)};
    const Real limits[2] = {allowed_force(walk, walk->side), allowed_length(walk)};
    if (either(force, gap, 0, 1, bends, limits))
        return true;
    snprintf(walk->scan->why, sizeof walk->scan->why, "%s on side %d near %.17Lg s",
             phase_names[INSIDE], walk->side, walk->t);
    return false;
}

static bool prove(ImportContext *walk, const Piece *piece, int side) {
    Real f[TERMS], most = 0;
    guard(walk, piece, side, f);
    for (int i = 1; i < TERMS; i++)
        most += fabsl(f[i]);
    if (f[0] >= most)
        return true;
    // No finer than the coefficients are known.
    const Real limit = allowed(walk) + 1e-17L * (fabsl(f[0]) + most);
    if (limit == 0)
        return true;
    const Real deep = depth(f, 0, 1, f[0], at(f, 1), bend_of(f), limit);
    if (deep == 0)
        return true;
    snprintf(walk->scan->why, sizeof walk->scan->why,
             "%s on side %d near %.17Lg s, by %.3Lg, allowed %.3Lg", phase_names[walk->phase], side,
             walk->t, deep, limit);
    return false;
}

// Goes to `until`, proving all the way.
static bool advance(ImportContext *walk, Real until) {
    while (walk->t < until) {
        const bool is_near = walk->phase == CONTACT || walk->phase == INSIDE;
        const Real rate = is_near ? walk->rate[walk->side] : walk->flight_rate;
        Real value, slope;
        const Real kink = base(walk, &value, &slope);
        const Real target = fminl(kink, until), reach = REACH / rate;
        const bool is_cut = target - walk->t > reach;
        const Real h = is_cut ? reach : target - walk->t;
        Piece piece;
        piece_make(walk, h, value, slope, &piece);
        walk->scan->pieces++;
        const bool is_free = walk->phase == FLIGHT || walk->phase == INSIDE;
        if (walk->phase == INSIDE ? !prove_inside(walk, &piece) : !prove(walk, &piece, walk->side))
            return false;
        if (is_free && !prove(walk, &piece, 1 - walk->side))
            return false;
        piece_end(walk, &piece, h);
        walk->t = is_cut ? walk->t + h : target;
        if (walk->phase == INSIDE && (walk->side == SIDE_RIGHT ? walk->r < 0 : walk->r > 0))
            walk->phase = FLIGHT;
        walk->push =
            fmaxl(walk->push, fabsl(walk->omega2 * walk->x) + fabsl(walk->damping * walk->v));
        walk->speed = fmaxl(walk->speed, fabsl(walk->w));
    }
    return true;
}

static bool meets(ImportContext *walk, const char *what, Real miss, Real limit) {
    walk->scan->worst = fmax(walk->scan->worst, (double)(miss / limit));
    if (miss <= limit)
        return true;
    snprintf(walk->scan->why, sizeof walk->scan->why,
             "%s at %.17Lg s is missed by %.3Lg, allowed %.3Lg", what, walk->t, miss, limit);
    return false;
}

static Real press(const ImportContext *walk) {
    return walk->contact_omega2[walk->side] * walk->r + walk->contact_damping[walk->side] * walk->w;
}

// A contact ends where it is listed to. An ulp of the time is much in a short one: it goes on to
// where p, or the force, is 0 and that is called the end.
static bool let_go(ImportContext *walk, Real end) {
    const bool is_force = walk->scene->is_zero_force;
    const Real miss = is_force ? fabsl(press(walk)) : fabsl(walk->r);
    if (!meets(walk, "the end of the contact", miss, allowed(walk)))
        return false;
    for (int i = 0; i < 4; i++) {
        const Real push = walk->omega2 * walk->x + walk->damping * walk->v, n = press(walk);
        const Real slope = walk->contact_omega2[walk->side] * walk->w +
                           walk->contact_damping[walk->side] * (push - n);
        const Real late = is_force ? -n / slope : -walk->r / walk->w;
        if (late != 0 && fabsl(late) < 4 * ULP * end)
            step(walk, late);
    }
    walk->t = end;
    if (!is_force)
        walk->r = 0;
    walk->phase = is_force ? INSIDE : FLIGHT;
    return true;
}

static bool event(ImportContext *walk, const Impact *impact) {
    const int side = impact->side;
    const Real sign = side == SIDE_RIGHT ? 1 : -1, e = walk->scene->restitution[side];
    const Real end = isnan(impact->end) ? (Real)walk->scene->duration : (Real)impact->end;
    if (!advance(walk, impact->start))
        return false;
    if (walk->phase == INSIDE && side == walk->side && impact->approach_speed == 0) {
        if (!meets(walk, "the force", fabsl(press(walk)), allowed_force(walk, side)))
            return false;
    } else {
        walk->phase = FLIGHT;
        if (!meets(walk, "the stop", fabsl(sign * walk->r - walk->room[side]), allowed(walk)))
            return false;
        walk->r = 0;
        walk->room[side] = 0;
        walk->room[1 - side] = walk->scene->clearance;
    }
    walk->side = side;
    if (impact->kind == IMPACT_RESTING) {
        // All bounces that are left, at once.
        walk->v += walk->share * walk->w;
        walk->w = 0;
        walk->phase = REST;
    } else {
        const Real inward = fmaxl(0, sign * walk->w);
        if (!meets(walk, "the approach speed", fabsl(inward - (Real)impact->approach_speed),
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
    if (walk->phase == CONTACT && !isnan(impact->end))
        return let_go(walk, end);
    walk->phase = FLIGHT;
    return true;
}

// w T_c under zero_force, from e = exp(-2 Z / sqrt(1 - Z^2) arccos Z) or its like above critical
// damping.
static Real zero_force(Real e) {
    const bool is_over = logl(e) < -2;
    Real low = is_over ? 1 : 0, high = is_over ? 100 : 1, Z = 0, turn = 0;
    for (int i = 0; i < 100; i++) {
        Z = (low + high) / 2;
        const Real root = sqrtl(fabsl(1 - Z * Z));
        turn = 2 * (is_over ? acoshl(Z) : acosl(Z)) / root;
        if (expl(-Z * turn) > e)
            low = Z;
        else
            high = Z;
    }
    return turn;
}

void scan_run(const ReferenceScene *scene, const Impacts *impacts, double reach, Scan *scan) {
    const Real M = scene->mass, m = scene->damper_mass, pi = acosl(-1);
    ImportContext walk = {.scene = scene,
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
        const Real turn = scene->is_zero_force ? zero_force(scene->restitution[side])
                                               : sqrtl(pi * pi + loss * loss);
        walk.contact_omega2[side] = turn * turn / (T * T);
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
