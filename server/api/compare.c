// GET /v1/compare: two results side by side. Statistics and inputs come from what was stored,
// motions and spectra from the outcomes, which a worker may have to compute anew. Where another
// engine made one, the rest is compared without them.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/compare_parts.h"
#include "server/api/compare_side.h"
#include "server/http/reply.h"
#include "server/json/diff.h"
#include "server/util/base_path.h"

static void put_side(Bytes *bytes, const char *name, const ResultRow *row) {
    bytes_format(bytes, "\"%s\": {\"id\": \"%s\", \"engine\": ", name, row->id);
    bytes_json_string(bytes, row->engine);
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s\"}}", base_path(), row->id);
}

// Series and spectra are null where `gone` (not NULL) states why.
static void put_motions(Bytes *bytes, Outcome *const outcomes[SIDES], const char *gone) {
    const double horizons[2] = {outcomes[0]->summary.trust_horizon,
                                outcomes[1]->summary.trust_horizon};
    if (gone != NULL) {
        bytes_text(bytes, ", \"channels\": null, \"divergence\": null, \"psd\": null, "
                          "\"warnings\": [");
        compare_put_warning(bytes, "series and spectra are not compared: %s", gone);
        bytes_text(bytes, "]");
        return;
    }
    const Outcome *a = outcomes[0], *b = outcomes[1];
    bytes_text(bytes, ", ");
    const size_t motions = compare_put_motions(bytes, &a->response, &b->response, horizons);
    bytes_text(bytes, ", \"psd\": ");
    const size_t spectra = compare_put_spectra(bytes, &a->spectrum, &b->spectrum);
    bytes_text(bytes, ", \"warnings\": [");
    compare_warn_left(bytes, motions, spectra);
    compare_warn(bytes, &a->response, &b->response, &a->spectrum, &b->spectrum);
    bytes_text(bytes, "]");
}

static Status write_comparison(App *app, const ResultRow rows[2], Outcome *const outcomes[SIDES],
                               const char *gone, Reply *reply, Problem *problem) {
    static const DiffFormat format = {"a", "b", true};
    size_t inputs = 0;
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{");
    put_side(&bytes, "a", &rows[0]);
    bytes_text(&bytes, ", ");
    put_side(&bytes, "b", &rows[1]);
    bytes_text(&bytes, ", \"inputs\": ");
    // A study asks more of a scene; the scenes' own runs are compared.
    Status status =
        json_diff(rows[0].scene, rows[1].scene, "study", &format, &bytes, &inputs, problem);
    if (status == STATUS_OK) {
        bytes_format(&bytes, ", \"more_inputs\": %zu, \"metrics\": ",
                     inputs > DIFF_MAX ? inputs - DIFF_MAX : 0);
        compare_put_metrics(&bytes, &outcomes[0]->summary, &outcomes[1]->summary);
        put_motions(&bytes, outcomes, gone);
        bytes_text(&bytes, "}\n");
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    }
    bytes_clear(&bytes);
    return status;
}

static Status show(App *app, char results[2][72], Outcome *outcomes[SIDES], const char *gone,
                   Reply *reply, Problem *problem) {
    ResultRow rows[2] = {{.id = ""}, {.id = ""}};
    Status status = STATUS_OK;
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        status = db_result_load(app->db, results[i], &rows[i], problem);
        if (status == STATUS_OK && outcomes[i] == NULL)
            status = jobs_outcome_stored(app->manager, results[i], &outcomes[i], problem);
    }
    if (status == STATUS_OK)
        status = write_comparison(app, rows, outcomes, gone, reply, problem);
    for (int i = 0; i < 2; i++)
        result_row_clear(&rows[i]);
    return status;
}

static Status compare(App *app, const Request *request, Sides *sides, Reply *reply,
                      Problem *problem) {
    static const char *const names[2] = {"a", "b"};
    char results[2][72], tag[104];
    for (int i = 0; i < 2; i++) {
        const char *id = request_query(request, names[i]);
        if (id == NULL || *id == '\0')
            return problem_set(problem, STATUS_USAGE,
                               "\"%s\" is missing: /v1/compare?a=ID&b=ID takes two results or "
                               "finished jobs",
                               names[i]);
        TRY(side_resolve(app, names[i], id, results[i], problem));
    }
    snprintf(tag, sizeof tag, "%.34s-%.34s-compare", results[0], results[1]);
    if (reply_immutable(reply, request, tag))
        return STATUS_OK;
    bool is_waiting;
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the comparison");
    Status status = sides_outcomes(app, request, reply, 2, results, sides, &is_waiting, fault);
    if (status == STATUS_GONE) {
        // Another program may have the series: this answer is not for ever.
        reply->is_immutable = false;
        reply->etag[0] = reply->cache_control[0] = '\0';
        status = show(app, results, sides->outcomes, fault->detail, reply, problem);
    } else if (status != STATUS_OK) {
        (void)problem_set(problem, status, "%s", fault->detail);
    } else if (!is_waiting) {
        status = show(app, results, sides->outcomes, NULL, reply, problem);
    }
    free(fault);
    return status;
}

Status compare_results(App *app, const Request *request, Reply *reply, Problem *problem) {
    Sides sides = sides_begin(request);
    const Status status = compare(app, request, &sides, reply, problem);
    sides_end(&sides);
    return status;
}
