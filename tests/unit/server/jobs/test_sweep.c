// Sweeps in the jobs room, with the real engine and a real database: cancelled, interrupted and
// resumed at any moment, beside other jobs.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "core/math/fourier.h"
#include "server/jobs/intake.h"
#include "server/jobs/sweep.h"
#include "server/jobs/sweep_rows.h"
#include "tests/support/scratch.h"

typedef struct Room {
    char directory[SCRATCH_SIZE];
    Store *store;
    Intake *intake;
    size_t workers;
} Room;

static Problem problem;

static void room_open(Room *room) {
    const IntakeSettings settings = {.workers = room->workers,
                                     .queue_most = 1000,
                                     .cache_bytes = 1 << 24,
                                     .limits = {.samples = 1 << 25, .impacts = 1 << 20}};
    problem_clear(&problem);
    if (store_open(room->directory, &room->store, &problem) != STATUS_OK ||
        intake_open(room->store, &settings, &room->intake, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static void room_close(Room *room) {
    intake_close(room->intake);
    store_close(room->store);
}

static Room room_make(size_t workers) {
    Room room = {.workers = workers};
    scratch_make(room.directory);
    room_open(&room);
    return room;
}

static void room_end(Room *room) {
    room_close(room);
    scratch_remove(room->directory);
}

static Job *submit(const Room *room, size_t points, double duration) {
    char text[1024];
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},"
             " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],"
             " \"excitation\": {\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 1},"
             " \"duration\": %.17g, \"sample_rate\": 1000, \"output\": {\"psd\": null},"
             " \"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": "
             "\"/dampers/0/clearance\", \"from\": 0.01, \"to\": 0.02, \"count\": %zu}]}}",
             duration, points);
    Job *job;
    const Submission submission = {.text = text, .size = strlen(text)};
    problem_clear(&problem);
    if (intake_submit(room->intake, &submission, &job, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return job;
}

static void nap(long ns) {
    const struct timespec time = {0, ns};
    nanosleep(&time, NULL);
}

static JobState state_of(const Room *room, const char *id, char result[72]) {
    Job *job;
    JobShow show;
    assert_int_equal(intake_find(room->intake, id, &job, NULL), STATUS_OK);
    assert_int_equal(job_show(job, &show), STATUS_OK);
    job_drop(job);
    const JobState state = show.state;
    text_fit(result, 72, show.result);
    job_show_clear(&show);
    return state;
}

static void finish(const Room *room, const char *id, char result[72]) {
    JobState state;
    while (!job_state_is_final((int)(state = state_of(room, id, result))))
        nap(2000000);
    assert_int_equal(state, JOB_SUCCESSFUL);
}

static void id_of(Job *job, char id[40]) {
    JobShow show;
    assert_int_equal(job_show(job, &show), STATUS_OK);
    text_fit(id, 40, show.id);
    job_show_clear(&show);
    job_drop(job);
}

static void assert_whole(const Room *room, const char *result, size_t points) {
    SweepShow show;
    assert_int_equal(sweep_show_load(room->store, result, false, true, &show, NULL), STATUS_OK);
    assert_true(show.is_complete);
    assert_int_equal(show.sweep->table.points.count, points);
    for (size_t i = 0; i < points; i++)
        assert_true(show.sweep->table.points.at[i] == (double)i);
    sweep_show_clear(&show);
}

static void rows_come_back_as_they_were_put(void **state) {
    (void)state;
    const SweepRow row = {.points = 10, .metrics = 2, .chunks = 4};
    assert_int_equal(sweep_rows_of(&row, 0), 3);
    assert_int_equal(sweep_rows_of(&row, 1), 3);
    assert_int_equal(sweep_rows_of(&row, 2), 2);
    assert_int_equal(sweep_rows_of(&row, 3), 2);
    unsigned char bytes[2 * 17];
    char reasons[] = "0 too fast\n12 other\n";
    SweepChunkRow chunk = {.rows = {bytes, sizeof bytes}, .reasons = reasons};
    const double values[] = {-0.1, (double)NAN};
    double read[2];
    sweep_row_put(&row, &chunk, 1, SWEEP_UNSTABLE, values);
    assert_int_equal(sweep_row_status(&row, &chunk, 1), SWEEP_UNSTABLE);
    sweep_row_values(&row, &chunk, 1, read);
    assert_true(read[0] == -0.1 && isnan(read[1]));
    assert_int_equal(sweep_row_status(&row, &chunk, 2), SWEEP_PENDING);
    char why[8];
    sweep_row_reason(&chunk, 0, why, sizeof why);
    assert_string_equal(why, "too fas");
    sweep_row_reason(&chunk, 1, why, sizeof why);
    assert_string_equal(why, "");
    sweep_row_reason(&chunk, 12, why, sizeof why);
    assert_string_equal(why, "other");
}

static void a_sweep_interrupted_again_and_again_comes_to_its_end(void **state) {
    (void)state;
    Room room = room_make(3);
    char id[40], result[72];
    enum { POINTS = 4000 };
    id_of(submit(&room, POINTS, 20), id);
    for (int i = 0; i < 6; i++) {
        nap(30000000L * (i + 1));
        room_close(&room);
        room_open(&room);
    }
    finish(&room, id, result);
    assert_whole(&room, result, POINTS);
    room_end(&room);
}

static void a_sweep_is_dismissed_at_any_moment_and_leaves_nothing(void **state) {
    (void)state;
    Room room = room_make(2);
    char id[40], other[72];
    for (int i = 0; i < 20; i++) {
        Job *job;
        id_of(submit(&room, 3000, 20 + i), id);
        nap(7000000L * (i % 10));
        assert_int_equal(intake_dismiss(room.intake, id, &job, NULL), STATUS_OK);
        job_drop(job);
    }
    // The workers are free again and the room closes at once.
    id_of(submit(&room, 5, 1), id);
    finish(&room, id, other);
    assert_whole(&room, other, 5);
    room_end(&room);
}

static void two_sweeps_and_their_doubles_share_the_workers(void **state) {
    (void)state;
    Room room = room_make(2);
    char ids[4][40], results[4][72];
    for (int i = 0; i < 4; i++)
        id_of(submit(&room, i % 2 == 0 ? 300 : 200, 10), ids[i]);
    for (int i = 0; i < 4; i++) {
        finish(&room, ids[i], results[i]);
        assert_whole(&room, results[i], i % 2 == 0 ? 300 : 200);
    }
    assert_string_equal(results[0], results[2]);
    assert_string_equal(results[1], results[3]);
    room_end(&room);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_come_back_as_they_were_put),
        cmocka_unit_test(a_sweep_interrupted_again_and_again_comes_to_its_end),
        cmocka_unit_test(a_sweep_is_dismissed_at_any_moment_and_leaves_nothing),
        cmocka_unit_test(two_sweeps_and_their_doubles_share_the_workers),
    };
    fourier_start();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
