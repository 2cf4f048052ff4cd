// A pattern is literal text with {names}. A name takes the text up to the character that follows it
// in the pattern, or the rest of the segment: at least one character, never a '/'.
#include "server/http/router.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/spelling.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/util/base_path.h"

enum { PATH_MAX_SHOWN = 160, PARAMETERS_MAX = 512 };

typedef struct RouteSpan {
    const char *at;
    size_t size;
} RouteSpan;

typedef struct RouteMatch {
    RouteSpan spans[REQUEST_PARAMETERS]; // the {names}, in the path as sent
    size_t count;
    char allow[64]; // the methods of the first pattern that fits; "" if none does
} RouteMatch;

static bool route_match(const char *pattern, const char *path, RouteMatch *match) {
    match->count = 0;
    while (*pattern != '\0') {
        if (*pattern != '{') {
            if (*path++ != *pattern++)
                return false;
            continue;
        }
        assert(match->count < REQUEST_PARAMETERS);
        pattern = strchr(pattern, '}') + 1;
        size_t size = strcspn(path, "/");
        if (*pattern != '\0' && *pattern != '/') {
            const char *stop = memchr(path, *pattern, size);
            if (stop == NULL)
                return false;
            size = (size_t)(stop - path);
        }
        if (size == 0)
            return false;
        match->spans[match->count++] = (RouteSpan){path, size};
        path += size;
    }
    return *path == '\0';
}

static const Route *route_find(const Route *table, const char *method, const char *path,
                               RouteMatch *match) {
    const char *fitting = NULL;
    match->allow[0] = '\0';
    for (const Route *route = table; route->method != NULL; route++) {
        if (fitting != NULL ? strcmp(route->pattern, fitting) != 0
                            : !route_match(route->pattern, path, match))
            continue;
        fitting = route->pattern;
        if (strcmp(route->method, method) == 0)
            return route;
        text_list(match->allow, sizeof match->allow, route->method);
        if (strcmp(route->method, "GET") == 0)
            text_list(match->allow, sizeof match->allow, "HEAD");
    }
    return NULL;
}

// The pattern with its {names} filled from the segments of `path` at the same place, so that the
// distance between the two is that of the literal text. A name that shares its segment with literal
// text stays as it is.
static void route_fill(const char *pattern, const char *path, char *target, size_t size) {
    size_t used = 0;
    target[0] = '\0';
    while (*pattern == '/') {
        const size_t pattern_size = strcspn(pattern + 1, "/") + 1;
        const size_t path_size = *path == '/' ? strcspn(path + 1, "/") + 1 : 0;
        const bool is_name = pattern[1] == '{' && pattern[pattern_size - 1] == '}' &&
                             memchr(pattern + 2, '{', pattern_size - 2) == NULL;
        const bool takes_path = is_name && path_size > 1;
        const char *from = takes_path ? path : pattern;
        const size_t from_size = takes_path ? path_size : pattern_size;
        if (used + from_size >= size)
            return;
        memcpy(target + used, from, from_size);
        used += from_size;
        target[used] = '\0';
        pattern += pattern_size;
        path += path_size;
    }
}

// The nearest path to one that no route fits; false if none is similar.
static bool route_nearest(const Route *table, const char *path, char target[PATH_MAX_SHOWN]) {
    // Files of pages, whose names may be anything.
    static const char *const files[] = {"/web/", "/guide/", "/problems/"};
    char filled[PATH_MAX_SHOWN];
    const char *const candidates[] = {target, filled, NULL}; // the nearest so far, and one more
    target[0] = '\0';
    if (strlen(path) >= sizeof filled)
        return false;
    for (const Route *route = table; route->method != NULL; route++) {
        size_t i = 0;
        while (i < COUNT(files) && strncmp(route->pattern, files[i], strlen(files[i])) != 0)
            i++;
        if (i < COUNT(files))
            continue;
        route_fill(route->pattern, path, filled, sizeof filled);
        if (spelling_nearest(candidates, path) == filled)
            memcpy(target, filled, sizeof filled);
    }
    return target[0] != '\0';
}

