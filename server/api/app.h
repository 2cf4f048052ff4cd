// What handlers work with: the rooms of the running daemon, and the few facts replies tell about
// it. Not the rooms' settings. Filled by cli/serve.c, used by every handler in api/.
#ifndef SERVER_API_APP_H
#define SERVER_API_APP_H

#include <stdatomic.h>
#include <stdint.h>

#include "server/db/db.h"
#include "server/http/request.h"
#include "server/jobs/background.h"
#include "server/jobs/jobs.h"

struct App {
    Db *db;
    JobManager *manager;
    BackgroundTasks *background_tasks; // for readers of what takes a run
    const struct RequestMetrics *request_metrics;
    struct ResponseCache *response_cache;
    _Atomic(struct Server *) server; // NULL until it is open
    size_t reply_most;               // bytes of one answer
    char base_url[256]; // as clients see us, without a slash at its end; "": by their Host
    bool has_tls;
    int64_t started_unix_ms;
    atomic_bool is_stopping;
    atomic_int evaluations; // long ones, under way
};

extern const char program_version[]; // "0.1.0"
extern const char program_build[];   // the compiler

// Sets Retry-After where a scene was refused with STATUS_BUSY or STATUS_QUOTA; returns `status`.
Status jobs_refused(App *app, const Request *request, Reply *reply, Status status);

// A run for one request. `reply` may take what it needs of the context.
typedef struct RequestRun {
    void (*run)(void *context, const Progress *watch); // `watch` may be NULL
    void (*release)(void *context);
    Status (*reply)(App *app, const Request *request, Reply *reply, void *context,
                    Problem *problem);
    const char *why; // it is refused after 60 s
} RequestRun;
// Takes the context. At once where it is predicted to take few `seconds` of CPU, else the request
// waits.
Status request_run_start(App *app, const Request *request, Reply *reply, const RequestRun *run,
                         void *context, double seconds, Problem *problem);
// Of a request that waited.
Status request_run_resume(App *app, const Request *request, Reply *reply, const RequestRun *run,
                          Problem *problem);

// The handlers, by file; routes.c lists them with their patterns.
bool jobs_are_light(const Request *request); // planned in some ten microseconds
Handler jobs_create, jobs_list, jobs_show, jobs_change, jobs_dismiss, jobs_retry, jobs_scene,
    jobs_events;
Handler results_again, results_delete, results_show, results_manifest, results_series, results_psd,
    results_impacts, results_energy, results_force, results_bundle, results_tradeoff,
    results_ensemble, results_compare, results_sensitivity;
Handler cache_show, cache_explain, previews_create;
Handler compare_results, compare_measured;
Handler sweeps_table, sweeps_point, sweeps_scene;
Handler materials_list, materials_show, materials_show_revision;
Handler materials_export, materials_import;
Handler measurements_list, measurements_create, measurements_show, proposals_show;
Handler derived_show, derived_show_revision;
Handler materials_create, materials_revise, materials_revert, materials_review;
Handler materials_revisions, materials_history, materials_diff, materials_uses,
    materials_uses_revision;
Handler records_create, records_list, records_show, records_samples, records_delete;
Handler examples_list, examples_show, schemas_list, schemas_show, openapi_show;
Handler health_live, health_ready, metrics_show, version_show, landing_show;
Handler short_ids_redirect; // of no route: Router.not_found
Handler assets_show, assets_show_icon;

// The job that the path names. STATUS_FORBIDDEN unless the token may read it: with the scope
// "submit" alone only its own.
Status job_find_visible(App *app, const Request *request, Job **job, Problem *problem);

#endif
