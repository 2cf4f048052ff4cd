// What a material's measurements come to, and the revision that would say so: nothing is written,
// whoever agrees sends it back as a revision, under the tag that came with it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/evaluation.h"
#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/formats/chart.h"
#include "server/formats/charts.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/materials/measurement.h"
#include "server/util/base_path.h"

enum { TESTS_MAX = 100, FORMATS = 2 };

static const char *const extensions[] = {"json", "svg", NULL};

// The measurements that are taken in, with their numbers.
typedef struct Taken {
    StoredTest stored[TESTS_MAX];
    Measurement tests[TESTS_MAX];
    size_t count;
} Taken;

static void taken_free(Taken *taken) {
    for (size_t i = 0; taken != NULL && i < taken->count; i++)
        stored_test_clear(&taken->stored[i]);
    free(taken);
}

static Status take(const char *slug, const MaterialState *state, uint64_t number, Taken *taken,
                   Problem *problem) {
    for (size_t i = 0; i < taken->count; i++)
        if (taken->tests[i].number == number)
            return problem_set(problem, STATUS_USAGE,
                               "the query parameter \"measurements\" names %llu twice",
                               (unsigned long long)number);
    if (taken->count == TESTS_MAX)
        return problem_set(problem, STATUS_USAGE,
                           "at most %d measurements are taken in at a time: name them as "
                           "?measurements=1,2",
                           TESTS_MAX);
    if (number == 0 || number > state->measurements)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no measurement %llu of the material \"%.63s\"",
                           (unsigned long long)number, slug);
    taken->tests[taken->count] = (Measurement){number, &taken->stored[taken->count].test};
    taken->count++;
    return STATUS_OK;
}

static Status load(CpuBudget *budget, const char *slug, Taken *taken, Reply *reply,
                   Problem *problem) {
    for (size_t i = 0; i < taken->count; i++) {
        if (!cpu_budget_lasts(budget, 0)) {
            const Status status = cpu_budget_report(budget, problem);
            reply->retry_after = status == STATUS_BUSY ? 10 : reply->retry_after;
            return status;
        }
        TRY(stored_test_load(budget->app->db, slug, taken->tests[i].number, &taken->stored[i],
                             problem));
        // Before there are more of them in memory.
        if (evaluation_sample_count(taken->tests, i + 1) > EVALUATION_SAMPLES_MAX)
            return problem_set(problem, STATUS_LIMIT,
                               "more than %d samples in traces: take in fewer measurements at a "
                               "time, as ?measurements=1,2",
                               EVALUATION_SAMPLES_MAX);
    }
    return STATUS_OK;
}

// "1,2,5"; all of them without it.
static Status take_asked(const Request *request, const MaterialState *state, Taken *taken,
                         Problem *problem) {
    const char *slug = request->parameters[0], *list = request_query(request, "measurements");
    if (state->measurements == 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the material \"%.63s\" has no measurements yet: POST one to "
                           "/v1/materials/%.63s/measurements",
                           slug, slug);
    for (uint64_t i = 1; list == NULL && i <= state->measurements; i++)
        TRY(take(slug, state, i, taken, problem));
    for (const char *text = list; text != NULL;) {
        const size_t size = strspn(text, "0123456789");
        if (size == 0 || size > 9 || (text[size] != ',' && text[size] != '\0'))
            return problem_set(problem, STATUS_USAGE,
                               "the query parameter \"measurements\" must be numbers with commas "
                               "between, as 1,2, is \"%.40s\"",
                               list);
        TRY(take(slug, state, strtoull(text, NULL, 10), taken, problem));
        text = text[size] == ',' ? text + size + 1 : NULL;
    }
    return STATUS_OK;
}

// Which of the extensions.
static Status choose_format(const Request *request, Reply *reply, int *format, Problem *problem) {
    static const char *const types[] = {"application/json", chart_type, NULL};
    const char *extension = request->parameters[1];
    reply->varies_by_accept = extension == NULL;
    *format = extension == NULL ? header_accept(request->accept, types) : -1;
    for (int i = 0; extension != NULL && i < FORMATS; i++)
        if (strcmp(extension, extensions[i]) == 0)
            *format = i;
    if (*format >= 0)
        return STATUS_OK;
    return extension == NULL
               ? problem_set(problem, STATUS_NOT_ACCEPTABLE,
                             "none of the formats fits Accept; there are json, svg, by extension "
                             "too")
               : problem_set(problem, STATUS_NOT_FOUND,
                             "there is no format \"%.20s\"; there are json, svg", extension);
}

