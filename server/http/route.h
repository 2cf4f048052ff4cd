// What ONE endpoint is, and how a path finds it; api/routes.c lists all.
// Not the handlers and not who may call them. Used by dispatch.c, api/ and the contract tests.
#ifndef SERVER_HTTP_ROUTE_H
#define SERVER_HTTP_ROUTE_H

#include "server/http/request.h"

typedef struct App App; // api/app.h

typedef Status Handler(App *app, const Request *request, Reply *reply, Problem *problem);

typedef struct Route {
    const char *method; // "GET"
    const char
        *pattern; // "/v1/results/{id}/series.{format}": {x} matches one segment or the rest of one
    const char *scope;          // "read", "submit", "materials", "admin"; "open": needs no token
    const char *const *queries; // names allowed in the query, NULL-terminated; NULL for none
    const char *doc;
    Handler *handle;
} Route;

// A handler's answer on the event loop: what takes a moment at most and waits for nothing. It may
// decline by leaving the reply's code 0, and `of` is asked on a thread.
typedef struct QuickHandler {
    Handler *of, *quick;
} QuickHandler;
extern const QuickHandler quick_handlers[]; // ends with NULL

extern const Route routes[]; // ends with method == NULL; of two patterns that fit, the first counts

enum { ROUTE_SEGMENT_MAX = 160 };

// Whether `pattern` fits the path as sent. Fills `spans` (start and length in `path`) for each
// {..}.
typedef struct RouteSpan {
    const char *at;
    size_t size;
} RouteSpan;
bool route_match(const char *pattern, const char *path, RouteSpan spans[REQUEST_PARAMETERS],
                 size_t *count);

// The first route whose method and pattern fit; NULL if there is none. `allow` gets the methods of
// the first fitting pattern ("GET, HEAD"), "" if no pattern fits.
const Route *route_find(const Route *table, const char *method, const char *path,
                        RouteSpan spans[REQUEST_PARAMETERS], size_t *count, char allow[64]);

// The nearest path to one that no route fits; false if none is near enough to be meant.
bool route_nearest(const Route *table, const char *path, char target[ROUTE_SEGMENT_MAX]);

#endif
