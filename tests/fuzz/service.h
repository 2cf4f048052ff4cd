// A daemon within this program, with a little of everything in a database in memory.
#ifndef TESTS_FUZZ_SERVICE_H
#define TESTS_FUZZ_SERVICE_H

#include "server/api/app.h"
#include "server/http/server.h"

// With a run, a sweep, a material of two revisions and a drop test, a record. It listens on
// loopback. Kept until service_close.
typedef struct Service {
    App app;
    AccessControl access;
    Router router;
    Server *server;
    char job[40], result[72], sweep_job[40], sweep[72];
} Service;
Service *service_open(void);
void service_close(Service *service);
// What was read of the database is forgotten. With `restarts` unfinished jobs are resumed, too.
void service_forget(Service *service, bool restarts);

// The text with {job}, {result}, {sweep_job} and {sweep} replaced by these ids; to be freed.
char *service_fill(const Service *service, const char *text, size_t size, size_t *filled);

// Sends a request to the router. Reads the body to its end; returns the code.
int service_ask(Service *service, const char *method, const char *target, const char *body);

#endif
