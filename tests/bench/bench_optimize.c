// The study optimize beside a search by brute force, on drawn problems of the paper's structure
// with one to four variables: random bases over 8 or 16 seeds, and free vibration, sines, pulses
// and chirps. Brute force tries 20,000 runs' worth of evenly spread candidates, the study 1,000
// runs' worth, both with the same seeds. Then the CPU time of the study beside that of its runs.
//
//     bench_optimize [problems [first [FILE]]]
//
// FILE keeps the results of brute force, which take most of the time, from one call to the next.
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/base/canonical.h"
#include "core/base/philox.h"
#include "core/excitation/excitation.h"
#include "core/math/fft.h"
#include "core/study/optimize.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"

enum { VARIABLES = 4, RUNS = 1000, BRUTE_RUNS = 20000, PROBLEMS_MAX = 1000, THREADS = 2 };

typedef enum DrawnExcitation {
    DRAWN_RANDOM,
    DRAWN_FREE,
    DRAWN_SINE,
    DRAWN_PULSE,
    DRAWN_CHIRP
} DrawnExcitation;

// Members of the damper, as variables.
static const char *const pointers[] = {"/dampers/0/clearance", "/dampers/0/mass",
                                       "/dampers/0/buffer/restitution",
                                       "/dampers/0/buffer/contact_time"};
static const double lowest[] = {0.002, 0.02, 0.2, 0.003}, highest[] = {0.06, 0.3, 0.95, 0.04};

typedef struct Drawn {
    size_t variables, variable[VARIABLES], runs;
    double given[VARIABLES];
    int objective, constraint; // metrics; -1: none
    double bound;              // of the constraint
    RunAggregate aggregate;
    DrawnExcitation excitation;
    double level, duration, frequency, length;
    uint64_t seed;
} Drawn;

typedef struct Compared {
    Drawn drawn;
    double brute, found; // INFINITY: no feasible candidate
    double cpu, cpu_alone;
    bool is_kept, is_repeated; // the constraint holds in a run of its own; the bytes are the same
} Compared;

static Compared all[PROBLEMS_MAX];
static size_t count = 50, first = 1000;
static atomic_size_t next;

static double uniform(uint64_t problem, uint32_t draw) {
    const uint32_t key[2] = {(uint32_t)problem, 77}, counter[4] = {draw, 0, 0, 0};
    uint32_t words[4];
    philox_words(counter, key, words);
    return ((double)words[0] + 0.5) / 0x1p32;
}

static void fail(const char *what, const Problem *problem) {
    fprintf(stderr, "%s: %s\n", what, problem->detail);
    exit(1);
}

static void make_scene(const Drawn *drawn, const double *values, size_t run, Simulation *scene) {
    paper_scene(scene, values[2], values[3], drawn->duration);
    scene->scene.dampers.at[0].clearance = values[0];
    scene->scene.dampers.at[0].mass = values[1];
    paper_no_psd(scene);
    scene->output.impacts = false;
    scene->output.reduction = false;
    Variant **excitation = &scene->scene.excitation;
    switch (drawn->excitation) {
    case DRAWN_RANDOM:
        paper_random(scene, drawn->level, drawn->seed + run);
        break;
    case DRAWN_FREE:
        paper_free(scene, drawn->level);
        break;
    case DRAWN_SINE:
        paper_sine(scene, drawn->level, drawn->frequency);
        break;
    case DRAWN_PULSE:
        scene_choose(excitation, &excitation_kinds, "half_sine");
        ((ExcitationPulse *)(void *)*excitation)->amplitude = drawn->level;
        ((ExcitationPulse *)(void *)*excitation)->length = drawn->length;
        break;
    case DRAWN_CHIRP:
        scene_choose(excitation, &excitation_kinds, "chirp");
        ((ExcitationChirp *)(void *)*excitation)->amplitude = drawn->level;
        ((ExcitationChirp *)(void *)*excitation)->start_frequency = 2;
        ((ExcitationChirp *)(void *)*excitation)->end_frequency = 7;
        ((ExcitationChirp *)(void *)*excitation)->sweep_time = drawn->duration;
        break;
    }
}

