// What the jobs room offers its clients: quotas, keys, deletion, retention, and quick jobs beside
// slow ones.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/jobs/jobs.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

typedef struct Room {
    char directory[SCRATCH_SIZE];
    Db *db;
    JobManager *manager;
    JobManagerSettings settings;
} Room;

static Problem problem;
static const struct timespec moment = {0, 1000000};

static void room_open(Room *room) {
    problem_clear(&problem);
    if (db_open(room->directory, &room->db, &problem) != STATUS_OK ||
        jobs_open(room->db, &room->settings, &room->manager, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static void room_close(Room *room) {
    jobs_close(room->manager);
    db_close(room->db);
}

static Room room_make(size_t workers, size_t quota, double rate) {
    Room room = {.settings = {.workers = workers,
                              .queue_most = 1000,
                              .cache_bytes = 1 << 24,
                              .quota = quota,
                              .rate = rate,
                              .limits = {.samples = 1 << 25, .impacts = 1 << 20}}};
    scratch_make(room.directory);
    room_open(&room);
    return room;
}

static void room_end(Room *room) {
    room_close(room);
    scratch_remove(room->directory);
}

// [s] of a scene that no test lives to see the end of: billions of steps.
static const double endless = 1e5;

static Status send(Room *room, const char *client, const char *key, double displacement,
                   double duration, Job **job, bool *is_replayed) {
    char text[1024];
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},"
             " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],"
             " \"excitation\": {\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 1, "
             "\"displacement\": %.17g},"
             " \"duration\": %.17g, \"sample_rate\": %d, \"accuracy\": {%s},"
             " \"output\": {\"channels\": [\"displacement\"], \"psd\": {\"channels\": []}}}",
             displacement, duration, duration < endless ? 1000 : 1,
             duration < endless ? "" : "\"solver\": \"rk4\", \"step\": 1e-6");
    const Submission submission = {.text = text,
                                   .size = strlen(text),
                                   .client = client,
                                   .idempotency_key = key,
                                   .is_replayed = is_replayed};
    problem_clear(&problem);
    return jobs_submit(room->manager, &submission, job, &problem);
}

static void wait_for(Job *job) {
    bool is_kept = false;
    for (int i = 0; i < 60000 && !(job_is_finished(job) && is_kept); i++) {
        nanosleep(&moment, NULL);
        assert_int_equal(job_is_durable(job, &is_kept, &problem), STATUS_OK);
    }
    assert_true(job_is_finished(job));
}

static void dismiss(Room *room, Job *job) {
    JobView now;
    Job *same;
    assert_int_equal(job_view(job, &now), STATUS_OK);
    assert_int_equal(jobs_cancel(room->manager, now.id, &same, &problem), STATUS_OK);
    wait_for(same);
    job_view_clear(&now);
    job_unref(same);
    job_unref(job);
}

TEST(a_token_has_no_more_unfinished_jobs_than_its_quota) {
    Room room = room_make(1, 2, 0);
    Job *jobs[3], *more;
    assert_int_equal(send(&room, "ann", NULL, 0.010, endless, &jobs[0], NULL), STATUS_OK);
    assert_int_equal(send(&room, "ann", NULL, 0.011, endless, &jobs[1], NULL), STATUS_OK);
    assert_int_equal(send(&room, "ann", NULL, 0.012, endless, &more, NULL), STATUS_QUOTA);
    assert_non_null(strstr(problem.detail, "\"ann\" has 2 unfinished jobs, 2 are allowed"));
    assert_in_range(jobs_retry_after(room.manager, "ann", STATUS_QUOTA), 1, 3600);
    assert_int_equal(send(&room, "bob", NULL, 0.012, endless, &jobs[2], NULL), STATUS_OK);
    for (double at = 0.02; at < 0.025; at += 0.001) { // nobody in particular has none
        assert_int_equal(send(&room, NULL, NULL, at, endless, &more, NULL), STATUS_OK);
        dismiss(&room, more);
    }
    dismiss(&room, jobs[1]);
    assert_int_equal(send(&room, "ann", NULL, 0.013, endless, &jobs[1], NULL), STATUS_OK);
    for (size_t i = 0; i < 3; i++)
        dismiss(&room, jobs[i]);
    room_end(&room);
}

TEST(a_quota_counts_the_jobs_of_an_earlier_life) {
    Room room = room_make(1, 1, 0);
    Job *job, *more;
    bool is_kept = false;
    assert_int_equal(send(&room, "ann", NULL, 0.010, endless, &job, NULL), STATUS_OK);
    job_save(job);
    while (!is_kept)
        assert_int_equal(job_is_durable(job, &is_kept, &problem), STATUS_OK);
    job_unref(job);
    room_close(&room);
    room_open(&room);
    assert_int_equal(send(&room, "ann", NULL, 0.011, endless, &more, NULL), STATUS_QUOTA);
    assert_int_equal(send(&room, "bob", NULL, 0.011, endless, &more, NULL), STATUS_OK);
    job_unref(more);
    room_end(&room);
}

TEST(a_token_sends_no_more_than_its_rate) {
    Room room = room_make(1, 0, 3);
    Job *job;
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(send(&room, "ann", NULL, 0.015, 1, &job, NULL), STATUS_OK);
        wait_for(job);
        job_unref(job);
    }
    assert_int_equal(send(&room, "ann", NULL, 0.015, 1, &job, NULL), STATUS_QUOTA);
    // One every 20 s.
    assert_in_range(jobs_retry_after(room.manager, "ann", STATUS_QUOTA), 1, 20);
    assert_int_equal(send(&room, "bob", NULL, 0.015, 1, &job, NULL), STATUS_OK);
    job_unref(job);
    room_end(&room);
}

