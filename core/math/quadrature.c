// Double exponential rule (Takahasi and Mori 1974): with u = 1 / (1 + exp(-pi sinh t)) the
// integrand decays doubly exponentially in t, also at algebraic singularities, and the trapezium
// rule doubles its number of correct digits with each halving of the step.
#include "core/math/quadrature.h"

#include <math.h>
#include <stdbool.h>

// Limit of |t|. A singularity of 1 / sqrt(u) has decayed to 1e-12 there, and the present integrands
// are smoother.
static const double quadrature_reach = 3.6;

enum { QUADRATURE_HALVINGS = 8 };

static double quadrature_term(double (*f)(const void *context, double u, double rest),
                              const void *context, double t) {
    const double pi = 3.14159265358979323846;
    const double far = exp(-pi * sinh(fabs(t)));
    const double small = far / (1 + far), large = 1 / (1 + far);
    const double value = t < 0 ? f(context, small, large) : f(context, large, small);
    return value * pi * cosh(t) * small * large;
}

double quadrature_unit(double (*f)(const void *context, double u, double rest),
                       const void *context) {
    double sum = quadrature_term(f, context, 0), step = 0.5, result = 0;
    for (int i = 1; i * step <= quadrature_reach; i++)
        sum += quadrature_term(f, context, i * step) + quadrature_term(f, context, -i * step);
    result = sum * step;
    for (int halving = 0; halving < QUADRATURE_HALVINGS; halving++) {
        const double before = result;
        step /= 2;
        for (int i = 1; i * step <= quadrature_reach; i += 2)
            sum += quadrature_term(f, context, i * step) + quadrature_term(f, context, -i * step);
        result = sum * step;
        // The digits double, so the remaining error is the square of this difference.
        if (fabs(result - before) <= 1e-8 * fabs(result))
            break;
    }
    return result;
}
