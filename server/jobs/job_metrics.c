#include "server/jobs/job_metrics.h"

#include <stdio.h>
#include <string.h>

#include "core/solve/solver.h"

void job_metrics_ended(JobMetrics *totals, int state, bool is_known) {
    counter_add(&totals->ended[state], 1);
    if (is_known)
        counter_add(&totals->known, 1);
}

void job_metrics_run(JobMetrics *totals, const Outcome *outcome, int64_t cpu_ns) {
    size_t i = 0;
    while (solvers[i] != NULL && (outcome->plan.solver == NULL ||
                                  strcmp(solvers[i]->kind.name, outcome->plan.solver) != 0))
        i++;
    if (solvers[i] == NULL || i >= TOTALS_SOLVERS)
        return;
    SolverTotals *solver = &totals->solvers[i];
    counter_add(&solver->runs, 1);
    counter_add(&solver->cpu_ns, cpu_ns > 0 ? (uint64_t)cpu_ns : 0);
    const char *work = (const char *)&outcome->work;
    for (size_t k = 0; work_counters_fields[k].kind == FIELD_KIND_COUNT && k < TOTALS_WORKS; k++)
        counter_add(&solver->work[k],
                    *(const uint64_t *)(const void *)(work + work_counters_fields[k].offset));
}

void job_metrics_study(JobMetrics *totals, int64_t cpu_ns) {
    counter_add(&totals->study_runs, 1);
    job_metrics_study_part(totals, cpu_ns);
}

void job_metrics_study_part(JobMetrics *totals, int64_t cpu_ns) {
    counter_add(&totals->study_cpu_ns, cpu_ns > 0 ? (uint64_t)cpu_ns : 0);
}

static void write_jobs(const JobMetrics *totals, Bytes *bytes) {
    static const char jobs[] = "impactd_jobs_total";
    char labels[64];
    metrics_family(bytes, jobs, "counter", "Jobs that ended, by their final state.");
    for (int state = 0; state < TOTALS_STATES; state++) {
        if (!job_state_is_final(state))
            continue;
        snprintf(labels, sizeof labels, "state=\"%s\"", job_state_names[state]);
        metrics_count(bytes, jobs, labels, counter_get(&totals->ended[state]));
    }
    metrics_counter(bytes, "impactd_jobs_known_total",
                    "Jobs that were answered from known results, without computing.",
                    counter_get(&totals->known));
    static const char waited[] = "impactd_queue_wait_seconds";
    metrics_family(bytes, waited, "histogram", "Time in the queue, of jobs that were computed.");
    metrics_histogram(bytes, waited, "", &totals->waited);
}

// Only solvers that ran.
static void write_solvers(const JobMetrics *totals, Bytes *bytes) {
    static const char runs[] = "impactd_engine_runs_total";
    static const char cpu[] = "impactd_engine_cpu_seconds_total";
    static const char work[] = "impactd_engine_work_total";
    char labels[128];
    metrics_family(bytes, runs, "counter",
                   "Scenes simulated, by solver; a study's runs are apart.");
    for (size_t i = 0; solvers[i] != NULL && i < TOTALS_SOLVERS; i++) {
        snprintf(labels, sizeof labels, "solver=\"%s\"", solvers[i]->kind.name);
        if (counter_get(&totals->solvers[i].runs) > 0)
            metrics_count(bytes, runs, labels, counter_get(&totals->solvers[i].runs));
    }
    metrics_family(bytes, cpu, "counter", "CPU time of these simulations, by solver.");
    for (size_t i = 0; solvers[i] != NULL && i < TOTALS_SOLVERS; i++) {
        snprintf(labels, sizeof labels, "solver=\"%s\"", solvers[i]->kind.name);
        if (counter_get(&totals->solvers[i].runs) > 0)
            metrics_real(bytes, cpu, labels,
                         1e-9 * (double)counter_get(&totals->solvers[i].cpu_ns));
    }
    metrics_family(bytes, work, "counter",
                   "What the engine did in these simulations, by solver and kind: steps, contacts, "
                   "bounces and others.");
    for (size_t i = 0; solvers[i] != NULL && i < TOTALS_SOLVERS; i++)
        for (size_t k = 0; work_counters_fields[k].kind == FIELD_KIND_COUNT && k < TOTALS_WORKS;
             k++) {
            if (counter_get(&totals->solvers[i].runs) == 0)
                break;
            snprintf(labels, sizeof labels, "solver=\"%s\",kind=\"%s\"", solvers[i]->kind.name,
                     work_counters_fields[k].name);
            metrics_count(bytes, work, labels, counter_get(&totals->solvers[i].work[k]));
        }
}

void job_metrics_write(const JobMetrics *totals, Bytes *bytes) {
    write_jobs(totals, bytes);
    write_solvers(totals, bytes);
    metrics_counter(bytes, "impactd_study_runs_total", "Studies that were run.",
                    counter_get(&totals->study_runs));
    metrics_family(bytes, "impactd_study_cpu_seconds_total", "counter", "CPU time of studies.");
    metrics_real(bytes, "impactd_study_cpu_seconds_total", "",
                 1e-9 * (double)counter_get(&totals->study_cpu_ns));
}
