// Heads that are refused before anything else reads a request: those that two parsers could read
// differently, and hosts that are not this server's. Plain values, no sockets. The connection of a
// refused request is closed.
#ifndef SERVER_HTTP_VALIDATE_H
#define SERVER_HTTP_VALIDATE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

// The names that requests may call us by.
typedef struct AcceptedHosts {
    const char *const *names;   // without port, "[::1]", NULL-terminated
    bool takes_addresses;       // any numeric address as well: no other site's name leads to it
    const char *const *origins; // of other sites that may use the API, NULL-terminated; or NULL
} AcceptedHosts;
extern const AcceptedHosts gate_loopback; // localhost, 127.0.0.1 and [::1]

// Facts gathered header by header; all zero to begin with, but for `names`.
typedef struct RequestValidator {
    const AcceptedHosts *names; // NULL: gate_loopback
    size_t hosts, lengths, encodings, authorizations;
    unsigned long long length; // of the body, as told
    bool is_chunked, is_foreign_host, has_bad_length, has_control;
    char fault_name[40]; // the header that has_control is about
    // Values of headers as given, of the caller; NULL where there is none.
    const char *own_host, *origin, *fetch_site;
    char host[64];
} RequestValidator;

void validate_header(RequestValidator *validator, const char *name, size_t name_size,
                     const char *value, size_t value_size);

// 0 if the request may go on, else the HTTP status (400, 403, 414, 421, 501, 505), with the reason
// in `problem`. 403: another site's page sends a request that is not GET, HEAD or OPTIONS.
int validate_request(const RequestValidator *validator, const char *method, const char *target,
                     const char *version, Problem *problem);

// The one of `origins` that the Origin header names; NULL: none.
const char *validate_allowed_origin(const RequestValidator *validator);

// Whether a Host header's value is one of the names, with any port or none.
bool validate_host_is_ours(const AcceptedHosts *hosts, const char *host, size_t size);

#endif
