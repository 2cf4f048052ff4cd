// Every thread, this one too, asks for a member, makes it, hands it in, and asks for the next.
#include "server/cli/crew.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

#include "server/jobs/reorder.h"

enum { THREADS = 256 };

typedef struct Crew {
    const SimulationLimits *limits;
    const Progress *watch;
    ReorderBuffer order;
    pthread_mutex_t lock; // of what follows
    pthread_cond_t changed;
    uint64_t changes; // members that were handed in
    double done;      // members
    Status status;    // of the first that failed, as `problem` says
    Problem *problem;
} Crew;

typedef struct Hand {
    Crew *crew;
    pthread_t thread;
    double told; // of its member
    Problem problem;
} Hand;

// With the lock held.
static void fail(Crew *crew, Status status, const char *detail) {
    if (crew->status == STATUS_OK)
        crew->status = problem_set(crew->problem, status, "%s", detail);
}

static bool advance(void *context, double fraction) {
    Hand *hand = context;
    Crew *crew = hand->crew;
    const double expected = (double)reorder_expected(&crew->order);
    pthread_mutex_lock(&crew->lock);
    if (fraction > hand->told) {
        crew->done += fraction - hand->told;
        hand->told = fraction;
    }
    const double share = STUDY_BEGUN + (1 - STUDY_BEGUN) * fmin(crew->done / expected, 1);
    if (crew->status == STATUS_OK && !progress_advance(crew->watch, share))
        fail(crew, STATUS_CANCELLED, "the study was stopped");
    const bool goes_on = crew->status == STATUS_OK;
    pthread_mutex_unlock(&crew->lock);
    return goes_on;
}

static Status make_member(Hand *hand, Workspace *workspace, size_t member) {
    Crew *crew = hand->crew;
    const Progress watch = {hand, advance};
    const StudyTools tools = {.limits = crew->limits, .progress = &watch, .workspace = workspace};
    StudyPart *part = NULL;
    hand->told = 0;
    problem_clear(&hand->problem);
    const Status status = study_part_make(crew->order.work, member, &tools, &part, &hand->problem);
    if (status != STATUS_OK) {
        study_part_free(crew->order.work, part);
        return status;
    }
    (void)advance(hand, 1);
    return reorder_put(&crew->order, member, part, &hand->problem);
}

// How many were handed in so far; false where the crew is to stop.
static bool look(Crew *crew, uint64_t *changes) {
    pthread_mutex_lock(&crew->lock);
    *changes = crew->changes;
    const bool goes_on = crew->status == STATUS_OK;
    pthread_mutex_unlock(&crew->lock);
    return goes_on;
}

static void wait_for_change(Crew *crew, uint64_t seen) {
    pthread_mutex_lock(&crew->lock);
    while (crew->changes == seen)
        pthread_cond_wait(&crew->changed, &crew->lock);
    pthread_mutex_unlock(&crew->lock);
}

static void *work(void *context) {
    Hand *hand = context;
    Crew *crew = hand->crew;
    Workspace workspace = {0};
    uint64_t seen;
    size_t from, to;
    // Looked at before members are asked for: what is handed in after that is no reason to wait.
    while (look(crew, &seen) && reorder_begin(&crew->order, 1, &from, &to)) {
        if (from == to) {
            wait_for_change(crew, seen);
            continue;
        }
        const Status status = make_member(hand, &workspace, from);
        pthread_mutex_lock(&crew->lock);
        if (status != STATUS_OK)
            fail(crew, status, hand->problem.detail);
        crew->changes++;
        pthread_cond_broadcast(&crew->changed);
        pthread_mutex_unlock(&crew->lock);
    }
    workspace_clear(&workspace);
    return NULL;
}

static size_t slots(void) {
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    return processors < 1 ? 1 : processors > THREADS ? THREADS : (size_t)processors;
}

static Status make_all(Crew *crew, size_t most, Problem *problem) {
    Hand *hands = calloc(most, sizeof *hands);
    size_t others = 0;
    if (hands == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    for (size_t i = 0; i < most; i++)
        hands[i].crew = crew;
    // Fewer than there could be do as well.
    while (others + 1 < most &&
           pthread_create(&hands[others + 1].thread, NULL, work, &hands[others + 1]) == 0)
        others++;
    (void)work(&hands[0]);
    for (size_t i = 1; i <= others; i++)
        pthread_join(hands[i].thread, NULL);
    free(hands);
    return crew->status;
}

static Status make_members(StudyWork *of, const StudyTools *tools, Problem *problem) {
    Crew crew = {.limits = tools->limits, .watch = tools->progress, .problem = problem};
    pthread_mutex_init(&crew.lock, NULL);
    pthread_cond_init(&crew.changed, NULL);
    const size_t threads = slots();
    Status status = reorder_make(of, threads, &crew.order, problem);
    if (status == STATUS_OK)
        status = make_all(&crew, threads, problem);
    reorder_clear(&crew.order);
    pthread_cond_destroy(&crew.changed);
    pthread_mutex_destroy(&crew.lock);
    return status;
}

Status crew_run(const Variant *study, const Simulation *simulation, const SimulationLimits *limits,
                const Progress *watch, Variant **answer, Problem *problem) {
    Workspace workspace = {0};
    StudyWork *work;
    const StudyTools tools = {.limits = limits, .progress = watch, .workspace = &workspace};
    Status status = study_begin(study, simulation, &tools, answer, &work, problem);
    if (status == STATUS_OK)
        status = make_members(work, &tools, problem);
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
