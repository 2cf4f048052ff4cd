// The jobs room with the real engine and a real database: nothing lost, nothing twice, one state at
// the end.
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "server/db/sqlite.h"
#include "server/jobs/jobs.h"
#include "server/jobs/jobs_private.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

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

// The jobs are unreferenced before the manager is freed.
static void room_close_jobs(Room *room, Job *job) {
    jobs_stop(room->manager);
    job_unref(job);
    room_close(room);
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
    job_save(job);
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

static void note_wake(void *context) {
    atomic_fetch_add((atomic_int *)context, 1);
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
            own->dismissed +=
                jobs_cancel(own->room->manager, now.row.id, &gone, fault) == STATUS_OK;
        (void)job_subscribe(job, JOB_IS_FINISHED, &callback);
        job_unsubscribe(job, &callback);
        while (!job_is_finished(job))
            nanosleep(&(struct timespec){0, 200000}, NULL);
        job_view_clear(&now);
        if (job_view(job, &now) == STATUS_OK && now.row.state == JOB_SUCCESSFUL)
            (void)jobs_outcome(own->room->manager, now.row.result, &callback, &outcome, fault);
        own->finished++;
        outcome_unref(outcome);
        job_view_clear(&now);
        job_unref(job);
        job_unref(gone);
    }
    free(fault);
    return NULL;
}

TEST(many_clients_at_once_leave_nothing_behind) {
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
        jobs_stats(room->manager, &metrics);
        pthread_mutex_lock(&room->manager->lock);
        is_idle = metrics.queued + metrics.running + room->manager->writes == 0;
        pthread_mutex_unlock(&room->manager->lock);
    }
    assert_true(is_idle);
}

// [s], long enough that it still runs when there is no room any more; instrumented code takes many
// times as long.
enum { LONG = IMPACTD_SANITIZED ? 4000 : 20000 };

TEST_IN(a_result_that_there_is_no_room_for_waits_for_it, NULL, lift_limit) {
    Room room = room_make(1);
    signal(SIGXFSZ, SIG_IGN);
    Job *job = submit(&room, 0.015, LONG), *dropped = submit(&room, 0.016, LONG);
    limit_files(1);
    wait_until_idle(&room);
    jobs_retry_writes(room.manager);
    wait_until_idle(&room);
    JobView waits = show(job), gone = show(dropped);
    assert_int_equal(waits.row.state, JOB_RUNNING);
    Job *dismissed;
    assert_int_equal(jobs_cancel(room.manager, gone.row.id, &dismissed, &problem), STATUS_OK);
    assert_int_equal(wait_until_kept(dismissed, &problem), STATUS_FULL);
    job_unref(dismissed);
    limit_files(RLIM_INFINITY);
    jobs_retry_writes(room.manager);
    wait_until_idle(&room);
    assert_true(job_is_finished(job));
    JobView now = show(job);
    assert_int_equal(now.row.state, JOB_SUCCESSFUL);
    assert_true(db_result_exists(room.db, now.row.result));
    assert_int_equal(wait_until_kept(dropped, &problem), STATUS_OK);
    JobView end = show(dropped);
    assert_int_equal(end.row.state, JOB_DISMISSED);
    job_view_clear(&end);
    job_view_clear(&waits);
    job_view_clear(&gone);
    job_view_clear(&now);
    job_unref(job);
    job_unref(dropped);
    room_end(&room);
}

TEST_IN(a_job_that_cannot_be_kept_never_was, NULL, lift_limit) {
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
        assert_int_equal(jobs_find(room.manager, now.row.id, &found, &problem), STATUS_NOT_FOUND);
        assert_false(db_result_exists(room.db, now.row.result));
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
        jobs_stats(room.manager, &metrics);
    } while (metrics.queued + metrics.running > 0);
    room_end(&room);
}

TEST(a_job_is_saved_when_that_is_asked_for_and_its_subscribers_are_called) {
    Room room = room_make(1);
    static atomic_int wakes;
    const Callback callback = {&wakes, note_wake};
    Job *job = submit_unkept(&room, 0.015, 20000);
    assert_true(job_subscribe(job, JOB_IS_DURABLE, &callback));
    assert_int_equal(atomic_load(&wakes), 0); // it is not saved before it is asked for
    assert_int_equal(wait_until_kept(job, &problem), STATUS_OK);
    assert_int_equal(atomic_load(&wakes), 1);
    assert_false(job_is_finished(job));
    assert_true(job_subscribe(job, JOB_IS_DURABLE, &callback)); // at once
    assert_int_equal(atomic_load(&wakes), 2);
    job_unref(job);
    room_end(&room);
}

