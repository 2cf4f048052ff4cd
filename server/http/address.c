// The socket is opened here and not by libmicrohttpd: a port in use differs from other faults, and
// the number chosen for port 0 can be read.
#include "server/http/server.h"

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
        const bool is_bracketed = text[0] == '[' && colon[-1] == ']';
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
    unsigned char bytes[16] = {1}; // of none, where it cannot be read
    const bool is_v6 = strchr(address->host, ':') != NULL;
    const size_t size = is_v6 ? 16 : 4;
    (void)inet_pton(is_v6 ? AF_INET6 : AF_INET, address->host, bytes);
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

// The size of "host" or "[::1]" at the beginning of `text`; 0 if there is none.
static size_t base_url_host_size(const char *text, const char *name_characters) {
    if (text[0] != '[')
        return strspn(text, name_characters);
    const size_t inner = strspn(text + 1, "0123456789abcdefABCDEF:.");
    return text[1 + inner] == ']' ? inner + 2 : 0;
}

Status base_url_read(const char *text, BaseUrl *url, Problem *problem) {
    // Those of a path; the characters of a host are behind the first three.
    static const char characters[] =
        "/_~abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-.";
    const char *why = NULL, *host = strstr(text, "://"), *path = "";
    const bool has_scheme = strncmp(text, "http://", 7) == 0 || strncmp(text, "https://", 8) == 0;
    host = host != NULL ? host + 3 : text;
    const size_t size = base_url_host_size(host, characters + 3);
    const size_t digits = host[size] == ':' ? strspn(host + size + 1, "0123456789") : 0;
    const long port = digits <= 5 ? strtol(host + size + (digits > 0), NULL, 10) : 0;
    path = host + size + (host[size] == ':' ? 1 + digits : 0);
    size_t path_size = strlen(path);
    while (path_size > 0 && path[path_size - 1] == '/')
        path_size--;
    if (!has_scheme)
        why = "must begin with http:// or https://";
    else if (size == 0 || size >= sizeof url->host)
        why = "must name a host";
    else if (host[size] == ':' && (port < 1 || port > 65535))
        why = "must have a port from 1 to 65535, or none";
    else if (strspn(path, characters) < path_size)
        why = "may hold letters, digits, - . _ ~ and / behind the host";
    else if (path_size > 0 &&
             (path[0] != '/' || strstr(path, "//") != NULL || strstr(path, "/.") != NULL))
        why = "must have a plain path behind the host";
    else if (path_size >= sizeof url->path || strlen(text) >= sizeof url->text)
        why = "is too long: 255 bytes at most, and 63 of its path";
    // Requests may have the base path or not: it must not look like a path of the API.
    else if (strncmp(path, "/v1", 3) == 0 && (path_size == 3 || path[3] == '/'))
        why = "must not have a path that begins with /v1, which is ours";
    if (why != NULL)
        return problem_set(problem, STATUS_USAGE,
                           "--base-url %s, is \"%.100s\"; write it as "
                           "https://sim.example.org/impactd",
                           why, text);
    snprintf(url->text, sizeof url->text, "%.*s", (int)(path + path_size - text), text);
    snprintf(url->host, sizeof url->host, "%.*s", (int)size, host);
    snprintf(url->path, sizeof url->path, "%.*s", (int)path_size, path);
    return STATUS_OK;
}
