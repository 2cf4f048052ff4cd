// The HTTP server: accepts connections, collects requests, has them answered, sends the replies.
// libmicrohttpd is used in server.c, connection.c and connection.h alone.
#ifndef SERVER_HTTP_SERVER_H
#define SERVER_HTTP_SERVER_H

#include "server/http/address.h"
#include "server/http/router.h"
#include "server/http/tls.h"
#include "server/http/validate.h"

typedef struct Server Server;

typedef struct ServerSettings {
    Address address;
    size_t body_most; // bytes; a larger body is answered 413
    const Router *router;
    const AcceptedHosts *hosts;     // NULL: gate_loopback
    CertificateSource *certificate; // NULL: no TLS
} ServerSettings;

// Fails as address_open does.
Status server_open(const ServerSettings *settings, Server **server, Problem *problem);
// "http://127.0.0.1:8080", with the port that was chosen.
const char *server_url(const Server *server);
// Accepts no more connections, ends all waits and lets requests under way finish for at most
// `grace_ms`. When this returns no handler runs.
void server_stop(Server *server, int grace_ms);
// Frees what requests' callbacks point to: none may be called any more.
void server_free(Server *server);

// The number of open connections.
size_t server_connections(const Server *server);

#endif
