// GET /: browsers get the dashboard, made of the files under web/; all other clients get lines that
// can be pasted into a shell. GET /guide/: the guide. The browser checks each time that its copy of
// a file is current.
#include <stdio.h>
#include <string.h>

#include "server/api/app.h"
#include "server/http/header.h"

// The lines to paste; in the file "@/" stands for the server's URL.
static void landing_write(Bytes *bytes, const EmbeddedFile *lines, const char *url) {
    bytes_format(bytes, "# impactd %s: simulations of impact dampers over HTTP and JSON\n\n",
                 program_version);
    const char *at = lines->bytes;
    for (const char *next; (next = strstr(at, "@/")) != NULL; at = next + 1) {
        bytes_put(bytes, at, (size_t)(next - at));
        bytes_text(bytes, url);
    }
    bytes_text(bytes, at);
}

Status landing_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const char *const types[] = {"text/plain", "text/html", NULL};
    reply->varies_by_accept = true;
    const EmbeddedFile *dashboard = embedded_find(embedded_web, "web/index.html");
    if (dashboard != NULL && header_accept(request->accept, types) == 1) {
        // Its links are relative: at a base path without a slash at its end they would miss it.
        if (request->target[strcspn(request->target, "?") - 1] != '/') {
            text_fit(reply->location, sizeof reply->location, "/");
            reply_borrow(reply, 308, NULL, NULL, 0);
            return STATUS_OK;
        }
        reply->policy = reply_page_policy;
        return reply_embedded(reply, request, dashboard, "text/html; charset=utf-8");
    }
    char url[sizeof app->base_url];
    // Only Hosts of this server are accepted, so that it is safe in a line for the shell.
    if (app->base_url[0] != '\0')
        text_fit(url, sizeof url, app->base_url);
    else
        snprintf(url, sizeof url, "%s://%.80s", app->has_tls ? "https" : "http", request->host);
    Bytes text = {.most = 1 << 16};
    landing_write(&text, embedded_find(embedded_web, "web/landing.txt"), url);
    return reply_bytes(reply, 200, "text/plain; charset=utf-8", &text, problem);
}

static const struct {
    const char *extension, *content_type;
} types[] = {
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", type_json},
    {".svg", "image/svg+xml"},
    {".woff2", "font/woff2"},
    {".png", "image/png"},
    {".py", "text/x-python; charset=utf-8"},
    {".m", "text/x-matlab; charset=utf-8"},
    {".ipynb", "application/x-ipynb+json"},
};

const char *asset_type(const char *path) {
    const char *extension = strrchr(path, '.');
    for (size_t i = 0; extension != NULL && i < COUNT(types); i++)
        if (strcmp(extension, types[i].extension) == 0)
            return types[i].content_type;
    return NULL;
}

static Status asset_reply(const EmbeddedFile *table, const char *path, const Request *request,
                          Reply *reply, Problem *problem) {
    const EmbeddedFile *file = table != NULL ? embedded_find(table, path) : NULL;
    const char *type = asset_type(path);
    if (file == NULL || type == NULL)
        return problem_set(problem, STATUS_NOT_FOUND, "there is no file \"%.120s\"", path);
    reply->policy = reply_page_policy;
    return reply_embedded(reply, request, file, type);
}

Status assets_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    const char *path = request->path + 1; // a file's path has no first slash
    // The links of the page are relative to "/".
    const bool is_page = strcmp(path, "web/index.html") == 0;
    return asset_reply(is_page ? NULL : embedded_web, path, request, reply, problem);
}

Status assets_show_icon(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    return asset_reply(embedded_web, "web/icon.svg", request, reply, problem);
}

const EmbeddedFile *guide_files;

Status guide_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    static const char index[] = "guide/index.html";
    static const char *const accepted[] = {"application/problem+json", "text/html", NULL};
    const char *path = request->path[strlen("/guide/")] == '\0' ? index : request->path + 1;
    if (guide_files != NULL && embedded_find(guide_files, path) == NULL &&
        header_accept(request->accept, accepted) == 1) { // a reader gets what leads on
        const EmbeddedFile *file = embedded_find(guide_files, index);
        reply->varies_by_accept = true;
        reply_borrow(reply, 404, asset_type(index), file->bytes, file->size);
        reply->policy = reply_page_policy;
        return STATUS_OK;
    }
    return asset_reply(guide_files, path, request, reply, problem);
}

// The type of a problem document is an address: the section of the guide on that problem.
Status problems_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    const char *name = request->parameters[0];
    for (int i = STATUS_OK + 1; i < STATUS_COUNT; i++)
        if (strcmp(status_slug((Status)i), name) == 0) {
            snprintf(reply->location, sizeof reply->location, "/guide/problems.html#%s", name);
            reply_borrow(reply, 303, NULL, NULL, 0);
            return STATUS_OK;
        }
    return problem_set(problem, STATUS_NOT_FOUND, "there is no type of problem \"%.60s\"", name);
}
