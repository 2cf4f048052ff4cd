#include "server/cli/network.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "server/http/tls.h"
#include "server/util/bytes.h"

static Status add_name(Network *reach, const char *name, size_t size, Problem *problem) {
    char **grown = realloc(reach->names, (reach->name_count + 2) * sizeof *grown);
    if (grown != NULL)
        reach->names = grown;
    char *copy = grown != NULL ? strndup(name, size) : NULL;
    if (copy == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the names of hosts");
    reach->names[reach->name_count++] = copy;
    reach->names[reach->name_count] = NULL;
    return STATUS_OK;
}

static bool is_host(const char *name, size_t size) {
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._";
    if (size > 2 && name[0] == '[')
        return strcspn(name, "]") == size - 1;
    return size > 0 && size < 200 && strspn(name, plain) >= size;
}

// "a.example.org,b.example.org"
static Status add_list(Network *reach, const char *list, Problem *problem) {
    Status status = STATUS_OK;
    for (const char *at = list; *at != '\0';) {
        const size_t size = strcspn(at, ",");
        const size_t from = strspn(at, " ");
        if (from >= size || !is_host(at + from, size - from))
            status = problem_add(problem, STATUS_USAGE, "--host",
                                 "must be a name without port or http://, is \"%.*s\"",
                                 (int)(size < 80 ? size : 80), at);
        else
            TRY(add_name(reach, at + from, size - from, problem));
        at += size;
        at += *at == ',' ? 1 : 0;
    }
    return status;
}

static Status add_names(const NetworkSettings *settings, const Address *address, Network *reach,
                        Problem *problem) {
    Status status = STATUS_OK;
    const bool is_any = address_is_any(address);
    if (is_any || address_is_loopback(address)) {
        for (size_t i = 0; gate_loopback.names[i] != NULL; i++)
            TRY(add_name(reach, gate_loopback.names[i], strlen(gate_loopback.names[i]), problem));
    }
    if (!is_any) {
        char name[80];
        const bool is_v6 = strchr(address->host, ':') != NULL;
        snprintf(name, sizeof name, "%s%s%s", is_v6 ? "[" : "", address->host, is_v6 ? "]" : "");
        bool is_there = false;
        for (size_t i = 0; i < reach->name_count; i++)
            is_there = is_there || strcmp(reach->names[i], name) == 0;
        if (!is_there)
            TRY(add_name(reach, name, strlen(name), problem));
    }
    for (size_t i = 0; i < settings->host.count; i++) {
        const Status added = add_list(reach, settings->host.at[i], problem);
        status = added != STATUS_OK ? added : status;
    }
    if (reach->url.host[0] != '\0')
        TRY(add_name(reach, reach->url.host, strlen(reach->url.host), problem));
    reach->hosts = (AcceptedHosts){(const char *const *)reach->names, is_any};
    return status;
}

static Status read_file(const char *name, const char *path, bool is_secret, char **text,
                        Problem *problem) {
    enum { PEM_MAX = 1 << 20 };
    struct stat facts;
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return problem_add(problem, STATUS_USAGE, name, "cannot be read: %s: %s", path,
                           strerror(errno));
    Status status = STATUS_OK;
    if (is_secret && fstat(fileno(file), &facts) == 0 && (facts.st_mode & S_IROTH) != 0)
        status = problem_add(problem, STATUS_USAGE, name,
                             "can be read by everyone on this machine; chmod 600 %s", path);
    char piece[4096];
    Bytes bytes = {.most = PEM_MAX};
    for (size_t count; !bytes.is_failed && (count = fread(piece, 1, sizeof piece, file)) > 0;)
        bytes_put(&bytes, piece, count);
    fclose(file);
    const bool has_nul = bytes.at != NULL && strlen(bytes.at) != bytes.count;
    if (bytes.is_failed || has_nul || bytes.count == 0) {
        bytes_clear(&bytes);
        return problem_add(problem, STATUS_USAGE, name,
                           "%s is not a PEM file of at most a megabyte", path);
    }
    *text = bytes_take(&bytes, NULL);
    return status;
}

Status network_read_tls(const NetworkSettings *settings, Problem *problem) {
    const char *cert = settings->tls_cert, *key = settings->tls_key;
    char *cert_text = NULL, *key_text = NULL;
    if (cert == NULL && key == NULL)
        return STATUS_OK;
    if (cert == NULL || key == NULL)
        return problem_add(problem, STATUS_USAGE, cert != NULL ? "--tls-cert" : "--tls-key",
                           "needs %s FILE beside it", cert != NULL ? "--tls-key" : "--tls-cert");
    const Status first = read_file("--tls-cert", cert, false, &cert_text, problem);
    const Status second = read_file("--tls-key", key, true, &key_text, problem);
    Status status = first != STATUS_OK ? first : second;
    if (status == STATUS_OK)
        status = tls_use(cert_text, cert, key_text, key, problem);
    free(cert_text);
    free(key_text);
    return status;
}

Status network_read(const NetworkSettings *settings, const Address *address, Network *reach,
                    Problem *problem) {
    *reach = (Network){.needs_tokens = settings->require_tokens || !address_is_loopback(address)};
    if (settings->base_url != NULL)
        TRY(base_url_read(settings->base_url, &reach->url, problem));
    const Status names = add_names(settings, address, reach, problem);
    const Status tls = network_read_tls(settings, problem);
    return names != STATUS_OK ? names : tls;
}

void network_clear(Network *reach) {
    for (size_t i = 0; i < reach->name_count; i++)
        free(reach->names[i]);
    free(reach->names);
    *reach = (Network){0};
}

Status network_check(const Network *reach, const Address *address, size_t tokens,
                     Problem *problem) {
    if (!reach->needs_tokens || tokens > 0)
        return STATUS_OK;
    const bool is_loopback = address_is_loopback(address);
    return problem_set(problem, STATUS_FORBIDDEN,
                       "does not listen on %s%s: there is no valid token. Create one with\n    "
                       "impactd token create --name NAME --scopes read,submit\n(with the same "
                       "--data DIR, if any)%s",
                       address->host, is_loopback ? " with --require-tokens" : "",
                       is_loopback ? "" : ", or listen on 127.0.0.1");
}
