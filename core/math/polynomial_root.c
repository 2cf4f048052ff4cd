// With B >= -g'' on all of [0, 1], g(s + d) >= g(s) + g'(s) d - B d^2 / 2: the positive zero of
// that parabola is a step which cannot pass a root. Towards a simple root it shrinks like Newton's;
// past a near miss it strides on. Where many such steps would be needed (almost a double root under
// a coarse B) the interval is halved instead, which makes B local and always ends.
#include "core/math/polynomial_root.h"

#include <float.h>
#include <math.h>

enum { ROOT_STEPS = 40, ROOT_HALVINGS = 52 };

// g(s) is known to about this much: rounding of the coefficients and of Horner's scheme.
static double noise(const double *c, size_t degree, double s) {
    double sum = fabs(c[degree]);
    for (size_t i = degree; i-- > 0;)
        sum = sum * s + fabs(c[i]);
    return 2 * DBL_EPSILON * sum;
}

// Coefficients of g(from + width s) in place.
static void shift(double *c, size_t degree, double from, double width) {
    for (size_t i = 0; i < degree; i++)
        for (size_t j = degree; j-- > i;)
            c[j] += from * c[j + 1];
    double scale = width;
    for (size_t i = 1; i <= degree; i++, scale *= width)
        c[i] *= scale;
}

// fmin is a call into the C library.
static inline double below_zero(double value) {
    return value < 0 ? value : 0;
}

static bool is_surely_positive(const double *c, size_t degree) {
    double least = c[0];
    for (size_t i = 1; i <= degree; i++)
        least += below_zero(c[i]);
    return least > 0;
}

// The march; c[0] > 0. True if decided, then *found tells and *s is the root.
static bool march(const double *c, size_t degree, double *s, bool *found) {
    double bound = 0;
    for (size_t i = 2; i <= degree; i++)
        bound -= (double)(i * (i - 1)) * below_zero(c[i]);
    double at = 0;
    for (int step = 0; step < ROOT_STEPS; step++) {
        const double value = root_value(c, degree, at);
        const double slope = root_slope(c, degree, at);
        if (isnan(value)) { // no number has no zero; halving would never end
            *found = false;
            return true;
        }
        if (value <= noise(c, degree, at)) {
            // The last bit of the way needs no caution: what is left is rounding.
            const double last = slope < 0 ? -value / slope : 0;
            *s = fmin(fmax(at + last, 0), 1);
            *found = true;
            return true;
        }
        const double root = sqrt(slope * slope + 2 * bound * value);
        double stride;
        if (slope <= 0)
            stride = root - slope > 0 ? 2 * value / (root - slope) : INFINITY;
        else
            stride = bound > 0 ? (slope + root) / bound : INFINITY;
        if (at + stride > 1) {
            *found = false;
            return true;
        }
        if (at + stride <= at) {
            *s = at;
            *found = true;
            return true;
        }
        at += stride;
    }
    return false;
}

// c[0] may have any sign here: a half may begin where the other ended.
static bool search(const double *c, size_t degree, int halvings, double *s) {
    if (c[0] <= 0) {
        *s = 0;
        return true;
    }
    if (is_surely_positive(c, degree))
        return false;
    bool found;
    if (march(c, degree, s, &found))
        return found;
    if (halvings == 0) {
        *s = 0;
        return true;
    }
    double half[ROOT_DEGREE + 1];
    for (int side = 0; side < 2; side++) {
        for (size_t i = 0; i <= degree; i++)
            half[i] = c[i];
        shift(half, degree, 0.5 * side, 0.5);
        if (search(half, degree, halvings - 1, s)) {
            *s = 0.5 * (*s + side);
            return true;
        }
    }
    return false;
}

bool root_first_crossing(const double *c, size_t degree, double *s) {
    // A root at the start is divided out: g(s) = s^n r(s), and r decides from there on.
    while (degree > 0 && c[0] == 0) {
        c++;
        degree--;
    }
    if (c[0] == 0)
        return false;
    return search(c, degree, ROOT_HALVINGS, s);
}
