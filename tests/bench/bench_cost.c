// Predicted over measured CPU time and memory of drawn scenes: `bench_cost [SEED [COUNT [list]]]`.
// Draws COUNT scenes (500) of all kinds below that take at least 5 ms of CPU, and prints how many
// predictions are within a factor of 2 and of 4, and the smallest, median and largest ratio. CPU
// times are the smaller of two runs; memory is the peak of allocated bytes during a run. Scenes
// predicted to take more than PREDICTED_MAX are not run. A run that takes STOPPED_AFTER is stopped
// there and compared at that time. `list` prints every scene as well.
#include <errno.h>
#include <malloc.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "core/simulation/simulation.h"
#include "server/json/parse.h"
#include "server/util/clock.h"
#include "server/util/process.h"
#include "tests/truth/drawn.h"

enum { SCENES = 500, SCENES_MAX = 100000, STOREYS_MAX = 40 };
static const double MEASURED_MIN = 5e-3, PREDICTED_MAX = 0.3, STOPPED_AFTER = 3; // [s] of CPU

// Counts what is allocated and its peak. Sanitizers have an allocator of their own.
static size_t allocated, allocated_peak;

#ifndef __has_feature
#define __has_feature(x) 0
#endif
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) &&                             \
    !__has_feature(address_sanitizer) && !__has_feature(memory_sanitizer) &&                       \
    !__has_feature(thread_sanitizer)
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *block);

static void *allocation_count(void *block) {
    allocated += malloc_usable_size(block);
    if (allocated > allocated_peak)
        allocated_peak = allocated;
    return block;
}

void *malloc(size_t size) {
    return allocation_count(__libc_malloc(size));
}

void *calloc(size_t count, size_t size) {
    return allocation_count(__libc_calloc(count, size));
}

void *realloc(void *block, size_t size) {
    const size_t before = malloc_usable_size(block);
    void *moved = __libc_realloc(block, size);
    if (moved == NULL && size > 0)
        return NULL;
    allocated -= before;
    return allocation_count(moved);
}

void *memalign(size_t alignment, size_t size) {
    return allocation_count(__libc_memalign(alignment, size));
}

void *aligned_alloc(size_t alignment, size_t size) {
    return memalign(alignment, size);
}

int posix_memalign(void **block, size_t alignment, size_t size) {
    *block = memalign(alignment, size);
    return *block == NULL ? ENOMEM : 0;
}

void free(void *block) {
    allocated -= malloc_usable_size(block);
    __libc_free(block);
}
#endif

typedef struct SceneKind {
    const char *name, *solver;
    int storeys_min, storeys_max;
    bool is_power;
} SceneKind;

