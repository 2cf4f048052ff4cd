// The refusals, in the order in which they are tested. libmicrohttpd 0.9.75 accepts all of these
// heads by itself; it does not show a NUL in the request line and how a header's line ended.
#include "server/http/validate.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/http/request.h"

static const char *const known_methods[] = {"GET",    "HEAD",    "POST", "PUT",
                                            "DELETE", "OPTIONS", "PATCH"};

static const char *const loopback[] = {"localhost", "127.0.0.1", "[::1]", NULL};
const AcceptedHosts gate_loopback = {loopback, false, NULL};

// The size of the name in "name:port"; 0 where the port is no port. An IPv6 address has brackets.
static size_t host_name_size(const char *host, size_t size) {
    size_t name_size = 0;
    while (name_size < size && host[name_size] != ':')
        if (host[name_size++] == '[')
            while (name_size < size && host[name_size] != ']')
                name_size++;
    if (name_size == size)
        return size;
    const size_t digits = size - name_size - 1;
    for (size_t i = 0; i < digits; i++)
        if (host[name_size + 1 + i] < '0' || host[name_size + 1 + i] > '9')
            return 0;
    return digits <= 5 ? name_size : 0;
}

// Dotted decimal, or something in brackets that only an address may be.
static bool host_is_address(const char *name, size_t size) {
    char text[64];
    unsigned char ignored[16];
    const bool has_brackets = size > 2 && name[0] == '[' && name[size - 1] == ']';
    const size_t inner = has_brackets ? size - 2 : size;
    if (inner >= sizeof text)
        return false;
    memcpy(text, name + has_brackets, inner);
    text[inner] = '\0';
    return inet_pton(has_brackets ? AF_INET6 : AF_INET, text, ignored) == 1;
}

static const AcceptedHosts *validate_names(const RequestValidator *validator) {
    return validator->names != NULL ? validator->names : &gate_loopback;
}

bool validate_host_is_ours(const AcceptedHosts *hosts, const char *host, size_t size) {
    const size_t name_size = host_name_size(host, size);
    if (name_size == 0)
        return false;
    for (size_t i = 0; hosts->names[i] != NULL; i++)
        if (strlen(hosts->names[i]) == name_size &&
            strncasecmp(host, hosts->names[i], name_size) == 0)
            return true;
    return hosts->takes_addresses && host_is_address(host, name_size);
}

static bool header_is_named(const char *name, size_t size, const char *text) {
    return size == strlen(text) && strncasecmp(name, text, size) == 0;
}

static bool text_has_control(const char *text, size_t size) {
    for (size_t i = 0; i < size; i++) {
        const unsigned char c = (unsigned char)text[i];
        if ((c < 0x20 && c != '\t') || c == 0x7f)
            return true;
    }
    return false;
}

// Whether every character may stand in a header's name (RFC 9110 token).
static bool text_is_token(const char *text, size_t size) {
    for (size_t i = 0; i < size; i++) {
        const unsigned char c = (unsigned char)text[i];
        const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-';
        if (!is_plain && (c <= 0x20 || c >= 0x7f || strchr("\"(),/:;<=>?@[\\]{}", c) != NULL))
            return false;
    }
    return size > 0;
}

void validate_header(RequestValidator *validator, const char *name, size_t name_size,
                     const char *value, size_t value_size) {
    if (value == NULL)
        value_size = 0;
    if (!validator->has_control &&
        (!text_is_token(name, name_size) || text_has_control(value, value_size))) {
        validator->has_control = true;
        snprintf(validator->fault_name, sizeof validator->fault_name, "%s",
                 text_is_token(name, name_size) && name_size < sizeof validator->fault_name
                     ? name
                     : "a header");
    }
    if (header_is_named(name, name_size, "Host")) {
        validator->hosts++;
        validator->own_host = value;
        if (!validate_host_is_ours(validate_names(validator), value_size > 0 ? value : "",
                                   value_size)) {
            validator->is_foreign_host = true;
            if (value_size > 0 && !text_has_control(value, value_size))
                text_fit(validator->host, sizeof validator->host, value);
        }
    } else if (header_is_named(name, name_size, "Content-Length")) {
        validator->lengths++;
        if (value_size == 0 || value_size > 18 || strspn(value, "0123456789") != value_size)
            validator->has_bad_length = true;
        else
            validator->length = strtoull(value, NULL, 10);
    } else if (header_is_named(name, name_size, "Origin")) {
        validator->origin = value != NULL ? value : "";
    } else if (header_is_named(name, name_size, "Sec-Fetch-Site")) {
        validator->fetch_site = value;
    } else if (header_is_named(name, name_size, "Authorization")) {
        validator->authorizations++;
    } else if (header_is_named(name, name_size, "Transfer-Encoding")) {
        validator->encodings++;
        validator->is_chunked = header_is_named(value_size > 0 ? value : "", value_size, "chunked");
    }
}

static int validate_refuse(Problem *problem, int code, const char *detail) {
    problem_set(problem, STATUS_USAGE, "%s", detail);
    return code;
}

// Whether the path holds an escaped NUL, or a segment that becomes "." or ".." only when decoded;
// plain dot segments are refused as well, because clients take them out before sending and proxies
// differ.
static const char *validate_path(const char *target) {
    const size_t size = strcspn(target, "?");
    size_t dots = 0, others = 0;
    for (size_t i = 0; i <= size; i++) {
        if (i == size || target[i] == '/') {
            if (others == 0 && (dots == 1 || dots == 2))
                return "the path holds a dot segment; write it without \".\" and \"..\"";
            dots = others = 0;
        } else if (target[i] == '.') {
            dots++;
        } else if (target[i] == '%' && strncasecmp(target + i, "%2e", 3) == 0) {
            dots++;
            i += 2;
        } else {
            others++;
        }
    }
    return strstr(target, "%00") != NULL ? "the target holds an escaped NUL" : NULL;
}

