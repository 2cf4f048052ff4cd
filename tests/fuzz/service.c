// Requests go to the router as connection.c gives them to it.
#include "tests/fuzz/service.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/db/db_private.h"
#include "server/jobs/jobs_private.h"
#include "server/util/clock.h"
#include "tests/fuzz/fuzz.h"

static Problem problem;

static void wait_moment(void) {
    nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
}

static void wake(void *context) {
    atomic_store((atomic_bool *)context, true);
}

// Reads a stream that waits for little.
static void stream_read(const Stream *stream, void *context) {
    enum { WAITS_MAX = 50 };
    char piece[4096];
    ptrdiff_t count;
    for (int waits = 0; waits < WAITS_MAX;) {
        count = stream->next(context, piece, sizeof piece);
        if (count == STREAM_END || count == STREAM_BROKEN)
            return;
        if (count == STREAM_WAIT) {
            wait_moment();
            waits++;
        }
    }
}

int service_ask(Service *service, const char *method, const char *target, const char *body) {
    enum { WAIT_MS = 2000 };
    atomic_bool is_woken = false;
    const Callback callback = {&is_woken, wake};
    Request request = {.method = method,
                       .host = "localhost",
                       .content_type = body != NULL ? "application/json" : NULL,
                       .if_match = body != NULL ? "*" : NULL,
                       .body = body,
                       .body_size = body != NULL ? strlen(body) : 0,
                       .body_most = 1 << 20,
                       .started_ns = clock_monotonic_ns(),
                       .callback = &callback};
    Reply reply;
    void (*forget)(void *) = NULL;
    reply_default(&reply);
    problem_clear(&problem);
    if (request_open(&request, target, &problem) == STATUS_OK &&
        router_admit(&service->router, &request, &reply))
        for (;;) {
            reply_default(&reply);
            if (!router_answer(&service->router, &request, &reply) && forget != NULL)
                forget(request.kept);
            request.kept = reply.keep;
            forget = reply.forget;
            if (reply.wait_ms == 0)
                break;
            for (int ms = 0; ms < WAIT_MS && ms < reply.wait_ms && !atomic_load(&is_woken); ms++)
                nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
            request.is_resumed = true;
            request.is_expired = !atomic_exchange(&is_woken, false);
        }
    const int code = reply.code;
    if (reply.stream.next != NULL)
        stream_read(&reply.stream, reply.context);
    reply_clear(&reply);
    request_close(&request);
    return code;
}

static void service_add(Service *service, const char *target, const char *body) {
    const int code = service_ask(service, "POST", target, body);
    if (code / 100 != 2)
        fprintf(stderr, "fuzz: %s answers %d\n", target, code);
    fuzz_check(code / 100 == 2, "the daemon accepts what the fuzzer begins with");
}

static void service_run(Service *service, const char *scene, char job[40], char result[72]) {
    const Submission submission = {.text = scene, .size = strlen(scene)};
    Job *made = NULL;
    JobView view;
    bool is_saved = false;
    fuzz_check(jobs_submit(service->app.manager, &submission, &made, &problem) == STATUS_OK,
               "a job is accepted");
    job_save(made);
    while (!job_is_finished(made) || !is_saved) {
        fuzz_check(job_is_durable(made, &is_saved, &problem) == STATUS_OK, "a job is saved");
        wait_moment();
    }
    fuzz_check(job_view(made, &view) == STATUS_OK && view.row.state == JOB_SUCCESSFUL,
               "a job is successful");
    snprintf(job, 40, "%s", view.row.id);
    snprintf(result, 72, "%s", view.row.result);
    job_view_clear(&view);
    job_unref(made);
}

static void series_saved(void *context, Status status, const char *detail) {
    (void)detail;
    atomic_store((atomic_int *)context, status == STATUS_OK ? 1 : -1);
}

// The series of so short a run is not worth being stored.
static void service_store_series(Service *service) {
    Outcome *outcome = NULL;
    Bytes body = {0};
    size_t size;
    atomic_int saved = 0;
    const Callback callback = {NULL, wake};
    fuzz_check(jobs_outcome(service->app.manager, service->result, &callback, &outcome, &problem) ==
                       STATUS_OK &&
                   outcome != NULL,
               "a run has its series");
    series_blob_write(&body, &outcome->response.series);
    char *bytes = bytes_take(&body, &size);
    fuzz_check(db_series_post(service->app.db, service->result, bytes, size, 1 << 30,
                              &(WriteDone){series_saved, &saved}) == STATUS_OK,
               "series can be stored");
    while (atomic_load(&saved) == 0)
        wait_moment();
    outcome_unref(outcome);
}