static void *dismiss_it(void *context) {
    void **both = context;
    Job *dismissed = NULL;
    const Status status = jobs_cancel(both[0], both[1], &dismissed, NULL);
    job_unref(dismissed);
    return status == STATUS_OK ? both : NULL;
}

TEST(a_dismissed_job_is_dismissed_for_all_before_the_store_has_it) {
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
    assert_int_equal(
        pthread_create(&thread, NULL, dismiss_it, (void *[]){room.manager, now.row.id}), 0);
    wait_for(job);
    assert_int_equal(jobs_find(room.manager, now.row.id, &found, &problem), STATUS_OK);
    assert_true(job_is_finished(found));
    job_unref(found);
    assert_int_equal(jobs_cancel(room.manager, now.row.id, &found, &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "dismissed already"));
    assert_int_equal(sqlite_execute(other, "ROLLBACK", &problem), STATUS_OK);
    sqlite_close(other);
    pthread_join(thread, &returned);
    assert_non_null(returned);
    assert_int_equal(jobs_find(room.manager, now.row.id, &found, &problem), STATUS_OK);
    assert_true(job_is_finished(found));
    job_unref(found);
    job_view_clear(&now);
    job_unref(job);
    job_unref(blocker);
    room_end(&room);
}

TEST(a_job_that_is_dismissed_while_it_is_inserted_is_dismissed_in_the_store) {
    Room room = room_make(1);
    Job *job = submit_unkept(&room, 0.015, 20000), *found = NULL;
    JobView now = show(job);
    char path[128];
    Sqlite *other;
    JobStats stats;
    snprintf(path, sizeof path, "%s/impactd.db", room.directory);
    assert_int_equal(sqlite_open(path, DATABASE_WRITER, &other, &problem), STATUS_OK);
    assert_int_equal(sqlite_execute(other, "BEGIN IMMEDIATE", &problem), STATUS_OK);
    job_save(job);
    assert_int_equal(jobs_cancel(room.manager, now.row.id, &found, &problem), STATUS_OK);
    assert_ptr_equal(found, job);
    job_unref(found);
    assert_true(job_is_finished(job));
    assert_int_equal(sqlite_execute(other, "ROLLBACK", &problem), STATUS_OK);
    sqlite_close(other);
    assert_int_equal(wait_until_kept(job, &problem), STATUS_OK);
    jobs_stats(room.manager, &stats);
    assert_int_equal(stats.unfinished, 0);
    room_close_jobs(&room, job);
    room_open(&room);
    assert_int_equal(jobs_find(room.manager, now.row.id, &job, &problem), STATUS_OK);
    job_view_clear(&now);
    now = show(job);
    assert_int_equal(now.row.state, JOB_DISMISSED);
    job_view_clear(&now);
    room_close_jobs(&room, job);
    scratch_remove(room.directory);
}

TEST(a_manager_that_stops_computes_nothing_more) {
    Room room = room_make(1);
    static atomic_int wakes;
    const Callback callback = {&wakes, note_wake};
    char text[1024];
    Outcome *outcome = NULL;
    Job *job = submit(&room, 0.015, 1), *none = NULL;
    wait_for(job);
    JobView now = show(job);
    room_close_jobs(&room, job);
    room_open(&room); // with nothing in memory
    jobs_stop(room.manager);
    scene_text(text, 0.02, 1, "sponge");
    assert_int_equal(submit_text(room.manager, text, &none, &problem), STATUS_BUSY);
    assert_non_null(strstr(problem.detail, "stopping"));
    assert_null(none);
    problem_clear(&problem);
    assert_int_equal(jobs_outcome(room.manager, now.row.result, &callback, &outcome, &problem),
                     STATUS_BUSY);
    assert_non_null(strstr(problem.detail, "cannot be computed now"));
    assert_null(outcome);
    assert_int_equal(atomic_load(&wakes), 0);
    job_view_clear(&now);
    room_end(&room);
}

