// The Taylor coefficients of a linear system follow from each other:
//   (k + 1)(k + 2) x_{k+2} = -a_k - s_k + share n_k,   (k + 1)(k + 2) r_{k+2} = s_k - n_k.
// In s = t / length they fall like rho^k / k!, so the degree that leaves only rounding is known
// beforehand. No eigenvalues are taken, so underdamped, critical, overdamped and singular systems
// are all the same to it.
#include "core/solve/arc.h"

#include <math.h>

// Smallest degree n with 3! rho^(n - 3) / n! below rounding, since a base's slope enters x at t^3
// only; at least 5.
size_t arc_degree(double rho) {
    size_t degree = 3;
    double term = 1;
    while ((term > 4e-18 || degree < 5) && degree < POLYNOMIAL_DEGREE_MAX)
        term *= rho / (double)++degree;
    return degree;
}

void arc_base_series(double *base, size_t degree, const Slice *slice, double length) {
    for (size_t k = 0; k <= degree; k++)
        base[k] = 0;
    if (slice->omega > 0) {
        const double turn = slice->omega * length;
        const double cycle[4] = {slice->value, slice->slope, -slice->value, -slice->slope};
        double scale = 1;
        for (size_t k = 0; k <= degree; k++) {
            base[k] = cycle[k % 4] * scale;
            scale *= turn / (double)(k + 1);
        }
    } else {
        base[0] = slice->value;
        base[1] = slice->slope * length;
    }
}

void arc_make(Arc *arc, const Motion *motion, const State *start, const Slice *slice,
              double length) {
    arc->length = length;
    arc->rho = length * fmax(motion->rate, slice->omega);
    arc->degree = arc_degree(arc->rho);
    arc_base_series(arc->base, arc->degree, slice, length);
    const double square = length * length;
    const double omega2 = motion->omega2 * square, damping = motion->damping * length;
    const double contact2 = motion->contact_omega2 * square;
    const double contact_damping = motion->contact_damping * length;
    double *x = arc->x, *r = arc->r;
    x[0] = start->x;
    x[1] = start->v * length;
    r[0] = start->r;
    r[1] = start->w * length;
    for (size_t k = 0; k < arc->degree; k++) {
        const double next = (double)(k + 1);
        const double push = damping * next * x[k + 1] + omega2 * x[k];
        const double force =
            motion->is_resting ? push : contact_damping * next * r[k + 1] + contact2 * r[k];
        arc->push[k] = push;
        arc->force[k] = force;
        if (k + 2 <= arc->degree) {
            const double scale = 1 / (next * (next + 1));
            x[k + 2] = (motion->share * force - push - square * arc->base[k]) * scale;
            r[k + 2] = (push - force) * scale;
        }
    }
}

void arc_cut(Arc *arc, double s) {
    double power = 1;
    for (size_t k = 0; k <= arc->degree; k++, power *= s) {
        arc->x[k] *= power;
        arc->r[k] *= power;
        arc->base[k] *= power;
        arc->push[k] *= power * s * s; // these carry length^2
        arc->force[k] *= power * s * s;
    }
    arc->length *= s;
    arc->rho *= s;
}

State arc_at(const Arc *arc, double s) {
    return (State){polynomial_value(arc->x, arc->degree, s),
                   polynomial_slope(arc->x, arc->degree, s) / arc->length,
                   polynomial_value(arc->r, arc->degree, s),
                   polynomial_slope(arc->r, arc->degree, s) / arc->length};
}

// Small terms first.
State arc_end(const Arc *arc) {
    State end = {0, 0, 0, 0};
    for (size_t k = arc->degree; k > 0; k--) {
        end.x += arc->x[k];
        end.v += (double)k * arc->x[k];
        end.r += arc->r[k];
        end.w += (double)k * arc->r[k];
    }
    return (State){end.x + arc->x[0], end.v / arc->length, end.r + arc->r[0], end.w / arc->length};
}