static const SceneKind kinds[] = {
    {"exact, one mass", "exact", 1, 1, false},
    {"exact, frame", "exact", 2, STOREYS_MAX, false},
    {"exact, power law, one mass", "exact", 1, 1, true},
    {"exact, power law, frame", "exact", 2, 12, true},
    {"rk4", "rk4", 1, 8, false},
    {"rk4, power law", "rk4", 1, 8, true},
    {"newmark", "newmark", 1, 8, false},
    {"precise", "precise", 1, 8, false},
    {"adaptive", "adaptive", 1, 4, false},
    {"adaptive, power law", "adaptive", 1, 4, true},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

static Draws draws;

static int draw_int(int first, int last) {
    return first + (int)draws_uniform(&draws, 0, last - first + 1);
}

static void encode_list(FILE *out, const char *name, int count, double a, double b) {
    fprintf(out, "\"%s\": [", name);
    for (int i = 0; i < count; i++)
        fprintf(out, "%s%.6g", i > 0 ? ", " : "", draws_uniform(&draws, a, b));
    fprintf(out, "]");
}

static void write_structure(FILE *out, int storeys) {
    if (storeys == 1) {
        fprintf(out, "\"structure\": {\"mass\": 1.35, \"stiffness\": %.6g, \"damping\": %.6g}",
                draws_scattered(&draws, 200, 5000), draws_uniform(&draws, 0, 4));
        return;
    }
    fprintf(out, "\"structure\": {\"kind\": \"frame\", ");
    encode_list(out, "masses", storeys, 0.5, 2);
    fprintf(out, ", ");
    encode_list(out, "stiffnesses", storeys, 500, 5000);
    fprintf(out, ", ");
    if (draws_chance(&draws, 0.3))
        encode_list(out, "dampings", storeys, 0.2, 2);
    else
        fprintf(out, "\"damping_ratio\": %.3g", draws_uniform(&draws, 0.005, 0.05));
    fprintf(out, "}");
}

static void write_dampers(FILE *out, const SceneKind *kind, int storeys) {
    static const char *const power_laws[] = {
        "hertz",  "hunt_crossley", "hunt_crossley_textbook", "lankarani_nikravesh",
        "flores", "jankowski"};
    const int most = storeys < 3 ? storeys : 3;
    const int count = draws_chance(&draws, 0.7) || kind->is_power ? draw_int(1, most) : 0;
    const char *law = kind->is_power ? power_laws[draw_int(0, 5)] : NULL;
    const double exponent = draws_chance(&draws, 0.7) ? 1.5 : draws_uniform(&draws, 1.1, 2.9);
    fprintf(out, ", \"dampers\": [");
    for (int d = 0; d < count; d++) {
        fprintf(out, "%s{\"mass\": %.6g, \"clearance\": %.6g, \"storey\": %d, ", d > 0 ? ", " : "",
                draws_uniform(&draws, 0.02, 0.3), draws_scattered(&draws, 1e-3, 0.05),
                draw_int(1, storeys));
        // Hertz's law has no restitution.
        fprintf(out, "\"buffer\": {\"restitution\": %.6g, \"contact_time\": %.6g",
                law == power_laws[0] ? 1 : draws_uniform(&draws, 0.3, 0.95),
                draws_scattered(&draws, 1e-4, 3e-2));
        if (kind->is_power)
            fprintf(out, ", \"exponent\": %.6g", exponent);
        fprintf(out, "}}");
    }
    fprintf(out, "]");
    if (kind->is_power)
        fprintf(out, ", \"contact\": {\"model\": \"%s\"}", law);
    else if (count > 0 && draws_chance(&draws, 0.2))
        fprintf(out, ", \"contact\": {\"model\": \"impulse\"}");
    else if (count > 0 && draws_chance(&draws, 0.2))
        fprintf(out, ", \"contact\": {\"model\": \"spring_damper\", "
                     "\"separation\": \"zero_force\"}");
}

static void write_excitation(FILE *out, int storeys) {
    const double amplitude = draws_scattered(&draws, 0.2, 5),
                 frequency = draws_scattered(&draws, 0.5, 20);
    fprintf(out, ", \"excitation\": {\"kind\": ");
    switch (draw_int(0, 6)) {
    case 0:
        fprintf(out, "\"free\", ");
        encode_list(out, "displacement", storeys, -0.05, 0.05);
        fprintf(out, "}");
        break;
    case 1:
    case 2:
        fprintf(out, "\"random\", \"seed\": %d, \"rms\": %.6g, \"band\": [0, %.6g]}",
                draw_int(1, 1000), amplitude, draws_scattered(&draws, 5, 50));
        break;
    case 3:
        fprintf(out, "\"sine\", \"amplitude\": %.6g, \"frequency\": %.6g}", amplitude, frequency);
        break;
    case 4:
        fprintf(out,
                "\"chirp\", \"amplitude\": %.6g, \"start_frequency\": 0.5, \"end_frequency\": "
                "%.6g}",
                amplitude, frequency + 1);
        break;
    case 5:
        fprintf(out, "\"%s\", \"amplitude\": %.6g, \"length\": %.6g}",
                draws_chance(&draws, 0.5) ? "half_sine" : "triangular", 4 * amplitude,
                draws_scattered(&draws, 0.01, 1));
        break;
    default:
        fprintf(out, "\"record\", \"interval\": %.6g, ", draws_scattered(&draws, 1e-3, 0.05));
        encode_list(out, "samples", draw_int(100, 2000), -2 * amplitude, 2 * amplitude);
        fprintf(out, "}");
    }
}

static void write_accuracy(FILE *out, const SceneKind *kind) {
    fprintf(out, ", \"accuracy\": {\"solver\": \"%s\"", kind->solver);
    const bool has_tolerance = strcmp(kind->solver, "adaptive") == 0;
    if (draws_chance(&draws, 0.5))
        fprintf(out, "}");
    else if (strcmp(kind->solver, "exact") == 0 && !kind->is_power)
        fprintf(out, "}");
    else if (has_tolerance || strcmp(kind->solver, "exact") == 0)
        fprintf(out, ", \"tolerance\": %.6g}", draws_scattered(&draws, 1e-12, 1e-3));
    else
        fprintf(out, ", \"step\": %.6g}", draws_scattered(&draws, 1e-5, 1e-3));
}

// A scene of that kind as JSON text; freed by the caller.
static char *scene_text(const SceneKind *kind) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL)
        abort();
    const int storeys = (int)draws_scattered(
        &draws, kind->storeys_min, kind->storeys_max + (kind->storeys_max > 1 ? 0.99 : 0));
    const double rate = draws_scattered(&draws, 200, 5000),
                 duration = draws_scattered(&draws, 0.5, 500);
    fprintf(out, "{\"duration\": %.6g, \"sample_rate\": %.6g, ", fmin(duration, 1e6 / rate), rate);
    write_structure(out, storeys);
    write_dampers(out, kind, storeys);
    write_excitation(out, storeys);
    write_accuracy(out, kind);
    if (draws_chance(&draws, 0.5))
        fprintf(out, ", \"output\": {\"psd\": null}}");
    else
        fprintf(out, ", \"output\": {\"psd\": {\"segment\": %d}}}", 1 << draw_int(7, 13));
    fclose(out);
    return text;
}

