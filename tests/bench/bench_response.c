// CPU of response curves of the paper's scene over frequency, beside that of the same motion by
// simulation_run: a run of settle_cycles from rest at each value, and one as long as the section
// where no period is found. Smallest of the repeats.
#include <stdio.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/math/fft.h"
#include "core/study/response_curve.h"
#include "server/util/clock.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"

enum { REPEATS = 3 };

typedef struct ResponseCase {
    const char *model;
    double restitution, contact_time, from, to;
    size_t points, section_points;
} ResponseCase;

static Problem problem;

static void scene_make(const ResponseCase *one, double frequency, double cycles,
                       Simulation *simulation) {
    paper_scene(simulation, one->restitution, one->contact_time, cycles / frequency);
    paper_model(simulation, one->model);
    paper_sine(simulation, 1, frequency);
    paper_channels(simulation, NULL, 0);
    paper_no_psd(simulation);
    simulation->output.impacts = false;
}

static double value_of(const ResponseCase *one, size_t point) {
    return one->from + (one->to - one->from) * (double)point / (double)(one->points - 1);
}

// CPU of the study [s]; the number of points with a period. Negative: it failed.
static double study_cpu(const ResponseCase *one, size_t *periodic) {
    StudyRequest request = {0};
    const StudyTools tools = {0};
    Variant *answer = NULL;
    scene_make(one, one->from, 10, &request.simulation);
    request.study = variant_new(&study_response.kind);
    ResponseStudy *study = (ResponseStudy *)(void *)request.study;
    study->axis.pointer = strdup("/excitation/frequency");
    study->axis.from = one->from;
    study->axis.to = one->to;
    study->axis.count = one->points;
    study->section_points = one->section_points;
    double cpu = -1;
    if (study_request_complete(&request, NULL, NULL, &problem) == STATUS_OK) {
        const int64_t start = clock_thread_cpu_ns();
        if (study_run(request.study, &request.simulation, &tools, &answer, &problem) == STATUS_OK)
            cpu = (double)(clock_thread_cpu_ns() - start) / 1e9;
    }
    const ResponseCurve *curve = (const ResponseCurve *)(const void *)answer;
    *periodic = 0;
    for (size_t i = 0; curve != NULL && i < curve->points.count; i++)
        *periodic += curve->points.at[i].period != COUNT_ABSENT ? 1 : 0;
    variant_free(answer);
    study_request_clear(&request);
    return cpu;
}

// CPU of the runs [s]. Negative: one failed.
static double runs_cpu(const ResponseCase *one) {
    Workspace workspace = {0};
    double cpu = 0;
    for (size_t i = 0; i < one->points && cpu >= 0; i++) {
        Simulation simulation;
        Outcome *outcome = NULL;
        scene_make(one, value_of(one, i), 200 + (double)one->section_points, &simulation);
        const int64_t start = clock_thread_cpu_ns();
        if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK ||
            simulation_run(&simulation, NULL, NULL, &workspace, &outcome, &problem) != STATUS_OK)
            cpu = -1;
        else
            cpu += (double)(clock_thread_cpu_ns() - start) / 1e9;
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
    workspace_clear(&workspace);
    return cpu;
}

int main(void) {
    static const ResponseCase cases[] = {
        {"spring_damper", 0.61, 0.025, 2, 6, 400, 0},
        {"spring_damper", 0.61, 0.025, 2, 6, 400, 64},
        {"spring_damper", 0.46, 0.0003, 2, 6, 400, 0},
        {"spring_damper", 0.46, 0.0003, 2, 6, 400, 64},
        {"impulse", 0.61, 0.025, 2, 6, 400, 64},
        {"spring_damper", 0.61, 0.025, 4.1, 4.6, 400, 64},
    };
    fft_start();
    printf("%-14s %5s %7s %9s %7s %9s %9s %9s %6s\n", "contact", "e", "T_c s", "Hz", "points",
           "periodic", "study s", "runs s", "ratio");
    for (size_t i = 0; i < COUNT(cases); i++) {
        const ResponseCase *one = &cases[i];
        double study = 1e300, runs = 1e300;
        size_t periodic = 0;
        for (int k = 0; k < REPEATS; k++) {
            const double a = study_cpu(one, &periodic), b = runs_cpu(one);
            if (a < 0 || b < 0) {
                printf("%s\n", problem.detail);
                return 1;
            }
            study = a < study ? a : study;
            runs = b < runs ? b : runs;
        }
        printf("%-14s %5.2f %7.4f %3g to %-3g %4zu+%-3zu %8zu %9.3f %9.3f %6.2f\n", one->model,
               one->restitution, one->contact_time, one->from, one->to, one->points,
               one->section_points, periodic, study, runs, study / runs);
    }
    return 0;
}
