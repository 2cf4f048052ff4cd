// The dashboard: the files under web/, as they stand there. A page is asked for again each time and
// mostly answered by "not changed", so that it is never older than the program.
#include "server/api/assets.h"

#include <stdio.h>
#include <string.h>

#include "server/api/app.h"
#include "server/base/embedded.h"
#include "server/http/reply.h"
#include "server/http/shield.h"

static const struct {
    const char *extension, *content_type;
} types[] = {
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".html", "text/html; charset=utf-8"},
};

Status assets_reply(const Request *request, Reply *reply, const EmbeddedFile *file,
                    const char *content_type) {
    if (!reply_tagged(reply, request, file->digest))
        reply_borrow(reply, 200, content_type, file->bytes, file->size);
    return STATUS_OK;
}

static const char *type_of(const char *path) {
    const char *extension = strrchr(path, '.');
    for (size_t i = 0; extension != NULL && i < COUNT(types); i++)
        if (strcmp(extension, types[i].extension) == 0)
            return types[i].content_type;
    return "application/octet-stream";
}

// The route's parameters follow `folder`.
static Status show(const char *folder, const Request *request, Reply *reply, Problem *problem) {
    char path[256];
    size_t used = (size_t)snprintf(path, sizeof path, "%s", folder);
    for (size_t i = 0; i < REQUEST_PARAMETERS && request->parameters[i] != NULL; i++)
        used += (size_t)snprintf(path + used, sizeof path - used, "/%.60s", request->parameters[i]);
    const EmbeddedFile *file = embedded_find(embedded_web, path);
    if (file == NULL)
        return problem_set(problem, STATUS_NOT_FOUND, "the dashboard has no file \"%.120s\"", path);
    reply->policy = shield_page_policy;
    return assets_reply(request, reply, file, type_of(path));
}

Status assets_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    return show("web", request, reply, problem);
}

Status assets_show_vendor(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    return show("web/vendor", request, reply, problem);
}

Status assets_show_icon(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    const EmbeddedFile *file = embedded_find(embedded_web, "web/icon.svg");
    if (file == NULL)
        return problem_set(problem, STATUS_INTERNAL, "this program was built without its icon");
    return assets_reply(request, reply, file, type_of(file->path));
}
