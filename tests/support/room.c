#include "tests/support/room.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static Problem problem;

void room_open(Room *room) {
    const JobManagerSettings settings = {.workers = room->workers,
                                         .queue_most = 1000,
                                         .cache_bytes = 1 << 24,
                                         .limits = {.samples = 1 << 25, .impacts = 1 << 20}};
    problem_clear(&problem);
    if (db_open(room->directory, &room->db, &problem) != STATUS_OK ||
        jobs_open(room->db, &settings, &room->manager, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

void room_close(Room *room) {
    jobs_close(room->manager);
    db_close(room->db);
}

Room room_make(size_t workers) {
    Room room = {.workers = workers};
    scratch_make(room.directory);
    room_open(&room);
    return room;
}

void room_end(Room *room) {
    room_close(room);
    scratch_remove(room->directory);
}

void room_submit(const Room *room, const char *text, const char *client, char id[40]) {
    Job *job;
    JobView show;
    const Submission submission = {.text = text, .size = strlen(text), .client = client};
    problem_clear(&problem);
    if (jobs_submit(room->manager, &submission, &job, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    assert_int_equal(job_view(job, &show), STATUS_OK);
    text_fit(id, 40, show.row.id);
    job_view_clear(&show);
    job_unref(job);
}

void room_dismiss(const Room *room, const char *id) {
    Job *job;
    assert_int_equal(jobs_cancel(room->manager, id, &job, NULL), STATUS_OK);
    job_unref(job);
}

JobState room_state(const Room *room, const char *id, char result[72]) {
    Job *job;
    JobView show;
    assert_int_equal(jobs_find(room->manager, id, &job, NULL), STATUS_OK);
    assert_int_equal(job_view(job, &show), STATUS_OK);
    job_unref(job);
    const JobState state = (JobState)show.row.state;
    text_fit(result, 72, show.row.result);
    job_view_clear(&show);
    return state;
}

void room_finish(const Room *room, const char *id, char result[72]) {
    JobState state;
    while (!job_state_is_final((int)(state = room_state(room, id, result))))
        room_nap(2000000);
    assert_int_equal(state, JOB_SUCCESSFUL);
}

void room_nap(long ns) {
    const struct timespec time = {0, ns};
    nanosleep(&time, NULL);
}

void room_sweep(char *text, size_t size, size_t points, double duration) {
    snprintf(text, size,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},"
             " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],"
             " \"excitation\": {\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 1},"
             " \"duration\": %.17g, \"sample_rate\": 1000, \"output\": {\"psd\": null},"
             " \"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": "
             "\"/dampers/0/clearance\", \"from\": 0.01, \"to\": 0.02, \"count\": %zu}]}}",
             duration, points);
}
