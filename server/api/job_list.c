// GET /v1/jobs: newest first, a page at a time, by what they are called, what became of them and
// when they came. The next page's link says all that was asked for again.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/rfc3339.h"
#include "core/study/study.h"
#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/api/query.h"
#include "server/http/reply.h"
#include "server/jobs/job.h"

enum { LIST_INITIAL = 20, LIST_MAX = 100 };

// Unfinished jobs whose state is asked for are looked at one by one, this many at a time.
enum { LOOKED_AT = 256 };

// A row knows no progress: of an unfinished job the queue is asked. False where the job is not in
// the state that was asked for (-1: any).
static bool list_row(App *app, Bytes *bytes, const JobRow *row, int state, const char *separator) {
    JobView show = {0};
    Job *job = NULL;
    const bool is_unfinished = !job_state_is_final(row->state);
    if (is_unfinished && jobs_find(app->manager, row->id, &job, NULL) == STATUS_OK) {
        const Status status = job_view(job, &show);
        const bool is_meant = state < 0 || (int)show.state == state;
        job_unref(job);
        if (status == STATUS_OK && is_meant) {
            bytes_text(bytes, separator);
            job_json_put(bytes, &show, JOB_PUT_LINKS | JOB_PUT_SENDER);
        }
        job_view_clear(&show);
        if (status == STATUS_OK)
            return is_meant;
    }
    if (state >= 0 && row->state != state)
        return false;
    show = (JobView){.state = (JobState)row->state,
                     .progress = row->state == JOB_SUCCESSFUL ? 100 : 0,
                     .is_cached = row->is_cached,
                     .created_unix_ms = row->created_unix_ms,
                     .started_unix_ms = row->started_unix_ms,
                     .finished_unix_ms = row->finished_unix_ms,
                     .queued = row->queued,
                     .run = row->run,
                     .total = row->total,
                     .problem = row->problem,
                     .title = row->title,
                     .labels = row->labels,
                     .study = row->study,
                     .client = row->client,
                     .is_result_deleted = !row->has_result};
    text_fit(show.id, sizeof show.id, row->id);
    text_fit(show.result, sizeof show.result, row->result);
    bytes_text(bytes, separator);
    job_json_put(bytes, &show, JOB_PUT_LINKS | JOB_PUT_SENDER); // borrows the row's texts
    return true;
}

static Status read_time(const Request *request, const char *name, bool is_end, int64_t *unix_ms,
                        Problem *problem) {
    const char *text;
    TRY(query_text(request, name, &text, problem));
    if (text == NULL)
        return STATUS_OK;
    if (!rfc3339_read(text, unix_ms))
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" must be a day or a time as of RFC 3339, "
                           "2026-11-21T09:00:00Z, is \"%.40s\"",
                           name, text);
    if (is_end && strlen(text) == 10)
        *unix_ms += 86399999; // the whole of that day
    return STATUS_OK;
}

static Status read_search(const Request *request, JobSearch *search, int *state, Problem *problem) {
    const char *kinds[32] = {"none"};
    size_t count = 1;
    for (size_t i = 0; studies[i] != NULL && count + 1 < COUNT(kinds); i++)
        kinds[count++] = studies[i]->kind.name;
    size_t limit;
    int kind;
    TRY(request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &limit, problem));
    *search = job_search_all(limit);
    TRY(query_choice(request, "status", job_state_names, -1, state, problem));
    TRY(query_choice(request, "kind", kinds, -1, &kind, problem));
    TRY(query_text(request, "before", &search->before, problem));
    if (search->before != NULL)
        search->before_unix_ms = job_id_unix_ms(search->before);
    TRY(query_text(request, "q", &search->words, problem));
    TRY(query_text(request, "label", &search->label, problem));
    TRY(query_text(request, "result", &search->result, problem));
    TRY(read_time(request, "since", false, &search->since_unix_ms, problem));
    TRY(read_time(request, "until", true, &search->until_unix_ms, problem));
    if (kind >= 0) // the names are the studies' own, and outlive this
        search->study = kinds[kind];
    // The store knows an unfinished job only as accepted.
    if (*state == JOB_ACCEPTED || *state == JOB_RUNNING)
        search->most_state = JOB_RUNNING;
    else if (*state >= 0)
        search->least_state = search->most_state = *state;
    return STATUS_OK;
}

// Up to `most` jobs into `bytes`. `last` gets the last one's id where more may follow, else "".
static Status list(App *app, JobSearch search, int state, Bytes *bytes, char last[40],
                   Problem *problem) {
    const size_t most = search.most;
    const bool is_live = state == JOB_ACCEPTED || state == JOB_RUNNING;
    char before[40];
    size_t count = 0;
    last[0] = '\0';
    // One more than asked for tells whether there is a next page.
    search.most = is_live ? LOOKED_AT : most + 1;
    for (;;) {
        JobRows rows = {0};
        TRY(db_job_search(app->db, &search, &rows, problem));
        bool is_full = false;
        for (size_t i = 0; i < rows.count && !is_full; i++) {
            is_full = count == most;
            if (!is_full && list_row(app, bytes, &rows.at[i], state, count > 0 ? ",\n " : "")) {
                count++;
                text_fit(last, 40, rows.at[i].id);
            }
        }
        const bool is_more = is_live && rows.count == search.most && !is_full;
        if (is_more)
            text_fit(before, sizeof before, rows.at[rows.count - 1].id);
        job_rows_clear(&rows);
        if (!is_more) {
            if (!is_full)
                last[0] = '\0';
            return STATUS_OK;
        }
        search.before = before;
        search.before_unix_ms = job_id_unix_ms(before);
    }
}

Status jobs_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    JobSearch search;
    int state;
    TRY(read_search(request, &search, &state, problem));
    Bytes bytes = {.most = app->reply_most};
    char last[40];
    bytes_text(&bytes, "{\"jobs\": [");
    const Status status = list(app, search, state, &bytes, last, problem);
    if (status != STATUS_OK) {
        bytes_clear(&bytes);
        return status;
    }
    bytes_text(&bytes, "]}\n");
    if (last[0] != '\0')
        query_link_next(request, reply, "before", last);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}
