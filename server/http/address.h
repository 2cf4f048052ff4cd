// Where the daemon listens: reading "HOST:PORT", opening the socket, writing the URL.
// Loopback only, while there are no access tokens. Used by listener.c and command/serve.c.
#ifndef SERVER_HTTP_ADDRESS_H
#define SERVER_HTTP_ADDRESS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"

typedef struct Address {
    char host[64]; // "127.0.0.1", "::1"
    uint16_t port; // 0: any free one
} Address;

// Reads "127.0.0.1:8080", "localhost:0", "[::1]:8080", ":8080" or "8080". STATUS_USAGE for what is
// not an address, STATUS_FORBIDDEN for one that is not loopback.
Status address_read(const char *text, Address *address, Problem *problem);

// A listening, non-blocking socket in *descriptor, and the port it got in `address`.
// STATUS_CONFLICT if the port is taken, STATUS_IO for other reasons.
Status address_open(Address *address, int *descriptor, Problem *problem);

// "http://127.0.0.1:8080", or https
void address_url(const Address *address, bool is_tls, char target[96]);

#endif
