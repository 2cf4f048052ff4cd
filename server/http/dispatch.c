#include "server/http/dispatch.h"

#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/spelling.h"
#include "server/http/body.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/util/base_path.h"

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
        const char *nearest = spelling_nearest(allowed, name);
        char list[160] = "";
        for (size_t k = 0; allowed[k] != NULL; k++)
            text_list(list, sizeof list, allowed[k]);
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

// A finished answer as this client takes it; what never changes is kept for the next one.
static Status finish(const Dispatcher *dispatcher, const Route *route, uint64_t age,
                     const Request *request, Reply *reply, Problem *problem) {
    const bool is_packed = reply_pack(reply, request);
    const bool is_kept = dispatcher->response_cache != NULL && reply->is_immutable &&
                         reply->code == 200 && reply->stream.next == NULL &&
                         !reply->varies_by_accept;
    if (is_kept)
        response_cache_put(dispatcher->response_cache, age, request->target, is_packed, route,
                           reply);
    return reply_range(reply, request, problem);
}

static Status answer(const Dispatcher *dispatcher, const Route *route, Handler *handle,
                     const RouteSpan *spans, size_t count, Request *request, Reply *reply,
                     Problem *problem) {
    char scratch[512];
    if (!request->is_admitted)
        TRY(access_authorize(dispatcher->access, route->scope, request, problem));
    request->is_admitted = false; // whoever sleeps is judged again
    TRY(check_queries(route, request, problem));
    TRY(set_parameters(request, spans, count, scratch, sizeof scratch, problem));
    const uint64_t age =
        dispatcher->response_cache != NULL ? response_cache_age(dispatcher->response_cache) : 0;
    TRY(handle(dispatcher->app, request, reply, problem));
    if (reply->wait_ms > 0 || reply->code == 0)
        return STATUS_OK;
    base_path_apply(reply->location, sizeof reply->location);
    base_path_apply(reply->link, sizeof reply->link);
    return finish(dispatcher, route, age, request, reply, problem);
}

static Status refuse(const Dispatcher *dispatcher, const Request *request, const char *allow,
                     Reply *reply, Problem *problem) {
    char near[ROUTE_SEGMENT_MAX];
    if (allow[0] != '\0') {
        snprintf(reply->allow, sizeof reply->allow, "%s", allow);
        return problem_set(problem, STATUS_METHOD, "%s is not for this path; it takes %s",
                           request->method, allow);
    }
    if (route_nearest(dispatcher->table, request->path, near))
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is nothing at this path; did you mean %s%s?", base_path(), near);
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is nothing at this path; GET %s/openapi.json lists what there is",
                       base_path());
}

// Turns a fault into its problem document, and has the answer noted if it is one.
static void close_up(const Dispatcher *dispatcher, Request *request, Status status,
                     Problem *problem, Reply *reply) {
    memset(request->parameters, 0, sizeof request->parameters);
    if (status != STATUS_OK) {
        if (problem->status == STATUS_OK)
            problem_set(problem, status, "%s", status_title(status));
        reply->wait_ms = 0;
        base_path_apply(reply->link, sizeof reply->link);
        body_problem(reply, problem, reply->code == 416 ? 416 : 0, request->target, request->id);
    }
    if (reply->wait_ms == 0)
        access_log(dispatcher->access, request, reply);
}

static const Route *find(const Dispatcher *dispatcher, Request *request, RouteSpan *spans,
                         size_t *count, char allow[64]) {
    request->route =
        route_find(dispatcher->table, request->method, request->path, spans, count, allow);
    return request->route;
}

void dispatch(void *context, Request *request, Reply *reply) {
    const Dispatcher *dispatcher = context;
    RouteSpan spans[REQUEST_PARAMETERS];
    size_t count = 0;
    char allow[64];
    // A Problem is large: problem_clear and encode_problem touch only what is used of it.
    Problem problem;
    problem_clear(&problem);
    const Route *route = find(dispatcher, request, spans, &count, allow);
    const Status status = route != NULL ? answer(dispatcher, route, route->handle, spans, count,
                                                 request, reply, &problem)
                                        : refuse(dispatcher, request, allow, reply, &problem);
    close_up(dispatcher, request, status, &problem, reply);
}

bool dispatch_admits(void *context, Request *request, Reply *reply) {
    const Dispatcher *dispatcher = context;
    RouteSpan spans[REQUEST_PARAMETERS];
    size_t count = 0;
    char allow[64];
    Problem problem;
    problem_clear(&problem);
    const Route *route = find(dispatcher, request, spans, &count, allow);
    const Status status =
        route != NULL ? access_authorize(dispatcher->access, route->scope, request, &problem)
                      : refuse(dispatcher, request, allow, reply, &problem);
    request->is_admitted = status == STATUS_OK;
    if (request->is_admitted)
        return true;
    close_up(dispatcher, request, status, &problem, reply);
    return false;
}

bool dispatch_still_admits(void *context, Request *request) {
    const Dispatcher *dispatcher = context;
    return request->route == NULL ||
           access_authorize(dispatcher->access, request->route->scope, request, NULL) == STATUS_OK;
}

void dispatch_note(void *context, const Request *request, const Reply *reply) {
    const Dispatcher *dispatcher = context;
    access_log(dispatcher->access, request, reply);
}

static bool find_hot(const Dispatcher *dispatcher, Request *request, Reply *reply) {
    if (dispatcher->response_cache == NULL || strcmp(request->method, "GET") != 0)
        return false;
    const bool takes_gzip = header_accepts_gzip(request->accept_encoding);
    const Route **route = &request->route;
    if (!takes_gzip ||
        !response_cache_find(dispatcher->response_cache, request->target, true, reply, route)) {
        if (!response_cache_find(dispatcher->response_cache, request->target, false, reply, route))
            return false;
        if (takes_gzip && reply->varies_by_encoding) {
            reply_clear(reply); // it is made once more, to be packed
            return false;
        }
    }
    Problem problem;
    problem_clear(&problem);
    Status status = access_authorize(dispatcher->access, request->route->scope, request, &problem);
    if (status != STATUS_OK)
        reply_clear(reply);
    else if (!reply_is_known(reply, request))
        status = reply_range(reply, request, &problem);
    close_up(dispatcher, request, status, &problem, reply);
    return true;
}

static Handler *find_quick(const Dispatcher *dispatcher, const Route *route) {
    const QuickHandler *quick = dispatcher->quick;
    while (quick != NULL && quick->of != NULL && quick->of != route->handle)
        quick++;
    return quick != NULL ? quick->quick : NULL;
}

bool dispatch_quick(void *context, Request *request, Reply *reply) {
    const Dispatcher *dispatcher = context;
    enum { QUICK_BYTES = 64 * 1024 }; // of a body that is read in a moment
    if (find_hot(dispatcher, request, reply))
        return true;
    RouteSpan spans[REQUEST_PARAMETERS];
    size_t count = 0;
    char allow[64];
    const Route *route = find(dispatcher, request, spans, &count, allow);
    Handler *const handle = route != NULL ? find_quick(dispatcher, route) : NULL;
    if (handle == NULL || request->body_size > QUICK_BYTES)
        return false;
    Problem problem;
    problem_clear(&problem);
    const Status status = answer(dispatcher, route, handle, spans, count, request, reply, &problem);
    if (status == STATUS_OK && reply->code == 0 && reply->wait_ms == 0)
        return false;
    close_up(dispatcher, request, status, &problem, reply);
    return true;
}
