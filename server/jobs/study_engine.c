#include "server/jobs/study_engine.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#include "server/util/clock.h"

enum { WINDOW_BYTES = 32 << 20, WINDOW_PER_SLOT = 8, THREADS_MAX = 256, MILLION = 1000000 };

static Status study_engine_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

Status study_engine_open(StudyEngine *engine, StudyWork *work, const SimulationLimits *limits,
                         const Progress *progress, size_t slots, Problem *problem) {
    const size_t by_bytes = WINDOW_BYTES / (work->part_bytes + 1);
    const size_t by_slots = WINDOW_PER_SLOT * slots;
    const size_t window = by_bytes > by_slots ? by_bytes : by_slots;
    *engine = (StudyEngine){.work = work,
                            .limits = limits,
                            .progress = *progress,
                            .window = window < work->members ? window : work->members + 1,
                            .wanted = work->wanted};
    atomic_store(&engine->expected, work->expected);
    atomic_store(&engine->is_over, work->wanted == 0);
    pthread_mutex_init(&engine->lock, NULL);
    pthread_cond_init(&engine->changed, NULL);
    if (slots == 0)
        return STATUS_OK;
    engine->parts = calloc(engine->window, sizeof *engine->parts);
    return engine->parts != NULL ? STATUS_OK : study_engine_no_memory(problem);
}

void study_engine_close(StudyEngine *engine) {
    if (engine->work == NULL)
        return;
    for (size_t i = 0; engine->parts != NULL && i < engine->window; i++)
        study_part_free(engine->work, engine->parts[i]);
    free(engine->parts);
    pthread_cond_destroy(&engine->changed);
    pthread_mutex_destroy(&engine->lock);
}

// With the lock held.
static bool study_engine_is_open(const StudyEngine *engine) {
    const size_t room = engine->folded + engine->window;
    return !atomic_load(&engine->is_over) &&
           engine->begun < (engine->wanted < room ? engine->wanted : room);
}

bool study_engine_has_next(StudyEngine *engine) {
    pthread_mutex_lock(&engine->lock);
    const bool is_open = study_engine_is_open(engine);
    pthread_mutex_unlock(&engine->lock);
    return is_open;
}

bool study_engine_next(StudyEngine *engine, bool may_wait, size_t *member) {
    pthread_mutex_lock(&engine->lock);
    while (may_wait && !study_engine_is_open(engine) && !atomic_load(&engine->is_over))
        pthread_cond_wait(&engine->changed, &engine->lock);
    const bool is_open = study_engine_is_open(engine);
    *member = engine->begun;
    engine->begun += is_open;
    pthread_mutex_unlock(&engine->lock);
    return is_open;
}

void study_engine_stop(StudyEngine *engine) {
    pthread_mutex_lock(&engine->lock);
    atomic_store(&engine->is_over, true);
    pthread_cond_broadcast(&engine->changed);
    pthread_mutex_unlock(&engine->lock);
}

bool study_engine_continues(StudyEngine *engine) {
    const double expected = MILLION * (double)atomic_load(&engine->expected);
    const double share = fmin((double)atomic_load(&engine->millionths) / fmax(expected, 1), 1);
    return progress_advance(&engine->progress, share) && !atomic_load(&engine->is_over);
}

void study_engine_count(StudyEngine *engine, size_t members) {
    atomic_fetch_add(&engine->millionths, (uint_fast64_t)members * MILLION);
}

// A member that is being made.
typedef struct MemberProgress {
    StudyEngine *engine;
    uint_fast64_t counted; // millionths of it
} MemberProgress;

static bool study_engine_advance(void *context, double fraction) {
    MemberProgress *member = context;
    const uint_fast64_t done = (uint_fast64_t)(MILLION * fmax(0, fmin(fraction, 1)));
    if (done > member->counted) {
        atomic_fetch_add(&member->engine->millionths, done - member->counted);
        member->counted = done;
    }
    return study_engine_continues(member->engine);
}

Status study_engine_part(StudyEngine *engine, size_t member, Workspace *workspace, StudyPart **part,
                         Problem *problem) {
    MemberProgress made = {engine, 0};
    const Progress watch = {&made, study_engine_advance};
    const StudyTools tools = {.limits = engine->limits, .progress = &watch, .workspace = workspace};
    TRY(study_part_make(engine->work, member, &tools, part, problem));
    (void)study_engine_advance(&made, 1);
    return STATUS_OK;
}