// Statistics of objective and constraint at values of the variables.
static void evaluate(const Drawn *drawn, const double *at, Workspace *workspace, double *objective,
                     double *constraint) {
    double values[VARIABLES], objectives[64], constraints[64] = {0};
    memcpy(values, drawn->given, sizeof values);
    for (size_t j = 0; j < drawn->variables; j++)
        values[drawn->variable[j]] = at[j];
    for (size_t run = 0; run < drawn->runs; run++) {
        Simulation scene = {0};
        Problem problem;
        Outcome *outcome;
        problem_clear(&problem);
        make_scene(drawn, values, run, &scene);
        texts_clear(&scene.output.channels);
        if (simulation_complete(&scene, NULL, NULL, &problem) != STATUS_OK)
            fail("completing", &problem);
        objectives[run] = (double)NAN;
        if (simulation_run(&scene, NULL, NULL, workspace, &outcome, &problem) == STATUS_OK) {
            objectives[run] =
                study_summary_value(&outcome->summary, study_metric_names[drawn->objective]);
            if (drawn->constraint >= 0)
                constraints[run] =
                    study_summary_value(&outcome->summary, study_metric_names[drawn->constraint]);
            outcome_unref(outcome);
        }
        simulation_clear(&scene);
    }
    *objective = run_aggregate(&drawn->aggregate, objectives, drawn->runs);
    *constraint = run_aggregate(&drawn->aggregate, constraints, drawn->runs);
}

