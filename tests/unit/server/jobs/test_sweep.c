// Sweeps in the jobs room, with the real engine and a real database: cancelled, interrupted and
// resumed at any moment, beside other jobs.
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/jobs/jobs_private.h"
#include "server/jobs/sweep.h"
#include "tests/support/room.h"
#include "tests/support/test.h"

// The next `failing` syncs of the database fail, after `spared` others.
static atomic_int failing, spared;

int fdatasync(int file) {
    if (atomic_load(&failing) > 0 && atomic_fetch_sub(&spared, 1) <= 0) {
        atomic_fetch_sub(&failing, 1);
        errno = EIO;
        return -1;
    }
    return fsync(file);
}

static void submit(const Room *room, size_t points, double duration, char id[40]) {
    char text[1024];
    room_sweep(text, sizeof text, points, duration);
    room_submit(room, text, NULL, id);
}

static void assert_whole(const Room *room, const char *result, size_t points) {
    SweepView show;
    assert_int_equal(sweep_view_load(room->db, result, false, true, &show, NULL), STATUS_OK);
    assert_true(show.is_complete);
    assert_int_equal(show.rows, points);
    for (size_t i = 0; i < points; i++) {
        double point;
        assert_true(sweep_view_read(&show, 0, i, 1, &point));
        assert_true(point == (double)i);
    }
    sweep_view_clear(&show);
}

TEST(a_sweep_interrupted_again_and_again_comes_to_its_end) {
    Room room = room_make(3);
    char id[40], result[72];
    enum { POINTS = IMPACTD_SANITIZED ? 1500 : 4000 };
    submit(&room, POINTS, 20, id);
    for (int i = 0; i < 6; i++) {
        room_nap(30000000L * (i + 1));
        room_close(&room);
        room_open(&room);
    }
    room_finish(&room, id, result);
    assert_whole(&room, result, POINTS);
    room_end(&room);
}

TEST(a_sweep_is_dismissed_at_any_moment_and_leaves_nothing) {
    Room room = room_make(2);
    char id[40], other[72];
    for (int i = 0; i < 20; i++) {
        submit(&room, 3000, 20 + i, id);
        room_nap(7000000L * (i % 10));
        room_dismiss(&room, id);
    }
    // The workers are free again and the room closes at once.
    submit(&room, 5, 1, id);
    room_finish(&room, id, other);
    assert_whole(&room, other, 5);
    room_end(&room);
}

TEST(a_sweep_waits_for_a_disk_whose_faults_pass) {
    for (int i = 0; i < 6; i++) {
        Room room = room_make(2);
        char id[40], result[72];
        JobRow row;
        submit(&room, 300, 100, id); // its own run is longer than the write of the job
        while (db_job_load(room.db, id, &row, NULL) != STATUS_OK)
            room_nap(100000);
        job_row_clear(&row);
        atomic_store(&spared, i);
        atomic_store(&failing, 3);
        while (!job_state_is_final((int)room_state(&room, id, result))) {
            room_nap(5000000);
            jobs_retry_writes(room.manager);
        }
        assert_int_equal(atomic_load(&failing), 0);
        room_finish(&room, id, result);
        assert_whole(&room, result, 300);
        room_end(&room);
    }
}

enum { OF_EACH = 60 }; // points that are made, and that fail

// Points with their rows and reasons; those that fail are what their scenes fail of by themselves.
static void assert_failed(const Room *room, const char *result) {
    SweepView view;
    Workspace workspace = {0};
    Problem problem;
    assert_int_equal(sweep_view_load(room->db, result, false, true, &view, NULL), STATUS_OK);
    assert_true(view.is_complete && view.row.chunks < OF_EACH / 2); // some rows of a chunk fail
    assert_int_equal(view.sweep->table.failed, OF_EACH);
    assert_int_equal(view.sweep->table.failures.count, 1);
    assert_int_equal(view.sweep->table.failures.at[0].count, OF_EACH);
    for (size_t i = 0; i < 2 * OF_EACH; i++) {
        SweepPoint point;
        Outcome *outcome;
        assert_int_equal(sweep_point_load(&view, i, &point, NULL), STATUS_OK);
        problem_clear(&problem);
        const Status status =
            simulation_run(&point.scene.simulation, NULL, NULL, &workspace, &outcome, &problem);
        assert_int_equal(point.status == SWEEP_MADE, i < OF_EACH);
        assert_int_equal(status == STATUS_OK, i < OF_EACH);
        if (i < OF_EACH)
            assert_string_equal(point.why, "");
        else
            assert_true(point.why[0] != '\0' &&
                        strncmp(point.why, problem.detail, strlen(point.why)) == 0);
        outcome_unref(outcome);
        study_request_clear(&point.scene);
    }
    workspace_clear(&workspace);
    sweep_view_clear(&view);
}

