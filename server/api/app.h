// What handlers work with: the modules of the running daemon, and the functions that handlers of
// several resources share. Filled by cli/serve.c.
#ifndef SERVER_API_APP_H
#define SERVER_API_APP_H

#include <stdatomic.h>
#include <stdint.h>

#include "core/formats/ground_motion_text.h"
#include "server/db/db.h"
#include "server/formats/study_formats.h"
#include "server/formats/table_stream.h"
#include "server/http/reply.h"
#include "server/jobs/background.h"
#include "server/jobs/jobs.h"

struct App {
    Db *db;
    JobManager *manager;
    BackgroundTasks *background_tasks; // runs for one request
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

// The handlers, by file; routes.c lists them with their patterns.
bool jobs_are_light(const Request *request); // planned in some ten microseconds
Handler jobs_create, jobs_list, jobs_show, jobs_change, jobs_dismiss, jobs_retry, jobs_scene,
    jobs_events;
Handler results_again, results_delete, results_show, results_manifest, results_part, results_force,
    results_bundle, results_study, results_solution, sweeps_table, sweeps_point,
    calibrations_propose;
Handler cache_show, cache_explain, previews_create, compare_results, compare_measured;
Handler materials_list, materials_show, materials_export, materials_import, materials_create,
    materials_revise, materials_revert, materials_review, materials_revisions, materials_history,
    materials_diff, materials_uses;
Handler measurements_list, measurements_create, measurements_show, proposals_show, derived_show;
Handler records_create, records_list, records_show, records_samples, records_spectrum,
    records_delete;
Handler examples_list, examples_show, schemas_list, schemas_show, openapi_show;
Handler health_live, health_ready, metrics_show, version_show, landing_show;
Handler short_ids_redirect; // of no route: Router.not_found
Handler assets_show, assets_show_icon, guide_show, problems_show;
Handler client_files_list, client_files_show;

// The pages of the guide, "guide/index.html" ...; set by main.c, since they are printed by programs
// that use these tables. NULL: none.
extern const EmbeddedFile *guide_files;

// The content type of an embedded file, by its extension; NULL: unknown. landing.c.
const char *asset_type(const char *path);

// The table of a ground motion in the body, records.c. Cleared by ground_motion_text_clear.
Status records_read_motion(const Request *request, const GroundMotionOptions *options,
                           GroundMotionText *motion, Problem *problem);

// --- jobs, jobs.c ---

// The job that the path names. STATUS_FORBIDDEN unless the token may read it: with the scope
// "submit" alone only its own.
Status job_find_visible(App *app, const Request *request, Job **job, Problem *problem);
// Sets Retry-After where a scene was refused with STATUS_BUSY or STATUS_QUOTA; returns `status`.
Status jobs_refused(App *app, const Request *request, Reply *reply, Status status);

// jobs_stats, with the series in the database. cache.c.
void cache_tally_all(App *app, JobStats *stats);

// --- results, results.c ---

// Append the documents of a result's row, as /v1/results/{id} and its manifest answer them.
Status result_put(const ResultRow *row, Bytes *bytes, Problem *problem);
Status manifest_put(App *app, const ResultRow *row, Bytes *bytes, Problem *problem);
// The entity tag of what may change with a material's status or the base of links, by its content
// (or by another that changes with it). True if the client has it.
bool results_tagged(const Request *request, Reply *reply, const ResultRow *row, const char *what,
                    const Bytes *content);
// The links of a 410: how to have the result made by this engine, and what it is.
void results_link_gone(const char *id, Reply *reply);
extern const char no_impacts[]; // why a result has no list of impacts

// The answer of the study of a row that has one. Cleared by fields_clear(study_answer_fields, ...)
// in any case.
Status study_read(const ResultRow *row, StudyAnswer *answer, Problem *problem);
// The row of the request's result with the answer of its study, which must be of this kind. Both
// are cleared in any case. STATUS_NOT_FOUND. studies.c.
Status study_load(App *app, const Request *request, const StudyKind *kind, ResultRow *row,
                  StudyAnswer *answer, Problem *problem);

// --- tables of numbers, columns.c ---

// The format of the extension in the path's `parameter`, else by Accept; `offered` ends with NULL.
Status columns_format(const Request *request, size_t parameter, const TableFormat *const *offered,
                      Reply *reply, const TableFormat **format, Problem *problem);
// "?from=&to=" [s]: which of `count` samples, at least one, are written. "?points=n": smallest and
// largest values in at most n buckets. STATUS_USAGE: not numbers, or no sample is there.
Status columns_window(const Request *request, size_t count, TableStream *stream, Problem *problem);
// The outcome with series of the result in the request's first parameter. *outcome is a reference,
// or NULL where the request waits until it is computed.
Status columns_outcome(App *app, const Request *request, Reply *reply, Outcome **outcome,
                       Problem *problem);
// Lets the request wait for its callback until 60 s after its start; `kept` comes back as
// request->kept and is freed by `forget`, here too where the time is over: STATUS_BUSY with `why`.
Status columns_wait(const Request *request, Reply *reply, void *kept, void (*forget)(void *kept),
                    const char *why, Problem *problem);
// Takes `stream`, also when it fails; NULL is STATUS_NO_MEMORY.
Status columns_reply(App *app, Reply *reply, const TableFormat *format, TableStream *stream,
                     Problem *problem);

// --- runs for one request, contact_force.c ---

// `reply` may take what it needs of the context.
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

#endif
