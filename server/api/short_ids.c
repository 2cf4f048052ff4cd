// "j-" or "r-" and 8 or more digits of an id, in GET: 307 to the full id, 409 where several begin
// so.
#include <stdio.h>
#include <string.h>

#include "server/api/app.h"
#include "server/jobs/job.h"
#include "server/util/base_path.h"

enum { DIGITS_MIN = 8, CANDIDATES_MAX = 10 };

// Where the id begins in the target; NULL if the route has none or it is not a short one.
static const char *short_id_find(const Request *request) {
    static const char job[] = "/v1/jobs/{id}", result[] = "/v1/results/{id}";
    const char *id = request->parameters[0], *pattern = request->route->pattern;
    const char kind = strncmp(pattern, job, sizeof job - 1) == 0         ? 'j'
                      : strncmp(pattern, result, sizeof result - 1) == 0 ? 'r'
                                                                         : '\0';
    if (kind == '\0' || id == NULL || strcmp(request->method, "GET") != 0 || id[0] != kind ||
        id[1] != '-')
        return NULL;
    const size_t digits = strspn(id + 2, "0123456789abcdef");
    const size_t full = id[0] == 'j' ? JOB_ID_LENGTH - 2 : 64;
    return id[2 + digits] == '\0' && digits >= DIGITS_MIN && digits < full
               ? strstr(request->target, id)
               : NULL;
}

static Status short_id_ambiguous(const char *id, const JobRows *rows, Problem *problem) {
    char list[CANDIDATES_MAX * sizeof rows->at->result] = "";
    for (size_t i = 0; i < rows->count && i < CANDIDATES_MAX; i++)
        text_list(list, sizeof list, rows->at[i].result);
    problem_clear(problem);
    return problem_set(problem, STATUS_CONFLICT, "the id %.72s is ambiguous: %s%s", id, list,
                       rows->count > CANDIDATES_MAX ? ", ..." : "");
}

Status short_ids_redirect(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *id = request->parameters[0], *at = short_id_find(request);
    const char *path = base_path_strip(request->target);
    JobRows rows = {0};
    if (at == NULL || path == NULL ||
        strlen(path) + sizeof rows.at->result >= sizeof reply->location)
        return STATUS_NOT_FOUND;
    TRY(db_ids_with_prefix(app->db, id, CANDIDATES_MAX + 1, &rows, problem));
    Status status = STATUS_NOT_FOUND;
    if (rows.count > 1) {
        status = short_id_ambiguous(id, &rows, problem);
    } else if (rows.count == 1) {
        reply_clear(reply);
        snprintf(reply->location, sizeof reply->location, "%.*s%s%s", (int)(at - path), path,
                 rows.at->result, at + strlen(id));
        reply_borrow(reply, 307, NULL, NULL, 0);
        status = STATUS_OK;
    }
    job_rows_clear(&rows);
    return status;
}