static int validate_refuse_host(const RequestValidator *validator, Problem *problem) {
    const AcceptedHosts *hosts = validate_names(validator);
    char list[256] = "";
    for (size_t i = 0; hosts->names[i] != NULL; i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s",
                 i == 0                        ? ""
                 : hosts->names[i + 1] == NULL ? " or "
                                               : ", ",
                 hosts->names[i]);
    }
    problem_set(
        problem, STATUS_USAGE,
        "the Host must be %s%s, with any port, is \"%s\"; the daemon's --host NAME adds one", list,
        hosts->takes_addresses ? ", or an address in digits" : "", validator->host);
    return 421;
}

// Whether an Origin header names this server: the authority of the Host header, or a name given by
// --host or --base-url, for a proxy that changes the Host.
static bool validate_origin_is_ours(const RequestValidator *validator) {
    const char *const mark = strstr(validator->origin, "://");
    if (mark == NULL)
        return false;
    const char *const authority = mark + 3;
    if (validator->own_host != NULL && strcasecmp(authority, validator->own_host) == 0)
        return true;
    const AcceptedHosts named = {validate_names(validator)->names, false, NULL};
    const size_t size = strlen(authority);
    return validate_host_is_ours(&named, authority, size) &&
           !validate_host_is_ours(&gate_loopback, authority, size);
}

const char *validate_allowed_origin(const RequestValidator *validator) {
    const char *const *origin = validate_names(validator)->origins;
    if (validator->origin == NULL || origin == NULL)
        return NULL;
    while (*origin != NULL && strcmp(*origin, validator->origin) != 0)
        origin++;
    return *origin;
}

// Another site's page may send requests with the rights of this machine (CSRF); browsers mark them.
static bool validate_is_from_other_site(const RequestValidator *validator, const char *method) {
    if (strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0 ||
        strcmp(method, "OPTIONS") == 0 || validate_allowed_origin(validator) != NULL)
        return false;
    return (validator->fetch_site != NULL &&
            (strcasecmp(validator->fetch_site, "cross-site") == 0 ||
             strcasecmp(validator->fetch_site, "same-site") == 0)) ||
           (validator->origin != NULL && !validate_origin_is_ours(validator));
}

int validate_request(const RequestValidator *validator, const char *method, const char *target,
                     const char *version, Problem *problem) {
    if (strcmp(version, "HTTP/1.1") != 0 && strcmp(version, "HTTP/1.0") != 0)
        return validate_refuse(problem, 505, "this server speaks HTTP/1.1 and HTTP/1.0");
    bool is_known = false;
    for (size_t i = 0; i < COUNT(known_methods) && !is_known; i++)
        is_known = strcmp(method, known_methods[i]) == 0;
    if (!is_known)
        return validate_refuse(
            problem, 501,
            "unknown method; known are GET, HEAD, POST, PUT, PATCH, DELETE and OPTIONS");
    if (target[0] != '/')
        return validate_refuse(problem, 400, "the target must be a path that begins with \"/\"");
    if (strlen(target) > REQUEST_TARGET_MAX)
        return validate_refuse(problem, 414, "the target is longer than 4096 bytes");
    if (text_has_control(target, strlen(target)))
        return validate_refuse(problem, 400, "the target holds a control character");
    if (strchr(target, ' ') != NULL)
        return validate_refuse(problem, 400, "the target holds a space; write it as %20");
    const char *fault = validate_path(target);
    if (fault != NULL)
        return validate_refuse(problem, 400, fault);
    if (validator->has_control) {
        problem_set(problem, STATUS_USAGE, "the head holds a control character (in %s)",
                    validator->fault_name);
        return 400;
    }
    if (validator->hosts > 1)
        return validate_refuse(problem, 400, "more than one Host");
    if (validator->hosts == 0 && strcmp(version, "HTTP/1.1") == 0)
        return validate_refuse(problem, 400, "HTTP/1.1 needs a Host");
    if (validator->is_foreign_host) {
        return validate_refuse_host(validator, problem);
    }
    if (validator->lengths > 1)
        return validate_refuse(problem, 400, "more than one Content-Length");
    if (validator->authorizations > 1)
        return validate_refuse(problem, 400, "more than one Authorization");
    if (validator->has_bad_length)
        return validate_refuse(problem, 400, "Content-Length must be a plain number");
    if (validator->lengths > 0 && validator->encodings > 0)
        return validate_refuse(problem, 400, "Content-Length beside Transfer-Encoding");
    if (validator->encodings > 1 || (validator->encodings == 1 && !validator->is_chunked))
        return validate_refuse(problem, 501,
                               "the only Transfer-Encoding understood is \"chunked\"");
    if (validator->encodings > 0 && strcmp(version, "HTTP/1.0") == 0)
        return validate_refuse(problem, 400, "HTTP/1.0 has no Transfer-Encoding");
    if (validate_is_from_other_site(validator, method))
        return validate_refuse(
            problem, 403,
            "a page of another site may not send this: Origin must be this server's, and "
            "Sec-Fetch-Site same-origin or none");
    return 0;
}