TEST(only_so_many_bytes_of_scenes_wait) {
    enum { MOST = 20 };
    Room room = room_make(1);
    Job *jobs[MOST + 1] = {NULL}, *found;
    char text[1024];
    Status status = STATUS_OK;
    size_t count = 0;
    room_close(&room);
    room.settings.queue_bytes = 4000;
    room_open(&room);
    for (; status == STATUS_OK; count += status == STATUS_OK) {
        assert_in_range(count, 0, MOST);
        scene_text(text, 0.01 + 1e-4 * (double)count, 20000, "sponge");
        status = submit_text(room.manager, text, &jobs[count], &problem);
    }
    assert_int_equal(status, STATUS_BUSY);
    assert_non_null(strstr(problem.detail, "bytes of scenes wait, 4000 are allowed"));
    assert_in_range(count, 2, MOST);
    JobView last = show(jobs[count - 1]);
    assert_int_equal(jobs_cancel(room.manager, last.row.id, &found, NULL), STATUS_OK);
    job_unref(found);
    job_view_clear(&last);
    assert_int_equal(submit_text(room.manager, text, &jobs[count], &problem), STATUS_OK);
    jobs_stop(room.manager);
    for (size_t i = 0; i <= count; i++)
        job_unref(jobs[i]);
    room_end(&room);
}

TEST(who_is_refused_waits_for_the_end_of_a_study) {
    Room room = room_make(1);
    char text[1024];
    Job *job = NULL;
    scene_text(text, 0.015, 1000, "sponge");
    snprintf(strrchr(text, '}'), 200,
             ", \"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": "
             "\"/dampers/0/clearance\", \"from\": 0.01, \"to\": 0.02, \"count\": 100000}]}}");
    const Submission submission = {.text = text, .size = strlen(text)};
    room_close(&room);
    room.settings.study_seconds = 0;
    room_open(&room);
    assert_int_equal(jobs_submit(room.manager, &submission, &job, &problem), STATUS_OK);
    pthread_mutex_lock(&room.manager->lock);
    while (room.manager->studies == NULL) {
        pthread_mutex_unlock(&room.manager->lock);
        nanosleep(&moment, NULL);
        pthread_mutex_lock(&room.manager->lock);
    }
    pthread_mutex_unlock(&room.manager->lock);
    // Once there is some progress: a turn of it alone is over in a moment.
    int seconds = 1;
    for (int i = 0; i < 60000 && seconds < 5; i++, nanosleep(&moment, NULL))
        seconds = jobs_retry_after(room.manager, NULL, STATUS_BUSY);
    assert_in_range(seconds, 5, 3600);
    jobs_stop(room.manager);
    job_unref(job);
    room_end(&room);
}

TEST(only_the_failed_points_of_a_sweep_are_made_again) {
    Room room = room_make(1);
    Job *job = submit(&room, 0.015, 1), *again = NULL;
    wait_for(job);
    JobView now = show(job);
    Submission submission = {.retry_of = "j-0000000000000000"};
    assert_int_equal(jobs_submit(room.manager, &submission, &again, &problem), STATUS_NOT_FOUND);
    assert_null(again);
    submission.retry_of = now.row.id; // without a sweep
    problem_clear(&problem);
    assert_int_equal(jobs_submit(room.manager, &submission, &again, &problem), STATUS_NOT_FOUND);
    assert_non_null(strstr(problem.detail, "sweep"));
    assert_null(again);
    job_view_clear(&now);
    room_close_jobs(&room, job);
    scratch_remove(room.directory);
}

TEST(labels_and_title_of_a_live_job_are_set_each_alone) {
    Room room = room_make(1);
    Job *job = submit(&room, 0.015, 20000);
    JobView now = show(job);
    char *names[] = {(char *)"one", (char *)"two"};
    const Texts labels = {names, 2}, none = {NULL, 0};
    char id[40];
    memcpy(id, now.row.id, sizeof id);
    job_view_clear(&now);
    static const char *const titles[] = {NULL, "a title", NULL, ""};
    const Texts *const given[] = {&labels, NULL, &none, NULL};
    static const char *const shown[][2] = {{NULL, "[\"one\", \"two\"]"},
                                           {"a title", "[\"one\", \"two\"]"},
                                           {"a title", NULL},
                                           {NULL, NULL}};
    for (size_t i = 0; i < COUNT(titles); i++) {
        assert_int_equal(jobs_annotate(room.manager, id, titles[i], given[i], &problem), STATUS_OK);
        now = show(job);
        assert_true(text_same(now.row.title, shown[i][0]));
        assert_true(text_same(now.row.labels, shown[i][1]));
        job_view_clear(&now);
    }
    room_close_jobs(&room, job);
    scratch_remove(room.directory);
}

TEST(only_ids_of_jobs_have_a_time) {
    static const char *const wrong[] = {"",
                                        "j-",
                                        "r-0006439e5f2c00000123456789abcdef",
                                        "j-0006439e5f2c00000123456789abcde",
                                        "j-0006439e5f2c00000123456789abcdeg",
                                        "j-0006439e5f2c00000123456789abcdef0"};
    char id[40];
    assert_true(job_id_make(id));
    assert_true(job_id_unix_ms(id) > 1600000000000);
    for (size_t i = 0; i < COUNT(wrong); i++)
        assert_int_equal(job_id_unix_ms(wrong[i]), -1);
}

