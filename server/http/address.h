// Where the daemon listens: reading "HOST:PORT", opening the socket, writing the URL; and the URL
// by which clients reach it behind a proxy.
#ifndef SERVER_HTTP_ADDRESS_H
#define SERVER_HTTP_ADDRESS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
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

#endif