TEST(keys_are_each_clients_own) {
    Room room = room_make(1, 0, 0);
    Job *ann, *again, *bob, *nobody;
    bool is_replayed = true;
    assert_int_equal(send(&room, "ann", "k", 0.015, 1, &ann, &is_replayed), STATUS_OK);
    assert_false(is_replayed);
    assert_int_equal(send(&room, "ann", "\"k\"", 0.015, 1, &again, &is_replayed), STATUS_OK);
    assert_true(is_replayed);
    JobView first, second;
    assert_int_equal(job_view(ann, &first), STATUS_OK);
    assert_int_equal(job_view(again, &second), STATUS_OK);
    assert_string_equal(first.id, second.id);
    assert_int_equal(send(&room, "bob", "k", 0.016, 1, &bob, &is_replayed), STATUS_OK);
    assert_false(is_replayed);
    assert_int_equal(send(&room, NULL, "k", 0.017, 1, &nobody, &is_replayed), STATUS_OK);
    assert_false(is_replayed);
    wait_for(ann);
    job_unref(again);
    assert_int_equal(send(&room, "ann", "k", 0.016, 1, &again, &is_replayed), STATUS_REUSED);
    job_view_clear(&first);
    job_view_clear(&second);
    job_unref(ann);
    job_unref(bob);
    job_unref(nobody);
    room_end(&room);
}

TEST(a_key_that_is_none_is_refused) {
    Room room = room_make(1, 0, 0);
    char longest[300];
    memset(longest, 'k', sizeof longest);
    longest[256] = '\0';
    const char *const bad[] = {"", "\"\"", "a\"b", "a\\b", "a\tb", "\xc3\xa4", longest};
    Job *job;
    for (size_t i = 0; i < COUNT(bad); i++) {
        assert_int_equal(send(&room, NULL, bad[i], 0.015, 1, &job, NULL), STATUS_USAGE);
        assert_null(job);
    }
    longest[255] = '\0';
    assert_int_equal(send(&room, NULL, longest, 0.015, 1, &job, NULL), STATUS_OK);
    wait_for(job);
    job_unref(job);
    room_end(&room);
}