// The value of a variable at a share of its range.
static double value_at(const Drawn *drawn, size_t variable, double share) {
    const size_t v = drawn->variable[variable];
    return lowest[v] + share * (highest[v] - lowest[v]);
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The bound is a quantile of the constraint's metric over some candidates.
static double draw_bound(const Drawn *drawn, uint64_t problem, double share) {
    enum { SAMPLES = 32 };
    double values[SAMPLES], objective;
    for (size_t i = 0; i < SAMPLES; i++) {
        double at[VARIABLES];
        for (size_t j = 0; j < drawn->variables; j++)
            at[j] = value_at(drawn, j, uniform(problem, 1000 + (uint32_t)(VARIABLES * i + j)));
        evaluate(drawn, at, NULL, &objective, &values[i]);
    }
    qsort(values, SAMPLES, sizeof *values, by_value);
    const double rank = share * (SAMPLES - 1);
    const size_t below = (size_t)rank;
    return values[below] + (rank - (double)below) * (values[below + 1] - values[below]);
}

static Drawn draw(uint64_t problem) {
    static const double levels[] = {0.5, 0.01, 0.2, 2, 0.3}, ratios[] = {6, 3, 4, 5, 4};
    static const int objectives[] = {0, 1, 1, 1, 2, 3, 3}, constraints[] = {5, 2, 4};
    Drawn drawn = {.variables = 1 + (size_t)(problem % VARIABLES), .constraint = -1};
    uint32_t i = 0;
    drawn.given[0] = 0.005 + 0.03 * uniform(problem, i++);
    drawn.given[1] = 0.05 + 0.15 * uniform(problem, i++);
    drawn.given[2] = 0.3 + 0.5 * uniform(problem, i++);
    drawn.given[3] = 0.005 + 0.03 * uniform(problem, i++);
    const double kind = uniform(problem, i++);
    drawn.excitation = kind < 0.6   ? DRAWN_RANDOM
                       : kind < 0.7 ? DRAWN_FREE
                       : kind < 0.8 ? DRAWN_SINE
                       : kind < 0.9 ? DRAWN_PULSE
                                    : DRAWN_CHIRP;
    const double level = uniform(problem, i++), runs = uniform(problem, i++);
    drawn.level = levels[drawn.excitation] * pow(ratios[drawn.excitation], level);
    drawn.seed = 1 + 100 * problem;
    drawn.runs = drawn.excitation != DRAWN_RANDOM ? 1 : runs < 0.33 ? 8 : 16;
    drawn.duration = 15 + 15 * uniform(problem, i++);
    drawn.frequency = 3.6 + 0.8 * uniform(problem, i++);
    drawn.length = 0.05 + 0.15 * uniform(problem, i++);
    const double statistic = uniform(problem, i++);
    const bool is_mean = drawn.runs == 1 || statistic < 0.7;
    drawn.aggregate = (RunAggregate){!is_mean && statistic >= 0.85,
                                     is_mean || statistic >= 0.85 ? (double)NAN : 0.8};
    bool is_taken[VARIABLES] = {false};
    for (size_t j = 0; j < drawn.variables; j++) {
        size_t v;
        do
            v = (size_t)(VARIABLES * uniform(problem, i++));
        while (is_taken[v]);
        is_taken[v] = true;
        drawn.variable[j] = v;
    }
    // The peak of a free vibration is its start.
    drawn.objective = drawn.excitation == DRAWN_FREE
                          ? 1
                          : objectives[(size_t)((double)COUNT(objectives) * uniform(problem, i++))];
    if (uniform(problem, i++) < 0.5) {
        const int constraint =
            constraints[(size_t)((double)COUNT(constraints) * uniform(problem, i++))];
        drawn.constraint = constraint == drawn.objective ? constraints[0] : constraint;
        drawn.bound = draw_bound(&drawn, problem, 0.2 + 0.5 * uniform(problem, i++));
    }
    return drawn;
}

static bool is_feasible(const Drawn *drawn, double constraint) {
    return drawn->constraint < 0 || constraint <= drawn->bound;
}

// Candidates spread by an additive recurrence with powers of the root of x^(n + 1) = x + 1.
static double brute_force(const Drawn *drawn, Workspace *workspace) {
    double root = 2, best = INFINITY;
    for (int i = 0; i < 64; i++)
        root = pow(1 + root, 1 / (double)(drawn->variables + 1));
    for (size_t k = 0; k < BRUTE_RUNS / drawn->runs; k++) {
        double at[VARIABLES], objective, constraint, whole;
        for (size_t j = 0; j < drawn->variables; j++)
            at[j] = value_at(drawn, j, modf(0.5 + (double)k * pow(root, -(double)(j + 1)), &whole));
        evaluate(drawn, at, workspace, &objective, &constraint);
        if (is_feasible(drawn, constraint) && objective < best)
            best = objective;
    }
    return best;
}

static double thread_cpu(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void request_make(const Drawn *drawn, StudyRequest *request, Problem *problem) {
    make_scene(drawn, drawn->given, 0, &request->simulation);
    request->study = variant_new(&study_optimize.kind);
    OptimizeStudy *study = (OptimizeStudy *)(void *)request->study;
    study->max_candidates = RUNS / drawn->runs;
    study->objectives.at = calloc(1, sizeof *study->objectives.at);
    study->objectives.at[study->objectives.count++].metric = drawn->objective;
    if (drawn->constraint >= 0) {
        study->constraints.at = calloc(1, sizeof *study->constraints.at);
        study->constraints.at[study->constraints.count++] =
            (OptimizeConstraint){drawn->constraint, (double)NAN, drawn->bound};
    }
    if (drawn->excitation == DRAWN_RANDOM)
        study->over.runs = drawn->runs;
    if (drawn->aggregate.is_max)
        study->statistic.of = OPTIMIZE_MAX;
    study->statistic.quantile = drawn->aggregate.quantile;
    study->variables.at = calloc(drawn->variables, sizeof *study->variables.at);
    for (size_t j = 0; j < drawn->variables; j++)
        study->variables.at[study->variables.count++] =
            (StudyAxis){.pointer = strdup(pointers[drawn->variable[j]]),
                        .from = lowest[drawn->variable[j]],
                        .to = highest[drawn->variable[j]],
                        .count = COUNT_ABSENT,
                        .spacing = CHOICE_ABSENT};
    if (study_request_complete(request, NULL, NULL, problem) != STATUS_OK)
        fail(problem->faults[0].pointer, problem);
}

static Optimum *optimize(const StudyRequest *request, Workspace *workspace, Problem *problem) {
    const StudyTools tools = {.workspace = workspace};
    Variant *answer;
    if (study_run(request->study, &request->simulation, &tools, &answer, problem) != STATUS_OK)
        fail("the study", problem);
    return (Optimum *)(void *)answer;
}

static void hash(void *context, const void *bytes, size_t size) {
    uint64_t *sum = context; // FNV-1a
    for (size_t i = 0; i < size; i++)
        *sum = (*sum ^ ((const unsigned char *)bytes)[i]) * UINT64_C(1099511628211);
}

static uint64_t digest(const Optimum *optimum) {
    uint64_t sum = UINT64_C(14695981039346656037);
    canonical_write(study_optimize.answer->fields, optimum, hash, &sum);
    return sum;
}

static void compare(Compared *compared, bool is_repeated, Workspace *workspace) {
    const Drawn *drawn = &compared->drawn;
    StudyRequest request = {0};
    Problem problem;
    problem_clear(&problem);
    request_make(drawn, &request, &problem);
    compared->cpu = -thread_cpu();
    Optimum *optimum = optimize(&request, workspace, &problem);
    compared->cpu += thread_cpu();
    compared->found = INFINITY;
    compared->is_kept = compared->is_repeated = true;
    // The same runs alone, and the best once more.
    compared->cpu_alone = -thread_cpu();
    for (size_t i = 0; i < optimum->history.count; i++) {
        const OptimumCandidate *candidate = &optimum->history.at[i];
        double at[VARIABLES], objective, constraint;
        for (size_t j = 0; j < drawn->variables; j++)
            at[j] = strtod(candidate->values.at[j].value, NULL);
        evaluate(drawn, at, workspace, &objective, &constraint);
        if (is_feasible(drawn, constraint) != candidate->feasible ||
            objective != candidate->objectives.at[0])
            compared->is_kept = false;
        if (candidate->feasible)
            compared->found = fmin(compared->found, candidate->objectives.at[0]);
    }
    compared->cpu_alone += thread_cpu();
    const OptimumBest *best = &optimum->best;
    if (drawn->constraint >= 0 && best->feasible)
        compared->is_kept =
            compared->is_kept && best->metrics.of[drawn->constraint] <= drawn->bound;
    if (best->feasible && best->objectives.at[0].value != compared->found)
        compared->is_kept = false;
    if (is_repeated) {
        Optimum *again = optimize(&request, workspace, &problem);
        compared->is_repeated = digest(again) == digest(optimum);
        variant_free(&again->variant);
    }
    variant_free(&optimum->variant);
    study_request_clear(&request);
}

static void *work(void *context) {
    Workspace workspace = {0};
    size_t i;
    (void)context;
    while ((i = atomic_fetch_add(&next, 1)) < count) {
        all[i].drawn = draw(first + i);
        if (isnan(all[i].brute))
            all[i].brute = brute_force(&all[i].drawn, &workspace);
        compare(&all[i], i % 10 == 0, &workspace);
    }
    workspace_clear(&workspace);
    return NULL;
}

static void load(const char *path) {
    FILE *file = fopen(path, "r");
    unsigned long number;
    double value;
    while (file != NULL && fscanf(file, "%lu %lf", &number, &value) == 2)
        if (number >= first && number < first + count)
            all[number - first].brute = value;
    if (file != NULL)
        fclose(file);
}

static void save(const char *path) {
    FILE *file = fopen(path, "w");
    for (size_t i = 0; i < count && file != NULL; i++)
        fprintf(file, "%zu %.17g\n", first + i, all[i].brute);
    if (file != NULL)
        fclose(file);
}

static void report(void) {
    static const char *const kinds[] = {"random", "free", "sine", "pulse", "chirp"};
    size_t good = 0, kept = 0, repeated = 0;
    double cpu = 0, cpu_alone = 0, cpu_16 = 0, cpu_alone_16 = 0;
    printf("problem excitation variables seeds objective constraint statistic miss\n");
    for (size_t i = 0; i < count; i++) {
        const Compared *one = &all[i];
        const Drawn *drawn = &one->drawn;
        const double miss = one->found <= one->brute ? fmax(one->found / one->brute - 1, -1)
                                                     : one->found / one->brute - 1;
        printf("%4zu %-6s %zu %2zu %-17s %-18s %-4s %+.2f %%%s\n", first + i,
               kinds[drawn->excitation], drawn->variables, drawn->runs,
               study_metric_names[drawn->objective],
               drawn->constraint >= 0 ? study_metric_names[drawn->constraint] : "-",
               drawn->aggregate.is_max             ? "max"
               : !isnan(drawn->aggregate.quantile) ? "0.8"
                                                   : "mean",
               100 * miss, miss > 0.01 ? " *" : "");
        good += miss <= 0.01 || (isinf(one->found) && isinf(one->brute));
        kept += one->is_kept;
        repeated += one->is_repeated;
        cpu += one->cpu;
        cpu_alone += one->cpu_alone;
        cpu_16 += drawn->runs >= 16 ? one->cpu : 0;
        cpu_alone_16 += drawn->runs >= 16 ? one->cpu_alone : 0;
    }
    printf("within 1 %% of brute force, or better: %zu of %zu\n", good, count);
    printf(
        "constraints kept, results those of runs alone: %zu; repeated with the same bytes: %zu\n",
        kept, repeated);
    printf("CPU time of the runs alone over that of the study: %.2f; with 16 runs or more: %.2f\n",
           cpu_alone / cpu, cpu_alone_16 / cpu_16);
}

int main(int argc, char **argv) {
    pthread_t threads[THREADS];
    if (argc > 1)
        count = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        first = strtoul(argv[2], NULL, 10);
    if (count < 1 || count > PROBLEMS_MAX)
        return 2;
    for (size_t i = 0; i < count; i++)
        all[i].brute = (double)NAN;
    if (argc > 3)
        load(argv[3]);
    fft_start();
    for (size_t i = 0; i < THREADS; i++)
        pthread_create(&threads[i], NULL, work, NULL);
    for (size_t i = 0; i < THREADS; i++)
        pthread_join(threads[i], NULL);
    if (argc > 3)
        save(argv[3]);
    report();
    return 0;
}
