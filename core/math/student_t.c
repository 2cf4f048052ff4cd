// With theta = atan(t / sqrt(n)) the share within [-t, t] is a finite sum (Abramowitz and Stegun
// 26.7.3 and 26.7.4), all of whose terms are positive:
//
//   n odd:  2/pi (theta + sin theta cos theta (1 + 2/3 cos^2 theta + 2/3 4/5 cos^4 theta ...)),
//   n even: sin theta (1 + 1/2 cos^2 theta + 1/2 3/4 cos^4 theta ...),
//
// to the powers n - 3 and n - 2 of the cosine.
#include "core/math/student_t.h"

#include <math.h>

#define PI 3.14159265358979323846264338328

double student_share(double t, size_t freedom) {
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

double student_quantile(double share, size_t freedom) {
    double least = 0, most = 1;
    while (student_share(most, freedom) < share && most < 1e9)
        most *= 2;
    for (;;) {
        const double middle = least + (most - least) / 2;
        if (!(least < middle && middle < most))
            return middle;
        if (student_share(middle, freedom) < share)
            least = middle;
        else
            most = middle;
    }
}
