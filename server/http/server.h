// The door: listens, collects requests, has them answered, sends the replies.
// libmicrohttpd lives in listener.c, exchange.c and sending.c
// alone. Not routes and not rights (dispatch.h). Used by
// cli/serve.c.
#ifndef SERVER_HTTP_SERVER_H
#define SERVER_HTTP_SERVER_H

#include "server/http/address.h"
#include "server/http/request.h"
#include "server/http/tls.h"
#include "server/http/validate.h"

typedef struct Server Server;

typedef struct ServerSettings {
    Address address;
    size_t body_most; // bytes; a larger body is answered 413
    // Both are called from several threads. The first answers what takes no waiting and no more
    // than a moment, on the event loop, or returns false with `reply` untouched; then the second
    // is called on a thread where it may take its time.
    bool (*answer_at_once)(void *context, Request *request, Reply *reply);
    void (*answer)(void *context, Request *request, Reply *reply);
    // Asked before a body is taken, on the event loop: false and a refusal in `reply`. May be NULL.
    bool (*admits)(void *context, Request *request, Reply *reply);
    // Asked now and then while a body is made piece by piece, on the event loop: false ends it. May
    // be NULL.
    bool (*still_admits)(void *context, Request *request);
    // Told of refusals that none of them made. May be NULL.
    void (*note)(void *context, const Request *request, const Reply *reply);
    void *context;
    const AcceptedHosts *hosts;     // NULL: gate_loopback
    CertificateSource *certificate; // NULL: no TLS
} ServerSettings;

// Fails as address_open does.
Status server_open(const ServerSettings *settings, Server **server, Problem *problem);
// "http://127.0.0.1:8080", with the port that was chosen.
const char *server_url(const Server *server);
// Takes no more connections, ends all waiting and lets requests under way finish for at most
// `grace_ms`. When this returns nothing is being answered.
void server_stop(Server *server, int grace_ms);
// Frees what wakers point to: after whoever may call them is gone.
void server_free(Server *server);

// How many clients are connected now.
size_t server_connections(const Server *server);

#endif
