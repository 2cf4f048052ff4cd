// impactd materials export, import: the whole database out and in.
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/command/materials_ask.h"
#include "server/command/output.h"
#include "server/command/scene_file.h"

static const struct Format {
    const char *ending, *path, *type;
} formats[] = {
    {".json", "/v1/materials.json", "application/json"},
    {".csv", "/v1/materials.csv", "text/csv"},
};

static const struct Format *format_of(const char *path, Problem *problem) {
    const size_t length = strlen(path);
    for (size_t i = 0; i < COUNT(formats); i++) {
        const size_t ending = strlen(formats[i].ending);
        if (length > ending && strcmp(path + length - ending, formats[i].ending) == 0)
            return &formats[i];
    }
    (void)problem_set(problem, STATUS_USAGE, "the file must end in .json or .csv, is %.200s", path);
    return NULL;
}

static Status take(void *context, const void *bytes, size_t size, Problem *problem) {
    (void)context;
    return output_write(bytes, size, problem);
}

Status materials_export_act(MaterialsCall *call, Problem *problem) {
    const char *file = call->operands[0];
    const struct Format *format = format_of(file, problem);
    HttpAnswer answer = {0};
    if (format == NULL)
        return STATUS_USAGE;
    call->about = file;
    if (!call->settings->force && access(file, F_OK) == 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "is there already: name another file, or --force replaces it");
    const HttpAsk ask = {.method = "GET", .path = format->path, .take = take, .most = UINT64_MAX};
    Status status = output_open(file, problem);
    if (status == STATUS_OK)
        status = daemon_ask(call->daemon, &ask, &answer, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    http_answer_clear(&answer);
    return status;
}

Status materials_import_act(MaterialsCall *call, Problem *problem) {
    const char *file = call->operands[0];
    const struct Format *format = format_of(file, problem);
    Bytes body = {0};
    HttpAnswer answer = {0};
    if (format == NULL)
        return STATUS_USAGE;
    call->about = file;
    Status status = scene_file_read(file, &body, problem);
    const HttpAsk ask = {.method = "POST",
                         .path = call->settings->dry_run ? "/v1/materials/import?dry_run=1"
                                                         : "/v1/materials/import",
                         .body = &body,
                         .content_type = format->type};
    if (status == STATUS_OK)
        status = daemon_ask(call->daemon, &ask, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print(call, &answer, NULL, problem);
    http_answer_clear(&answer);
    bytes_clear(&body);
    return status;
}
