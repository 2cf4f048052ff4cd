// A record's deletion beside the jobs that name it, and those that do not.
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "server/db/records.h"
#include "server/jobs/jobs_private.h"
#include "tests/support/scratch.h"

static Problem problem;
static char folder[SCRATCH_SIZE];
static Db *db;
static JobManager *manager;

static int set_up(void **state) {
    (void)state;
    const JobManagerSettings settings = {
        .workers = 1, .queue_most = 1000, .cache_bytes = (size_t)64 << 20};
    double values[] = {1, -2, 2};
    const Reals samples = {values, 3};
    char digest[RECORD_DIGEST_SIZE];
    bool is_there;
    record_digest(0.02, &samples, digest);
    const RecordRow row = {.name = "a",
                           .layout = "json",
                           .unit = "m/s^2",
                           .interval = 0.02,
                           .count = 3,
                           .digest = digest};
    scratch_make(folder);
    problem_clear(&problem);
    return db_open(folder, &db, &problem) == STATUS_OK &&
                   db_record_add(db, &row, &samples, &is_there, &problem) == STATUS_OK &&
                   jobs_open(db, &settings, &manager, &problem) == STATUS_OK
               ? 0
               : 1;
}

static int tear_down(void **state) {
    (void)state;
    jobs_close(manager);
    db_close(db);
    scratch_remove(folder);
    return 0;
}

// One that takes long.
static Job *submit(const char *excitation) {
    char text[512];
    Job *job = NULL;
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"dampers\": [{\"mass\": 0.1, "
             "\"clearance\": 0.01, \"buffer\": \"sponge\"}], \"duration\": 20000, "
             "\"sample_rate\": 100, \"excitation\": {%s}, \"output\": {\"channels\": [], "
             "\"psd\": null}, \"accuracy\": {\"solver\": \"rk4\", \"step\": 1e-4}}",
             excitation);
    const Submission submission = {.text = text, .size = strlen(text)};
    problem_clear(&problem);
    if (jobs_submit(manager, &submission, &job, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return job;
}

static void dismiss(Job *job) {
    JobView now;
    Job *same;
    assert_int_equal(job_view(job, &now), STATUS_OK);
    assert_int_equal(jobs_cancel(manager, now.id, &same, &problem), STATUS_OK);
    job_view_clear(&now);
    job_unref(same);
    job_unref(job);
}

static void a_scene_that_names_none_is_accepted_meanwhile(void **state) {
    (void)state;
    naming_close(&manager->naming);
    Job *job = submit("\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 1"); // would hang
    naming_open(&manager->naming);
    dismiss(job);
}

static void a_job_that_waits_keeps_its_record_but_not_in_memory(void **state) {
    (void)state;
    NamedRecord *named;
    Job *first = submit("\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 2");
    const struct timespec moment = {0, 1000000};
    double progress;
    for (int i = 0; i < 60000 && job_peek(first, &progress) != JOB_RUNNING; i++)
        nanosleep(&moment, NULL);
    Job *second = submit("\"kind\": \"record\", \"name\": \"a\"");
    assert_int_equal(db_record_named(db, "a", &named, &problem), STATUS_OK);
    // The memory's and ours.
    assert_int_equal(atomic_load(&named->shared.count), 2);
    refcount_unref(&named->shared);
    assert_int_equal(jobs_record_delete(manager, "a", &problem), STATUS_CONFLICT);
    assert_non_null(strstr(problem.detail, "0 results and 1 unfinished job:"));
    dismiss(second);
    problem_clear(&problem);
    assert_int_equal(jobs_record_delete(manager, "a", &problem), STATUS_OK);
    dismiss(first);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_scene_that_names_none_is_accepted_meanwhile, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(a_job_that_waits_keeps_its_record_but_not_in_memory, set_up,
                                        tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
