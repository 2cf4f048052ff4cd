// GET /client: clients in other languages, which are files of web/client/, and the Python wheel
// that pip installs. A wheel is a ZIP archive of the module, two files that describe it and a list
// of their digests (Python Packaging User Guide, "Binary distribution format").
#include <stdio.h>
#include <string.h>

#include "server/api/app.h"
#include "server/util/base_path.h"
#include "server/util/sha256.h"

static const char client_files_folder[] = "web/client/";

// What describes a wheel, with the version of the program in place of %s.
static const struct {
    const char *name, *format;
} wheel_texts[] = {
    {"METADATA", "Metadata-Version: 2.1\nName: impactd\nVersion: %s\n"
                 "Summary: Client of impactd, which simulates impact dampers\n"
                 "License: MIT\nRequires-Python: >=3.9\n"},
    {"WHEEL", "Wheel-Version: 1.0\nGenerator: impactd %s\nRoot-Is-Purelib: true\n"
              "Tag: py3-none-any\n"},
};

static void wheel_name(char target[64]) {
    snprintf(target, 64, "impactd-%.20s-py3-none-any.whl", program_version);
}

// The digest in the base64 of URLs, without padding, as RECORD writes it.
static void wheel_put_digest(Bytes *record, const void *content, size_t size) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    unsigned char sum[DIGEST_BYTES + 1] = {0};
    sha256_sum(content, size, sum);
    for (size_t bit = 0; bit < 8 * (size_t)DIGEST_BYTES; bit += 6) {
        const unsigned pair = (unsigned)(sum[bit / 8] << 8 | sum[bit / 8 + 1]);
        bytes_put(record, &digits[pair >> (10 - bit % 8) & 63], 1);
    }
}

// Adds a member to the archive and, unless it is RECORD, its line to RECORD.
static Status wheel_put(Zip *zip, Bytes *record, const char *name, const void *content, size_t size,
                        Problem *problem) {
    Segments segments = {.size = 0};
    if (content != record->at) {
        bytes_format(record, "%s,sha256=", name);
        wheel_put_digest(record, content, size);
        bytes_format(record, ",%zu\n", size);
    }
    segments_put(&segments, content, size);
    const Status status = zip_put(zip, name, &segments, problem);
    segments_clear(&segments);
    return status;
}

static Status wheel_fill(Zip *zip, Bytes *record, Problem *problem) {
    const EmbeddedFile *module = embedded_find(embedded_client, "web/client/impactd.py");
    char folder[48], name[64], text[256];
    snprintf(folder, sizeof folder, "impactd-%.20s.dist-info", program_version);
    TRY(wheel_put(zip, record, "impactd.py", module->bytes, module->size, problem));
    for (size_t i = 0; i < COUNT(wheel_texts); i++) {
        snprintf(name, sizeof name, "%s/%s", folder, wheel_texts[i].name);
        const int size = snprintf(text, sizeof text, wheel_texts[i].format, program_version);
        TRY(wheel_put(zip, record, name, text, (size_t)size, problem));
    }
    snprintf(name, sizeof name, "%s/RECORD", folder);
    bytes_format(record, "%s,,\n", name);
    return wheel_put(zip, record, name, record->at, record->count, problem);
}

// The same bytes at each call.
static Status wheel_write(Bytes *wheel, Problem *problem) {
    Segments segments = {.size = 0};
    Zip zip = {.segments = &segments};
    Bytes record = {.most = 0};
    Status status = wheel_fill(&zip, &record, problem);
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    status = status != STATUS_OK ? status : ended;
    if (status == STATUS_OK)
        segments_write(&segments, wheel);
    segments_clear(&segments);
    bytes_clear(&record);
    return status;
}

Status client_files_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    char name[64], path[128];
    snprintf(path, sizeof path, "%s%.100s", client_files_folder, request->parameters[0]);
    const EmbeddedFile *file = embedded_find(embedded_client, path);
    if (file != NULL)
        return reply_embedded(reply, request, file, asset_type(path));
    wheel_name(name);
    if (strcmp(request->parameters[0], name) != 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no client file \"%.80s\"; GET %s/client lists them",
                           request->parameters[0], base_path());
    Bytes wheel = {.most = app->reply_most};
    TRY(wheel_write(&wheel, problem));
    unsigned char sum[DIGEST_BYTES];
    char digest[65];
    sha256_sum(wheel.at, wheel.count, sum);
    sha256_hex(sum, digest);
    digest[32] = '\0'; // as of files
    if (!reply_tagged(reply, request, digest))
        return reply_bytes(reply, 200, "application/zip", &wheel, problem);
    bytes_clear(&wheel);
    return STATUS_OK;
}

// A page as in PEP 503: pip takes the wheel by its link.
Status client_files_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const char line[] = "<li><a href=\"%s/client/%s\">%s</a></li>\n";
    char name[64];
    Bytes page = {.most = app->reply_most};
    (void)request;
    wheel_name(name);
    bytes_text(&page,
               "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Clients of "
               "impactd</title>\n<h1>Clients of impactd</h1>\n<ul>\n");
    bytes_format(&page, line, base_path(), name, name);
    for (const EmbeddedFile *file = embedded_client; file->path != NULL; file++) {
        const char *own = file->path + sizeof client_files_folder - 1;
        bytes_format(&page, line, base_path(), own, own);
    }
    bytes_text(&page, "</ul></html>\n");
    return reply_bytes(reply, 200, "text/html; charset=utf-8", &page, problem);
}