double arc_integral(const double *c, size_t degree) {
    double sum = 0;
    for (size_t k = degree + 1; k-- > 0;)
        sum += c[k] / (double)(k + 1);
    return sum;
}

double arc_impulse(const Arc *arc) {
    return arc->length > 0 ? arc_integral(arc->force, arc->degree - 1) / arc->length : 0;
}

// Its error for products of two solutions is (2 rho)^(2 n) times a constant that 4, 5 and 8 points
// keep below 1e-14. Fewer points are not enough for small rho either: under a linear base v has an
// s^2 of its own, and v^2 an s^6 with rho^2 alone.
// clang-format off
const Quadrature arc_rules[ARC_RULES] = {
    {4, {0.06943184420297371, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263},
        {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269}},
    {5, {0.04691007703066800, 0.2307653449471585, 0.5, 0.7692346550528415, 0.9530899229693320},
        {0.1184634425280945, 0.2393143352496832, 0.2844444444444444, 0.2393143352496832, 0.1184634425280945}},
    {8, {0.01985507175123188, 0.1016667612931866, 0.2372337950418355, 0.4082826787521751,
         0.5917173212478249, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681},
        {0.05061426814518813, 0.1111905172266872, 0.1568533229389436, 0.1813418916891810,
         0.1813418916891810, 0.1568533229389436, 0.1111905172266872, 0.05061426814518813}},
};
// clang-format on

const Quadrature *arc_quadrature(double rho) {
    return &arc_rules[rho <= 0.02 ? 0 : rho <= 0.3 ? 1 : 2];
}

ArcIntegrals arc_integrals(const Arc *arc) {
    ArcIntegrals out = {0, 0, 0, 0, arc->length * arc_integral(arc->base, arc->degree)};
    if (!(arc->length > 0))
        return out;
    const Quadrature *rule = arc_quadrature(arc->rho);
    for (size_t i = 0; i < rule->count; i++) {
        const double s = rule->node[i], weight = rule->weight[i];
        const double v = polynomial_slope(arc->x, arc->degree, s),
                     w = polynomial_slope(arc->r, arc->degree, s);
        const double a = polynomial_value(arc->base, arc->degree, s);
        out.vv += weight * v * v;
        out.ww += weight * w * w;
        out.av += weight * a * v;
        out.aw += weight * a * w;
    }
    out.vv /= arc->length;
    out.ww /= arc->length;
    return out;
}

double arc_largest(const double *c, size_t degree, double least, double *s) {
    double bound = 0;
    for (size_t k = 0; k <= degree; k++)
        bound += fabs(c[k]);
    if (bound <= least)
        return least;
    // The magnitude is largest at an end or where its slope changes sign; an arc is too short for a
    // second such place.
    double slope[POLYNOMIAL_DEGREE_MAX + 1], at[3] = {0, 1, 1};
    const double sign = degree > 0 && c[1] < 0 ? -1 : 1;
    for (size_t k = 0; k < degree; k++)
        slope[k] = sign * (double)(k + 1) * c[k + 1];
    if (degree > 1)
        (void)polynomial_root_first(slope, degree - 1, &at[2]);
    for (size_t i = 0; i < 3; i++) {
        const double value = fabs(polynomial_value(c, degree, at[i]));
        if (value > least) {
            least = value;
            *s = at[i];
        }
    }
    return least;
}

double arc_peak_force(const Arc *arc, double least, double *s) {
    if (!(arc->length > 0))
        return least;
    const double square = arc->length * arc->length;
    double at = -1;
    const double most = arc_largest(arc->force, arc->degree - 1, least * square, &at);
    if (at < 0)
        return least;
    *s = at;
    return most / square;
}

double slice_at(const Slice *slice, double time) {
    if (slice->omega > 0)
        return slice->value * cos(slice->omega * time) + slice->slope * sin(slice->omega * time);
    return slice->value + slice->slope * time;
}
