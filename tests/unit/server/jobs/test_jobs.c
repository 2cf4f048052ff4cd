// The jobs room with the real engine and a real database: nothing lost, nothing twice, one state at
// the end.
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include <cmocka.h>

#include "core/math/fft.h"
#include "server/db/sqlite.h"
#include "server/jobs/jobs.h"
#include "server/jobs/jobs_private.h"
#include "tests/support/scratch.h"

typedef struct Room {
    char directory[SCRATCH_SIZE];
    Db *db;
    JobManager *manager;
    JobManagerSettings settings;
} Room;

static Problem problem;

static void room_open(Room *room) {
    problem_clear(&problem);
    if (db_open(room->directory, &room->db, &problem) != STATUS_OK ||
        jobs_open(room->db, &room->settings, &room->manager, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static void room_close(Room *room) {
    jobs_close(room->manager);
    db_close(room->db);
    room->manager = NULL;
    room->db = NULL;
}

static Room room_make(size_t workers) {
    Room room = {.settings = {.workers = workers,
                              .queue_most = 1000,
                              .cache_bytes = 1 << 24,
                              .limits = {.samples = 1 << 25, .impacts = 1 << 20}}};
    scratch_make(room.directory);
    room_open(&room);
    return room;
}

static void room_end(Room *room) {
    room_close(room);
    scratch_remove(room->directory);
}

// The paper's scene; `displacement` makes scenes differ, `duration` makes them long.
static void scene_text(char target[1024], double displacement, double duration,
                       const char *buffer) {
    snprintf(target, 1024,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},"
             " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"%s\"}],"
             " \"excitation\": {\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 1, "
             "\"displacement\": %.17g},"
             " \"duration\": %.17g, \"sample_rate\": 1000,"
             " \"output\": {\"channels\": [\"displacement\"], \"psd\": {\"channels\": []}}}",
             buffer, displacement, duration);
}

static Status submit_text(JobManager *manager, const char *text, Job **job, Problem *told) {
    const Submission submission = {.text = text, .size = strlen(text)};
    return jobs_submit(manager, &submission, job, told);
}

static const struct timespec moment = {0, 1000000};

static Status wait_until_kept(Job *job, Problem *told) {
    bool is_kept = false;
    Status status = STATUS_OK;
    for (int i = 0; i < 60000 && status == STATUS_OK && !is_kept; i++) {
        status = job_is_durable(job, &is_kept, told);
        if (!is_kept)
            nanosleep(&moment, NULL);
    }
    assert_true(is_kept || status != STATUS_OK);
    return status;
}

static Job *submit_unkept(Room *room, double displacement, double duration) {
    char text[1024];
    Job *job = NULL;
    scene_text(text, displacement, duration, "sponge");
    problem_clear(&problem);
    if (submit_text(room->manager, text, &job, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return job;
}

static Job *submit(Room *room, double displacement, double duration) {
    Job *job = submit_unkept(room, displacement, duration);
    if (wait_until_kept(job, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return job;
}

static void wait_for(Job *job) {
    for (int i = 0; i < 60000 && !job_is_finished(job); i++)
        nanosleep(&moment, NULL);
    assert_true(job_is_finished(job));
}

static JobView show(Job *job) {
    JobView now;
    assert_int_equal(job_view(job, &now), STATUS_OK);
    return now;
}

static void a_job_finishes_and_is_found_again(void **state) {
    (void)state;
    Room room = room_make(2);
    Job *job = submit(&room, 0.015, 2), *again = NULL;
    wait_for(job);
    JobView first = show(job);
    assert_int_equal(first.state, JOB_SUCCESSFUL);
    assert_false(first.is_cached);
    assert_non_null(first.plan);
    assert_non_null(strstr(first.summary, "\"impacts\": "));
    assert_int_equal(jobs_find(room.manager, first.id, &again, &problem), STATUS_OK);
    JobView second = show(again);
    assert_string_equal(second.summary, first.summary);
    assert_string_equal(second.plan, first.plan);
    job_view_clear(&first);
    job_view_clear(&second);
    job_unref(job);
    job_unref(again);
    assert_int_equal(jobs_find(room.manager, "j-none", &again, &problem), STATUS_NOT_FOUND);
    room_end(&room);
}

static void a_known_scene_computes_nothing(void **state) {
    (void)state;
    Room room = room_make(1);
    for (int is_reopened = 0; is_reopened < 2; is_reopened++) {
        Job *job = submit(&room, 0.015, 2);
        wait_for(job);
        Job *same = submit(&room, 0.015, 2);
        assert_true(job_is_finished(same));
        JobView first = show(job), second = show(same);
        assert_true(second.is_cached);
        assert_true(first.is_cached == is_reopened);
        assert_string_equal(first.result, second.result);
        assert_string_not_equal(first.id, second.id);
        assert_string_equal(first.summary, second.summary);
        job_view_clear(&first);
        job_view_clear(&second);
        job_unref(job);
        job_unref(same);
        room_close(&room);
        room_open(&room);
    }
    room_end(&room);
}

static void equal_scenes_in_flight_share_a_computation(void **state) {
    (void)state;
    Room room = room_make(1);
    Job *blocker = submit(&room, 0.001, 400), *jobs[8];
    for (size_t i = 0; i < 8; i++)
        jobs[i] = submit(&room, 0.015, 2);
    JobStats metrics;
    jobs_tally(room.manager, &metrics);
    assert_true(metrics.queued <= 2);
    for (size_t i = 0; i < 8; i++) {
        wait_for(jobs[i]);
        JobView now = show(jobs[i]);
        assert_int_equal(now.state, JOB_SUCCESSFUL);
        job_view_clear(&now);
        job_unref(jobs[i]);
    }
    wait_for(blocker);
    job_unref(blocker);
    room_end(&room);
}

static void a_dismissed_job_stops_and_stays_dismissed(void **state) {
    (void)state;
    Room room = room_make(1);
    Job *running = submit(&room, 0.001, 30000), *queued = submit(&room, 0.002, 30000),
        *again = NULL;
    JobView a = show(running), b = show(queued);
    for (int i = 0; i < 2000 && a.state != JOB_RUNNING; i++) {
        nanosleep(&moment, NULL);
        job_view_clear(&a);
        a = show(running);
    }
    assert_int_equal(a.state, JOB_RUNNING);
    Job *dismissed[2] = {NULL, NULL};
    assert_int_equal(jobs_cancel(room.manager, b.id, &dismissed[0], &problem), STATUS_OK);
    assert_int_equal(jobs_cancel(room.manager, a.id, &dismissed[1], &problem), STATUS_OK);
    assert_true(job_is_finished(running) && job_is_finished(queued));
    problem_clear(&problem);
    assert_int_equal(jobs_cancel(room.manager, a.id, &again, &problem), STATUS_CONFLICT);
    // The worker is free at once: another job does not wait for 30,000 s of simulated time.
    Job *next = submit(&room, 0.003, 1);
    wait_for(next);
    assert_int_equal(jobs_find(room.manager, a.id, &again, &problem), STATUS_OK);
    JobView c = show(again);
    assert_int_equal(c.state, JOB_DISMISSED);
    job_view_clear(&a);
    job_view_clear(&b);
    job_view_clear(&c);
    Job *all[] = {running, queued, dismissed[0], dismissed[1], next, again};
    for (size_t i = 0; i < COUNT(all); i++)
        job_unref(all[i]);
    room_end(&room);
}

static void a_full_queue_refuses(void **state) {
    (void)state;
    Room room = room_make(1);
    room_close(&room);
    room.settings.queue_most = 3;
    room_open(&room);
    Job *jobs[3], *more = NULL;
    for (size_t i = 0; i < 3; i++)
        jobs[i] = submit(&room, 0.001 * (double)(i + 1), 30000);
    char text[1024];
    scene_text(text, 0.01, 30000, "sponge");
    problem_clear(&problem);
    assert_int_equal(submit_text(room.manager, text, &more, &problem), STATUS_BUSY);
    assert_null(more);
    for (size_t i = 0; i < 3; i++)
        job_unref(jobs[i]);
    room_end(&room);
}

static void unfinished_jobs_go_on_after_a_restart(void **state) {
    (void)state;
    Room room = room_make(1);
    Job *jobs[6];
    char ids[6][40];
    for (size_t i = 0; i < 6; i++) {
        jobs[i] = submit(&room, 0.001 * (double)(i / 2 + 1), 300);
        JobView now = show(jobs[i]);
        strcpy(ids[i], now.id);
        job_view_clear(&now);
    }
    room_close(&room);
    for (size_t i = 0; i < 6; i++)
        job_unref(jobs[i]);
    room_open(&room);
    for (size_t i = 0; i < 6; i++) {
        Job *job;
        assert_int_equal(jobs_find(room.manager, ids[i], &job, &problem), STATUS_OK);
        wait_for(job);
        JobView now = show(job);
        assert_int_equal(now.state, JOB_SUCCESSFUL);
        job_view_clear(&now);
        job_unref(job);
    }
    room_end(&room);
}

static void note_wake(void *context) {
    atomic_fetch_add((atomic_int *)context, 1);
}

static Outcome *outcome_of(Room *room, const char *result) {
    atomic_int wakes;
    atomic_init(&wakes, 0);
    const Callback callback = {&wakes, note_wake};
    Outcome *outcome = NULL;
    for (int i = 0; i < 20000; i++) {
        const int seen = atomic_load(&wakes);
        assert_int_equal(jobs_outcome(room->manager, result, &callback, &outcome, &problem),
                         STATUS_OK);
        if (outcome != NULL)
            return outcome;
        for (int j = 0; j < 20000 && atomic_load(&wakes) == seen; j++)
            nanosleep(&moment, NULL);
    }
    return NULL;
}

static void a_series_that_is_gone_is_computed_again_with_the_same_bytes(void **state) {
    (void)state;
    Room room = room_make(2);
    Job *job = submit(&room, 0.015, 20);
    wait_for(job);
    JobView now = show(job);
    Outcome *kept = outcome_of(&room, now.result);
    room_close(&room);
    room.settings.cache_bytes = 0;
    room_open(&room);
    Outcome *anew = outcome_of(&room, now.result);
    assert_true(kept != anew);
    assert_int_equal(kept->response.count, anew->response.count);
    assert_memory_equal(kept->response.series.block, anew->response.series.block,
                        kept->response.count * sizeof(double));
    const Callback callback = {NULL, note_wake};
    Outcome *none = NULL;
    assert_int_equal(jobs_outcome(room.manager, "r-none", &callback, &none, &problem),
                     STATUS_NOT_FOUND);
    outcome_unref(kept);
    outcome_unref(anew);
    job_view_clear(&now);
    job_unref(job);
    room_end(&room);
}

static void a_failing_job_says_why(void **state) {
    (void)state;
    Room room = room_make(1);
    room_close(&room);
    room.settings.limits.impacts = 3;
    room_open(&room);
    Job *job = submit(&room, 0.015, 20);
    wait_for(job);
    JobView now = show(job);
    assert_int_equal(now.state, JOB_FAILED);
    assert_non_null(strstr(now.problem, "more than 3 impacts"));
    assert_string_equal(now.result, "");
    job_view_clear(&now);
    job_unref(job);
    room_end(&room);
}

static const char *const studied =
    "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"dampers\": [{\"mass\": 0.1107, "
    "\"clearance\": 0.015, \"buffer\": \"sponge\"}], \"excitation\": {\"kind\": \"free\", "
    "\"displacement\": 0.015}, \"duration\": 2, \"sample_rate\": 1000, "
    "\"study\": {\"kind\": \"tradeoff\", \"repeats\": %d, \"point_steps\": 1e6}}";

static Job *submit_study(Room *room, int repeats) {
    char text[1024];
    Job *job = NULL;
    snprintf(text, sizeof text, studied, repeats);
    problem_clear(&problem);
    if (submit_text(room->manager, text, &job, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return job;
}

static void a_studys_answer_is_kept_with_the_result_of_its_scene(void **state) {
    (void)state;
    Room room = room_make(2);
    Job *job = submit_study(&room, 1), *twin = submit_study(&room, 1);
    wait_for(job);
    wait_for(twin);
    JobView now = show(job), other = show(twin);
    assert_int_equal(now.state, JOB_SUCCESSFUL);
    assert_string_equal(now.result, other.result); // one measurement for both
    ResultRow row;
    assert_int_equal(db_result_load(room.db, now.result, &row, &problem), STATUS_OK);
    assert_non_null(strstr(row.study, "{\"study\": {\"kind\": \"tradeoff\", "));
    assert_non_null(strstr(row.scene, "\"point_steps\": 1000000"));
    assert_null(strstr(row.study, "null")); // it can be read again
    result_row_clear(&row);
    job_view_clear(&now);
    job_view_clear(&other);
    job_unref(job);
    job_unref(twin);
    // Another number of repeats is another study.
    job = submit_study(&room, 2);
    wait_for(job);
    now = show(job);
    assert_false(now.is_cached);
    job_view_clear(&now);
    job_unref(job);
    room_end(&room);
}

static void a_study_is_stopped_with_its_job_and_goes_on_after_a_restart(void **state) {
    (void)state;
    Room room = room_make(1);
    Job *job = submit_study(&room, 1000), *gone = NULL;
    JobView now = show(job);
    for (int i = 0; i < 60000 && now.progress <= 5; i++) { // beyond the scene's own run
        nanosleep(&moment, NULL);
        job_view_clear(&now);
        now = show(job);
    }
    assert_int_equal(now.state, JOB_RUNNING);
    assert_true(now.progress > 5 && now.progress < 100);
    char id[40];
    strcpy(id, now.id);
    job_view_clear(&now);
    job_unref(job);
    room_close(&room);
    room_open(&room);
    assert_int_equal(jobs_find(room.manager, id, &job, &problem), STATUS_OK);
    assert_false(job_is_finished(job));
    assert_int_equal(jobs_cancel(room.manager, id, &gone, &problem), STATUS_OK);
    now = show(gone);
    assert_int_equal(now.state, JOB_DISMISSED);
    assert_false(db_result_exists(room.db, now.result));
    job_view_clear(&now);
    job_unref(gone);
    job_unref(job);
    // The worker is free for others.
    job = submit(&room, 0.015, 1);
    wait_for(job);
    job_unref(job);
    room_end(&room);
}

static void names_are_resolved_and_all_faults_told(void **state) {
    (void)state;
    Room room = room_make(1);
    StudyRequest inquiry;
    Warnings warnings = {NULL, 0};
    char text[1024];
    scene_text(text, 0.015, 1, "spnge");
    problem_clear(&problem);
    assert_int_equal(jobs_prepare(room.db, text, strlen(text), NULL, &inquiry, &warnings, &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/dampers/0/buffer");
    assert_string_equal(problem.faults[0].did_you_mean, "sponge");
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    static const struct {
        const char *buffer, *pointer, *did_you_mean;
    } cases[] = {
        {"{\"material\": \"sponge\", \"restitution\": 0.7}", "/dampers/0/buffer/restitution", ""},
        {"\"sponge@9\"", "/dampers/0/buffer", "sponge@1"},
        {"\"soft_ruber@9\"", "/dampers/0/buffer", "soft_rubber"},
        {"\"sponge@x\"", "/dampers/0/buffer", "sponge"},
        {"\"\"", "/dampers/0/buffer", ""},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        snprintf(text, sizeof text,
                 "{\"structure\": {\"mass\": -1, \"stiffness\": 865}, \"duration\": 1, "
                 "\"sample_rate\": 100,"
                 " \"dampers\": [{\"mass\": 0.1, \"clearance\": 0.01, \"buffer\": %s}]}",
                 cases[i].buffer);
        problem_clear(&problem);
        assert_int_equal(
            jobs_prepare(room.db, text, strlen(text), NULL, &inquiry, &warnings, &problem),
            STATUS_INVALID);
        assert_true(problem_concerns(&problem, "/structure/mass"));
        if (problem.count != 2 || !problem_concerns(&problem, cases[i].pointer))
            fail_msg("%s: %zu faults, %s: %s", cases[i].buffer, problem.count,
                     problem.faults[0].pointer, problem.faults[0].detail);
        for (size_t k = 0; k < problem.count; k++)
            if (strncmp(problem.faults[k].pointer, "/dampers", 8) == 0)
                assert_string_equal(problem.faults[k].did_you_mean, cases[i].did_you_mean);
        study_request_clear(&inquiry);
        warnings_clear(&warnings);
    }
    room_end(&room);
}

static void a_cached_scene_is_answered_with_a_job_of_its_own(void **state) {
    (void)state;
    Room room = room_make(1);
    Job *job = submit(&room, 0.015, 2), *again = NULL, *found = NULL;
    wait_for(job);
    again = submit(&room, 0.015, 2);
    assert_true(job_is_finished(again));
    assert_int_equal(wait_until_kept(again, &problem), STATUS_OK);
    JobView first = show(job), now = show(again);
    assert_true(now.is_cached && now.state == JOB_SUCCESSFUL);
    assert_true(strcmp(first.id, now.id) < 0);
    assert_string_equal(now.result, first.result);
    assert_string_equal(now.summary, first.summary);
    room_close(&room);
    room_open(&room);
    assert_int_equal(jobs_find(room.manager, now.id, &found, &problem), STATUS_OK);
    job_view_clear(&first);
    job_view_clear(&now);
    job_unref(found);
    job_unref(again);
    job_unref(job);
    room_end(&room);
}

static void change_engine(const Room *room) {
    char path[128];
    Sqlite *other;
    snprintf(path, sizeof path, "%s/impactd.db", room->directory);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &other, &problem), STATUS_OK);
    assert_int_equal(
        sqlite_execute(other, "UPDATE results SET engine = 'an earlier one'", &problem), STATUS_OK);
    sqlite_close(other);
}

static void a_dear_series_is_kept_and_outlasts_its_engine(void **state) {
    (void)state;
    Room room = room_make(1);
    room_close(&room);
    room.settings.store_bytes = 1 << 26;
    room_open(&room);
    // Few samples of a long run, and none at all.
    static const char dear[] =
        "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"dampers\": [{\"mass\": 0.1107, "
        "\"clearance\": 0.015, \"buffer\": \"aluminium\"}], \"excitation\": {\"kind\": \"sine\", "
        "\"frequency\": 1, \"amplitude\": 1}, \"duration\": 5000, \"sample_rate\": 1}";
    static const char none_asked[] =
        "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"excitation\": {\"kind\": "
        "\"free\", \"displacement\": 0.01}, \"duration\": 20, \"sample_rate\": 100, "
        "\"output\": {\"channels\": []}}";
    const char *const texts[] = {dear, none_asked};
    char results[2][72];
    Outcome *before = NULL, *after = NULL, *none = NULL;
    for (size_t i = 0; i < 2; i++) {
        Job *job = NULL;
        problem_clear(&problem);
        if (submit_text(room.manager, texts[i], &job, &problem) != STATUS_OK)
            fail_msg("%s", problem.detail);
        wait_for(job);
        JobView now = show(job);
        assert_int_equal(now.state, JOB_SUCCESSFUL);
        strcpy(results[i], now.result);
        job_view_clear(&now);
        job_unref(job);
    }
    before = outcome_of(&room, results[0]);
    for (int i = 0; i < 10000 && !db_series_exists(room.db, results[0]); i++)
        nanosleep(&moment, NULL);
    assert_true(db_series_exists(room.db, results[0]));
    assert_false(db_series_exists(room.db, results[1]));
    room_close(&room);
    change_engine(&room);
    room_open(&room);
    after = outcome_of(&room, results[0]);
    assert_true(after != before);
    assert_int_equal(after->response.count, before->response.count);
    assert_memory_equal(after->response.series.block, before->response.series.block,
                        before->response.series.count * before->response.series.rows *
                            sizeof(double));
    assert_int_equal(after->response.impacts.count, before->response.impacts.count);
    const Callback callback = {NULL, note_wake};
    problem_clear(&problem);
    assert_int_equal(jobs_outcome(room.manager, results[1], &callback, &none, &problem),
                     STATUS_GONE);
    assert_non_null(strstr(problem.detail, "/again"));
    // Its documents were not kept with it, nor are they looked for there.
    Job *again = NULL;
    assert_int_equal(submit_text(room.manager, dear, &again, &problem), STATUS_OK);
    JobView now = show(again);
    assert_true(now.is_cached);
    assert_non_null(strstr(now.summary, "\"impacts\": "));
    job_view_clear(&now);
    job_unref(again);
    outcome_unref(before);
    outcome_unref(after);
    room_end(&room);
}

typedef struct Hammer {
    Room *room;
    unsigned seed;
    int finished, dismissed;
} Hammer;

// Submits from a few scenes, dismisses some, asks for outcomes; every job ends in one state.
static void *hammer(void *context) {
    Hammer *own = context;
    static atomic_int wakes;
    Problem *fault = calloc(1, sizeof *fault);
    const Callback callback = {&wakes, note_wake};
    for (int i = 0; i < 60; i++) {
        char text[1024];
        Job *job = NULL, *gone = NULL;
        Outcome *outcome = NULL;
        scene_text(text, 0.001 * (1 + rand_r(&own->seed) % 12), 5 + rand_r(&own->seed) % 3,
                   "aluminium");
        problem_clear(fault);
        if (submit_text(own->room->manager, text, &job, fault) != STATUS_OK)
            continue;
        JobView now;
        if (job_view(job, &now) == STATUS_OK && rand_r(&own->seed) % 3 == 0)
            own->dismissed += jobs_cancel(own->room->manager, now.id, &gone, fault) == STATUS_OK;
        (void)job_subscribe(job, &callback);
        job_unsubscribe(job, &callback);
        while (!job_is_finished(job))
            nanosleep(&(struct timespec){0, 200000}, NULL);
        job_view_clear(&now);
        if (job_view(job, &now) == STATUS_OK && now.state == JOB_SUCCESSFUL)
            (void)jobs_outcome(own->room->manager, now.result, &callback, &outcome, fault);
        own->finished++;
        if (rand_r(&own->seed) % 8 == 0)
            db_catalog_changed(own->room->db);
        outcome_unref(outcome);
        job_view_clear(&now);
        job_unref(job);
        job_unref(gone);
    }
    free(fault);
    return NULL;
}

static void many_clients_at_once_leave_nothing_behind(void **state) {
    (void)state;
    Room room = room_make(3);
    Hammer hammers[6];
    pthread_t threads[6];
    int finished = 0;
    for (unsigned i = 0; i < 6; i++) {
        hammers[i] = (Hammer){.room = &room, .seed = i + 1};
        assert_int_equal(pthread_create(&threads[i], NULL, hammer, &hammers[i]), 0);
    }
    for (int i = 0; i < 6; i++) {
        pthread_join(threads[i], NULL);
        finished += hammers[i].finished;
    }
    assert_int_equal(finished, 360);
    JobRows rows = {NULL, 0};
    assert_int_equal(db_job_unfinished(room.db, &rows, &problem), STATUS_OK);
    assert_int_equal(rows.count, 0);
    job_rows_clear(&rows);
    room_end(&room);
}

// A limit on file sizes stands in for a full disk.
static void limit_files(rlim_t size) {
    struct rlimit limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    limit.rlim_cur = size;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
}

static int lift_limit(void **state) {
    (void)state;
    limit_files(RLIM_INFINITY);
    return 0;
}

// Until nothing is computed and the store has answered whatever it was sent, so that only what
// could not be stored is unfinished.
static void wait_until_idle(Room *room) {
    JobStats metrics;
    bool is_idle = false;
    for (int i = 0; i < 60000 && !is_idle; i++) {
        nanosleep(&moment, NULL);
        jobs_tally(room->manager, &metrics);
        pthread_mutex_lock(&room->manager->lock);
        is_idle = metrics.queued + metrics.running + room->manager->posted == 0;
        pthread_mutex_unlock(&room->manager->lock);
    }
    assert_true(is_idle);
}

// [s], long enough that it still runs when there is no room any more; instrumented code takes many
// times as long.
enum { LONG = IMPACTD_SANITIZED ? 4000 : 20000 };

static void a_result_that_there_is_no_room_for_waits_for_it(void **state) {
    (void)state;
    Room room = room_make(1);
    signal(SIGXFSZ, SIG_IGN);
    Job *job = submit(&room, 0.015, LONG), *dropped = submit(&room, 0.016, LONG);
    limit_files(1);
    wait_until_idle(&room);
    jobs_retry_sweep(room.manager);
    wait_until_idle(&room);
    JobView waits = show(job), gone = show(dropped);
    assert_int_equal(waits.state, JOB_RUNNING);
    Job *dismissed;
    assert_int_equal(jobs_cancel(room.manager, gone.id, &dismissed, &problem), STATUS_OK);
    assert_int_equal(wait_until_kept(dismissed, &problem), STATUS_FULL);
    job_unref(dismissed);
    limit_files(RLIM_INFINITY);
    jobs_retry_sweep(room.manager);
    wait_until_idle(&room);
    assert_true(job_is_finished(job));
    JobView now = show(job);
    assert_int_equal(now.state, JOB_SUCCESSFUL);
    assert_true(db_result_exists(room.db, now.result));
    assert_int_equal(wait_until_kept(dropped, &problem), STATUS_OK);
    JobView end = show(dropped);
    assert_int_equal(end.state, JOB_DISMISSED);
    job_view_clear(&end);
    job_view_clear(&waits);
    job_view_clear(&gone);
    job_view_clear(&now);
    job_unref(job);
    job_unref(dropped);
    room_end(&room);
}

static void a_result_that_there_is_no_room_for_is_computed_again_after_a_restart(void **state) {
    (void)state;
    Room room = room_make(1);
    signal(SIGXFSZ, SIG_IGN);
    Job *job = submit(&room, 0.015, LONG);
    limit_files(1);
    wait_until_idle(&room);
    JobView waits = show(job);
    assert_int_equal(waits.state, JOB_RUNNING);
    job_unref(job);
    jobs_close(room.manager);
    room.manager = NULL;
    limit_files(RLIM_INFINITY);
    room_close(&room);
    room_open(&room);
    assert_int_equal(jobs_find(room.manager, waits.id, &job, &problem), STATUS_OK);
    wait_for(job);
    JobView now = show(job);
    assert_int_equal(now.state, JOB_SUCCESSFUL);
    job_view_clear(&waits);
    job_view_clear(&now);
    job_unref(job);
    room_end(&room);
}

static void a_job_that_cannot_be_kept_never_was(void **state) {
    (void)state;
    Room room = room_make(1);
    signal(SIGXFSZ, SIG_IGN);
    limit_files(1);
    Job *job = submit_unkept(&room, 0.015, 20000), *found = NULL;
    problem_clear(&problem);
    assert_int_equal(wait_until_kept(job, &problem), STATUS_FULL);
    assert_non_null(strstr(problem.detail, room.directory));
    Job *quick = submit_unkept(&room, 0.016, 0.1);
    problem_clear(&problem);
    assert_int_equal(wait_until_kept(quick, &problem), STATUS_FULL);
    limit_files(RLIM_INFINITY);
    Job *const both[] = {job, quick};
    for (size_t i = 0; i < 2; i++) {
        JobView now = show(both[i]);
        assert_true(job_is_finished(both[i]));
        assert_int_equal(jobs_find(room.manager, now.id, &found, &problem), STATUS_NOT_FOUND);
        assert_false(db_result_exists(room.db, now.result));
        job_view_clear(&now);
        job_unref(both[i]);
    }
    // Its place is free, and nobody computes for it: 20,000 s would take long.
    Job *next = submit(&room, 0.017, 1);
    wait_for(next);
    job_unref(next);
    // A job may be seen finished a moment before its worker has looked up.
    JobStats metrics;
    do {
        nanosleep(&moment, NULL);
        jobs_tally(room.manager, &metrics);
    } while (metrics.queued + metrics.running > 0);
    room_end(&room);
}

static void a_job_that_is_done_before_it_was_written_is_written_once(void **state) {
    (void)state;
    Room room = room_make(1);
    char path[128];
    Sqlite *other;
    snprintf(path, sizeof path, "%s/impactd.db", room.directory);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &other, &problem), STATUS_OK);
    assert_int_equal(sqlite_execute(other, "BEGIN IMMEDIATE", &problem), STATUS_OK);
    // The first one's row holds the writer up; the others' are still queued when they are done.
    Job *jobs[4];
    for (size_t i = 0; i < 4; i++)
        jobs[i] = submit_unkept(&room, 0.001 * (double)(i + 1), 0.5);
    for (int i = 0; i < 300; i++)
        nanosleep(&moment, NULL);
    bool is_kept;
    for (size_t i = 0; i < 4; i++) {
        assert_false(job_is_finished(jobs[i]));
        assert_int_equal(job_is_durable(jobs[i], &is_kept, &problem), STATUS_OK);
        assert_false(is_kept);
    }
    assert_int_equal(sqlite_execute(other, "ROLLBACK", &problem), STATUS_OK);
    sqlite_close(other);
    for (size_t i = 0; i < 4; i++) {
        wait_for(jobs[i]);
        assert_int_equal(wait_until_kept(jobs[i], &problem), STATUS_OK);
        JobView now = show(jobs[i]);
        JobRow row;
        assert_int_equal(now.state, JOB_SUCCESSFUL);
        assert_int_equal(db_job_load(room.db, now.id, &row, &problem), STATUS_OK);
        assert_int_equal(row.state, JOB_SUCCESSFUL);
        assert_string_equal(row.result, now.result);
        job_row_clear(&row);
        job_view_clear(&now);
        job_unref(jobs[i]);
    }
    JobRows rows;
    const JobSearch all = job_search_all(100);
    assert_int_equal(db_job_search(room.db, &all, &rows, &problem), STATUS_OK);
    assert_int_equal(rows.count, 4);
    job_rows_clear(&rows);
    room_end(&room);
}

static void whoever_waits_for_a_job_to_be_kept_is_woken(void **state) {
    (void)state;
    Room room = room_make(1);
    static atomic_int wakes;
    const Callback callback = {&wakes, note_wake};
    Job *job = submit_unkept(&room, 0.015, 20000);
    assert_true(job_subscribe_durable(job, &callback));
    assert_int_equal(wait_until_kept(job, &problem), STATUS_OK);
    assert_int_equal(atomic_load(&wakes), 1);
    assert_false(job_is_finished(job));
    assert_true(job_subscribe_durable(job, &callback)); // at once
    assert_int_equal(atomic_load(&wakes), 2);
    job_unref(job);
    room_end(&room);
}

static void a_job_may_outlive_the_intake(void **state) {
    (void)state;
    Room room = room_make(1);
    static atomic_int wakes;
    const Callback callback = {&wakes, note_wake};
    Job *running = submit(&room, 0.015, 20000), *queued = submit(&room, 0.016, 20000);
    assert_true(job_subscribe(queued, &callback));
    room_close(&room);
    JobView now = show(queued);
    assert_int_equal(now.state, JOB_ACCEPTED);
    assert_false(job_is_finished(running));
    job_unsubscribe(queued, &callback);
    job_view_clear(&now);
    job_unref(running);
    job_unref(queued);
    room_open(&room);
    room_end(&room);
}

static void *dismiss_it(void *context) {
    void **both = context;
    Job *dismissed = NULL;
    const Status status = jobs_cancel(both[0], both[1], &dismissed, NULL);
    job_unref(dismissed);
    return status == STATUS_OK ? both : NULL;
}

static void a_dismissed_job_is_dismissed_for_all_before_the_store_has_it(void **state) {
    (void)state;
    Room room = room_make(1);
    Job *blocker = submit(&room, 0.001, 20000), *job = submit(&room, 0.015, 20000), *found = NULL;
    JobView now = show(job);
    char path[128];
    Sqlite *other;
    pthread_t thread;
    void *returned;
    snprintf(path, sizeof path, "%s/impactd.db", room.directory);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &other, &problem), STATUS_OK);
    assert_int_equal(sqlite_execute(other, "BEGIN IMMEDIATE", &problem), STATUS_OK);
    assert_int_equal(pthread_create(&thread, NULL, dismiss_it, (void *[]){room.manager, now.id}),
                     0);
    wait_for(job);
    assert_int_equal(jobs_find(room.manager, now.id, &found, &problem), STATUS_OK);
    assert_true(job_is_finished(found));
    job_unref(found);
    assert_int_equal(jobs_cancel(room.manager, now.id, &found, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "dismissed already"));
    assert_int_equal(sqlite_execute(other, "ROLLBACK", &problem), STATUS_OK);
    sqlite_close(other);
    pthread_join(thread, &returned);
    assert_non_null(returned);
    assert_int_equal(jobs_find(room.manager, now.id, &found, &problem), STATUS_OK);
    assert_true(job_is_finished(found));
    job_unref(found);
    job_view_clear(&now);
    job_unref(job);
    job_unref(blocker);
    room_end(&room);
}

static void waiting_scenes_have_a_limit_in_bytes(void **state) {
    (void)state;
    Room room = room_make(1);
    room_close(&room);
    room.settings.queue_bytes = 2000;
    room_open(&room);
    Job *first = submit(&room, 0.015, 20000), *second = NULL, *gone = NULL;
    char text[1024];
    Status status = STATUS_OK;
    int accepted = 1;
    for (; accepted < 10 && status == STATUS_OK; accepted++) {
        scene_text(text, 0.001 * accepted, 20000, "sponge");
        problem_clear(&problem);
        status = submit_text(room.manager, text, &second, &problem);
        if (status == STATUS_OK && accepted > 1)
            job_unref(second);
        else if (status == STATUS_OK)
            gone = second;
    }
    assert_int_equal(status, STATUS_BUSY);
    assert_true(accepted > 2 && accepted < 8);
    // What leaves makes room.
    JobView now = show(gone);
    job_unref(gone);
    assert_int_equal(jobs_cancel(room.manager, now.id, &gone, &problem), STATUS_OK);
    job_unref(gone);
    job_view_clear(&now);
    assert_int_equal(submit_text(room.manager, text, &second, &problem), STATUS_OK);
    job_unref(second);
    job_unref(first);
    room_end(&room);
}

int main(void) {
    fft_start();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_job_finishes_and_is_found_again),
        cmocka_unit_test(a_known_scene_computes_nothing),
        cmocka_unit_test(equal_scenes_in_flight_share_a_computation),
        cmocka_unit_test(a_dismissed_job_stops_and_stays_dismissed),
        cmocka_unit_test(a_full_queue_refuses),
        cmocka_unit_test(unfinished_jobs_go_on_after_a_restart),
        cmocka_unit_test(a_series_that_is_gone_is_computed_again_with_the_same_bytes),
        cmocka_unit_test(a_failing_job_says_why),
        cmocka_unit_test(a_studys_answer_is_kept_with_the_result_of_its_scene),
        cmocka_unit_test(a_study_is_stopped_with_its_job_and_goes_on_after_a_restart),
        cmocka_unit_test(names_are_resolved_and_all_faults_told),
        cmocka_unit_test(a_cached_scene_is_answered_with_a_job_of_its_own),
        cmocka_unit_test(a_dear_series_is_kept_and_outlasts_its_engine),
        cmocka_unit_test(many_clients_at_once_leave_nothing_behind),
        cmocka_unit_test_teardown(a_result_that_there_is_no_room_for_waits_for_it, lift_limit),
        cmocka_unit_test_teardown(
            a_result_that_there_is_no_room_for_is_computed_again_after_a_restart, lift_limit),
        cmocka_unit_test_teardown(a_job_that_cannot_be_kept_never_was, lift_limit),
        cmocka_unit_test(a_job_that_is_done_before_it_was_written_is_written_once),
        cmocka_unit_test(whoever_waits_for_a_job_to_be_kept_is_woken),
        cmocka_unit_test(a_job_may_outlive_the_intake),
        cmocka_unit_test(a_dismissed_job_is_dismissed_for_all_before_the_store_has_it),
        cmocka_unit_test(waiting_scenes_have_a_limit_in_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
