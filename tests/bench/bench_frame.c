// ns of CPU per sample of the general engine at frames of 10 and 200 storeys, with all modes and
// with some, 1 kHz and 5 channels
// of the top storey and its damper. Smallest of the repeats; the plan is made apart, the modes and
// tables of a run are in it. `bench_frame WORDS` runs the frames whose name has them.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "core/solve/exact.h"
#include "server/util/clock.h"
#include "tests/support/frames.h"
#include "tests/support/paper.h"

enum { CHANNELS = 5 };

typedef struct Case {
    const char *name;
    size_t storeys, dampers;
    double duration, restitution, contact_time;
    bool is_random;
    double odd; // how much more the first storey is damped: not classical
    int repeats;
    size_t kept; // modes; 0: all
} Case;

static const Case cases[] = {
    {"1 storey, 1 sponge, random", 1, 1, 60, 0.61, 0.025, true, 1, 10, 0},
    {"10 storeys, free", 10, 0, 60, 0.61, 0.025, false, 1, 10, 0},
    {"10 storeys, random", 10, 0, 60, 0.61, 0.025, true, 1, 10, 0},
    {"10 storeys, 2 sponge, free", 10, 2, 60, 0.61, 0.025, false, 1, 10, 0},
    {"10 storeys, 2 sponge, random", 10, 2, 60, 0.61, 0.025, true, 1, 10, 0},
    {"10 storeys, 2 aluminium, random", 10, 2, 60, 0.46, 0.0003, true, 1, 10, 0},
    {"10 storeys, 2 impulse, random", 10, 2, 60, 0.46, NAN, true, 1, 10, 0},
    {"10 storeys odd, 2 sponge, random", 10, 2, 60, 0.61, 0.025, true, 5, 5, 0},
    {"200 storeys, 2 sponge, random", 200, 2, 10, 0.61, 0.025, true, 1, 2, 0},
    {"200 storeys odd, 2 sponge, random", 200, 2, 10, 0.61, 0.025, true, 5, 1, 0},
    {"200 storeys, random", 200, 0, 10, 0.61, 0.025, true, 1, 3, 0},
    {"200 storeys, random, 50 modes", 200, 0, 10, 0.61, 0.025, true, 1, 5, 50},
    {"200 storeys, random, 10 modes", 200, 0, 10, 0.61, 0.025, true, 1, 5, 10},
    {"200 storeys, 2 sponge, 50 modes", 200, 2, 10, 0.61, 0.025, true, 1, 5, 50},
    {"200 storeys, 2 sponge, 10 modes", 200, 2, 10, 0.61, 0.025, true, 1, 5, 10},
    {"200 storeys odd, 2 sponge, 10 modes", 200, 2, 10, 0.61, 0.025, true, 5, 5, 10},
};

static Plan *make_plan(const Case *from) {
    const size_t n = from->storeys;
    Plan *plan = frames_new(n, from->dampers, from->duration, 1000);
    // A first mode of 1 Hz.
    const double first = 2 * sin(acos(-1) / (2 * (2 * (double)n + 1)));
    frames_uniform(plan, 1000, 1000 * pow(6.283185307179586 / first, 2), 0.02);
    plan->damping[0] *= from->odd;
    for (size_t d = 0; d < from->dampers; d++)
        frames_damper(plan, d, (n - 1) / (d + 1), 30, 0.05, from->restitution, from->contact_time);
    for (size_t i = 0; i < n && !from->is_random; i++)
        plan->displacement[i] = 0.1 * (double)(i + 1) / (double)n;
    if (modes_make(&plan->modes, n, plan->mass, plan->stiffness, plan->damping, plan->influence,
                   NULL) != STATUS_OK)
        abort();
    size_t list[200];
    for (size_t i = 0; i < n; i++)
        list[i] = i;
    if (from->kept > 0) {
        modes_keep(&plan->modes, n, list, from->kept);
        plan->is_truncated = true;
    }
    return plan;
}

int main(int argc, char **argv) {
    fft_start();
    printf("%-36s %10s %10s %10s %10s\n", "frame", "ns/sample", "impacts", "steps", "residual");
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        if (argc > 1 && strstr(cases[c].name, argv[1]) == NULL)
            continue;
        Plan *plan = make_plan(&cases[c]);
        Base base = {0};
        Problem problem;
        problem_clear(&problem);
        if (cases[c].is_random) {
            Simulation simulation;
            paper_scene(&simulation, 0.5, 0.01, cases[c].duration);
            paper_random(&simulation, 1, 1);
            const Excitation *excitation = scene_excitation(&simulation.scene);
            const Span span = {.duration = plan->duration, .sample_rate = plan->sample_rate};
            if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK ||
                excitation_make(excitation, &span, NULL, &base, &problem) != STATUS_OK)
                return printf("%s\n", problem.detail), 1;
            simulation_clear(&simulation);
        }
        double *values = calloc(plan->count, CHANNELS * sizeof *values);
        if (values == NULL)
            return 1;
        const ChannelId wanted[] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY, CHANNEL_ACCELERATION,
                                    CHANNEL_DAMPER_DISPLACEMENT, CHANNEL_CONTACT_FORCE};
        RunColumn columns[CHANNELS];
        for (size_t i = 0; i < CHANNELS; i++)
            columns[i] =
                (RunColumn){wanted[i], i < 3 ? plan->storeys - 1 : 0, values + i * plan->count};
        Run run = {.plan = plan,
                   .base = &base,
                   .columns = columns,
                   .column_count = cases[c].dampers > 0 ? CHANNELS : 3};
        double least = 1e300;
        for (int i = 0; i < cases[c].repeats; i++) {
            Response response = {0};
            run.steps = 0;
            const int64_t start = clock_thread_cpu_ns();
            if (exact_run_engine(&run, &response, &problem) != STATUS_OK)
                return printf("%s\n", problem.detail), 1;
            least = fmin(least, (double)(clock_thread_cpu_ns() - start) / (double)plan->count);
            if (i + 1 == cases[c].repeats)
                printf("%-36s %10.1f %10zu %10.0f %10.1e\n", cases[c].name, least,
                       response.impacts.count, run.steps, response.energy.residual);
            response_clear(&response);
        }
        free(values);
        base_clear(&base);
        plan_free(plan);
    }
    return 0;
}
