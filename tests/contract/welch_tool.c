// welch_tool WINDOW DETREND SEGMENT OVERLAP RATE: the density of the doubles at standard input,
// first the frequencies, then the values.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "core/result/welch.h"
#include "tests/support/doubles.h"

static int index_of(const char *const *names, const char *name) {
    for (int i = 0; names[i] != NULL; i++)
        if (strcmp(names[i], name) == 0)
            return i;
    return -1;
}

int main(int count, char **arguments) {
    if (count != 6)
        return 2;
    const WelchSettings settings = {
        .window = index_of(welch_window_names, arguments[1]),
        .detrend = index_of(welch_detrend_names, arguments[2]),
        .segment = strtoul(arguments[3], NULL, 10),
        .overlap = strtoul(arguments[4], NULL, 10),
    };
    const char *unit = "1/Hz";
    Column column = {.name = "x"};
    Columns series = {.at = &column, .count = 1};
    column.values = doubles_read(&series.rows);
    if (column.values == NULL)
        return 1;

    static Problem problem;
    Spectrum spectrum;
    fft_start();
    const Status status = welch_spectrum(&series, &unit, strtod(arguments[5], NULL), &settings,
                                         NULL, NULL, &spectrum, &problem);
    bool is_written = false;
    if (status == STATUS_OK)
        is_written = doubles_write(spectrum.frequency, spectrum.densities.rows) &&
                     doubles_write(spectrum.densities.at[0].values, spectrum.densities.rows);
    else
        fprintf(stderr, "welch_tool: %s\n", problem.detail);
    spectrum_clear(&spectrum);
    free(column.values);
    return is_written ? 0 : 1;
}
