// One study: many runs of a completed scene, folded into one answer. studies.c lists all kinds.
#ifndef CORE_STUDY_STUDY_H
#define CORE_STUDY_STUDY_H

#include "core/base/report.h"
#include "core/simulation/simulation.h"

// The environment of a study.
typedef struct StudyTools {
    const SimulationLimits *limits; // of every run, and of the steps of all; may be NULL
    const Progress *progress;       // may be NULL
    Workspace *workspace;           // may be NULL
    double (*cpu)(void *context);   // CPU time of this thread [s]
    void *cpu_context;
    bool is_validated; // the request was begun before, so that not all members are validated again
} StudyTools;

// Result of one run. A run that failed has a reason and no numbers.
typedef struct RunRecord {
    uint64_t number; // its seed, or its place
    Status status;
    char *why;                       // reason of the failure; NULL: none
    double steps;                    // solver steps; NAN after a failure
    Summary summary;                 // absent after a failure
    Reduction reduction;             // absent also where it was not requested
    Reals restitution, contact_time; // factors of a drawn run, buffer by buffer
    Reals inputs;                    // numbers of a drawn run of an ensemble
} RunRecord;

typedef struct RunTable {
    RunRecord *at;
    size_t count;
} RunTable;

// Moves the record of a run to the end of the table. STATUS_NO_MEMORY.
Status run_table_add(RunTable *table, RunRecord *run, uint64_t number);

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
                          const char *why);

// What became of the runs of a study.
typedef struct StudyRuns {
    uint64_t runs, failed; // made, and those of them that failed
    double steps;          // solver steps of the others
    StudyFailures failures;
    Warnings warnings; // what weakens the answer
} StudyRuns;