static void service_fill_database(Service *service) {
    static const char scene[] =
        "{\"title\": \"t\", \"labels\": [\"a=1\", \"b\"], \"structure\": {\"mass\": 1.35, "
        "\"stiffness\": 865, \"damping\": 1.092}, \"dampers\": [{\"mass\": 0.1107, \"clearance\": "
        "0.015, \"buffer\": \"felt\"}], \"excitation\": {\"kind\": \"record\", \"name\": "
        "\"quake\"}, \"duration\": 0.5, \"sample_rate\": 100, \"output\": {\"psd\": {\"segment\": "
        "32}}}";
    static const char sweep[] =
        "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}, \"dampers\": "
        "[{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"felt\"}], \"excitation\": "
        "{\"kind\": \"free\", \"displacement\": 0.05}, \"duration\": 0.5, \"sample_rate\": 100, "
        "\"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/dampers/0/clearance\", "
        "\"values\": [0.01, 0.02]}, {\"pointer\": \"/dampers/0/buffer\", \"values\": [\"sponge\", "
        "\"felt\"]}]}}";
    service_add(
        service, "/v1/materials",
        "{\"slug\": \"felt\", \"name\": \"Felt\", \"source\": \"lab\", \"restitution\": 0.5, "
        "\"contact_time\": 0.02, \"tags\": [\"a\"], \"comment\": \"c\"}");
    service_add(service, "/v1/materials/felt@1/review",
                "{\"status\": \"approved\", \"reason\": \"r\"}");
    service_add(service, "/v1/materials/felt/measurements",
                "{\"drops\": [{\"drop_height\": 1, \"rebound_height\": 0.2}, {\"drop_height\": 1, "
                "\"rebound_height\": 0.21, \"contact_time\": 0.02}], \"impactor_mass\": 0.1}");
    service_add(service, "/v1/materials/felt/revisions",
                "{\"name\": \"Felt 2\", \"source\": \"lab\", \"table\": [{\"approach_speed\": 0.1, "
                "\"restitution\": 0.5}, {\"approach_speed\": 0.2, \"restitution\": 0.4}], "
                "\"measurements\": [1], \"comment\": \"c\"}");
    service_add(
        service, "/v1/records",
        "{\"name\": \"quake\", \"interval\": 0.01, \"samples\": [5, 10, -10, 2.5, 1, 3, -7, "
        "8, 2, 1, -4, 6, 1]}");
    service_run(service, scene, service->job, service->result);
    service_store_series(service);
    service_run(service, sweep, service->sweep_job, service->sweep);
}

// A job ends at three times of the CPU time it is allowed, which an instrumented build needs.
static const JobManagerSettings job_settings = {.workers = 1,
                                                .queue_most = 50,
                                                .cache_bytes = 1 << 20,
                                                .store_bytes = 1 << 20,
                                                .study_seconds = 10,
                                                .limits = {.samples = 2000,
                                                           .impacts = 1000,
                                                           .steps = 1e8,
                                                           .bytes = 1e8,
                                                           .document_bytes = 1e6,
                                                           .points = 20}};

static Status service_open_all(Service *service) {
    static const char *const origins[] = {"https://lab.example.org", NULL};
    static AcceptedHosts hosts;
    App *app = &service->app;
    hosts = (AcceptedHosts){loopback_hosts.names, false, origins};
    *service = (Service){.app = {.reply_most = 1 << 24, .started_unix_ms = clock_unix_ms()}};
    app->request_metrics = service->access.request_metrics = request_metrics_new(routes);
    app->response_cache = response_cache_new(1 << 20);
    TRY(db_open(NULL, &app->db, &problem));
    TRY(tokens_open(app->db, false, &service->access.tokens, &problem));
    TRY(jobs_open(app->db, &job_settings, &app->manager, &problem));
    TRY(background_open(2, &app->background_tasks, &problem));
    service->router =
        (Router){app, routes, app->response_cache, &service->access, short_ids_redirect};
    const ServerSettings http = {.address = {"127.0.0.1", 0},
                                 .body_most = 1 << 16,
                                 .router = &service->router,
                                 .hosts = &hosts};
    TRY(server_open(&http, &service->server, &problem));
    atomic_store(&app->server, service->server);
    return STATUS_OK;
}

Service *service_open(void) {
    static Service service;
    problem_clear(&problem);
    if (service_open_all(&service) != STATUS_OK)
        fprintf(stderr, "fuzz: %s\n", problem.detail);
    fuzz_check(service.server != NULL, "a daemon starts");
    service_fill_database(&service);
    return &service;
}

void service_close(Service *service) {
    App *app = &service->app;
    server_stop(service->server, 1000);
    background_close(app->background_tasks);
    jobs_stop(app->manager);
    server_free(service->server);
    jobs_close(app->manager);
    response_cache_free(app->response_cache);
    tokens_close(service->access.tokens);
    db_close(app->db);
    request_metrics_free(service->access.request_metrics);
}

void service_forget(Service *service, bool restarts) {
    App *app = &service->app;
    response_cache_clear(app->response_cache);
    for (DbCache which = 0; which < CACHE_COUNT; which++)
        shared_cache_clear(db_cache(app->db, which));
    if (!restarts) {
        pthread_mutex_lock(&app->manager->lock);
        lru_clear(app->manager->cache);
        pthread_mutex_unlock(&app->manager->lock);
        return;
    }
    jobs_stop(app->manager);
    jobs_close(app->manager);
    problem_clear(&problem);
    fuzz_check(jobs_open(app->db, &job_settings, &app->manager, &problem) == STATUS_OK,
               "jobs can be opened, whatever their rows are");
}

char *service_fill(const Service *service, const char *text, size_t size, size_t *filled) {
    const struct {
        const char *name, *id;
    } ids[] = {{"{job}", service->job},
               {"{result}", service->result},
               {"{sweep_job}", service->sweep_job},
               {"{sweep}", service->sweep}};
    Bytes bytes = {0};
    for (size_t at = 0; at < size;) {
        size_t i = 0;
        while (i < COUNT(ids) && (size - at < strlen(ids[i].name) ||
                                  memcmp(text + at, ids[i].name, strlen(ids[i].name)) != 0))
            i++;
        if (i < COUNT(ids))
            bytes_text(&bytes, ids[i].id);
        else
            bytes_put(&bytes, text + at, 1);
        at += i < COUNT(ids) ? strlen(ids[i].name) : 1;
    }
    char *all = bytes_take(&bytes, filled);
    fuzz_check(all != NULL, "there is memory");
    return all;
}
