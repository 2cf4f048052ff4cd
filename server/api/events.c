// GET /v1/jobs/{id}/events: what happens to a job, as it happens (text/event-stream of the HTML
// standard).
//
//     event: progress   id: 1 + 100 * percent, one more once it runs   {"status", "progress", ...}
//     event: finished   id: 20000, the last one                        the job's document
//     event: stopping   no id: the daemon ends, the job goes on at the next start
//
// The id says how far the job is, so nothing needs to be remembered for a client that comes back
// with Last-Event-ID: it gets what is beyond that, and 204 behind the last one, which ends its
// coming back.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/util/clock.h"

enum {
    POLL_MS = 250,        // between two reads of the progress of a job
    HEARTBEAT_MS = 15000, // of silence at most
    RETRY_MS = 2000,
    FINISHED_ID = 20000,
};

typedef struct Events {
    App *app;
    Job *job;
    const Callback *callback;
    Bytes text; // not sent yet, from `sent`
    size_t sent;
    int last_id;
    int64_t spoke_ns;
    bool is_complete; // `text` has the last event
} Events;

static const char no_memory[] = ": no memory\n\n";

static void events_release(void *context) {
    Events *events = context;
    job_unsubscribe(events->job, events->callback);
    job_unref(events->job);
    bytes_clear(&events->text);
    free(events);
}

// A document in one event: each of its lines is a line of data.
static void events_put_data(Bytes *text, const char *document) {
    for (;;) {
        const size_t length = strcspn(document, "\n");
        bytes_text(text, "data: ");
        bytes_put(text, document, length);
        bytes_text(text, "\n");
        if (document[length] == '\0')
            break;
        document += length + 1;
    }
    bytes_text(text, "\n");
}

static void events_put_finished(Events *events) {
    JobView show = {0};
    Bytes document = {.most = events->app->reply_most};
    if (job_view(events->job, &show) == STATUS_OK)
        job_json_put(&document, &show, JOB_PUT_WHOLE | JOB_PUT_LINKS | JOB_PUT_SENDER);
    job_view_clear(&show);
    char *job = bytes_take(&document, NULL);
    bytes_format(&events->text, "event: finished\nid: %d\n", FINISHED_ID);
    events_put_data(&events->text, job != NULL ? job : "{}");
    free(job);
    events->last_id = FINISHED_ID;
    events->is_complete = true;
}

static void events_put_progress(Events *events, JobState state, double progress) {
    const int id = 1 + (state == JOB_RUNNING) + (int)(100 * progress);
    if (id <= events->last_id)
        return;
    JobView show = {0};
    if (job_view(events->job, &show) == STATUS_OK)
        bytes_json(&events->text,
                   "event: progress\nid: %d\ndata: {\"status\": %s, \"progress\": %g, \"timing\": "
                   "{\"queued\": %g, \"run\": %g, \"total\": %g}}\n\n",
                   id, job_state_names[state], progress, show.row.queued, show.row.run,
                   show.row.total);
    job_view_clear(&show);
    events->last_id = id;
}

// Appends the events that are new.
static void events_poll(Events *events) {
    double progress;
    // Before the state is read, so that no change is missed; a subscription ends with its call.
    (void)job_subscribe(events->job, JOB_IS_FINISHED, events->callback);
    const JobState state = job_peek(events->job, &progress);
    if (job_state_is_final((int)state)) {
        events_put_finished(events);
    } else if (atomic_load(&events->app->is_stopping)) {
        bytes_text(&events->text, "event: stopping\n");
        events_put_data(
            &events->text,
            "{\"detail\": \"the server stops; the job continues when it is started again\"}");
        events->is_complete = true;
    } else {
        events_put_progress(events, state, progress);
    }
}

static ptrdiff_t events_next(void *context, char *target, size_t size) {
    Events *events = context;
    Bytes *text = &events->text;
    const int64_t now = clock_monotonic_ns();
    if (events->sent == text->count && !events->is_complete) {
        bytes_clear(text);
        events->sent = 0;
        events_poll(events);
        if (text->count == 0 && now - events->spoke_ns > (int64_t)HEARTBEAT_MS * 1000000)
            bytes_text(text, ": still here\n\n");
        if (text->is_failed) {
            bytes_clear(text);
            bytes_text(text, no_memory);
            events->is_complete = true;
        }
    }
    const size_t left = text->count - events->sent;
    if (left == 0)
        return events->is_complete ? STREAM_END : STREAM_WAIT;
    const size_t count = left < size ? left : size;
    memcpy(target, text->at + events->sent, count);
    events->sent += count;
    events->spoke_ns = now;
    return (ptrdiff_t)count;
}

// 0: none, or not an id of this stream.
static int events_read_last_id(const Request *request) {
    const char *text = request->last_event_id;
    if (text == NULL || *text == '\0' || strlen(text) > 6 || text[strspn(text, "0123456789")])
        return 0;
    return (int)strtol(text, NULL, 10);
}

Status jobs_events(App *app, const Request *request, Reply *reply, Problem *problem) {
    Job *job = NULL;
    TRY(job_find_visible(app, request, &job, problem));
    if (events_read_last_id(request) >= FINISHED_ID) {
        job_unref(job);
        reply_borrow(reply, 204, NULL, NULL, 0);
        return STATUS_OK;
    }
    Events *events = calloc(1, sizeof *events);
    if (events == NULL) {
        job_unref(job);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the events");
    }
    *events = (Events){.app = app,
                       .job = job,
                       .callback = request->callback,
                       .last_id = events_read_last_id(request),
                       .spoke_ns = clock_monotonic_ns()};
    bytes_format(&events->text, "retry: %d\n\n", RETRY_MS);
    reply->code = 200;
    reply->content_type = "text/event-stream";
    reply->stream = (Stream){.next = events_next, .size = UINT64_MAX, .wait_ms = POLL_MS};
    reply->release = events_release;
    reply->context = events;
    return STATUS_OK;
}