// A path that a route fits with a slash at its end ("/guide/"), or without the one that it has.
// Folders of the documentation and of the dashboard are not meant.
static bool router_redirect_slash(const Router *router, const Request *request, Reply *reply) {
    RouteMatch match;
    char path[REQUEST_TARGET_MAX + 2];
    size_t size = strlen(request->path);
    if (strcmp(request->method, "GET") != 0 || size < 2 || size + 1 >= sizeof path ||
        strncmp(request->path, "/guide/", 7) == 0 || strncmp(request->path, "/web/", 5) == 0)
        return false;
    memcpy(path, request->path, size + 1);
    if (path[size - 1] == '/')
        path[--size] = '\0';
    else
        memcpy(path + size++, "/", 2);
    const char *query = strchr(request->target, '?');
    query = query != NULL ? query : "";
    if (route_find(router->routes, "GET", path, &match) == NULL ||
        size + strlen(query) >= sizeof reply->location)
        return false;
    memcpy(reply->location, path, size);
    memcpy(reply->location + size, query, strlen(query) + 1);
    base_path_apply(reply->location, sizeof reply->location);
    reply_borrow(reply, 308, NULL, NULL, 0);
    return true;
}

// CORS: whether a page of an allowed origin may send a request. The question has no token.
static bool router_answer_preflight(const Router *router, const Request *request, Reply *reply) {
    RouteMatch match;
    if (request->allow_origin == NULL || request->preflight == NULL ||
        strcmp(request->method, "OPTIONS") != 0)
        return false;
    (void)route_find(router->routes, "OPTIONS", request->path, &match);
    if (match.allow[0] == '\0')
        return false;
    snprintf(reply->allow, sizeof reply->allow, "%s", match.allow);
    reply->is_preflight = true;
    reply_borrow(reply, 204, NULL, NULL, 0);
    return true;
}

// ?pretty=1 is of every route: it is taken out before the route's own queries are checked.
static Status router_set_pretty(Request *request, Problem *problem) {
    static const char *const types[] = {"application/json", "text/html", NULL};
    for (size_t i = 0; i < request->query_count; i++) {
        if (strcmp(request->queries[i].name, "pretty") != 0)
            continue;
        TRY(request_flag(request, "pretty", &request->is_pretty, problem));
        request->is_pretty_asked = true;
        request->query_count--;
        memmove(&request->queries[i], &request->queries[i + 1],
                (request->query_count - i) * sizeof request->queries[0]);
        return STATUS_OK;
    }
    request->is_pretty = request->accept != NULL && strstr(request->accept, "text/html") != NULL &&
                         request_is_pretty_by_accept(request) &&
                         header_accept(request->accept, types) == 1;
    return STATUS_OK;
}

static Status router_refuse(const Router *router, const Request *request, const RouteMatch *match,
                            Reply *reply, Problem *problem) {
    char near[PATH_MAX_SHOWN];
    if (match->allow[0] != '\0') {
        snprintf(reply->allow, sizeof reply->allow, "%s", match->allow);
        return problem_set(problem, STATUS_METHOD, "%s is not for this path; it takes %s",
                           request->method, match->allow);
    }
    if (route_nearest(router->routes, request->path, near))
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is nothing at this path; did you mean %s%s?", base_path(), near);
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is nothing at this path; GET %s/openapi.json lists what there is",
                       base_path());
}

const char *const any_query[] = {NULL};

