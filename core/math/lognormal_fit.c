// With x = ln of a bound and z = alpha x - gamma, alpha = 1 / beta and gamma = mu / beta, the
// likelihood is the product of Phi(z_high) - Phi(z_low). Its logarithm is concave in alpha and
// gamma (Burridge, Journal of the Royal Statistical Society B 43 (1981) 41-45), so that Newton's
// method with halved steps finds its maximum. That exists where no direction in (alpha, gamma)
// lowers no term: there are lower and upper bounds, and the largest lower one is above the smallest
// upper one.
//
// The covariance of mu and ln beta is the inverse of the observed information. Student's t in place
// of the normal distribution makes the intervals of few numbers wide enough.
#include "core/math/lognormal_fit.h"

#include <math.h>

#include "core/math/student_t.h"

enum { ITERATIONS_MAX = 100, HALVINGS_MAX = 40 };

static const double GAIN_MIN = 1e-8; // of the logarithm of the likelihood in a step

// Bounds as (ln bound - middle) / width; the values here are of these.
typedef struct LognormalData {
    const CensoredNumber *numbers;
    size_t count;
    double middle, width;
} LognormalData;

typedef struct LognormalPoint {
    double value;    // logarithm of the likelihood
    double slope[2]; // by alpha and gamma
    double bend[3];  // by alpha twice, by both, by gamma twice
} LognormalPoint;

static bool lognormal_is_bound(double bound) {
    return bound > 0 && bound < (double)INFINITY;
}

static double lognormal_density(double z) {
    return exp(-z * z / 2) / 2.50662827463100050242; // sqrt(2 pi)
}

// Phi(to) - Phi(from), of which the tail on the same side as both is taken.
static double lognormal_between(double from, double to) {
    return from > 0 ? (erfc(from / sqrt(2)) - erfc(to / sqrt(2))) / 2
                    : (erfc(-to / sqrt(2)) - erfc(-from / sqrt(2))) / 2;
}

static LognormalPoint lognormal_point(const LognormalData *data, double alpha, double gamma) {
    LognormalPoint point = {0};
    for (size_t i = 0; i < data->count; i++) {
        const double bounds[2] = {data->numbers[i].low, data->numbers[i].high};
        double z[2] = {-(double)INFINITY, (double)INFINITY}, slope[2] = {0}, bend[3] = {0};
        for (int k = 0; k < 2; k++) {
            if (!lognormal_is_bound(bounds[k]))
                continue;
            const double x = (log(bounds[k]) - data->middle) / data->width, sign = k == 0 ? -1 : 1;
            z[k] = alpha * x - gamma;
            const double density = sign * lognormal_density(z[k]);
            slope[0] += x * density;
            slope[1] -= density;
            bend[0] -= x * x * z[k] * density;
            bend[1] += x * z[k] * density;
            bend[2] -= z[k] * density;
        }
        const double p = lognormal_between(z[0], z[1]);
        point.value += log(p);
        for (int k = 0; k < 2; k++)
            point.slope[k] += slope[k] / p;
        point.bend[0] += bend[0] / p - slope[0] / p * (slope[0] / p);
        point.bend[1] += bend[1] / p - slope[0] / p * (slope[1] / p);
        point.bend[2] += bend[2] / p - slope[1] / p * (slope[1] / p);
    }
    return point;
}

// False where there is no maximum.
static bool lognormal_measure(LognormalData *data) {
    double low_max = 0, high_min = (double)INFINITY, least = (double)INFINITY, most = 0;
    for (size_t i = 0; i < data->count; i++) {
        const double bounds[2] = {data->numbers[i].low, data->numbers[i].high};
        for (int k = 0; k < 2; k++)
            if (lognormal_is_bound(bounds[k])) {
                least = fmin(least, bounds[k]);
                most = fmax(most, bounds[k]);
            }
        if (lognormal_is_bound(bounds[0]))
            low_max = fmax(low_max, bounds[0]);
        if (lognormal_is_bound(bounds[1]))
            high_min = fmin(high_min, bounds[1]);
    }
    data->middle = (log(least) + log(most)) / 2;
    data->width = log(most) - log(least);
    return low_max > high_min;
}

// The maximum, from a distribution that is wide enough for every bound.
static bool lognormal_maximize(const LognormalData *data, double *alpha, double *gamma,
                               LognormalPoint *at) {
    *alpha = 4;
    *gamma = 0;
    *at = lognormal_point(data, *alpha, *gamma);
    for (int i = 0; i < ITERATIONS_MAX; i++) {
        const double *b = at->bend, *s = at->slope;
        const double determinant = b[0] * b[2] - b[1] * b[1];
        const double step[2] = {-(b[2] * s[0] - b[1] * s[1]) / determinant,
                                -(b[0] * s[1] - b[1] * s[0]) / determinant};
        const double gain = s[0] * step[0] + s[1] * step[1];
        if (!(determinant > 0) || !isfinite(gain))
            return false;
        // The last step is beyond what differences of the value can show.
        const bool is_last = gain < GAIN_MIN;
        double share = 1;
        for (int k = 0; k < HALVINGS_MAX; k++, share /= 2) {
            const double next[2] = {*alpha + share * step[0], *gamma + share * step[1]};
            const LognormalPoint there = lognormal_point(data, next[0], next[1]);
            if (!(next[0] > 0) || (!is_last && !(there.value >= at->value + 1e-4 * share * gain)))
                continue;
            *alpha = next[0];
            *gamma = next[1];
            *at = there;
            break;
        }
        if (is_last)
            return true;
    }
    return false;
}

bool lognormal_fit(const CensoredNumber *numbers, size_t count, double confidence,
                   LognormalFit *fit) {
    LognormalData data = {.numbers = numbers, .count = count};
    LognormalPoint at;
    double alpha, gamma;
    if (!lognormal_measure(&data) || !lognormal_maximize(&data, &alpha, &gamma, &at))
        return false;
    // By mu and ln beta, in the units of the data: d(alpha, gamma) = (0, -alpha) and (alpha,
    // -gamma).
    const double *b = at.bend;
    const double by_mu = -alpha * alpha * b[2];
    const double cross = alpha * (alpha * b[1] + gamma * b[2]);
    const double by_beta =
        -(alpha * alpha * b[0] + 2 * alpha * gamma * b[1] + gamma * gamma * b[2]);
    const double determinant = by_mu * by_beta - cross * cross;
    const double t = student_t_quantile(confidence, count > 1 ? count - 1 : 1);
    const double mu = data.middle + data.width * gamma / alpha, beta = data.width / alpha;
    const double mu_error = data.width * sqrt(by_beta / determinant),
                 beta_error = sqrt(by_mu / determinant);
    *fit = (LognormalFit){.median = exp(mu), .dispersion = beta};
    for (int k = 0; k < 2; k++) {
        const double sign = k == 0 ? -t : t;
        fit->median_interval[k] = exp(mu + sign * mu_error);
        fit->dispersion_interval[k] = beta * exp(sign * beta_error);
    }
    return determinant > 0 && isfinite(mu_error + beta_error) &&
           isfinite(fit->median_interval[1]) && isfinite(fit->dispersion_interval[1]);
}