// With the lock held, which is released while a part is folded: no other thread folds meanwhile.
static Status study_engine_fold_all(StudyEngine *engine, Problem *problem) {
    Status status = STATUS_OK;
    engine->is_folding = true;
    while (status == STATUS_OK && engine->folded < engine->wanted) {
        StudyPart **place = &engine->parts[engine->folded % engine->window], *part = *place;
        if (part == NULL)
            break;
        *place = NULL;
        pthread_mutex_unlock(&engine->lock);
        status = study_part_fold(engine->work, engine->folded, part, problem);
        study_part_free(engine->work, part);
        pthread_mutex_lock(&engine->lock);
        engine->folded++;
        // The fold may have changed what is wanted.
        engine->wanted = engine->work->wanted;
        atomic_store(&engine->expected, engine->work->expected);
        if (engine->folded >= engine->wanted)
            atomic_store(&engine->is_over, true);
        pthread_cond_broadcast(&engine->changed);
    }
    engine->is_folding = false;
    return status;
}

Status study_engine_fold(StudyEngine *engine, size_t member, StudyPart *part, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&engine->lock);
    engine->parts[member % engine->window] = part;
    if (!engine->is_folding && member == engine->folded)
        status = study_engine_fold_all(engine, problem);
    pthread_mutex_unlock(&engine->lock);
    return status;
}

Status study_engine_make(StudyEngine *engine, size_t member, Workspace *workspace,
                         Problem *problem) {
    StudyPart *part = NULL;
    const Status status = study_engine_part(engine, member, workspace, &part, problem);
    if (status == STATUS_OK)
        return study_engine_fold(engine, member, part, problem);
    study_part_free(engine->work, part);
    return status;
}

// A study on threads of this process alone.
typedef struct StudyThreads {
    StudyEngine engine;
    const Progress *watch;
    pthread_mutex_t lock; // of what follows, and of calls of `watch`
    Status status;        // of the first thread that failed, with its problem
    Problem *problem;
} StudyThreads;

static void study_threads_fail(StudyThreads *threads, Status status, const char *detail) {
    pthread_mutex_lock(&threads->lock);
    if (threads->status == STATUS_OK)
        threads->status = problem_set(threads->problem, status, "%s", detail);
    pthread_mutex_unlock(&threads->lock);
    study_engine_stop(&threads->engine);
}

static bool study_threads_advance(void *context, double fraction) {
    StudyThreads *threads = context;
    pthread_mutex_lock(&threads->lock);
    const bool continues =
        progress_advance(threads->watch, STUDY_BEGUN + (1 - STUDY_BEGUN) * fraction);
    pthread_mutex_unlock(&threads->lock);
    if (!continues)
        study_threads_fail(threads, STATUS_CANCELLED, "the study was stopped");
    return continues;
}

static void *study_threads_main(void *context) {
    StudyThreads *threads = context;
    StudyEngine *engine = &threads->engine;
    Workspace workspace = {0};
    Problem problem; // large, but a thread's stack is larger
    size_t member;
    while (study_engine_next(engine, true, &member)) {
        problem_clear(&problem);
        const Status status = study_engine_make(engine, member, &workspace, &problem);
        // A stop that was requested is noted already; the end of the study stops members beyond it.
        if (status != STATUS_OK && status != STATUS_CANCELLED)
            study_threads_fail(threads, status, problem.detail);
    }
    workspace_clear(&workspace);
    return NULL;
}

static Status study_threads_run(StudyWork *work, const StudyTools *tools, Problem *problem) {
    StudyThreads threads = {.watch = tools->progress, .problem = problem};
    const Progress progress = {&threads, study_threads_advance};
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const size_t count = processors < 1             ? 1
                         : processors > THREADS_MAX ? THREADS_MAX
                                                    : (size_t)processors;
    pthread_t others[THREADS_MAX];
    size_t started = 0;
    pthread_mutex_init(&threads.lock, NULL);
    Status status =
        study_engine_open(&threads.engine, work, tools->limits, &progress, count, problem);
    if (status == STATUS_OK) {
        // Fewer threads than there could be do as well.
        while (started + 1 < count &&
               pthread_create(&others[started], NULL, study_threads_main, &threads) == 0)
            started++;
        (void)study_threads_main(&threads);
        for (size_t i = 0; i < started; i++)
            pthread_join(others[i], NULL);
        status = threads.status;
    }
    study_engine_close(&threads.engine);
    pthread_mutex_destroy(&threads.lock);
    return status;
}

static double study_engine_cpu(void *context) {
    (void)context;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

Status study_engine_run(const Variant *study, const Simulation *simulation,
                        const SimulationLimits *limits, const Progress *watch, Variant **answer,
                        Problem *problem) {
    Workspace workspace = {0};
    StudyWork *work;
    const StudyTools tools = {
        .limits = limits, .progress = watch, .workspace = &workspace, .cpu = study_engine_cpu};
    // A study without members is made by this thread in study_begin.
    Status status = study_begin(study, simulation, &tools, answer, &work, problem);
    if (status == STATUS_OK && study_has_members(study))
        status = study_threads_run(work, &tools, problem);
    if (status == STATUS_OK)
        status = study_end(work, &tools, problem);
    study_free(work);
    workspace_clear(&workspace);
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}
