// Ground motions of every layout, mutated: whatever comes in, ground_motion_text_read answers with
// samples that are finite and of the count it tells, or with one fault that has a place. Meant for
// the instrumented build: build-debug/tests/fuzz_import SECONDS [SEED]. What breaks the rule is
// printed.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "tests/support/mutate.h"

enum { ROUNDS_TIMED = 256 };

static const char *const seeds[] = {
    "PEER STRONG MOTION DATABASE RECORD\nSOMEWHERE, 090\nACCELERATION TIME HISTORY IN UNITS OF G. "
    "FILTER\n"
    "NPTS=  7, DT= .01000 SEC\n  -.6403182E-02  -.6028715E-02   .5304162E-03\n   .7743260E-02 .1 "
    ".2\n .3",
    "PEER NGA\r\r\nunits: (g)\r\r\n5    0.0100    NPTS, DT\r\r\n   0.233833E-06   "
    "0.299033D-06\r\r\n 1 2 3\r\r\n",
    "Prose, 4 points\n*** Begin data ***\nNPTS=  4, dt= .02\n   0.00630   0.00364\n 1 -1\n*** End "
    "data ***\n\n",
    "   0.00630   0.00364   0.00099\n  -0.00128   0.00368   0.00864\n   0.00021\n*** End Data "
    "***\n",
    "From 1994\nTime[s] Accel[m/s^2]\n0.0000\t-0.0012\n0.0100\t-0.0007\n0.0200\t-0.0003\n0.0300\t1",
    "motion\n5 0.0100\n2.42E-07\n1.46E-07\n-2.42E-06\n6.85E-04\n5\n",
    "     0.039111\n     0.020721\n     0.006817\n    -0.020472\n",
};

// What files are broken with.
static const char *const pieces[] = {
    "NPTS",
    "DT=",
    "*** Begin data ***\n",
    "*** End data ***\n",
    "NaN",
    "****",
    "1e999",
    "-",
    ".",
    "E",
    "D+",
    "\n",
    "\r\n",
    "\t",
    " ",
    "0",
    "9",
    "99999999999999999999",
    "1.0-2.0",
    "UNITS OF G",
    "m/s^2",
    "CM/SEC/SEC",
    "GAL",
    "time",
    "VELOCITY TIME",
    "\xEF\xBB\xBF",
    "\xff",
    ",",
    "=",
    "1e-320",
    "1e308",
    "/",
    "(g)",
    "G*",
};

static Mutator mutator = {
    .seeds = seeds, .pieces = pieces, .seed_count = COUNT(seeds), .piece_count = COUNT(pieces)};

static const char *judge(Status status, const GroundMotionText *import, const Problem *problem) {
    if (status != STATUS_OK) {
        if (import->samples.at != NULL || import->header != NULL)
            return "failed, but left something";
        return problem->count == 1 && strncmp(problem->faults[0].pointer, "line ", 5) == 0 &&
                       problem->faults[0].detail[0] != '\0'
                   ? NULL
                   : "failed without one fault that has a place";
    }
    if (import->samples.count < 2 || !(import->interval > 0) || !isfinite(import->interval))
        return "no samples or no interval";
    for (size_t i = 0; i < import->samples.count; i++)
        if (!isfinite(import->samples.at[i]))
            return "a sample is not finite";
    return NULL;
}

int main(int argc, char **argv) {
    static Problem problem;
    const double seconds = argc > 1 ? atof(argv[1]) : 10;
    mutator.state = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    const time_t start = time(NULL);
    unsigned long long rounds = 0, passed = 0;
    while (difftime(time(NULL), start) < seconds)
        for (int i = 0; i < ROUNDS_TIMED; i++, rounds++) {
            size_t size;
            char *text = mutate_text(&mutator, &size);
            if (text == NULL)
                return 1;
            const GroundMotionOptions request = {mutate_draw(&mutator, 2) == 0 ? 0.01 : (double)NAN,
                                                 (int)mutate_draw(&mutator, 4) - 1};
            GroundMotionText import;
            problem_clear(&problem);
            const Status status =
                ground_motion_text_read(text, size, RECORD_SAMPLES, &request, &import, &problem);
            const char *wrong = judge(status, &import, &problem);
            if (wrong != NULL)
                return mutate_refuse(wrong, text, size);
            free(text);
            passed += status == STATUS_OK;
            ground_motion_text_clear(&import);
        }
    printf("%llu texts, %llu of them read\n", rounds, passed);
    return 0;
}
