// Studies in the jobs room, with the real engine and a real database: shared out to the workers,
// the same bytes for any number of them, stopped, interrupted, and side by side.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/study.h"
#include "server/util/clock.h"
#include "tests/support/room.h"
#include "tests/support/test.h"

// Instrumented code takes many times the CPU.
enum { SLOWER = IMPACTD_SANITIZED ? 20 : 1, FEWER = IMPACTD_SANITIZED ? 8 : 1 };

static Problem problem;

static void scene(char text[1024], double duration, const char *accuracy, const char *study) {
    snprintf(
        text, 1024,
        "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},"
        " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],"
        " \"excitation\": {\"kind\": \"random\", \"band\": [0.1, 10], \"rms\": 1, \"seed\": 3},"
        " \"duration\": %.17g, \"sample_rate\": 500, \"accuracy\": %s%s%s}",
        duration, accuracy, study == NULL ? "" : ", \"study\": ", study == NULL ? "" : study);
}

static const char usual[] = "{\"solver\": \"auto\"}";

static void ensemble(char text[1024], size_t runs, double duration) {
    char study[120];
    snprintf(study, sizeof study, "{\"kind\": \"ensemble\", \"runs\": %zu}", runs);
    scene(text, duration, usual, study);
}

// A study that notes in which order it is folded, and how many parts there are.
typedef struct Noted {
    StudyWork work;
    size_t folded, enough, parts, most;
} Noted;

static Status note(void *work, size_t member, StudyPart *part) {
    Noted *noted = work;
    assert_int_equal(member, noted->folded);
    assert_int_equal(part->run.number, member);
    noted->folded++;
    if (noted->folded == noted->enough)
        noted->work.wanted = noted->folded;
    return STATUS_OK;
}

static Noted *noted_of_all;

static void clear(StudyPart *part) {
    (void)part;
    noted_of_all->parts--;
}

static void fold(StudyEngine *engine, size_t member) {
    StudyPart *part = calloc(1, sizeof *part);
    assert_non_null(part);
    part->run.number = member;
    if (++noted_of_all->parts > noted_of_all->most)
        noted_of_all->most = noted_of_all->parts;
    assert_int_equal(study_engine_fold(engine, member, part, &problem), STATUS_OK);
}

static const StudyKind noted_kind = {.fold = note, .clear = clear};

// Takes all members that may be begun, and folds the last of them first. How many were folded.
static size_t fold_backwards(size_t members, size_t enough, size_t part_bytes, size_t *most) {
    Noted noted = {.work = {.kind = &noted_kind,
                            .members = members,
                            .wanted = members,
                            .expected = members,
                            .part_bytes = part_bytes},
                   .enough = enough};
    StudyEngine engine;
    const Progress progress = {NULL, NULL};
    size_t from, next;
    noted_of_all = &noted;
    assert_int_equal(study_engine_open(&engine, &noted.work, NULL, &progress, 2, NULL), STATUS_OK);
    while (study_engine_next(&engine, false, &from)) {
        size_t to = from + 1;
        while (study_engine_next(&engine, false, &next))
            assert_int_equal(next, to++);
        assert_true(to - from <= engine.window && !study_engine_has_next(&engine));
        while (to > from)
            fold(&engine, --to);
    }
    assert_true(atomic_load(&engine.is_over));
    study_engine_close(&engine);
    assert_int_equal(noted.parts, 0);
    *most = noted.most;
    return noted.folded;
}

TEST(parts_are_folded_in_order_within_bounded_memory) {
    size_t most;
    assert_int_equal(fold_backwards(1000, SIZE_MAX, 8, &most), 1000);
    assert_int_equal(most, 1000);
    // Large parts: some are begun, and as many more when those are folded.
    assert_int_equal(fold_backwards(1000, SIZE_MAX, 1 << 28, &most), 1000);
    assert_int_equal(most, 16);
    // Parts beyond the end are not used.
    assert_int_equal(fold_backwards(1000, 7, 1 << 28, &most), 7);
    assert_int_equal(fold_backwards(0, SIZE_MAX, 8, &most), 0);
}

