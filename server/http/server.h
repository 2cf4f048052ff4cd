// Where the server listens, its certificate, and the server itself: accepts connections, collects
// requests, has them answered, sends the replies. libmicrohttpd is used in event_loop.c,
// connection.c and connection.h alone.
#ifndef SERVER_HTTP_SERVER_H
#define SERVER_HTTP_SERVER_H

#include "server/http/router.h"
#include "server/util/base_path.h"

typedef struct Address {
    char host[64]; // "127.0.0.1", "::1"
    uint16_t port; // 0: any free one
} Address;

// Reads "127.0.0.1:8080", "localhost:0", "[::1]:8080", "0.0.0.0:8080", ":8080" or "8080"; without a
// host it is 127.0.0.1. STATUS_USAGE for what is not an address.
Status address_read(const char *text, Address *address, Problem *problem);

// A listening, non-blocking socket in *descriptor, and the port it got in `address`.
// STATUS_CONFLICT if the port is taken, STATUS_IO for other reasons.
Status address_open(Address *address, int *descriptor, Problem *problem);

// Whether only this machine can reach it; whether it means all addresses of this machine.
bool address_is_loopback(const Address *address);
bool address_is_any(const Address *address);

// "http://127.0.0.1:8080"
void address_url(const Address *address, bool has_tls, char target[96]);

// "https://sim.example.org/impactd"
typedef struct BaseUrl {
    char text[256];            // without a slash at its end
    char host[200];            // as a Host header has it, without port
    char path[LINK_BASE_SIZE]; // "/impactd", or ""
} BaseUrl;

// STATUS_USAGE says what would be right.
Status base_url_read(const char *text, BaseUrl *url, Problem *problem);

// The certificate and its key are checked before they are used, so that a fault is reported in
// words, and replaced while connections come and go.

// Answers handshakes with this one from now on; both as PEM text. STATUS_USAGE for what cannot be
// read, for a key that is not the certificate's, and for a certificate whose time is over:
// `cert_path` and `key_path` are named in the fault, and what was used before stays.
Status tls_use(const char *cert, const char *cert_path, const char *key, const char *key_path,
               Problem *problem);

// A gnutls_certificate_retrieve_function2 that hands out the one in use; NULL while there is none.
typedef void CertificateSource(void);
CertificateSource *tls_source(void);

// Whether a session (gnutls_session_t) has decrypted bytes that were not read yet.
bool tls_has_pending(void *session);

// When no connection is left.
void tls_forget(void);

typedef struct Server Server;

typedef struct ServerSettings {
    Address address;
    size_t body_most; // bytes; a larger body is answered 413
    const Router *router;
    const AcceptedHosts *hosts;
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
