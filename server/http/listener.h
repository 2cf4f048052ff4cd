// The door: listens, collects requests, has them answered, sends the replies.
// libmicrohttpd lives in listener.c alone. Not routes and not rights (dispatch.h). Used by
// command/serve.c.
#ifndef SERVER_HTTP_LISTENER_H
#define SERVER_HTTP_LISTENER_H

#include "server/http/address.h"
#include "server/http/gate.h"
#include "server/http/request.h"

typedef struct Listener Listener;

typedef struct ListenerSettings {
    Address address;
    size_t body_most;               // bytes; a larger body is answered 413
    const GateHosts *hosts;         // NULL: gate_loopback
    const char *tls_cert, *tls_key; // PEM; NULL: no TLS
    // The three are called from several threads. `admits` is asked before a body is taken, `note`
    // told of refusals that `answer` did not make; both may be NULL.
    void (*answer)(void *context, Request *request, Reply *reply);
    bool (*admits)(void *context, Request *request, Reply *reply);
    void (*note)(void *context, const Request *request, const Reply *reply);
    void *context;
} ListenerSettings;

// Fails as address_open does.
Status listener_open(const ListenerSettings *settings, Listener **listener, Problem *problem);
// "http://127.0.0.1:8080", with the port that was chosen.
const char *listener_url(const Listener *listener);
// Takes no more connections, ends all waiting and lets requests under way finish for at most
// `grace_ms`. When this returns nothing is being answered.
void listener_stop(Listener *listener, int grace_ms);
// Frees what wakers point to: after whoever may call them is gone.
void listener_free(Listener *listener);

// How many clients are connected now.
size_t listener_connections(Listener *listener);

#endif