static char *answer_of(const Room *room, const char *text) {
    char id[40], result[72];
    ResultRow row;
    room_submit(room, text, NULL, id);
    room_finish(room, id, result);
    assert_int_equal(db_result_load(room->db, result, &row, &problem), STATUS_OK);
    char *study = strdup(row.study);
    result_row_clear(&row);
    assert_non_null(study);
    return study;
}

// How many workers have chunks in hand.
static size_t busy(const Room *room) {
    size_t count = 0;
    pthread_mutex_lock(&room->manager->lock);
    for (size_t i = 0; i < room->manager->worker_count; i++)
        count += room->manager->workers[i].study != NULL;
    pthread_mutex_unlock(&room->manager->lock);
    return count;
}

static bool is_idle(const Room *room) {
    pthread_mutex_lock(&room->manager->lock);
    bool is_idle = room->manager->studies == NULL;
    for (size_t i = 0; i < room->manager->worker_count; i++)
        is_idle = is_idle && room->manager->workers[i].study == NULL &&
                  room->manager->workers[i].running == NULL;
    pthread_mutex_unlock(&room->manager->lock);
    return is_idle;
}

static int64_t process_cpu_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

// Dismisses a study whose members are long, in the midst of them: the CPU that it takes afterwards.
static bool stop_at_a_third(void *context, double fraction) {
    size_t *calls = context;
    ++*calls;
    return fraction < 1.0 / 3;
}

TEST(a_study_on_threads_stops_when_its_watch_does) {
    char text[1024];
    Db *db;
    StudyRequest request;
    Warnings warnings = {NULL, 0};
    Variant *answer = NULL;
    size_t calls = 0;
    const SimulationLimits limits = {.samples = 1 << 20, .impacts = 1 << 20};
    const Progress watch = {&calls, stop_at_a_third};
    problem_clear(&problem);
    ensemble(text, 100, 2);
    assert_int_equal(db_open(NULL, &db, &problem), STATUS_OK);
    assert_int_equal(jobs_prepare(db, text, strlen(text), &limits, &request, &warnings, &problem),
                     STATUS_OK);
    assert_int_equal(
        jobs_run_study(request.study, &request.simulation, &limits, &watch, &answer, &problem),
        STATUS_CANCELLED);
    assert_null(answer);
    assert_string_equal(problem.detail, "the study was stopped");
    assert_true(calls > 1);
    study_request_clear(&request);
    warnings_clear(&warnings);
    db_close(db);
}

TEST(a_study_stops_within_100_ms_of_work) {
    static const char sweep[] =
        "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/excitation/seed\","
        " \"from\": 1, \"to\": 50, \"count\": 50}]}";
    static const char *const kinds[] = {
        "{\"kind\": \"ensemble\", \"runs\": 50}",
        "{\"kind\": \"sensitivity\"}",
        "{\"kind\": \"compare\"}",
        sweep,
    };
    Room room = room_make(2);
    for (size_t i = 0; i < COUNT(kinds); i++) {
        char text[1024], id[40];
        // Some tenths of a second each.
        scene(text, 40.0 / SLOWER, "{\"solver\": \"rk4\", \"step\": 2e-5}", kinds[i]);
        room_submit(&room, text, NULL, id);
        while (busy(&room) < 2)
            room_nap(1000000);
        room_nap(5000000);
        const int64_t began_ns = process_cpu_ns();
        room_dismiss(&room, id);
        while (!is_idle(&room))
            room_nap(1000000);
        const double ms = 1e-6 * (double)(process_cpu_ns() - began_ns);
        if (ms > 100 * 2 * SLOWER)
            fail_msg("%s took %.0f ms of CPU more", kinds[i], ms);
    }
    room_end(&room);
}

