#include "core/solve/taylor_flight.h"

#include <string.h>

void taylor_flight_table_make(TaylorFlightTable *table, const Motion *flying, double omega,
                              double unit) {
    const double omega2 = flying->omega2 * unit * unit, damping = flying->damping * unit;
    const double turn = omega * unit;
    memset(table, 0, sizeof *table);
    table->unit = unit;
    table->per_unit = 1 / unit;
    table->square = unit * unit;
    table->slope = omega > 0 ? table->square : table->square * unit;
    table->is_sine = omega > 0;
    for (int i = 0; i < 4; i++) {
        // a_g's own series under a unit of its value, or of its slope or other half.
        double x[TAYLOR_FLIGHT_DEGREE + 1] = {i == 0, i == 1},
                                        a[TAYLOR_FLIGHT_DEGREE + 1] = {i == 2, 0};
        if (i == 3)
            a[1] = omega > 0 ? turn : 1;
        for (int k = 2; k <= TAYLOR_FLIGHT_DEGREE; k++) {
            if (omega > 0)
                a[k] = -turn * turn * a[k - 2] / (k * (k - 1));
            x[k] = -(damping * (k - 1) * x[k - 1] + omega2 * x[k - 2] + a[k - 2]) / (k * (k - 1));
            table->x[i][k - 1] = x[k];
            if (i >= 2)
                table->z[i - 2][k - 1] = -a[k - 2] / (k * (k - 1));
        }
    }
}
