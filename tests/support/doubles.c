#include "tests/support/doubles.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

double *doubles_read(size_t *count) {
    size_t room = 1 << 16;
    double *values = malloc(room * sizeof *values);
    *count = 0;
    while (values != NULL) {
        *count += fread(values + *count, sizeof *values, room - *count, stdin);
        if (*count < room)
            break;
        room *= 2;
        double *more = realloc(values, room * sizeof *values);
        if (more == NULL)
            free(values);
        values = more;
    }
    return values;
}

bool doubles_write(const double *values, size_t count) {
    return fwrite(values, sizeof *values, count, stdout) == count && fflush(stdout) == 0;
}

double doubles_largest(const double *values, size_t count) {
    double most = 0;
    for (size_t i = 0; i < count; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}