static Status router_check_queries(const Route *route, const Request *request, Problem *problem) {
    static const char *const none[] = {NULL};
    const char *const *allowed = route->queries != NULL ? route->queries : none;
    if (allowed == any_query)
        return STATUS_OK;
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

// Copies the parameters out of the path and decodes them.
static Status router_set_parameters(Request *request, const RouteMatch *match, Problem *problem) {
    char *text = request->parameter_storage;
    for (size_t i = 0; i < match->count; i++) {
        const size_t size = match->spans[i].size;
        if ((size_t)(text - request->parameter_storage) + size >= PARAMETERS_MAX)
            return problem_set(problem, STATUS_NOT_FOUND, "there is nothing under so long a name");
        memcpy(text, match->spans[i].at, size);
        text[size] = '\0';
        if (!request_decode(text, false))
            return problem_set(
                problem, STATUS_USAGE,
                "the path holds a broken escape; write %% and two hexadecimal digits");
        request->parameters[i] = text;
        text += size + 1;
    }
    return STATUS_OK;
}

// Turns a fault into its problem document, and records the answer if it is one.
static void router_close(const Router *router, const Request *request, Status status,
                         Problem *problem, Reply *reply) {
    if (status != STATUS_OK) {
        if (problem->status == STATUS_OK)
            problem_set(problem, status, "%s", status_title(status));
        reply->wait_ms = 0;
        base_path_apply(reply->link, sizeof reply->link);
        // Without the query, which may hold what should not be shown.
        char path[REQUEST_TARGET_MAX + 1];
        snprintf(path, sizeof path, "%.*s", (int)strcspn(request->target, "?"), request->target);
        reply_problem(reply, problem, reply->code == 416 ? 416 : 0, path, request->id);
        (void)reply_indent(reply, request);
    }
    if (reply->wait_ms == 0)
        access_record(router->access, request, reply);
}

// Immutable responses are made once: found by their target, which saves the look-up of the route.
static bool router_find_cached(const Router *router, Request *request, Reply *reply) {
    if (strcmp(request->method, "GET") != 0 || (request->is_pretty && !request->is_pretty_asked))
        return false;
    const bool accepts_gzip = header_accepts_gzip(request->accept_encoding);
    const Route **route = &request->route;
    if (accepts_gzip &&
        response_cache_find(router->response_cache, request->target, true, reply, route))
        return true;
    if (!response_cache_find(router->response_cache, request->target, false, reply, route))
        return false;
    if (!accepts_gzip || !reply->varies_by_encoding)
        return true;
    reply_clear(reply); // it is made once more, to be compressed
    return false;
}

static Status router_admit_cached(const Router *router, Request *request, Reply *reply,
                                  Problem *problem) {
    const Status status = access_authorize(router->access, request->route->scope, request, problem);
    if (status != STATUS_OK)
        reply_clear(reply);
    else if (!reply_is_known(reply, request))
        return reply_range(reply, request, problem);
    return status;
}

static Status router_open(const Router *router, Request *request, Reply *reply, Problem *problem) {
    RouteMatch match;
    const Route *route = route_find(router->routes, request->method, request->path, &match);
    request->route = route;
    if (route == NULL && router_redirect_slash(router, request, reply))
        return STATUS_OK;
    if (route == NULL)
        return router_refuse(router, request, &match, reply, problem);
    TRY(access_authorize(router->access, route->scope, request, problem));
    TRY(router_check_queries(route, request, problem));
    TRY(router_set_parameters(request, &match, problem));
    request->cache_age = response_cache_age(router->response_cache);
    return STATUS_OK;
}

bool router_admit(const Router *router, Request *request, Reply *reply) {
    // A Problem is large: problem_clear and encode_problem touch only what is used of it.
    Problem problem;
    problem_clear(&problem);
    Status status = router_set_pretty(request, &problem);
    if (status == STATUS_OK && !router_answer_preflight(router, request, reply)) {
        if (router_find_cached(router, request, reply))
            status = router_admit_cached(router, request, reply, &problem);
        else
            status = router_open(router, request, reply, &problem);
    }
    if (status == STATUS_OK && reply->code == 0)
        return true;
    router_close(router, request, status, &problem, reply);
    return false;
}

// The answer as this client accepts it; what never changes is kept for the next client.
static Status router_finish(const Router *router, Request *request, Reply *reply,
                            Problem *problem) {
    base_path_apply(reply->location, sizeof reply->location);
    base_path_apply(reply->link, sizeof reply->link);
    const bool is_cacheable = reply->is_immutable && reply->code == 200 &&
                              reply->stream.next == NULL && !reply->varies_by_accept &&
                              (!request->is_pretty || request->is_pretty_asked);
    TRY(reply_indent(reply, request));
    const bool is_packed = reply_pack(reply, request);
    if (is_cacheable)
        response_cache_put(router->response_cache, request->cache_age, request->target, is_packed,
                           request->route, reply);
    return reply_range(reply, request, problem);
}

bool router_answer(const Router *router, Request *request, Reply *reply) {
    Problem problem;
    problem_clear(&problem);
    Status status = STATUS_OK;
    if (request->is_resumed) // its token may have been revoked meanwhile
        status = access_authorize(router->access, request->route->scope, request, &problem);
    const bool is_admitted = status == STATUS_OK;
    if (is_admitted)
        status = request->route->handle(router->app, request, reply, &problem);
    if (status == STATUS_NOT_FOUND)
        status = router->not_found(router->app, request, reply, &problem);
    if (status == STATUS_OK && reply->wait_ms == 0)
        status = router_finish(router, request, reply, &problem);
    router_close(router, request, status, &problem, reply);
    return is_admitted;
}

bool router_still_admits(const Router *router, Request *request) {
    return access_authorize(router->access, request->route->scope, request, NULL) == STATUS_OK;
}
