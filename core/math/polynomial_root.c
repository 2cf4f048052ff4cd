// With B >= -g'' on [0, 1], g(s + d) >= g(s) + g'(s) d - B d^2 / 2. The positive zero of that
// parabola is a step that cannot pass a root. It converges to a simple root like Newton's method
// and moves past a near miss in one step. If many such steps are needed (nearly a double root under
// a coarse B), the interval is halved, which makes B local and always terminates.
#include "core/math/polynomial_root.h"

#include <float.h>
#include <math.h>

enum { ROOT_STEPS = 40, ROOT_HALVINGS = 52 };

// The rounding error of g(s), from the coefficients and Horner's scheme.
static double polynomial_noise(const double *c, size_t degree, double s) {
    double sum = fabs(c[degree]);
    for (size_t i = degree; i-- > 0;)
        sum = sum * s + fabs(c[i]);
    return 2 * DBL_EPSILON * sum;
}

// Replaces g(s) by g(from + width s).
static void polynomial_shift(double *c, size_t degree, double from, double width) {
    for (size_t i = 0; i < degree; i++)
        for (size_t j = degree; j-- > i;)
            c[j] += from * c[j + 1];
    double scale = width;
    for (size_t i = 1; i <= degree; i++, scale *= width)
        c[i] *= scale;
}

// Written out, because fmin is a call into the C library.
static inline double polynomial_negative_part(double value) {
    return value < 0 ? value : 0;
}

static bool polynomial_is_positive(const double *c, size_t degree) {
    double min = c[0];
    for (size_t i = 1; i <= degree; i++)
        min += polynomial_negative_part(c[i]);
    return min > 0;
}

// Steps from s = 0, where c[0] > 0. True if decided: *found, and the root *s.
static bool polynomial_root_march(const double *c, size_t degree, double *s, bool *found) {
    double bound = 0;
    for (size_t i = 2; i <= degree; i++)
        bound -= (double)(i * (i - 1)) * polynomial_negative_part(c[i]);
    const double near = 2 * polynomial_noise(c, degree, 1); // above all noise
    double at = 0;
    for (int step = 0; step < ROOT_STEPS; step++) {
        // polynomial_value and polynomial_slope side by side.
        double value = c[degree], slope = 0;
        for (size_t i = degree; i > 0; i--) {
            slope = slope * at + (double)i * c[i];
            value = value * at + c[i - 1];
        }
        if (isnan(value)) { // NAN: stop, because halving would not terminate
            *found = false;
            return true;
        }
        if (value <= near && value <= polynomial_noise(c, degree, at)) {
            // The rest is within rounding: one Newton step.
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

// c[0] may have any sign: the second half begins where the first ended.
static bool polynomial_root_search(const double *c, size_t degree, int halvings, double *s) {
    if (c[0] <= 0) {
        *s = 0;
        return true;
    }
    if (polynomial_is_positive(c, degree))
        return false;
    bool found;
    if (polynomial_root_march(c, degree, s, &found))
        return found;
    if (halvings == 0) {
        *s = 0;
        return true;
    }
    double half[POLYNOMIAL_DEGREE_MAX + 1];
    for (int side = 0; side < 2; side++) {
        for (size_t i = 0; i <= degree; i++)
            half[i] = c[i];
        polynomial_shift(half, degree, 0.5 * side, 0.5);
        if (polynomial_root_search(half, degree, halvings - 1, s)) {
            *s = 0.5 * (*s + side);
            return true;
        }
    }
    return false;
}

bool polynomial_root_first(const double *c, size_t degree, double *s) {
    // A root at s = 0 is divided out: g(s) = s^n r(s), and r is searched.
    while (degree > 0 && c[0] == 0) {
        c++;
        degree--;
    }
    if (c[0] == 0)
        return false;
    return polynomial_root_search(c, degree, ROOT_HALVINGS, s);
}
