// The dashboard: the files under web/, as they stand there. A page is asked for again each time and
// mostly answered by "not changed", so that it is never older than the program.
#include <string.h>

#include "server/api/app.h"
#include "server/http/reply.h"
#include "server/util/embedded.h"

static const struct {
    const char *extension, *content_type;
} types[] = {
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
};

// NULL: not to be had by its own path, from where the page's links would lead nowhere.
static const char *type_of(const char *path) {
    const char *extension = strrchr(path, '.');
    for (size_t i = 0; extension != NULL && i < COUNT(types); i++)
        if (strcmp(extension, types[i].extension) == 0)
            return types[i].content_type;
    return NULL;
}

Status assets_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    const char *path = request->path + 1, *type = type_of(path); // a file's path has no first slash
    const EmbeddedFile *file = embedded_find(embedded_web, path);
    if (file == NULL || type == NULL)
        return problem_set(problem, STATUS_NOT_FOUND, "the dashboard has no file \"%.120s\"", path);
    reply->policy = reply_page_policy;
    return reply_embedded(reply, request, file, type);
}

Status assets_show_icon(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    const EmbeddedFile *file = embedded_find(embedded_web, "web/icon.svg");
    if (file == NULL)
        return problem_set(problem, STATUS_INTERNAL, "this program was built without its icon");
    return reply_embedded(reply, request, file, type_of(file->path));
}
