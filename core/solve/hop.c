#include "core/solve/hop.h"

void hop_make(Hop *hop, const Motion *flying, const State *start, const Slice *slice, double unit) {
    static const double inverse[HOP_DEGREE + 1] = {
        0, 0, 1.0 / 2, 1.0 / 6, 1.0 / 12, 1.0 / 20, 1.0 / 30, 1.0 / 42, 1.0 / 56, 1.0 / 72};
    const double square = unit * unit, omega2 = flying->omega2 * square;
    const double damping = flying->damping * unit;
    const double a = slice->value * square, s = slice->slope * square * unit;
    double *x = hop->x;
    x[0] = start->x;
    x[1] = start->v * unit;
    x[2] = -(a + damping * x[1] + omega2 * x[0]) / 2;
    x[3] = -(s + damping * 2 * x[2] + omega2 * x[1]) / 6;
    for (int k = 4; k <= HOP_DEGREE; k++)
        x[k] = -(damping * (k - 1) * x[k - 1] + omega2 * x[k - 2]) * inverse[k];
    hop->unit = unit;
    hop->z1 = (start->v + start->w) * unit;
    hop->z2 = -a / 2;
    hop->z3 = -s / 6;
    hop->r = start->r;
    hop->value = slice->value;
    hop->slope = slice->slope;
}

static double speed(const Hop *hop, double s) {
    double v = HOP_DEGREE * hop->x[HOP_DEGREE];
    for (int k = HOP_DEGREE - 1; k > 0; k--)
        v = v * s + k * hop->x[k];
    return v;
}

State hop_at(const Hop *hop, double s) {
    double x = hop->x[HOP_DEGREE];
    for (int k = HOP_DEGREE; k-- > 1;)
        x = x * s + hop->x[k];
    const double v = speed(hop, s), z = hop->z1 + s * (2 * hop->z2 + s * (3 * hop->z3));
    return (State){hop->x[0] + s * x, v / hop->unit,
                   hop->r + s * (hop->z1 + s * (hop->z2 + s * hop->z3) - x), (z - v) / hop->unit};
}

ArcIntegrals hop_integrals(const Hop *hop, const State *start, double s) {
    // Gauss-Legendre: over so short a way three points are right to rounding.
    static const double node[3] = {0.1127016653792583, 0.5, 0.8872983346207417};
    static const double weight[3] = {0.2777777777777778, 0.4444444444444444, 0.2777777777777778};
    ArcIntegrals out = {0, 0, 0, 0, 0};
    const double length = s * hop->unit;
    for (int i = 0; i < 3; i++) {
        const double v = speed(hop, s * node[i]);
        out.vv += weight[i] * v * v;
        out.av += weight[i] * v * (hop->value + hop->slope * length * node[i]);
    }
    out.vv *= length / (hop->unit * hop->unit);
    out.av *= length / hop->unit;
    out.a = length * (hop->value + hop->slope * length / 2);
    out.aw = out.a * (start->v + start->w - out.a / 2) - out.av;
    return out;
}
