// One run of a study: its scene, its result, and the tables that hold the results of many.
#ifndef CORE_STUDY_STUDY_RUN_H
#define CORE_STUDY_STUDY_RUN_H

#include "core/simulation/simulation.h"

// The environment of a study.
typedef struct StudyTools {
    const SimulationLimits *limits; // of every run, and of the steps of all; may be NULL
    const Progress *progress;       // may be NULL
    Workspace *workspace;           // may be NULL
    double (*cpu)(void *context);   // CPU time of this thread [s]
    void *cpu_context;
} StudyTools;

// Result of one run. A run that failed has a reason and no numbers.
typedef struct RunRecord {
    uint64_t number; // its seed, or its place
    Status status;
    char *why;                       // reason of the failure; NULL: none
    double steps;                    // solver steps; NAN after a failure
    Summary summary;                 // absent after a failure
    Reals restitution, contact_time; // factors of a drawn run, buffer by buffer
} RunRecord;

typedef struct RunTable {
    RunRecord *at;
    size_t count;
} RunTable;

// Moves the record of a run to the end of the table. STATUS_NO_MEMORY.
Status run_table_add(RunTable *table, RunRecord *run, uint64_t number, Problem *problem);

// Runs that failed for one reason.
typedef struct StudyFailure {
    int status;            // the key of the reason
    char *reason;          // in a word; may be NULL
    uint64_t count, first; // number of the first of them
    char *detail;          // its `why`
} StudyFailure;

typedef struct StudyFailures {
    StudyFailure *at;
    size_t count;
} StudyFailures;

// Counts a failure. STATUS_NO_MEMORY.
Status study_failures_add(StudyFailures *failures, int status, const char *reason, uint64_t number,
                          const char *why, Problem *problem);

// Counts the failures of a table by their status, in its order.
Status study_failures_fill(const RunTable *table, StudyFailures *failures, Problem *problem);

// Densities that a run's spectra hold; 0 without spectra.
double study_run_densities(const Simulation *simulation);

// Validates that a study holds no more than 2^18 densities at a time.
Status study_run_check_densities(const Simulation *simulation, double densities, Problem *problem);

// Whether the contacts of the simulation have a force.
bool study_run_has_force(const Simulation *simulation);

// Validates that the scene can have a metric, the value of /study/metric.
Status study_run_check_metric(const Simulation *simulation, const char *metric, Problem *problem);

// Validates a list of names below `pointer` against a NULL-terminated list.
Status study_run_check_names(const Texts *given, const char *const *names, const char *pointer,
                             Problem *problem);

// The scene without sampled channels; spectra and impacts as in the original. `target` is cleared
// by simulation_clear in any case.
Status study_run_copy(const Simulation *simulation, Simulation *target, Problem *problem);

// Replaces an accuracy target by the solver that is chosen without one: otherwise the runs of one
// study could use different settings, and their differences would not be those of the scenes.
Status study_run_fix_solver(Simulation *target, Problem *problem);

// Whether a failure of one run ends the whole study.
static inline bool study_run_ends_study(Status status) {
    return status == STATUS_CANCELLED || status == STATUS_NO_MEMORY;
}

Status study_no_memory(Problem *problem);

// STATUS_OK, or STATUS_NO_MEMORY if something could not be made.
static inline Status study_status(bool is_made, Problem *problem) {
    return is_made ? STATUS_OK : study_no_memory(problem);
}

// STATUS_CANCELLED if the progress, at `fraction`, requests a stop.
Status study_advance(const Progress *progress, double fraction, Problem *problem);

// The first of two results that is a failure.
static inline Status study_first_failure(Status first, Status second) {
    return first != STATUS_OK ? first : second;
}

// Copies of a text (NULL: none) and of numbers. STATUS_NO_MEMORY.
Status study_copy_text(const char *text, char **target, Problem *problem);
Status study_copy_reals(const double *values, size_t count, Reals *target, Problem *problem);

// Appends an element of `size` zeros to a typed list (base/field.h) that only this function has
// filled. NULL without memory.
void *study_list_add(void *list, size_t size, Problem *problem);

// The same with a copy of a text, and with a number. STATUS_NO_MEMORY.
Status study_add_text(const char *text, Texts *texts, Problem *problem);
Status study_add_real(double value, Reals *reals, Problem *problem);

#endif
