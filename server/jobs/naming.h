// Scenes that name a record and are being accepted, any number at once, and against them whoever
// takes a name away from under them: he waits until none is under way, and they until he is done.
// Used by submit.c and forget_record.c.
#ifndef SERVER_JOBS_NAMING_H
#define SERVER_JOBS_NAMING_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct Naming {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    size_t readers;
    bool is_closed;
} Naming;

void naming_init(Naming *naming);
void naming_destroy(Naming *naming);
void naming_enter(Naming *naming);
void naming_leave(Naming *naming);
void naming_close(Naming *naming); // one at a time
void naming_open(Naming *naming);

#endif
