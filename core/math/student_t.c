// With theta = atan(t / sqrt(n)) the probability of [-t, t] is a finite sum of positive terms
// (Abramowitz and Stegun 26.7.3 and 26.7.4):
//
//   n odd:  2/pi (theta + sin theta cos theta (1 + 2/3 cos^2 theta + 2/3 4/5 cos^4 theta ...)),
//   n even: sin theta (1 + 1/2 cos^2 theta + 1/2 3/4 cos^4 theta ...),
//
// up to the powers n - 3 and n - 2 of the cosine.
#include "core/math/student_t.h"

#include <math.h>

#define PI 3.14159265358979323846264338328

double student_t_probability(double t, size_t freedom) {
    if (freedom == 0)
        return erf(t / sqrt(2));
    const double n = (double)freedom, square = n / (n + t * t);
    const double theta = atan(t / sqrt(n)), cosine = sqrt(square), sine = t / hypot(sqrt(n), t);
    const size_t first = freedom % 2;
    double term = 1, sum = freedom > 1 ? 1 : 0;
    for (size_t k = 2 + first; k < freedom; k += 2) {
        term *= square * ((double)k - 1) / (double)k;
        sum += term;
    }
    return first == 1 ? 2 / PI * (theta + sine * cosine * sum) : sine * sum;
}

double student_t_quantile(double probability, size_t freedom) {
    double low = 0, high = 1;
    while (student_t_probability(high, freedom) < probability && high < 1e9)
        high *= 2;
    for (;;) {
        const double middle = low + (high - low) / 2;
        if (!(low < middle && middle < high))
            return middle;
        if (student_t_probability(middle, freedom) < probability)
            low = middle;
        else
            high = middle;
    }
}
