// What the jobs room has done since the start, counted: jobs by how they ended, waiting and running
// times, the engine's work by solver. Not what it is doing now (JobStats). Used by worker.c,
// intake.c, submit.c and api/metrics.c.
#ifndef SERVER_JOBS_JOB_METRICS_H
#define SERVER_JOBS_JOB_METRICS_H

#include "core/simulation/simulation.h"
#include "server/jobs/job.h"
#include "server/util/metrics.h"

enum { TOTALS_SOLVERS = 16, TOTALS_WORKS = 32, TOTALS_STATES = JOB_DISMISSED + 1 };

typedef struct SolverTotals {
    Counter runs, cpu_ns;
    Counter work[TOTALS_WORKS]; // by row of work_counters_fields
} SolverTotals;

typedef struct JobMetrics {
    Counter ended[TOTALS_STATES];         // by final JobState
    Counter known;                        // of those, answered without computing
    Histogram waited;                     // in the queue, of jobs that were computed
    SolverTotals solvers[TOTALS_SOLVERS]; // in the order of `solvers`
    Counter study_runs, study_cpu_ns;     // the scenes' studies, whatever ran in them
} JobMetrics;

// `state` is a JobState, a final one.
void job_metrics_ended(JobMetrics *totals, int state, bool is_known);
void job_metrics_run(JobMetrics *totals, const Outcome *outcome, int64_t cpu_ns);
void job_metrics_study(JobMetrics *totals, int64_t cpu_ns);
void job_metrics_study_part(JobMetrics *totals, int64_t cpu_ns); // more of a study that was counted
// In the Prometheus text format.
void job_metrics_write(const JobMetrics *totals, Bytes *bytes);

#endif
