// From a Request to a Reply: find the route, check what all routes have in common, call the
// handler, turn its fault into a problem document. Not the gate (gate.h), not sockets (listener.h).
// Used by cli/serve.c, as the listener's answerer, and by tests without sockets.
#ifndef SERVER_HTTP_DISPATCH_H
#define SERVER_HTTP_DISPATCH_H

#include "server/http/access.h"
#include "server/http/response_cache.h"
#include "server/http/route.h"

typedef struct Dispatcher {
    App *app;
    const Route *table;
    const QuickHandler *quick;     // of the table's; may be NULL
    ResponseCache *response_cache; // whole answers that never change; may be NULL
    const AccessControl *access;   // NULL: whoever comes, nothing counted
} Dispatcher;

// Fills `reply` in any case; reply->wait_ms > 0 asks to be called again. `context` is a Dispatcher.
void dispatch(void *context, Request *request, Reply *reply);

// The same for what takes no more than a moment: an answer that is there already, or a quick
// route's. False if it is neither, with `reply` untouched.
bool dispatch_quick(void *context, Request *request, Reply *reply);

// Judges a request by its head, before its body is taken: false where dispatch would refuse it for
// its path or its token, with the refusal in `reply`.
bool dispatch_admits(void *context, Request *request, Reply *reply);
// Whether whoever sent an admitted request may still have its answer: a token may be revoked
// meanwhile.
bool dispatch_still_admits(void *context, Request *request);
// Notes an answer that did not come from here: a refusal of the listener's.
void dispatch_note(void *context, const Request *request, const Reply *reply);

#endif