// Rows of a StudyFailure: the name of its number, and a doc.
// clang-format off
#define STUDY_FAILURE_ROWS(first_, doc_) \
    FIELD_TEXT(StudyFailure, reason, 0, PRESENCE_OPTIONAL, 0, "reason"), \
    FIELD_COUNT(StudyFailure, count, NULL, AT_MIN(1), 0, "runs that failed for this reason"), \
    {.name = first_, .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(StudyFailure, first, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = doc_}, \
    FIELD_TEXT(StudyFailure, detail, 0, PRESENCE_OPTIONAL, 0, "reason of the first of them"), \
    FIELD_END
#define STUDY_RUNS_ROWS(failure_fields_) \
    FIELD_COUNT(StudyRuns, runs, NULL, AT_MIN(0), 0, "runs made"), \
    FIELD_COUNT(StudyRuns, failed, NULL, AT_MIN(0), 0, "runs that failed; all numbers are of the others"), \
    FIELD_REAL(StudyRuns, steps, NULL, ANY, 0, "solver steps of all runs"), \
    FIELD_LIST(StudyRuns, failures, failure_fields_, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"), \
    FIELD_LIST(StudyRuns, warnings, warning_fields, 0, PRESENCE_DEFAULT, "what weakens the answer"), \
    FIELD_END
// clang-format on
extern const Field study_failure_fields[], study_runs_fields[]; // the number is "first_run", from 0

// Counts a run, which may have failed. STATUS_NO_MEMORY, as of the next.
Status study_runs_add(StudyRuns *runs, const RunRecord *run, uint64_t number);
// Warns if runs failed.
Status study_runs_warn(StudyRuns *runs);

// Estimated solver steps of `count` members, from the scenes of a sample of them, at most
// `samples`; those that cannot be made are left out. Each scene is cleared by simulation_clear.
typedef Status (*StudySceneMaker)(const void *of, size_t member, const SimulationLimits *limits,
                                  Simulation *scene);
Status study_sample_cost(StudySceneMaker make, const void *of, size_t count, size_t samples,
                         const SimulationLimits *limits, double *steps);

// Densities that a run's spectra hold; 0 without spectra.
double study_run_densities(const Simulation *simulation);

// Validates that a study holds no more than 2^18 densities at a time.
Status study_run_check_densities(const Simulation *simulation, double densities, Problem *problem);

// Validates a list of names, a member of the study, against a NULL-terminated list.
Status study_run_check_names(const Texts *given, const char *const *names, const char *member,
                             Problem *problem);

// Replaces an accuracy target by the solver that is chosen without one: otherwise the runs of one
// study could use different settings, and their differences would not be those of the scenes.
void study_run_fix_solver(Simulation *target);

// The scene with this solver, without sampled channels and without its undamped run; spectra and
// impacts as in the original. `target` is cleared by simulation_clear in any case.
Status study_run_copy(const Simulation *simulation, Simulation *target);

// Runs a scene. The peak force of contacts without a force is unknown: as 0 it would be the best.
Status study_run_scene(const Simulation *scene, const StudyTools *tools, Outcome **outcome,
                       Problem *problem);

// Whether a failure of one run ends the whole study.
static inline bool study_run_ends_study(Status status) {
    return status == STATUS_CANCELLED || status == STATUS_NO_MEMORY;
}

// `status`, with the text of STATUS_NO_MEMORY: functions that can only fail by it set none.
static inline Status study_result(Status status, Problem *problem) {
    return status != STATUS_NO_MEMORY ? status
                                      : problem_set(problem, status, "no memory for the study");
}

// STATUS_CANCELLED if the progress, at `fraction`, requests a stop.
Status study_advance(const Progress *progress, double fraction, Problem *problem);

// The first of two results that is a failure.
static inline Status study_first_failure(Status first, Status second) {
    return first != STATUS_OK ? first : second;
}

// A copy of numbers. STATUS_NO_MEMORY, as of the next.
Status study_copy_reals(const double *values, size_t count, Reals *target);

// Appends a number.
Status study_add_real(double value, Reals *reals);

typedef struct StudyKind StudyKind;

// A study in progress; first member of each kind's own struct. Its members are independent runs:
// they are made by any threads in any order, and folded in the order of their numbers.
typedef struct StudyWork {
    const StudyKind *kind;
    const void *study; // the request; borrowed, as the next three
    const Simulation *simulation;
    const SimulationLimits *limits;
    void *answer;
    size_t members;    // at most
    size_t wanted;     // the first ones; the study ends when the last of them is folded
    size_t expected;   // estimate of the final `wanted`
    size_t part_bytes; // of memory held by each part, at most
} StudyWork;

// Result of one member; first member of each kind's own struct.
typedef struct StudyPart {
    RunRecord run;
    bool is_refused; // it failed before its run
    Spectrum spectrum;
    Spectrum history;  // a channel over time, which is its `frequency`
    Reals drawn_again; // how often each number of the inputs was
} StudyPart;

#define STUDY_BEGUN 0.1 // progress of the study when its first member is made

struct StudyReferences; // axis.h, as the next
struct StudyValue;

struct StudyKind {
    Kind kind;
    const Kind *answer;   // of the same name; its value struct begins with a Variant
    const char *shorten;  // what makes it shorter: "ask for fewer runs"
    bool is_measured;     // its answer holds CPU times, which differ in another run
    const char *document; // of a result: /v1/results/{id}/DOCUMENT; NULL: the kind's name
    // Where a request names materials and records, as it was read; NULL: nowhere.
    void (*references)(void *study, struct StudyReferences *references);
    // Changes the scene as the study needs it, before it is completed; names are resolved. NULL:
    // changes nothing.
    Status (*prepare)(const void *study, Simulation *simulation, Problem *problem);
    double max_runs; // multiple of limits->steps that the whole study may cost; 0: ten
    // Validates what rows cannot express and completes defaults, below "/study", for a completed
    // scene.
    Status (*complete)(void *study, const Simulation *simulation, const SimulationLimits *limits,
                       Problem *problem);
    // Estimated cost of a completed study in solver steps. STATUS_NO_MEMORY.
    Status (*cost)(const void *study, const Simulation *simulation, const SimulationLimits *limits,
                   double *steps);
    // Memory that a completed study takes beside a run of its scene. NULL: little.
    double (*bytes)(const Simulation *simulation);
    size_t work_size, part_size; // of the kind's structs, which begin zeroed
    // Validates, runs what all members need, fills `members` and the first part of the answer. A
    // study without members is made here, on one thread: the functions below are NULL then, but for
    // `free`, which follows also after a failure.
    Status (*begin)(void *work, const StudyTools *tools, Problem *problem);
    // Makes the scene of a member, from 0; other threads make other members at the same time.
    // `scene` is cleared by the caller. A failure is the member's, unless it ends the study.
    Status (*scene)(const void *work, size_t member, Simulation *scene, StudyPart *part,
                    Problem *problem);
    // Keeps what the fold needs of a run beside steps, summary and spectra. May be NULL.
    Status (*keep)(const void *work, const Outcome *outcome, const StudyTools *tools,
                   StudyPart *part, Problem *problem);
    // Adds a part to the answer and may take its contents. May change what is wanted.
    // STATUS_NO_MEMORY.
    Status (*fold)(void *work, size_t member, StudyPart *part);
    // Completes the answer when all wanted members are folded. May be NULL.
    Status (*end)(void *work, const StudyTools *tools, Problem *problem);
    // The values that the answer found for the axes of the references, borrowed from it; NULL: it
    // finds none. STATUS_NOT_FOUND.
    Status (*solution)(const void *study, const Variant *answer, struct StudyValue *values,
                       Problem *problem);
    void (*clear)(StudyPart *part); // what a part owns beside its StudyPart; may be NULL
    void (*free)(void *work);       // what the work owns; may be NULL
};

extern const StudyKind *const studies[]; // NULL-terminated
const StudyKind *study_of_answer(const Kind *answer);
extern const KindTable study_kinds, study_answer_kinds;
extern const StudyKind study_tradeoff, study_ensemble, study_compare, study_sensitivity,
    study_sweep, study_calibrate, study_response, study_optimize, study_fragility;

static inline const StudyKind *study_kind(const Variant *study) {
    return (const StudyKind *)(const void *)study->kind;
}

static inline const char *study_document_name(const StudyKind *kind) {
    return kind->document != NULL ? kind->document : kind->kind.name;
}

// Whether a study has members, which threads can share.
static inline bool study_has_members(const Variant *study) {
    return study_kind(study)->scene != NULL;
}

// An answer as a document: {"study": {"kind": ...}}. Cleared by fields_clear.
typedef struct StudyAnswer {
    Variant *study;
} StudyAnswer;
extern const Field study_answer_fields[];

// Runs a completed study of a completed simulation on this thread. The answer is freed by
// variant_free; NULL after a failure. Stops with STATUS_CANCELLED when the progress says so.
// `problem` is empty and not NULL.
Status study_run(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                 Variant **answer, Problem *problem);

// The same in steps, for a study with members that several threads make: begin, make and fold each
// wanted member, end, free. The work borrows study, simulation, limits and answer; both outputs are
// NULL after a failure.
Status study_begin(const Variant *study, const Simulation *simulation, const StudyTools *tools,
                   Variant **answer, StudyWork **work, Problem *problem);
// Makes a member. One that fails is a part too; an error ends the study. The part is freed by
// study_part_free in any case. `problem` is not NULL.
Status study_part_make(const StudyWork *work, size_t member, const StudyTools *tools,
                       StudyPart **part, Problem *problem);
Status study_part_fold(StudyWork *work, size_t member, StudyPart *part, Problem *problem);
Status study_end(StudyWork *work, const StudyTools *tools, Problem *problem);
void study_part_free(const StudyWork *work, StudyPart *part); // NULL is fine
void study_free(StudyWork *work);                             // NULL is fine

// A document: a scene, and perhaps a study of it.
typedef struct StudyRequest {
    Simulation simulation;
    Variant *study; // NULL: none
} StudyRequest;

// Without a study the same bytes as simulation_fields, in JSON and in the canonical form.
extern const Field study_request_fields[];

void study_request_clear(StudyRequest *request);

// simulation_complete, and the same for the study: validates and completes it, and refuses one
// whose estimated cost is above its limit, a multiple of limits->steps.
Status study_request_complete(StudyRequest *request, const SimulationLimits *limits,
                              Warnings *warnings, Problem *problem);

// That limit in solver steps; 0: none.
double study_max_steps(const Variant *study, const SimulationLimits *limits);

// Estimated cost of the whole. `problem` may be NULL.
Status study_request_cost(const StudyRequest *request, const SimulationLimits *limits, Cost *cost,
                          Problem *problem);

#endif
