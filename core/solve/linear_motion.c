#include "core/solve/linear_motion.h"

#include <math.h>

// Smallest degree n with 3! rho^(n - 3) / n! below rounding, since a base's slope enters x at t^3
// only; at least 5.
size_t linear_motion_degree(double rho) {
    size_t degree = 3;
    double term = 1;
    while ((term > 4e-18 || degree < 5) && degree < POLYNOMIAL_DEGREE_MAX)
        term *= rho / (double)++degree;
    return degree;
}

void linear_motion_base_series(double *base, size_t degree, const Slice *slice, double length) {
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

double linear_motion_integral(const double *c, size_t degree) {
    double sum = 0;
    for (size_t k = degree + 1; k-- > 0;)
        sum += c[k] / (double)(k + 1);
    return sum;
}

// Its error for products of two solutions is (2 rho)^(2 n) times a constant that 4, 5 and 8 points
// keep below 1e-14. Fewer points are not enough for small rho either: under a linear base v has an
// s^2 of its own, and v^2 an s^6 with rho^2 alone.
// clang-format off
const Quadrature linear_motion_rules[LINEAR_MOTION_RULES] = {
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

const Quadrature *linear_motion_quadrature(double rho) {
    return &linear_motion_rules[rho <= 0.02 ? 0 : rho <= 0.3 ? 1 : 2];
}

double linear_motion_largest(const double *c, size_t degree, double least, double *s) {
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

double slice_at(const Slice *slice, double time) {
    if (slice->omega > 0)
        return slice->value * cos(slice->omega * time) + slice->slope * sin(slice->omega * time);
    return slice->value + slice->slope * time;
}
