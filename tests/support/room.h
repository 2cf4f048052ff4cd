// A jobs room with the real engine and a real database, for tests: opened, closed and opened again.
#ifndef TESTS_SUPPORT_ROOM_H
#define TESTS_SUPPORT_ROOM_H

#include "server/jobs/jobs.h"
#include "tests/support/scratch.h"

typedef struct Room {
    char directory[SCRATCH_SIZE];
    Db *db;
    JobManager *manager;
    size_t workers;
} Room;

Room room_make(size_t workers);
void room_end(Room *room);
void room_open(Room *room);
void room_close(Room *room);

// Submits a scene with a study, as `client` (NULL: nobody in particular); the job's id.
void room_submit(const Room *room, const char *text, const char *client, char id[40]);
void room_dismiss(const Room *room, const char *id);

// The state of a job, and its result where it has one.
JobState room_state(const Room *room, const char *id, char result[72]);
// Waits until it is successful.
void room_finish(const Room *room, const char *id, char result[72]);

void room_nap(long ns);

// A sweep of the paper's sine scene over so many clearances.
void room_sweep(char *text, size_t size, size_t points, double duration);

#endif
