#include "core/solve/hop.h"

void hop_table_make(HopTable *table, const Motion *flying, double unit) {
    const double omega2 = flying->omega2 * unit * unit, damping = flying->damping * unit;
    table->unit = unit;
    table->per_unit = 1 / unit;
    for (int i = 0; i < 4; i++) {
        double x[HOP_DEGREE + 1] = {i == 0, i == 1};
        for (int k = 2; k <= HOP_DEGREE; k++) {
            const double base = k - i == 0 ? 1 : 0; // a unit of a_g is of degree 2, of its slope 3
            x[k] = -(damping * (k - 1) * x[k - 1] + omega2 * x[k - 2] + base) / (k * (k - 1));
            table->of[i][k - 2] = x[k];
        }
    }
}