// As it may be sent back.
static void write_revision(Bytes *bytes, const Taken *taken, const Material *material) {
    bytes_text(bytes, "{");
    (void)encode_members(bytes, material_fields, material, WRITE_SCENE);
    bytes_format(bytes, ", \"comment\": \"from measurement%s", taken->count > 1 ? "s" : "");
    for (size_t i = 0; i < taken->count; i++)
        bytes_format(bytes, "%s%llu", i > 0 ? ", " : " ",
                     (unsigned long long)taken->tests[i].number);
    bytes_text(bytes, "\"}");
}

static void write_links(Bytes *bytes, const Request *request) {
    const char *base = base_path(), *slug = request->parameters[0];
    const char *query = strchr(request->target, '?');
    bytes_text(bytes, ", \"links\": {\"self\": ");
    Bytes self = {.most = 8192};
    bytes_format(&self, "%s/v1/materials/%s/proposal%s", base, slug, query != NULL ? query : "");
    bytes_json_string(bytes, self.at);
    bytes_clear(&self);
    bytes_format(&self, "%s/v1/materials/%s/proposal.svg%s", base, slug,
                 query != NULL ? query : "");
    bytes_text(bytes, ", \"chart\": ");
    bytes_json_string(bytes, self.at);
    bytes_clear(&self);
    bytes_format(bytes,
                 ", \"confirm\": \"%s/v1/materials/%s/revisions\", \"material\": "
                 "\"%s/v1/materials/%s\"}",
                 base, slug, base, slug);
}

static Status tell(App *app, const Request *request, const Taken *taken,
                   const Evaluation *evaluation, const MaterialProposal *proposal, Reply *reply,
                   Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"measurements\": [", request->parameters[0]);
    for (size_t i = 0; i < taken->count; i++)
        bytes_format(&bytes, "%s%llu", i > 0 ? ", " : "",
                     (unsigned long long)taken->tests[i].number);
    bytes_text(&bytes, "], \"revision\": ");
    if (proposal->why == NULL)
        write_revision(&bytes, taken, &proposal->material);
    else
        bytes_text(&bytes, "null");
    bytes_text(&bytes, ", \"why\": ");
    bytes_json_string(&bytes, proposal->why);
    bytes_text(&bytes, ", ");
    evaluation_write(&bytes, evaluation);
    write_links(&bytes, request);
    bytes_text(&bytes, "}\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status tell_chart(App *app, const Request *request, const Evaluation *evaluation,
                         Reply *reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    charts_evaluation(evaluation, request->parameters[0], &bytes);
    return reply_bytes(reply, 200, chart_type, &bytes, problem);
}

static Status propose(App *app, const Request *request, const Material *before, Taken *taken,
                      int separation, int format, Reply *reply, Problem *problem) {
    int form;
    TRY(query_choice(request, "as", proposal_form_names, PROPOSAL_CONSTANT, &form, problem));
    Evaluation evaluation = {.separation = separation};
    MaterialProposal proposal = {.why = NULL};
    CpuBudget budget;
    cpu_budget_begin(app, &budget);
    Status status = load(&budget, request->parameters[0], taken, reply, problem);
    if (status == STATUS_OK)
        status = material_evaluate(&budget, taken->tests, taken->count, separation, &evaluation,
                                   reply, problem);
    cpu_budget_end(&budget);
    if (status == STATUS_OK)
        status = material_proposal_run(&evaluation, taken->tests, taken->count, before,
                                       (ProposalForm)form, &proposal, problem);
    if (status == STATUS_OK)
        status = format == 0 ? tell(app, request, taken, &evaluation, &proposal, reply, problem)
                             : tell_chart(app, request, &evaluation, reply, problem);
    material_proposal_clear(&proposal);
    evaluation_clear(&evaluation);
    return status;
}

Status proposals_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialState state;
    int format, separation;
    char tag[MATERIAL_TAG];
    TRY(choose_format(request, reply, &format, problem));
    if (format != 0)
        reply->policy = reply_drawing_policy;
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(material_separation(app, request, &separation, problem));
    material_tag(slug, state.latest, state.version, tag);
    MaterialRevision before = {.slug = NULL};
    TRY(material_latest(app, slug, &before, problem));
    Taken *taken = calloc(1, sizeof *taken);
    Status status = taken != NULL ? take_asked(request, &state, taken, problem)
                                  : problem_set(problem, STATUS_NO_MEMORY, "no memory for it");
    if (status == STATUS_OK && !reply_tagged(reply, request, tag))
        status = propose(app, request, &before.material, taken, separation, format, reply, problem);
    taken_free(taken);
    material_revision_clear(&before);
    return status;
}