TEST(an_ensemble_is_dismissed_at_any_moment_and_leaves_nothing) {
    Room room = room_make(2);
    char text[1024], id[40], result[72];
    for (int i = 0; i < 20; i++) {
        ensemble(text, 2000, 20 + i);
        room_submit(&room, text, NULL, id);
        room_nap(7000000L * (i % 10));
        room_dismiss(&room, id);
    }
    ensemble(text, 5, 1);
    room_submit(&room, text, NULL, id);
    room_finish(&room, id, result);
    while (!is_idle(&room))
        room_nap(1000000);
    assert_true(room.manager->memory == 0 && room.manager->studies == NULL);
    room_end(&room);
}

// One worker has turns of both: the other one stands in the queue, and no worker is at it.
TEST(a_study_that_waits_for_its_turn_is_dismissed) {
    Room room = room_make(1);
    char text[1024], ids[2][40];
    for (int i = 0; i < 10; i++) {
        for (int k = 0; k < 2; k++) {
            ensemble(text, 5000, 20 + 2 * i + k);
            room_submit(&room, text, k == 0 ? "one" : "two", ids[k]);
        }
        pthread_mutex_lock(&room.manager->lock);
        while (room.manager->studies == NULL || room.manager->studies->next == NULL) {
            pthread_mutex_unlock(&room.manager->lock);
            room_nap(1000000);
            pthread_mutex_lock(&room.manager->lock);
        }
        pthread_mutex_unlock(&room.manager->lock);
        room_nap(1000000L * i);
        room_dismiss(&room, ids[i % 2]);
        room_dismiss(&room, ids[1 - i % 2]);
        while (!is_idle(&room))
            room_nap(1000000);
        assert_true(room.manager->memory == 0 && room.manager->studies == NULL);
    }
    room_end(&room);
}

TEST(an_ensemble_that_was_interrupted_begins_again) {
    Room room = room_make(2);
    char text[1024], id[40], result[72];
    ensemble(text, 300, 20);
    char *whole = answer_of(&room, text);
    room_end(&room);
    room = room_make(2);
    room_submit(&room, text, NULL, id);
    for (int i = 0; i < 3; i++) {
        while (busy(&room) == 0 && !job_state_is_final((int)room_state(&room, id, result)))
            room_nap(100000);
        room_close(&room);
        room_open(&room);
    }
    char *again = answer_of(&room, text);
    assert_string_equal(again, whole);
    free(again);
    free(whole);
    room_end(&room);
}

// Points or members that a job has made, of a thousand.
static double share_of(const Room *room, const char *id) {
    Job *job;
    JobView show;
    assert_int_equal(jobs_find(room->manager, id, &job, NULL), STATUS_OK);
    assert_int_equal(job_view(job, &show), STATUS_OK);
    job_unref(job);
    const double share = show.progress / 100;
    job_view_clear(&show);
    return share;
}

// Two equal studies of two clients on one worker: when the first is at its end, the other is well
// on its way.
static void assert_both_get_on(const char *one, const char *other) {
    Room room = room_make(1);
    char ids[2][40], result[72];
    room_submit(&room, one, "one", ids[0]);
    while (share_of(&room, ids[0]) < 0.15) // its members are being made
        room_nap(1000000);
    room_submit(&room, other, "other", ids[1]);
    while (!job_state_is_final((int)room_state(&room, ids[0], result)))
        room_nap(1000000);
    const double share = share_of(&room, ids[1]);
    if (share < 0.4)
        fail_msg("the other is at %.0f %% when the first is at its end", 100 * share);
    room_finish(&room, ids[1], result);
    room_end(&room);
}

TEST(studies_of_two_clients_both_get_on) {
    char one[1024], other[1024];
    room_sweep(one, sizeof one, 4000 / FEWER, 20);
    room_sweep(other, sizeof other, 4000 / FEWER, 20.5);
    assert_both_get_on(one, other);
    ensemble(one, 1000 / FEWER, 20);
    ensemble(other, 1000 / FEWER, 20.5);
    assert_both_get_on(one, other);
    assert_both_get_on(other, one);
}
