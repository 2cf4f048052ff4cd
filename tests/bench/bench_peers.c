// The exact solver beside GSL and SUNDIALS CVODE at the paper's scenes, in one run: ns of CPU per
// sample of 5 channels at 1 kHz, and what each missed within the first seconds against quad
// precision, before rounding has grown to the motion's own size. Peers are slow: as many of
// the 20 repeats as their share of time allows.
//
// `bench_peers curve` prints errors and CPU times of all solvers and peers at many steps and
// tolerances as CSV: the paper's free vibration over 10 s, each run as a whole.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"
#include "server/util/clock.h"
#include "tests/bench/cases.h"
#include "tests/bench/peers.h"
#include "tests/support/paper.h"

static const double PEER_TOLERANCE = 1e-9;
static const double JUDGED = 5;     // [s]
static const double PATIENCE = 3e9; // of CPU for one peer and scene [ns]

typedef struct Row {
    double ns, displacement_error, start_error;
    size_t repeats, impacts;
} Row;

static void print_row(const char *name, const Row *row, double set) {
    printf("  %-24s %10.2f %10.1f %8zu %8zu %13.1e %13.1e\n", name, row->ns, row->ns / set,
           row->repeats, row->impacts, row->displacement_error, row->start_error);
}

// Worst sample of the displacement relative to its maximum; worst of the first starts [s].
static void measure(const ReferenceAnswer *truth, const double *displacement, const double *starts,
                    size_t count, Row *row) {
    double most = 0, worst = 0;
    for (size_t i = 0; i < truth->count; i++) {
        most = fmax(most, fabs(truth->channels[REFERENCE_DISPLACEMENT][i]));
        worst = fmax(worst, fabs(displacement[i] - truth->channels[REFERENCE_DISPLACEMENT][i]));
    }
    row->displacement_error = worst / most;
    row->start_error = 0;
    for (size_t i = 0; i < count && i < PEER_STARTS && i < truth->impact_count; i++)
        row->start_error = fmax(row->start_error, fabs(starts[i] - truth->impacts[i].start));
}

typedef bool Peer(const ReferenceScene *scene, double tolerance, PeerAnswer *answer);
static bool cvode_plain(const ReferenceScene *scene, double tolerance, PeerAnswer *answer) {
    return peer_cvode(scene, tolerance, false, answer);
}
static bool cvode_stops(const ReferenceScene *scene, double tolerance, PeerAnswer *answer) {
    return peer_cvode(scene, tolerance, true, answer);
}
static const struct {
    const char *name;
    Peer *run;
} peers[] = {
    {"GSL rk8pd", peer_gsl}, {"CVODE BDF, plain", cvode_plain}, {"CVODE BDF, stops", cvode_stops}};
enum { GSL, CVODE_PLAIN, CVODE_STOPS, PEERS };

static bool peer_time(size_t peer, double tolerance, const ReferenceScene *scene,
                      const ReferenceAnswer *truth, PeerAnswer *answer, Row *row) {
    row->ns = 1e300;
    const int64_t first = clock_thread_cpu_ns();
    for (row->repeats = 0; row->repeats < BENCH_REPEATS;) {
        const int64_t start = clock_thread_cpu_ns();
        if (!peers[peer].run(scene, tolerance, answer))
            return false;
        const int64_t end = clock_thread_cpu_ns();
        row->ns = fmin(row->ns, (double)(end - start) / (double)answer->count);
        row->repeats++;
        if ((double)(end - first) > PATIENCE)
            break;
    }
    row->impacts = answer->impacts;
    measure(truth, answer->columns[0], answer->starts, answer->impacts, row);
    return true;
}

