// Where the daemon listens, and the socket for it. Knows no HTTP. The socket is our own, so that a
// taken port can be told from other faults and port 0 can be asked which one it became.
#include "server/http/address.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

Status address_read(const char *text, Address *address, Problem *problem) {
    char host[64] = "127.0.0.1";
    const char *port = text;
    const char *colon = strrchr(text, ':');
    if (colon != NULL) {
        const bool is_bracketed = text[0] == '[' && colon > text && colon[-1] == ']';
        const char *from = is_bracketed ? text + 1 : text;
        const size_t size = (size_t)(colon - from) - (is_bracketed ? 1 : 0);
        if (size >= sizeof host || (is_bracketed && size == 0) ||
            (!is_bracketed && memchr(text, ':', (size_t)(colon - text)) != NULL))
            return problem_set(problem, STATUS_USAGE,
                               "\"%.60s\" is not HOST:PORT; write 127.0.0.1:8080 or [::1]:8080",
                               text);
        if (size > 0) {
            memcpy(host, from, size);
            host[size] = '\0';
        }
        port = colon + 1;
    }
    const size_t digits = strspn(port, "0123456789");
    const unsigned long number = digits > 0 && digits <= 5 ? strtoul(port, NULL, 10) : 65536;
    if (port[digits] != '\0' || number > 65535)
        return problem_set(problem, STATUS_USAGE,
                           "\"%.60s\" is not HOST:PORT with a port within [0, 65535]", text);
    if (strcmp(host, "localhost") == 0)
        snprintf(host, sizeof host, "127.0.0.1");
    unsigned char ignored[16];
    if (inet_pton(text[0] == '[' ? AF_INET6 : AF_INET, host, ignored) != 1)
        return problem_set(problem, STATUS_USAGE,
                           "\"%.60s\" is not the address of an interface; write it in digits, as "
                           "127.0.0.1, [::1] or 0.0.0.0 for all, or localhost",
                           host);
    snprintf(address->host, sizeof address->host, "%s", host);
    address->port = (uint16_t)number;
    return STATUS_OK;
}

bool address_is_loopback(const Address *address) {
    return strncmp(address->host, "127.", 4) == 0 || strcmp(address->host, "::1") == 0;
}

bool address_is_any(const Address *address) {
    unsigned char bytes[16] = {1};
    const bool is_v6 = strchr(address->host, ':') != NULL;
    const size_t size = is_v6 ? 16 : 4;
    if (inet_pton(is_v6 ? AF_INET6 : AF_INET, address->host, bytes) != 1)
        return false;
    for (size_t i = 0; i < size; i++)
        if (bytes[i] != 0)
            return false;
    return true;
}

Status address_open(Address *address, int *descriptor, Problem *problem) {
    union {
        struct sockaddr any;
        struct sockaddr_in v4;
        struct sockaddr_in6 v6;
    } name = {0};
    const bool is_v6 = strchr(address->host, ':') != NULL;
    socklen_t size = is_v6 ? sizeof name.v6 : sizeof name.v4;
    if (is_v6) {
        name.v6.sin6_family = AF_INET6;
        name.v6.sin6_port = htons(address->port);
        inet_pton(AF_INET6, address->host, &name.v6.sin6_addr);
    } else {
        name.v4.sin_family = AF_INET;
        name.v4.sin_port = htons(address->port);
        inet_pton(AF_INET, address->host, &name.v4.sin_addr);
    }
    const int made = socket(name.any.sa_family, SOCK_STREAM, 0);
    const int on = 1;
    if (made < 0)
        return problem_set(problem, STATUS_IO, "no socket: %s", strerror(errno));
    fcntl(made, F_SETFD, FD_CLOEXEC);
    fcntl(made, F_SETFL, O_NONBLOCK);
    setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(made, &name.any, size) != 0 || listen(made, 512) != 0 ||
        getsockname(made, &name.any, &size) != 0) {
        const int fault = errno;
        close(made);
        if (fault == EADDRINUSE)
            return problem_set(
                problem, STATUS_CONFLICT,
                "port %u on %s is taken; is another impactd running? Choose another with --listen "
                "%s:PORT, or port 0 for any free one",
                (unsigned)address->port, address->host, is_v6 ? "[::1]" : address->host);
        return problem_set(problem, STATUS_IO, "cannot listen on %s port %u: %s", address->host,
                           (unsigned)address->port, strerror(fault));
    }
    address->port = ntohs(is_v6 ? name.v6.sin6_port : name.v4.sin_port);
    *descriptor = made;
    return STATUS_OK;
}

void address_url(const Address *address, bool has_tls, char target[96]) {
    const bool is_v6 = strchr(address->host, ':') != NULL;
    snprintf(target, 96, "%s://%s%s%s:%u", has_tls ? "https" : "http", is_v6 ? "[" : "",
             address->host, is_v6 ? "]" : "", (unsigned)address->port);
}
