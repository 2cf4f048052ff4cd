#include "server/http/base_url.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char name_characters[] =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-.";
static const char digits[] = "0123456789";

static Status refuse(const char *text, const char *why, Problem *problem) {
    return problem_set(problem, STATUS_USAGE,
                       "--base-url %s, is \"%.100s\"; write it as https://sim.example.org/impactd",
                       why, text);
}

// The size of "host" or "[::1]" at the beginning of `text`; 0 if there is none.
static size_t host_size(const char *text) {
    if (text[0] != '[')
        return strspn(text, name_characters);
    const size_t inner = strspn(text + 1, "0123456789abcdefABCDEF:.");
    return text[1 + inner] == ']' ? inner + 2 : 0;
}

Status base_url_read(const char *text, BaseUrl *url, Problem *problem) {
    const size_t scheme = strncmp(text, "http://", 7) == 0    ? 7
                          : strncmp(text, "https://", 8) == 0 ? 8
                                                              : 0;
    if (scheme == 0)
        return refuse(text, "must begin with http:// or https://", problem);
    const char *host = text + scheme;
    const size_t size = host_size(host);
    if (size == 0 || size >= sizeof url->host)
        return refuse(text, "must name a host", problem);
    const char *path = host + size;
    if (*path == ':') {
        const size_t size_of_port = strspn(path + 1, digits);
        const long port = size_of_port <= 5 ? strtol(path + 1, NULL, 10) : 0;
        if (port < 1 || port > 65535)
            return refuse(text, "must have a port from 1 to 65535, or none", problem);
        path += 1 + size_of_port;
    }
    size_t path_size = strlen(path);
    while (path_size > 0 && path[path_size - 1] == '/')
        path_size--;
    for (size_t i = 0; i < path_size; i++)
        if (strchr(name_characters, path[i]) == NULL && strchr("/_~", path[i]) == NULL)
            return refuse(text, "may hold letters, digits, - . _ ~ and / behind the host", problem);
    if (path_size > 0 &&
        (path[0] != '/' || strstr(path, "//") != NULL || strstr(path, "/.") != NULL))
        return refuse(text, "must have a plain path behind the host", problem);
    if (path_size >= sizeof url->path || strlen(text) >= sizeof url->text)
        return refuse(text, "is too long: 255 bytes at most, and 63 of its path", problem);
    // Paths are taken with and without the base: then it must not look like one of ours.
    if (strncmp(path, "/v1", 3) == 0 && (path_size == 3 || path[3] == '/'))
        return refuse(text, "must not have a path that begins with /v1, which is ours", problem);
    snprintf(url->text, sizeof url->text, "%.*s", (int)(path + path_size - text), text);
    snprintf(url->host, sizeof url->host, "%.*s", (int)size, host);
    snprintf(url->path, sizeof url->path, "%.*s", (int)path_size, path);
    return STATUS_OK;
}
