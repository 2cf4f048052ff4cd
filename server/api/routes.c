// All endpoints, in the order in which they are tried: of two patterns that fit one path the more
// literal one is first.
#include "server/api/app.h"
#include "server/http/router.h"

static const char *const of_submit[] = {"dry_run", NULL};
static const char *const of_jobs[] = {"limit", "before", "status", "q",       "label", "result",
                                      "kind",  "since",  "until",  "details", NULL};
static const char *const of_job[] = {"wait", NULL};
static const char *const of_dismissal[] = {"purge", NULL};
static const char *const of_series[] = {"channels", "from", "to", "points", NULL};
static const char *const of_impacts[] = {"from", "to", "first", "limit", NULL};
static const char *const of_force[] = {"points", NULL};
static const char *const of_compare[] = {"a", "b", NULL};
static const char *const of_measured[] = {"a",         "channel",  "align", "shift", "most_shift",
                                          "densities", "interval", "unit",  NULL};
static const char *const of_calibration[] = {"material", "damper", NULL};
static const char *const of_import[] = {"dry_run", NULL};
static const char *const of_materials[] = {"q",   "kind",  "status", "e",
                                           "T_c", "limit", "after",  NULL};
static const char *const of_pages[] = {"limit", "before", NULL};
static const char *const of_diff[] = {"from", "to", NULL};
static const char *const of_uses[] = {"revision", "limit", "before", NULL};
static const char *const of_samples[] = {"from", "to", "points", NULL};
static const char *const of_spectrum[] = {"damping_ratio", "from", "to", "points", NULL};
static const char *const of_records[] = {"q", "limit", "after", NULL};
static const char *const of_record[] = {"name",  "interval",   "unit",    "source", "processing",
                                        "notes", "earthquake", "station", NULL};

static const char *const of_measurement[] = {"separation", NULL};
static const char *const of_measuring[] = {"dry_run", "separation", NULL};
static const char *const of_proposal[] = {"measurements", "separation", "as", NULL};
static const char *const of_derived[] = {"damper_mass", "structure_mass", "identified_for",
                                         "separation", NULL};

