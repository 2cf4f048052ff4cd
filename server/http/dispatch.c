#include "server/http/dispatch.h"

#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "server/base/link.h"
#include "server/http/body.h"
#include "server/http/reply.h"

static Status check_queries(const Route *route, const Request *request, Problem *problem) {
    static const char *const none[] = {NULL};
    const char *const *allowed = route->queries != NULL ? route->queries : none;
    for (size_t i = 0; i < request->query_count; i++) {
        const char *name = request->queries[i].name;
        size_t at = 0;
        while (allowed[at] != NULL && strcmp(allowed[at], name) != 0)
            at++;
        if (allowed[at] != NULL)
            continue;
        const char *nearest = texts_nearest(allowed, name);
        char list[160] = "";
        for (size_t k = 0; allowed[k] != NULL; k++) {
            const size_t used = strlen(list);
            snprintf(list + used, sizeof list - used, "%s%s", k > 0 ? ", " : "", allowed[k]);
        }
        if (nearest != NULL)
            return problem_set(problem, STATUS_USAGE,
                               "unknown query parameter \"%.40s\"; did you mean \"%s\"?", name,
                               nearest);
        if (allowed[0] == NULL)
            return problem_set(problem, STATUS_USAGE,
                               "unknown query parameter \"%.40s\"; there are none here", name);
        return problem_set(problem, STATUS_USAGE,
                           "unknown query parameter \"%.40s\"; known here: %s", name, list);
    }
    return STATUS_OK;
}

// Cuts the parameters out of the path, which is the request's own storage, and decodes them.
static Status set_parameters(Request *request, const RouteSpan *spans, size_t count, char *scratch,
                             size_t room, Problem *problem) {
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        if (used + spans[i].size + 1 > room)
            return problem_set(problem, STATUS_NOT_FOUND, "there is nothing under so long a name");
        char *text = scratch + used;
        memcpy(text, spans[i].at, spans[i].size);
        text[spans[i].size] = '\0';
        used += spans[i].size + 1;
        if (!request_decode(text, false))
            return problem_set(
                problem, STATUS_USAGE,
                "the path holds a broken escape; write %% and two hexadecimal digits");
        request->parameters[i] = text;
    }
    return STATUS_OK;
}

// The request's route, which its token may use.
static Status find(const Dispatcher *dispatcher, Request *request, RouteSpan *spans, size_t *count,
                   Reply *reply, Problem *problem) {
    char allow[64], near[ROUTE_SEGMENT_MOST];
    request->path = link_inside(request->path);
    const Route *route =
        route_find(dispatcher->table, request->method, request->path, spans, count, allow);
    request->route = route;
    if (route == NULL && allow[0] != '\0') {
        snprintf(reply->allow, sizeof reply->allow, "%s", allow);
        return problem_set(problem, STATUS_METHOD, "%s is not for this path; it takes %s",
                           request->method, allow);
    }
    if (route == NULL && route_nearest(dispatcher->table, request->path, near, sizeof near))
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is nothing at this path; did you mean %s?", near);
    if (route == NULL)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is nothing at this path; GET /openapi.json lists what there is");
    return doorman_admit(dispatcher->doorman, route->scope, request, problem);
}

static Status answer(const Dispatcher *dispatcher, Request *request, Reply *reply,
                     Problem *problem) {
    RouteSpan spans[REQUEST_PARAMETERS];
    size_t count = 0;
    char scratch[512];
    TRY(find(dispatcher, request, spans, &count, reply, problem));
    TRY(check_queries(request->route, request, problem));
    TRY(set_parameters(request, spans, count, scratch, sizeof scratch, problem));
    TRY(request->route->handle(dispatcher->app, request, reply, problem));
    if (reply->wait_ms > 0)
        return STATUS_OK;
    return reply_range(reply, request, problem);
}

static void refuse(const Request *request, Status status, Problem *problem, Reply *reply) {
    if (problem->status == STATUS_OK)
        problem_set(problem, status, "%s", status_title(status));
    reply->wait_ms = 0;
    body_problem(reply, problem, reply->code == 416 ? 416 : 0, request->target, request->id);
}

void dispatch(void *context, Request *request, Reply *reply) {
    const Dispatcher *dispatcher = context;
    // A Problem is large: problem_clear and write_problem touch only what is used of it.
    Problem problem;
    problem_clear(&problem);
    const Status status = answer(dispatcher, request, reply, &problem);
    memset(request->parameters, 0, sizeof request->parameters);
    if (status != STATUS_OK)
        refuse(request, status, &problem, reply);
    if (reply->wait_ms > 0)
        return;
    link_apply(reply->location, sizeof reply->location);
    link_apply(reply->link, sizeof reply->link);
    doorman_note(dispatcher->doorman, request, reply);
}

bool dispatch_admits(void *context, Request *request, Reply *reply) {
    const Dispatcher *dispatcher = context;
    RouteSpan spans[REQUEST_PARAMETERS];
    size_t count = 0;
    Problem problem;
    problem_clear(&problem);
    const Status status = find(dispatcher, request, spans, &count, reply, &problem);
    if (status == STATUS_OK)
        return true;
    refuse(request, status, &problem, reply);
    doorman_note(dispatcher->doorman, request, reply);
    return false;
}

void dispatch_note(void *context, const Request *request, const Reply *reply) {
    const Dispatcher *dispatcher = context;
    doorman_note(dispatcher->doorman, request, reply);
}