TEST(many_points_of_a_chunk_fail_each_with_its_reason_also_when_they_are_made_again) {
    Room room = room_make(2);
    char text[1024], id[40], result[72];
    Job *again;
    JobView view;
    Problem problem;
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}, "
             "\"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}], "
             "\"excitation\": {\"kind\": \"free\", \"displacement\": 0.03}, \"duration\": 2, "
             "\"sample_rate\": 100, \"accuracy\": {\"solver\": \"rk4\", \"step\": 1e-3}, "
             "\"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/dampers/0/buffer\", "
             "\"values\": [\"sponge\", \"aluminium\"]}, {\"pointer\": \"/dampers/0/clearance\", "
             "\"from\": 0.005, \"to\": 0.01, \"count\": %d}]}}",
             OF_EACH);
    room_submit(&room, text, NULL, id);
    room_finish(&room, id, result);
    assert_failed(&room, result);
    const Submission retry = {.retry_of = id};
    problem_clear(&problem);
    assert_int_equal(jobs_submit(room.manager, &retry, &again, &problem), STATUS_OK);
    assert_int_equal(job_view(again, &view), STATUS_OK);
    room_finish(&room, view.row.id, result);
    job_view_clear(&view);
    job_unref(again);
    assert_failed(&room, result);
    room_end(&room);
}

TEST(a_job_without_a_sweep_has_no_table) {
    static const char *const endings[] = {"",
                                          ", \"study\": {\"kind\": \"ensemble\", \"runs\": 100}"};
    Room room = room_make(1);
    Problem problem;
    for (size_t i = 0; i < COUNT(endings); i++) {
        char text[1024], id[40];
        SweepView view;
        snprintf(text, sizeof text,
                 "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"excitation\": {\"kind\": "
                 "\"random\", \"band\": [0.1, 10], \"rms\": 1, \"seed\": 3}, \"duration\": 10000, "
                 "\"sample_rate\": 100%s}",
                 endings[i]);
        room_submit(&room, text, NULL, id);
        Job *job;
        bool is_durable = false;
        assert_int_equal(jobs_find(room.manager, id, &job, &problem), STATUS_OK);
        job_save(job);
        while (!is_durable) {
            room_nap(1000000);
            assert_int_equal(job_is_durable(job, &is_durable, &problem), STATUS_OK);
        }
        job_unref(job);
        problem_clear(&problem);
        assert_int_equal(sweep_view_load(room.db, id, true, false, &view, &problem),
                         STATUS_NOT_FOUND);
        assert_non_null(strstr(problem.detail, "no sweep"));
        sweep_view_clear(&view);
        room_dismiss(&room, id);
    }
    room_end(&room);
}

// For the thread sanitizer.
TEST(the_client_of_a_job_is_read_while_it_ends) {
    Room room = room_make(2);
    for (size_t i = 0; i < 20; i++) {
        char text[1024], id[40];
        Job *job;
        room_sweep(text, sizeof text, 2 + i, 0.1);
        room_submit(&room, text, "lab", id);
        assert_int_equal(jobs_find(room.manager, id, &job, NULL), STATUS_OK);
        while (!job_is_finished(job))
            assert_string_equal(job_client(job), "lab");
        job_unref(job);
    }
    room_end(&room);
}

typedef struct Reading {
    Db *db;
    char result[72];
    atomic_bool is_over;
    atomic_size_t loaded;
    _Atomic Status wrong;
} Reading;

static void *read_tables(void *context) {
    Reading *reading = context;
    while (!atomic_load(&reading->is_over)) {
        SweepView show;
        Problem problem = {.status = STATUS_OK};
        const Status status =
            sweep_view_load(reading->db, reading->result, false, true, &show, &problem);
        sweep_view_clear(&show);
        atomic_fetch_add(&reading->loaded, status == STATUS_OK);
        if (status != STATUS_OK && status != STATUS_NOT_FOUND && status != STATUS_BUSY) {
            print_message("%s\n", problem.detail);
            atomic_store(&reading->wrong, status);
        }
    }
    return NULL;
}

// One that is deleted between two queries of a reader was no damage.
TEST(a_table_that_is_deleted_while_it_is_read_is_busy_or_gone) {
    enum { POINTS = 4, TIMES = 40, READERS = 2 };
    Room room = room_make(2);
    pthread_t threads[READERS];
    char id[40];
    Reading reading = {.db = room.db, .wrong = STATUS_OK};
    submit(&room, POINTS, 0.1, id);
    room_finish(&room, id, reading.result);
    for (size_t i = 0; i < READERS; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, read_tables, &reading), 0);
    for (size_t i = 0; i < TIMES; i++) {
        char result[72];
        assert_int_equal(jobs_delete(room.manager, reading.result, NULL), STATUS_OK);
        submit(&room, POINTS, 0.1, id);
        room_finish(&room, id, result);
    }
    atomic_store(&reading.is_over, true);
    for (size_t i = 0; i < READERS; i++)
        pthread_join(threads[i], NULL);
    assert_int_equal(reading.wrong, STATUS_OK);
    assert_true(reading.loaded > 0);
    room_end(&room);
}