// Stops a run that takes too long.
static bool cost_advance(void *context, double fraction) {
    (void)fraction;
    return (double)(clock_thread_cpu_ns() - *(const int64_t *)context) * 1e-9 < STOPPED_AFTER;
}

typedef struct MeasuredUpload {
    double cpu, bytes;
    double steps; // counted by the solver; NAN: the run was stopped
} MeasuredUpload;

static bool cost_measure(const Simulation *simulation, MeasuredUpload *measured) {
    Problem problem;
    *measured = (MeasuredUpload){INFINITY, 0, (double)NAN};
    for (int i = 0; i < 2; i++) {
        Outcome *outcome = NULL;
        problem_clear(&problem);
        const size_t before = allocated_peak = allocated;
        const int64_t start = clock_thread_cpu_ns();
        const Progress progress = {(void *)(uintptr_t)&start, cost_advance};
        const Status status = simulation_run(simulation, NULL, &progress, NULL, &outcome, &problem);
        const double cpu = (double)(clock_thread_cpu_ns() - start) * 1e-9;
        measured->cpu = fmin(measured->cpu, cpu);
        measured->bytes = (double)(allocated_peak - before);
        if (status == STATUS_OK)
            measured->steps = outcome->steps;
        outcome_unref(outcome);
        if (status == STATUS_CANCELLED)
            return true;
        if (status != STATUS_OK)
            return false;
        if (cpu < MEASURED_MIN / 2)
            break;
    }
    return measured->cpu >= MEASURED_MIN;
}

// Predicted over measured.
typedef enum Ratio { RATIO_CPU_COUNTED, RATIO_CPU, RATIO_BYTES, RATIOS } Ratio;
static const char *const ratio_names[] = {"CPU, contacts counted", "CPU", "memory"};

typedef struct Row {
    size_t kind;
    double ratio[RATIOS];
} Row;