TEST(quick_jobs_go_beside_slow_ones_that_have_every_worker) {
    Room room = room_make(2, 0, 0);
    Job *slow[5], *quick;
    for (size_t i = 0; i < 5; i++)
        assert_int_equal(send(&room, NULL, NULL, 0.01 + 0.001 * (double)i, endless, &slow[i], NULL),
                         STATUS_OK);
    assert_int_equal(send(&room, NULL, NULL, 0.02, 1, &quick, NULL), STATUS_OK);
    wait_for(quick);
    size_t unfinished = 0;
    for (size_t i = 0; i < 5; i++)
        unfinished += !job_is_finished(slow[i]);
    assert_true(unfinished >= 2);
    job_unref(quick);
    for (size_t i = 0; i < 5; i++)
        job_unref(slow[i]);
    room_end(&room);
}

TEST(a_deleted_result_is_known_no_more) {
    Room room = room_make(1, 0, 0);
    Job *job, *found;
    assert_int_equal(send(&room, NULL, NULL, 0.015, 1, &job, NULL), STATUS_OK);
    wait_for(job);
    JobView now, later;
    assert_int_equal(job_view(job, &now), STATUS_OK);
    assert_int_equal(jobs_delete(room.manager, now.result, &problem), STATUS_OK);
    problem_clear(&problem);
    assert_int_equal(jobs_delete(room.manager, now.result, &problem), STATUS_NOT_FOUND);
    assert_int_equal(jobs_find(room.manager, now.id, &found, NULL), STATUS_OK);
    assert_int_equal(job_view(found, &later), STATUS_OK);
    assert_true(later.is_result_deleted);
    job_view_clear(&later);
    job_unref(found);
    assert_int_equal(send(&room, NULL, NULL, 0.015, 1, &found, NULL), STATUS_OK);
    wait_for(found);
    assert_int_equal(job_view(found, &later), STATUS_OK);
    assert_false(later.is_cached);
    assert_string_equal(later.result, now.result);
    job_view_clear(&later);
    job_view_clear(&now);
    job_unref(found);
    job_unref(job);
    room_end(&room);
}

static size_t count_jobs(Db *db) {
    JobRows rows;
    const JobSearch all = job_search_all(1000);
    assert_int_equal(db_job_search(db, &all, &rows, &problem), STATUS_OK);
    const size_t count = rows.count;
    job_rows_clear(&rows);
    return count;
}

TEST(what_is_beyond_the_rules_goes_in_small_steps_and_no_more_than_that) {
    Room room = room_make(1, 0, 0);
    Job *job;
    Removed removed;
    for (size_t i = 0; i < 200; i++) {
        // Each scene twice.
        assert_int_equal(send(&room, NULL, NULL, 0.001 * (double)(i / 2 + 1), 0.5, &job, NULL),
                         STATUS_OK);
        wait_for(job);
        job_unref(job);
    }
    const JobRow unfinished = {.id = "j-0", .scene = "{}", .warnings = "[]", .created_unix_ms = 1};
    assert_int_equal(db_job_add(room.db, &unfinished, &problem), STATUS_OK);
    const KeepRules none = {0}, jobs = {.jobs = 31}, days = {.days = 1000}, bytes = {.bytes = 1};
    assert_int_equal(db_remove(room.db, &none, &removed, &problem), STATUS_OK);
    assert_false(removed.is_more);
    assert_int_equal(db_remove(room.db, &days, &removed, &problem), STATUS_OK);
    assert_false(removed.is_more);
    size_t steps = 0, results = 0;
    do {
        assert_int_equal(db_remove(room.db, &jobs, &removed, &problem), STATUS_OK);
        assert_true(removed.jobs <= RETENTION_BATCH);
        results += removed.results;
    } while (removed.is_more && ++steps < 100);
    assert_int_equal(count_jobs(room.db), 31 + 1);
    assert_int_equal(results, 84); // of 169 jobs; the last one's result is named by one that stays
    for (steps = 0; steps < 100; steps++) {
        assert_int_equal(db_remove(room.db, &bytes, &removed, &problem), STATUS_OK);
        if (removed.jobs == 0)
            break;
    }
    assert_int_equal(count_jobs(room.db), 1); // what is unfinished stays
    room_end(&room);
}