static size_t count_rows(Room *room) {
    JobRows rows;
    const JobSearch all = job_search_all(100);
    assert_int_equal(db_job_search(room->db, &all, &rows, &problem), STATUS_OK);
    const size_t count = rows.count;
    job_rows_clear(&rows);
    return count;
}

TEST(a_job_is_written_once_with_its_result) {
    Room room = room_make(1);
    const uint64_t before = counter_get(&db_stats(room.db)->writes);
    Job *job = submit_unkept(&room, 0.015, 1);
    wait_for(job);
    bool is_durable;
    assert_int_equal(job_is_durable(job, &is_durable, &problem), STATUS_OK);
    assert_true(is_durable);
    assert_int_equal(counter_get(&db_stats(room.db)->writes), before + 1);
    assert_int_equal(count_rows(&room), 1);
    job_unref(job);
    // Unfinished and not asked for, it is in no list, and is not resumed.
    job = submit_unkept(&room, 0.016, 20000);
    assert_int_equal(count_rows(&room), 1);
    room_close_jobs(&room, job);
    room_open(&room);
    assert_int_equal(count_rows(&room), 1);
    room_end(&room);
}

TEST(quick_jobs_go_beside_slow_ones_that_have_every_worker) {
    Room room = room_make(2);
    Job *slow[5];
    for (size_t i = 0; i < COUNT(slow); i++)
        slow[i] = submit(&room, 0.001 * (double)(i + 1), 30000);
    Job *quick = submit(&room, 0.02, 1);
    wait_for(quick);
    size_t unfinished = 0;
    for (size_t i = 0; i < COUNT(slow); i++) {
        unfinished += !job_is_finished(slow[i]);
        job_unref(slow[i]);
    }
    assert_true(unfinished >= 2);
    job_unref(quick);
    room_end(&room);
}

TEST(running_jobs_share_one_budget_of_memory) {
    Room room = room_make(2);
    room_close(&room);
    room.settings.memory_bytes = 1 << 20; // less than any of these takes
    room_open(&room);
    Job *jobs[3];
    for (size_t i = 0; i < 3; i++)
        jobs[i] = submit(&room, 0.001 * (double)(i + 1), 20000);
    for (int i = 0; i < 30; i++)
        nanosleep(&moment, NULL);
    JobStats stats;
    jobs_stats(room.manager, &stats);
    assert_int_equal(stats.running, 1);
    for (size_t i = 0; i < 3; i++) { // in turn, whether they run or wait
        JobView now = show(jobs[i]);
        Job *cancelled;
        if (jobs_cancel(room.manager, now.row.id, &cancelled, &problem) == STATUS_OK) {
            assert_int_equal(wait_until_kept(cancelled, &problem), STATUS_OK);
            job_unref(cancelled);
        } else {
            assert_true(job_is_finished(jobs[i])); // while a slow disk kept us waiting
        }
        job_view_clear(&now);
        job_unref(jobs[i]);
        Job *small = submit(&room, 0.1 + 0.001 * (double)i, 0.1); // it is not counted
        wait_for(small);
        job_unref(small);
        for (int k = 0; i < 2 && k < 60000; k++) {
            now = show(jobs[i + 1]);
            const bool has_begun = now.row.state != JOB_ACCEPTED;
            job_view_clear(&now);
            if (has_begun)
                break;
            nanosleep(&moment, NULL);
            assert_true(k < 59999);
        }
    }
    room_end(&room);
}

#if !IMPACTD_SANITIZED
// The first growth of a list of pointers fails.
extern void *__libc_realloc(void *at, size_t size);
static atomic_bool lists_fail;

void *realloc(void *at, size_t size) {
    return atomic_load(&lists_fail) && at == NULL && size == sizeof(void *)
               ? NULL
               : __libc_realloc(at, size);
}

TEST(a_result_is_saved_without_memory_for_a_list) {
    Room room = room_make(1);
    Job *job = submit(&room, 0.015, 200);
    atomic_store(&lists_fail, true);
    for (int i = 0; i < 20000 && !job_is_finished(job); i++)
        nanosleep(&moment, NULL);
    atomic_store(&lists_fail, false);
    JobView now = show(job);
    assert_int_equal(now.row.state, JOB_SUCCESSFUL);
    job_view_clear(&now);
    job_unref(job);
    room_end(&room);
}
#endif
