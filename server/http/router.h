// From a Request to a Reply: one look-up of the route, what all routes have in common, the handler,
// problem documents, the cache of responses.
#ifndef SERVER_HTTP_ROUTER_H
#define SERVER_HTTP_ROUTER_H

#include "server/http/access.h"
#include "server/http/response_cache.h"

typedef struct Router {
    App *app;
    const Route *routes; // ends with method == NULL; the first that fits counts
    ResponseCache *response_cache;
    const AccessControl *access;
    Handler *not_found; // called where a handler found nothing: may answer
} Router;

extern const Route routes[]; // api/routes.c

// Looks at a request's head, before its body is read. True: router_answer is to be called once the
// body is there; request->route and request->client are set. False: `reply` is the answer already,
// a cached response or a refusal.
bool router_admit(const Router *router, Request *request, Reply *reply);

// Calls the handler and fills `reply`. reply->wait_ms > 0 asks for another call. False: the request
// waited and may not go on, and the handler was not called: request->kept is to be freed.
bool router_answer(const Router *router, Request *request, Reply *reply);

// Whether the sender of an admitted request may still have its answer: its token may have been
// revoked.
bool router_still_admits(const Router *router, Request *request);

#endif
