// What ONE endpoint is; api/routes.c lists all.
#ifndef SERVER_HTTP_ROUTE_H
#define SERVER_HTTP_ROUTE_H

#include "server/http/request.h"

typedef struct App App;  // api/app.h

typedef Status Handler(App *app, const Request *request, Reply *reply, Problem *problem);

typedef struct Route {
    const char *method;   // "GET"
    const char *pattern;  // "/v1/results/{id}/series.{format}": {x} matches one segment or the rest of one
    const char *scope;    // "read", "submit", "materials", "admin"
    const char *doc;
    Handler *handle;
} Route;

extern const Route routes[];  // ends with method == NULL

#endif