// clang-format off
const Route routes[] = {
    {"POST",   "/v1/jobs",                              "submit", of_submit,    "Submit a scene; ?dry_run=1 only checks and plans it", jobs_create, jobs_are_light},
    {"POST",   "/v1/preview",                           "submit", of_force,     "Run a short scene for this answer alone, stored nowhere", previews_create, NULL},
    {"GET",    "/v1/jobs",                              "read",   of_jobs,      "Jobs, newest first; ?q= searches titles and labels", jobs_list, NULL},
    {"GET",    "/v1/jobs/{id}",                         "read",   of_job,       "A job's state; ?wait=S waits until it is finished", jobs_show, NULL},
    {"GET",    "/v1/jobs/{id}/events",                  "read",   NULL,         "A job's progress as server-sent events", jobs_events, NULL},
    {"PATCH",  "/v1/jobs/{id}",                         "submit", NULL,         "Change the title and the labels of a job", jobs_change, NULL},
    {"DELETE", "/v1/jobs/{id}",                         "submit", of_dismissal, "Cancel a job; ?purge=1 removes a finished one from the list", jobs_dismiss, NULL},
    {"GET",    "/v1/jobs/{id}/scene",                   "read",   NULL,         "The scene of a job, ready to submit", jobs_scene, NULL},
    {"POST",   "/v1/jobs/{id}/retry",                   "submit", NULL,         "Run the failed points of a finished sweep again", jobs_retry, NULL},
    {"GET",    "/v1/jobs/{id}/table.{format}",          "read",   NULL,         "Rows of a job's sweep so far", sweeps_table, NULL},
    {"GET",    "/v1/jobs/{id}/table",                   "read",   NULL,         "Rows of a job's sweep so far, format by Accept", sweeps_table, NULL},
    {"GET",    "/v1/results/{id}/table.{format}",       "read",   NULL,         "Rows of a sweep so far", sweeps_table, NULL},
    {"GET",    "/v1/results/{id}/table",                "read",   NULL,         "A sweep's rows, format by Accept", sweeps_table, NULL},
    {"GET",    "/v1/results/{id}/points/{index}/scene", "read",   NULL,         "The scene of one point, ready to submit", sweeps_point, NULL},
    {"GET",    "/v1/results/{id}/points/{index}",       "read",   NULL,         "One point: its values, metrics and scene", sweeps_point, NULL},
    {"GET",    "/v1/results/{id}",                      "read",   NULL,         "A result's scene, plan, summary and units", results_show, NULL},
    {"DELETE", "/v1/results/{id}",                      "submit", NULL,         "Delete a result; its jobs stay", results_delete, NULL},
    {"POST",   "/v1/results/{id}/again",                "submit", NULL,         "Submit its scene again", results_again, NULL},
    {"GET",    "/v1/results/{id}/manifest",             "read",   NULL,         "Everything needed to reproduce a result", results_manifest, NULL},
    {"GET",    "/v1/results/{id}/series.{format}",      "read",   of_series,    "Time series as json, csv, npy, npz or mat, or a chart as svg; ?points= keeps the extremes of buckets", results_part, NULL},
    {"GET",    "/v1/results/{id}/series",               "read",   of_series,    "Time series, format by Accept", results_part, NULL},
    {"GET",    "/v1/results/{id}/psd.{format}",         "read",   NULL,         "Power spectral densities as json, csv, npy, npz or mat, or a chart as svg", results_part, NULL},
    {"GET",    "/v1/results/{id}/psd",                  "read",   NULL,         "Power spectral densities, format by Accept", results_part, NULL},
    {"GET",    "/v1/results/{id}/impacts.{format}",     "read",   of_impacts,   "The list of impacts as json, csv, npy, npz or mat; ?from= &to= select a window", results_part, NULL},
    {"GET",    "/v1/results/{id}/impacts",              "read",   of_impacts,   "The list of impacts, format by Accept", results_part, NULL},
    {"GET",    "/v1/results/{id}/impacts/{number}/force.{format}", "read", of_force, "One impact in detail, as json, csv, npy, npz or mat", results_force, NULL},
    {"GET",    "/v1/results/{id}/impacts/{number}/force", "read", of_force,     "One impact in detail, format by Accept", results_force, NULL},
    {"GET",    "/v1/results/{id}/bundle.zip",           "read",   NULL,         "All of a result in one archive", results_bundle, NULL},
    {"GET",    "/v1/results/{id}/energy.{format}",      "read",   NULL,         "The energy balance as json, csv, npy, npz or mat", results_part, NULL},
    {"GET",    "/v1/results/{id}/energy",               "read",   NULL,         "The energy balance, format by Accept", results_part, NULL},
    {"GET",    "/v1/results/{id}/tradeoff.{format}",    "read",   NULL,         "The study's table as json, or its chart as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/tradeoff",             "read",   NULL,         "The study's table or chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/ensemble.{format}",    "read",   NULL,         "The study's statistics as json, its runs as csv, or its chart as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/ensemble",             "read",   NULL,         "The study's statistics, runs or chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/compare.{format}",     "read",   NULL,         "The study's variants as json or csv, or their chart as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/compare",              "read",   NULL,         "The study's variants or chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/sensitivity.{format}", "read",   NULL,         "The study's slopes and bands as json, the slopes as csv, or its chart as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/sensitivity",          "read",   NULL,         "The study's slopes or chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/response.{format}",    "read",   NULL,         "The response curve with periodic orbits and their stability, as json, csv, npz or svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/response",             "read",   NULL,         "The response curve with periodic orbits and their stability, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/fragility.{format}",   "read",   NULL,         "The study's curves and distributions as json, its runs as csv or npz, or its chart as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/fragility",            "read",   NULL,         "The study's curves, runs or chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/calibration.{format}", "read",   NULL,         "The fitted parameters as json or csv, or measured and fitted motions as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/calibration",          "read",   NULL,         "The fitted parameters or their chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/calibration/scene",    "read",   NULL,         "The scene with the fitted values, ready to submit", results_solution, NULL},
    {"POST",   "/v1/results/{id}/calibration/proposal", "read",   of_calibration, "The revision of a material that fitted restitution and contact time would make", calibrations_propose, NULL},
    {"GET",    "/v1/results/{id}/optimum.{format}",     "read",   NULL,         "The best candidate as json, all candidates as csv or npz, or their chart as svg", results_study, NULL},
    {"GET",    "/v1/results/{id}/optimum",              "read",   NULL,         "The best candidate, the candidates or their chart, format by Accept", results_study, NULL},
    {"GET",    "/v1/results/{id}/optimum/scene",        "read",   NULL,         "The scene with the best values, ready to submit", results_solution, NULL},
    {"GET",    "/v1/compare",                           "read",   of_compare,   "Compare two results and their inputs", compare_results, NULL},
    {"POST",   "/v1/compare",                           "read",   of_measured,  "Compare a result with a measured motion", compare_measured, NULL},
    {"GET",    "/v1/cache",                             "read",   NULL,         "Hits and misses of the caches, by layer", cache_show, NULL},
    {"POST",   "/v1/cache/explain",                     "read",   NULL,         "Whether a scene is cached, and its differences from the most similar cached one", cache_explain, NULL},
    {"GET",    "/v1/materials",                         "read",   of_materials, "Buffer materials; ?q= searches, ?kind= ?status= ?e= ?T_c= select", materials_list, NULL},
    {"POST",   "/v1/materials",                         "materials", NULL,      "Add a material", materials_create, NULL},
    {"GET",    "/v1/materials.{format}",                "read",   NULL,         "All materials as json or csv, as an import reads them", materials_export, NULL},
    {"POST",   "/v1/materials/import",                  "materials", of_import, "Import materials, all or none; ?dry_run=1 only validates them", materials_import, NULL},
    {"POST",   "/v1/materials/{slug}@{revision}/review", "materials", NULL,     "Approve or deprecate a revision, with a reason", materials_review, NULL},
    {"GET",    "/v1/materials/{slug}@{revision}/used-by", "read", of_pages,     "Results made with a revision, newest first", materials_uses, NULL},
    {"GET",    "/v1/materials/{slug}@{revision}/derived", "read", of_derived,   "Contact parameters of a revision for a pair of masses", derived_show, NULL},
    {"GET",    "/v1/materials/{slug}@{revision}",       "read",   NULL,         "One revision of a material", materials_show, NULL},
    {"POST",   "/v1/materials/{slug}/revisions",        "materials", NULL,      "Add a revision of a material", materials_revise, NULL},
    {"GET",    "/v1/materials/{slug}/revisions",        "read",   of_pages,     "Revisions of a material, newest first", materials_revisions, NULL},
    {"POST",   "/v1/materials/{slug}/revert",           "materials", NULL,      "Repeat an old revision as a new one", materials_revert, NULL},
    {"GET",    "/v1/materials/{slug}/history",          "read",   of_pages,     "What was done to a material, by whom and why, newest first", materials_history, NULL},
    {"GET",    "/v1/materials/{slug}/diff",             "read",   of_diff,      "Differences of two revisions of a material", materials_diff, NULL},
    {"GET",    "/v1/materials/{slug}/used-by",          "read",   of_uses,      "How many results were made with each revision; ?revision= lists them", materials_uses, NULL},
    {"GET",    "/v1/materials/{slug}/measurements",     "read",   of_pages,     "Drop tests of a material, newest first", measurements_list, NULL},
    {"POST",   "/v1/materials/{slug}/measurements",     "materials", of_measuring, "Store a drop test; ?dry_run=1 only evaluates it", measurements_create, NULL},
    {"GET",    "/v1/materials/{slug}/measurements/{number}", "read", of_measurement, "A drop test and its evaluation", measurements_show, NULL},
    {"GET",    "/v1/materials/{slug}/proposal.{format}", "read",  of_proposal,  "The revision that measurements would make, as json, or their chart as svg", proposals_show, NULL},
    {"GET",    "/v1/materials/{slug}/proposal",         "read",   of_proposal,  "The revision that measurements would make, or their chart, format by Accept", proposals_show, NULL},
    {"GET",    "/v1/materials/{slug}/derived",          "read",   of_derived,   "Contact parameters of a material for a pair of masses: k_b, c_b with uncertainty", derived_show, NULL},
    {"GET",    "/v1/materials/{slug}",                  "read",   NULL,         "A material's approved revision", materials_show, NULL},
    {"POST",   "/v1/records",                           "materials", of_record, "Upload a ground motion's file, or its samples as JSON", records_create, NULL},
    {"GET",    "/v1/records",                           "read",   of_records,   "Ground motions, by name; ?q= searches", records_list, NULL},
    {"GET",    "/v1/records/{name}/samples.{format}",   "read",   of_samples,   "A ground motion's samples as json, csv, npy, npz or mat; ?points= keeps the extremes of buckets", records_samples, NULL},
    {"GET",    "/v1/records/{name}/samples",            "read",   of_samples,   "A ground motion's samples, format by Accept", records_samples, NULL},
    {"GET",    "/v1/records/{name}/spectrum.{format}",  "read",   of_spectrum,  "A ground motion's response spectrum as json or csv, or its chart as svg", records_spectrum, NULL},
    {"GET",    "/v1/records/{name}/spectrum",           "read",   of_spectrum,  "A ground motion's response spectrum, format by Accept", records_spectrum, NULL},
    {"GET",    "/v1/records/{name}",                    "read",   NULL,         "A ground motion, and the number of its uses", records_show, NULL},
    {"DELETE", "/v1/records/{name}",                    "materials", NULL,      "Delete a ground motion that nothing uses", records_delete, NULL},
    {"GET",    "/v1/examples",                          "read",   NULL,         "Scenes that run as they are", examples_list, NULL},
    {"GET",    "/v1/examples/{name}",                   "read",   NULL,         "One example, ready to submit", examples_show, NULL},
    {"GET",    "/schemas",                              "open",   NULL,         "JSON Schemas, by name", schemas_list, NULL},
    {"GET",    "/schemas/{name}",                       "open",   NULL,         "A JSON Schema", schemas_show, NULL},
    {"GET",    "/openapi.json",                         "open",   NULL,         "This API as OpenAPI 3.1", openapi_show, NULL},
    {"GET",    "/health/live",                          "open",   NULL,         "The server answers", health_live, request_is_empty},
    {"GET",    "/health/ready",                         "open",   NULL,         "The server accepts jobs; 503 otherwise", health_ready, request_is_empty},
    {"GET",    "/metrics",                              "read",   NULL,         "Counters in the Prometheus text format", metrics_show, NULL},
    {"GET",    "/version",                              "open",   NULL,         "Program, engine and build", version_show, request_is_empty},
    {"GET",    "/web/{folder}/{part}/{file}",           "open",   any_query,    "A file of the dashboard", assets_show, NULL},
    {"GET",    "/web/{folder}/{file}",                  "open",   any_query,    "A file of the dashboard", assets_show, NULL},
    {"GET",    "/web/{file}",                           "open",   any_query,    "A file of the dashboard", assets_show, NULL},
    {"GET",    "/guide/{file}",                         "open",   any_query,    "A page or a picture of the guide", guide_show, NULL},
    {"GET",    "/guide/",                               "open",   any_query,    "The first page of the guide", guide_show, NULL},
    {"GET",    "/problems/{name}",                      "open",   NULL,         "Redirects to the section of the guide on a type of problem", problems_show, NULL},
    {"GET",    "/client/impactd",                       "open",   any_query,    "Links to the wheel, as pip --index-url reads them", client_files_list, NULL},
    {"GET",    "/client/{file}",                        "open",   any_query,    "A client for Python (a file or a wheel), Octave or MATLAB, or its notebook", client_files_show, NULL},
    {"GET",    "/client",                               "open",   any_query,    "Links to the clients, as pip --find-links reads them", client_files_list, NULL},
    {"GET",    "/favicon.ico",                          "open",   any_query,    "The dashboard's icon", assets_show_icon, NULL},
    {"GET",    "/",                                     "open",   any_query,    "The dashboard for browsers, curl lines for shells", landing_show, NULL},
    {NULL, NULL, NULL, NULL, NULL, NULL, NULL},
};
// clang-format on
