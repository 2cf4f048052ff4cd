// GET /: how to begin. Browsers get the dashboard, everyone else lines that can be pasted into a
// shell as they are.
#include <stdio.h>
#include <string.h>

#include "server/api/app.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/util/embedded.h"

#define SCENE                                                                                      \
    "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}, "                   \
    "\"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}], "            \
    "\"excitation\": {\"kind\": \"free\", \"displacement\": 0.015}, \"duration\": 10, "            \
    "\"sample_rate\": 1000"
#define STUDY                                                                                      \
    "\"study\": {\"kind\": \"tradeoff\", \"solvers\": [\"exact\", \"rk4\"], \"repeats\": 1}"
#define FELT                                                                                       \
    "{\"slug\": \"felt\", \"name\": \"Felt\", \"restitution\": 0.3, \"contact_time\": 0.02, "      \
    "\"source\": \"notebook 7\"}"
#define APPROVAL "{\"status\": \"approved\", \"reason\": \"as measured\"}"
// Of a job's document.
#define RESULT "grep -o '\"result\": \"r-[0-9a-f]*' | cut -d'\"' -f4"
// Of an example, once it is done.
#define RESULT_OF(example)                                                                         \
    "$(curl -s @/v1/examples/" example                                                             \
    " | curl -s -H 'Prefer: wait=30' --json @- @/v1/jobs | " RESULT ")"

typedef struct Step {
    const char *what;
    const char *line; // each @ is the server's URL
} Step;

static const Step steps[] = {
    {"Simulate the paper's sponge damper, released from 15 mm:",
     "curl -s --json '" SCENE "}' @/v1/jobs"},
    {"Keep the id of its result:", "R=" RESULT_OF("paper_free_sponge")},
    {"The impacts, the time series, the spectrum:", "curl -s @/v1/results/$R/impacts.json"},
    {NULL, "curl -s \"@/v1/results/$R/series.csv?channels=displacement&to=0.1\""},
    {NULL, "curl -s -O @/v1/results/$R/series.npy"},
    {NULL, "curl -s @/v1/results/$R/psd.json"},
    {"One impact, finely; all of it in one archive:",
     "curl -s @/v1/results/$R/impacts/1/force.csv"},
    {NULL, "curl -s -O @/v1/results/$R/bundle.zip"},
    {"Beside another result, what differs in both inputs and motions:",
     "S=" RESULT_OF("paper_free_impulse_sponge")},
    {NULL, "curl -s \"@/v1/compare?a=$R&b=$S\""},
    {"A job's progress as it goes:",
     "J=$(curl -s @/v1/examples/paper_random_sponge | curl -s -H 'Prefer: respond-async' --json @- "
     "@/v1/jobs | grep -o '\"id\": \"j-[0-9a-f]*' | cut -d'\"' -f4)"},
    {NULL, "curl -s -N @/v1/jobs/$J/events"},
    {"Check a scene and see its plan without running it:",
     "curl -s @/v1/examples/paper_free_sponge | curl -s --json @- '@/v1/jobs?dry_run=1'"},
    {"What speed costs in accuracy on this scene, as a chart:",
     "R=$(curl -s -H 'Prefer: wait=30' --json '" SCENE ", " STUDY "}' @/v1/jobs | " RESULT ")"},
    {NULL, "curl -s -O @/v1/results/$R/tradeoff.svg"},
    {"Many seeds of a random base: means with their confidence, and every run:",
     "R=" RESULT_OF("ensemble_random_sponge")},
    {NULL, "curl -s -O @/v1/results/$R/ensemble.svg"},
    {NULL, "curl -s @/v1/results/$R/ensemble.csv"},
    {"The scene at many points, and one point's own series:",
     "R=" RESULT_OF("sweep_clearance_buffer")},
    {NULL, "curl -s @/v1/results/$R/table.csv"},
    {NULL, "curl -s @/v1/results/$R/points/17/scene | curl -s --json @- @/v1/jobs"},
    {"Every contact model on one scene; what errors of restitution and contact time do:",
     "R=" RESULT_OF("compare_sponge")},
    {NULL, "curl -s @/v1/results/$R/compare.csv"},
    {NULL, "R=" RESULT_OF("sensitivity_sponge")},
    {NULL, "curl -s @/v1/results/$R/sensitivity.csv"},
    {"A material of your own: a draft, approved, what was done to it, who used it:",
     "curl -s --json '" FELT "' @/v1/materials"},
    {NULL,
     "curl -s -H 'If-Match: \"felt@1-1\"' --json '" APPROVAL "' @/v1/materials/felt@1/review"},
    {NULL, "curl -s @/v1/materials/felt/history"},
    {NULL, "curl -s @/v1/materials/felt/used-by"},
    {"A ground motion, for scenes to name:",
     "curl -s -H 'Content-Type: text/plain' --data-binary '0 1 -2 2 -1 0' "
     "'@/v1/records?name=shake&interval=0.1&unit=g'"},
    {NULL, "curl -s @/v1/records/shake/samples.csv"},
    {"Where tokens are asked for, every line needs this too:",
     "curl -s -H \"Authorization: Bearer $IMPACTD_TOKEN\" @/v1/jobs"},
    {"Jobs, what is known already, materials, records, examples, schemas, the whole API:",
     "curl -s @/v1/jobs"},
    {NULL, "curl -s @/v1/cache"},
    {NULL, "curl -s @/v1/materials"},
    {NULL, "curl -s @/v1/records"},
    {NULL, "curl -s @/v1/examples"},
    {NULL, "curl -s @/schemas/scene"},
    {NULL, "curl -s @/openapi.json"},
};

// "@-" is curl's standard input; every other @ stands for the URL.
static void write_line(Bytes *bytes, const char *line, const char *url) {
    for (; *line != '\0'; line++) {
        if (*line == '@' && line[1] == '/')
            bytes_text(bytes, url);
        else
            bytes_put(bytes, line, 1);
    }
}

static void write_text(Bytes *bytes, const char *url) {
    bytes_format(bytes, "# impactd %s: simulations of impact dampers over HTTP and JSON\n",
                 program_version);
    for (size_t i = 0; i < COUNT(steps); i++) {
        if (steps[i].what != NULL)
            bytes_format(bytes, "\n# %s\n", steps[i].what);
        write_line(bytes, steps[i].line, url);
        bytes_text(bytes, "\n");
    }
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
    // The gate lets through no Host but ours, so it can stand in a line for the shell.
    if (app->base_url[0] != '\0')
        text_fit(url, sizeof url, app->base_url);
    else
        snprintf(url, sizeof url, "%s://%.80s", app->has_tls ? "https" : "http", request->host);
    Bytes text = {.most = 1 << 16};
    write_text(&text, url);
    return reply_bytes(reply, 200, "text/plain; charset=utf-8", &text, problem);
}
