// Every condition is a polynomial; its first zero is isolated by halving the step until one sign of
// one derivative decides, and bisected.
#include "tests/truth/frame_reference_walk.h"

#include <string.h>

Quad quad_value(const Quad *f, int degree, Quad s) {
    Quad sum = f[degree];
    for (int i = degree; i-- > 0;)
        sum = sum * s + f[i];
    return sum;
}

Quad quad_slope(const Quad *f, int degree, Quad s) {
    Quad sum = 0;
    for (int i = degree; i > 0; i--)
        sum = sum * s + i * f[i];
    return sum;
}

// f on [a, b]: where it first goes below 0. f(a) >= 0.
static bool first_below(const Quad *f, int degree, Quad a, Quad b, int depth, Quad *s) {
    // Around the middle: f = sum of g_k t^k with |t| <= w.
    Quad g[TERMS], w = (b - a) / 2, middle = (a + b) / 2;
    memcpy(g, f, sizeof(Quad) * (size_t)(degree + 1));
    for (int i = 0; i < degree; i++)
        for (int j = degree; j-- > i;)
            g[j] += middle * g[j + 1];
    Quad power = w, rest = 0, bend = 0;
    for (int i = 1; i <= degree; i++, power *= w) {
        rest += fabsq(g[i]) * power;
        if (i > 1)
            bend += i * fabsq(g[i]) * power / w;
    }
    if (g[0] >= rest)
        return false;
    const bool is_monotone = fabsq(g[1]) > bend;
    if (is_monotone || depth == 0) {
        if (quad_value(f, degree, b) >= 0)
            return false;
        for (int i = 0; i < 130; i++) {
            const Quad c = (a + b) / 2;
            if (quad_value(f, degree, c) < 0)
                b = c;
            else
                a = c;
        }
        *s = b;
        return true;
    }
    return first_below(f, degree, a, middle, depth - 1, s) ||
           first_below(f, degree, middle, b, depth - 1, s);
}

bool quad_crossing(const Quad *f, int degree, int zeros, Quad *s) {
    f += zeros;
    degree -= zeros;
    if (f[0] < 0 || (f[0] == 0 && degree > 0 && f[1] < 0)) {
        *s = 0;
        return true;
    }
    return first_below(f, degree, 0, 1, 60, s);
}