static ReferenceScene reference_scene(const BenchCase *bench, const Plan *plan, const Base *base) {
    const PlanDamper *damper = &plan->dampers[0];
    return (ReferenceScene){
        .mass = plan->mass[0],
        .stiffness = plan->stiffness[0],
        .damping = plan->damping[0],
        .damper_mass = damper->mass,
        .clearance = damper->clearance,
        .restitution = {bench->restitution, bench->restitution},
        .contact_time = {bench->contact_time, bench->contact_time},
        .displacement = plan->displacement[0],
        .base = base->form == BASE_SAMPLED ? REFERENCE_RECORD : REFERENCE_STILL,
        .samples = base->values,
        .sample_count = base->count,
        .interval = base->interval,
        .duration = bench->duration,
        .sample_rate = plan->sample_rate,
    };
}

// The solver once more, for what it missed.
static bool our_errors(BenchScene *scene, const ReferenceAnswer *truth, Row *row) {
    Outcome *outcome = NULL;
    Problem problem;
    problem_clear(&problem);
    double starts[PEER_STARTS];
    if (simulation_run(&scene->simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        return false;
    const Impacts *impacts = &outcome->response.impacts;
    for (size_t i = 0; i < PEER_STARTS && i < impacts->count; i++)
        starts[i] = impacts->at[i].start;
    const Column *column = columns_find(&outcome->response.series, "displacement");
    measure(truth, column->values, starts, impacts->count, row);
    outcome_unref(outcome);
    return true;
}

static bool contest(const BenchCase *bench, BenchScene *scene) {
    BenchTimes times;
    Row ours = {0}, rows[PEERS];
    if (!bench_run(scene, &times))
        return false;
    const double set = bench_memset(scene), copy = bench_memcpy(scene);
    printf("\"%s\", %g s\n  %-24s %10s %10s %8s %8s %13s %13s\n", bench->name, bench->duration, "",
           "ns/sample", "x memset", "repeats", "impacts", "x error", "start error");
    printf("  %-24s %10.2f %10.1f %8d\n", "memset", set, 1.0, BENCH_REPEATS);
    printf("  %-24s %10.2f %10.1f %8d\n", "memcpy", copy, copy / set, BENCH_REPEATS);
    ours.ns = times.run;
    ours.repeats = BENCH_REPEATS;
    ours.impacts = times.impacts;
    if (!bench->has_contact) {
        printf("  %-24s %10.2f %10.1f %8d\n", "exact", ours.ns, ours.ns / set, BENCH_REPEATS);
        return true;
    }
    const ReferenceScene whole = reference_scene(bench, scene->plan, &scene->base);
    ReferenceScene judged = whole;
    judged.duration = JUDGED;
    ReferenceAnswer truth;
    reference_quad(&judged, 1, 1e9, &truth);
    bool is_good = truth.is_whole && our_errors(scene, &truth, &ours);
    print_row("exact", &ours, set);
    printf("  %-24s %10.2f   base %.2f, plan, base and run %.2f\n", "", ours.ns, times.base,
           times.whole);
    PeerAnswer answer = {.count = scene->count};
    for (size_t i = 0; i < BENCH_CHANNELS; i++)
        answer.columns[i] = scene->block + i * scene->count;
    for (size_t i = 0; i < PEERS && is_good; i++) {
        is_good = peer_time(i, PEER_TOLERANCE, &whole, &truth, &answer, &rows[i]);
        if (is_good)
            print_row(peers[i].name, &rows[i], set);
    }
    if (is_good)
        printf("  GSL / exact %.0f, CVODE / exact %.0f plain, %.0f with stops\n",
               rows[GSL].ns / ours.ns, rows[CVODE_PLAIN].ns / ours.ns,
               rows[CVODE_STOPS].ns / ours.ns);
    reference_clear(&truth);
    return is_good;
}

// CPU time [ms] and error of one setting of one of our solvers; false if it cannot run.
static bool solver_time(const BenchCase *bench, const char *solver, const char *setting,
                        double value, const ReferenceAnswer *truth, double *ms, double *error) {
    Simulation simulation;
    Problem problem;
    problem_clear(&problem);
    paper_scene(&simulation, bench->restitution, bench->contact_time, bench->duration);
    paper_no_psd(&simulation);
    simulation.output.reduction = false;
    variant_free(simulation.accuracy);
    simulation.accuracy = variant_new(kind_find(&solver_kinds, solver));
    size_t offset = 0;
    const Field *row = fields_find(simulation.accuracy->kind->fields, setting, &offset);
    if (row != NULL)
        *(double *)(void *)((char *)simulation.accuracy + offset + row->offset) = value;
    Workspace workspace = {0};
    Status status = simulation_complete(&simulation, NULL, NULL, &problem);
    const int64_t first = clock_thread_cpu_ns();
    *ms = 1e300;
    for (int i = 0; i < BENCH_REPEATS && status == STATUS_OK; i++) {
        Outcome *outcome = NULL;
        Row missed = {0};
        const int64_t start = clock_thread_cpu_ns();
        status = simulation_run(&simulation, NULL, NULL, &workspace, &outcome, &problem);
        const int64_t end = clock_thread_cpu_ns();
        *ms = fmin(*ms, (double)(end - start) / 1e6);
        if (status == STATUS_OK)
            measure(truth, columns_find(&outcome->response.series, "displacement")->values, NULL, 0,
                    &missed);
        *error = missed.displacement_error;
        outcome_unref(outcome);
        if ((double)(end - first) > PATIENCE)
            break;
    }
    workspace_clear(&workspace);
    simulation_clear(&simulation);
    return status == STATUS_OK;
}

static bool curve(const BenchCase *bench, BenchScene *scene) {
    static const char *const stepped[] = {"precise", "rk4", "newmark"};
    const ReferenceScene whole = reference_scene(bench, scene->plan, &scene->base);
    ReferenceAnswer truth;
    reference_quad(&whole, 1, 1e9, &truth);
    if (!truth.is_whole)
        return false;
    double ms, error;
    if (solver_time(bench, "exact", "", 0, &truth, &ms, &error))
        printf("\"%s\",exact,,,%.4g,%.2e\n", bench->name, ms, error);
    for (size_t i = 0; i < COUNT(stepped); i++)
        for (double step = 1e-3; step > 0.9e-6; step /= 10)
            if (solver_time(bench, stepped[i], "step", step, &truth, &ms, &error))
                printf("\"%s\",%s,step,%g,%.4g,%.2e\n", bench->name, stepped[i], step, ms, error);
    for (double tolerance = 1e-3; tolerance > 0.9e-13; tolerance /= 100)
        if (solver_time(bench, "adaptive", "tolerance", tolerance, &truth, &ms, &error))
            printf("\"%s\",adaptive,tolerance,%.0e,%.4g,%.2e\n", bench->name, tolerance, ms, error);
    PeerAnswer answer = {.count = scene->count};
    for (size_t i = 0; i < BENCH_CHANNELS; i++)
        answer.columns[i] = scene->block + i * scene->count;
    for (size_t i = 0; i <= CVODE_PLAIN; i++)
        for (double tolerance = 1e-3; tolerance > 0.9e-13; tolerance /= 100) {
            Row row;
            if (peer_time(i, tolerance, &whole, &truth, &answer, &row))
                printf("\"%s\",\"%s\",tolerance,%.0e,%.4g,%.2e\n", bench->name, peers[i].name,
                       tolerance, row.ns * (double)scene->count / 1e6, row.displacement_error);
        }
    reference_clear(&truth);
    return true;
}

int main(int argc, char **argv) {
    const bool is_curve = argc > 1 && strcmp(argv[1], "curve") == 0;
    fft_start();
    if (is_curve)
        puts("scene,solver,setting,value,cpu_ms,error");
    for (size_t i = 0; i < bench_case_count; i++) {
        if (is_curve && bench_cases[i].duration != 10)
            continue;
        BenchScene scene;
        const bool is_good = bench_open(&bench_cases[i], &scene) &&
                             (is_curve ? curve : contest)(&bench_cases[i], &scene);
        bench_close(&scene);
        if (!is_good)
            return 1;
        fflush(stdout);
    }
    return 0;
}
