// Who can reach the daemon and under which names: Host names, base URL, TLS files, and whether
// tokens are a must. Settings into what the listener takes.
#ifndef SERVER_CLI_NETWORK_H
#define SERVER_CLI_NETWORK_H

#include "core/base/field.h"
#include "server/http/address.h"
#include "server/http/validate.h"

typedef struct NetworkSettings {
    Texts host;
    const char *base_url, *tls_cert, *tls_key; // NULL: none; the last two are files
    bool require_tokens;
} NetworkSettings;

typedef struct Network {
    BaseUrl url; // empty: none
    AcceptedHosts hosts;
    char **names; // of hosts
    size_t name_count;
    bool needs_tokens;
} Network;

// Adds all faults (STATUS_USAGE); the certificate is in use then. `reach` is cleared by
// network_clear in any case.
Status network_read(const NetworkSettings *settings, const Address *address, Network *reach,
                    Problem *problem);
// The files of the certificate once more, if there are any: where they are wrong (STATUS_USAGE),
// the one in use stays.
Status network_read_tls(const NetworkSettings *settings, Problem *problem);
void network_clear(Network *reach);

// STATUS_FORBIDDEN where tokens are a must and none can be used; says how to make one.
Status network_check(const Network *reach, const Address *address, size_t tokens, Problem *problem);

#endif