static int ratio_compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void cost_print(const char *name, const Row *rows, size_t count, size_t kind, Ratio ratio) {
    double *of = calloc(count + 1, sizeof *of);
    size_t found = 0, two = 0, four = 0;
    if (of == NULL)
        abort();
    for (size_t i = 0; i < count; i++)
        if ((kind == KINDS || rows[i].kind == kind) && !isnan(rows[i].ratio[ratio]))
            of[found++] = rows[i].ratio[ratio];
    qsort(of, found, sizeof *of, ratio_compare);
    for (size_t i = 0; i < found; i++) {
        two += of[i] >= 0.5 && of[i] <= 2;
        four += of[i] >= 0.25 && of[i] <= 4;
    }
    if (found > 0)
        printf("  %-28s %6zu %8.1f %8.1f %9.3g %9.3g %9.3g\n", name, found,
               100 * (double)two / (double)found, 100 * (double)four / (double)found, of[0],
               of[found / 2], of[found - 1]);
    free(of);
}

static bool cost_compare(const Simulation *simulation, Row *row, const char *text) {
    MeasuredUpload measured;
    const Cost cost = simulation_cost(simulation);
    if (cost.cpu_seconds > PREDICTED_MAX || !cost_measure(simulation, &measured))
        return false;
    const double counted = (measured.steps + cost.spectra + cost.base + cost.output) * SOLVER_STEP;
    row->ratio[RATIO_CPU_COUNTED] = counted / measured.cpu;
    row->ratio[RATIO_CPU] = cost.cpu_seconds / measured.cpu;
    row->ratio[RATIO_BYTES] = cost.bytes / measured.bytes;
    if (text != NULL)
        printf("%-28s %6.3f %6.3f %6.3f  %8.4f s %8.3g MB  %.400s\n", kinds[row->kind].name,
               row->ratio[0], row->ratio[1], row->ratio[2], measured.cpu, measured.bytes / 1e6,
               text);
    return true;
}

int main(int argc, char **argv) {
    const unsigned long seed = argc > 1 ? strtoul(argv[1], NULL, 10) : 1;
    const size_t wanted = argc > 2 ? strtoul(argv[2], NULL, 10) : SCENES;
    Row *rows = calloc(wanted + 1, sizeof *rows);
    size_t count = 0, refused = 0, left_out = 0;
    Problem problem;
    if (rows == NULL)
        return 1;
    process_return_memory(); // as the server does
    fft_start();
    draws.state = seed;
    for (size_t number = 0; count < wanted && number < SCENES_MAX; number++) {
        Simulation simulation;
        char *text = scene_text(&kinds[count % KINDS]);
        rows[count].kind = count % KINDS;
        problem_clear(&problem);
        (void)json_parse(text, strlen(text), simulation_fields, &simulation, &problem);
        if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK) {
            refused++;
            if (argc > 3 && problem.count > 0)
                printf("%s: %s\n", problem.faults[0].pointer, problem.faults[0].detail);
        } else if (cost_compare(&simulation, &rows[count], argc > 3 ? text : NULL)) {
            count++;
        } else {
            left_out++;
        }
        simulation_clear(&simulation);
        free(text);
    }
    printf("%zu scenes; %zu drawn scenes were refused, %zu failed or took less than %g ms or more "
           "than %g s\n",
           count, refused, left_out, MEASURED_MIN * 1e3, PREDICTED_MAX);
    for (Ratio ratio = 0; ratio < RATIOS; ratio++) {
        printf("%s, predicted/measured:\n  %-28s %6s %8s %8s %9s %9s %9s\n", ratio_names[ratio],
               "kind", "scenes", "in 2 [%]", "in 4 [%]", "lowest", "median", "highest");
        for (size_t kind = 0; kind < KINDS; kind++)
            cost_print(kinds[kind].name, rows, count, kind, ratio);
        cost_print("all", rows, count, KINDS, ratio);
    }
    free(rows);
    return 0;
}
