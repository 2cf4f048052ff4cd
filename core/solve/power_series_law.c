#include "core/solve/power_series_law.h"

#include <math.h>

enum { ROOTS = 4, POWER_MAX = 18 };

static bool is_near_whole(double value) {
    return fabs(value - nearbyint(value)) <= 1e-12 * value;
}

// The number of Y^power; it is made if it is not there.
static int need(SeriesLaw *law, int power) {
    for (int i = 0; i < law->count; i++)
        if (law->power[i] == power)
            return i;
    const int left = need(law, power - power / 2), right = need(law, power / 2);
    law->power[law->count] = power;
    law->left[law->count] = left;
    law->right[law->count] = right;
    return law->count++;
}

void series_law_make(SeriesLaw *law, const ContactTerms *terms) {
    const double n = terms->exponent, own = terms->viscous > 0 ? terms->viscous_exponent : n;
    *law = (SeriesLaw){.exponents = {n, own}, .count = 2, .power = {0, 1}};
    for (law->root = 1; law->root <= ROOTS; law->root++)
        if (is_near_whole(law->root * n) && is_near_whole(law->root * own) &&
            law->root * n <= POWER_MAX)
            break;
    law->is_whole = law->root <= ROOTS;
    if (!law->is_whole)
        law->root = n < 3.5 ? ROOTS : n < 8 ? 2 : 1;
    law->pace = need(law, law->root - 1);
    if (!law->is_whole)
        return;
    law->spring = need(law, (int)nearbyint(law->root * n));
    law->viscous = need(law, (int)nearbyint(law->root * own));
}
