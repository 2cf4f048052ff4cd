// Double exponential rule (Takahasi and Mori 1974): u = 1 / (1 + exp(-pi sinh t)) turns every
// algebraic end into a doubly exponential decay in t, where the trapezium rule doubles its digits
// with each halving of the step.
#include "core/math/quadrature.h"

#include <math.h>
#include <stdbool.h>

// At 3.6 a singularity of 1 / sqrt(u) has sunk to 1e-12 of its neighbourhood; the functions met
// here are smooth, so that far less is left out.
static const double reach = 3.6;

enum { QUADRATURE_HALVINGS = 8 };

static double term(double (*f)(const void *context, double u, double rest), const void *context,
                   double t) {
    const double pi = 3.14159265358979323846;
    const double far = exp(-pi * sinh(fabs(t)));
    const double small = far / (1 + far), large = 1 / (1 + far);
    const double value = t < 0 ? f(context, small, large) : f(context, large, small);
    return value * pi * cosh(t) * small * large;
}

double quadrature_unit(double (*f)(const void *context, double u, double rest),
                       const void *context) {
    double sum = term(f, context, 0), step = 0.5, result = 0;
    for (int i = 1; i * step <= reach; i++)
        sum += term(f, context, i * step) + term(f, context, -i * step);
    result = sum * step;
    for (int halving = 0; halving < QUADRATURE_HALVINGS; halving++) {
        const double before = result;
        step /= 2;
        for (int i = 1; i * step <= reach; i += 2)
            sum += term(f, context, i * step) + term(f, context, -i * step);
        result = sum * step;
        // The digits double, so what is left is the square of this.
        if (fabs(result - before) <= 1e-8 * fabs(result))
            break;
    }
    return result;
}
