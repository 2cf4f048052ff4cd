// What is derived from a material: the revision that its measurements propose, which nothing writes
// until a user sends it back, and the contact parameters for one pair of masses.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/pair_parameters.h"
#include "server/api/materials.h"
#include "server/formats/study_formats.h"
#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"

enum { TESTS_MAX = 100 };

static const double mass_min = 1e-12, mass_max = 1e15; // [kg]

// The measurements of a proposal.
typedef struct Selection {
    StoredTest stored[TESTS_MAX];
    Measurement tests[TESTS_MAX];
    size_t count;
} Selection;

static void selection_free(Selection *selection) {
    for (size_t i = 0; selection != NULL && i < selection->count; i++)
        stored_test_clear(&selection->stored[i]);
    free(selection);
}

static Status selection_add(Selection *selection, const char *slug, const MaterialState *state,
                            uint64_t number, Problem *problem) {
    for (size_t i = 0; i < selection->count; i++)
        if (selection->tests[i].number == number)
            return problem_set(problem, STATUS_USAGE,
                               "the query parameter \"measurements\" has %llu twice",
                               (unsigned long long)number);
    if (selection->count == TESTS_MAX)
        return problem_set(problem, STATUS_USAGE,
                           "a proposal takes at most %d measurements: select some, as "
                           "?measurements=1,2",
                           TESTS_MAX);
    if (number == 0 || number > state->measurements)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the material \"%.63s\" has no measurement %llu", slug,
                           (unsigned long long)number);
    selection->tests[selection->count] =
        (Measurement){number, &selection->stored[selection->count].test};
    selection->count++;
    return STATUS_OK;
}

// "1,2,5"; without it all of them.
static Status selection_read(Selection *selection, const Request *request,
                             const MaterialState *state, Problem *problem) {
    const char *slug = request->parameters[0], *list = request_query(request, "measurements");
    if (state->measurements == 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the material \"%.63s\" has no measurements yet: POST one to "
                           "/v1/materials/%.63s/measurements",
                           slug, slug);
    for (uint64_t i = 1; list == NULL && i <= state->measurements; i++)
        TRY(selection_add(selection, slug, state, i, problem));
    for (const char *text = list; text != NULL;) {
        const size_t size = strspn(text, "0123456789");
        if (size == 0 || size > 9 || (text[size] != ',' && text[size] != '\0'))
            return problem_set(problem, STATUS_USAGE,
                               "the query parameter \"measurements\" must be numbers separated by "
                               "commas, as 1,2, is \"%.40s\"",
                               list);
        TRY(selection_add(selection, slug, state, strtoull(text, NULL, 10), problem));
        text = text[size] == ',' ? text + size + 1 : NULL;
    }
    return STATUS_OK;
}

static Status selection_load(App *app, Selection *selection, const char *slug, Problem *problem) {
    for (size_t i = 0; i < selection->count; i++) {
        TRY(stored_test_load(app->db, slug, selection->tests[i].number, &selection->stored[i],
                             problem));
        // Before more of them are in memory.
        if (evaluation_sample_count(selection->tests, i + 1) > EVALUATION_SAMPLES_MAX)
            return problem_set(problem, STATUS_LIMIT,
                               "the traces have more than %d samples: select fewer measurements, "
                               "as ?measurements=1,2",
                               EVALUATION_SAMPLES_MAX);
    }
    return STATUS_OK;
}

// `"name": ` and the address of the proposal, with the request's query.
static void proposal_write_link(Bytes *bytes, const Request *request, const char *name,
                                const char *rest) {
    Bytes link = {.most = 8192};
    const char *query = strchr(request->target, '?');
    bytes_format(&link, "%s/v1/materials/%s/proposal%s%s", base_path(), request->parameters[0],
                 rest, query != NULL ? query : "");
    bytes_text(bytes, name);
    bytes_json_string(bytes, link.at);
    bytes->is_failed = bytes->is_failed || link.is_failed;
    bytes_clear(&link);
}

static void proposal_write(Bytes *bytes, const Request *request, const Selection *selection,
                           const Evaluation *evaluation, const MaterialProposal *proposal) {
    const char *base = base_path(), *slug = request->parameters[0];
    Bytes numbers = {.most = 0};
    for (size_t i = 0; i < selection->count; i++)
        bytes_format(&numbers, "%s%llu", i > 0 ? ", " : "",
                     (unsigned long long)selection->tests[i].number);
    bytes_format(bytes, "{\"slug\": \"%s\", \"measurements\": [%s], \"revision\": ", slug,
                 numbers.at);
    if (proposal->why == NULL) { // as POST to /revisions takes it
        bytes_text(bytes, "{");
        (void)encode_members(bytes, material_fields, &proposal->material, WRITE_SCENE);
        bytes_format(bytes, ", \"comment\": \"from measurement%s %s\"}",
                     selection->count > 1 ? "s" : "", numbers.at);
    } else {
        bytes_text(bytes, "null");
    }
    bytes_json(bytes, ", \"why\": %s, ", proposal->why);
    evaluation_write(bytes, evaluation, true);
    bytes_text(bytes, ", \"links\": {");
    proposal_write_link(bytes, request, "\"self\": ", "");
    proposal_write_link(bytes, request, ", \"chart\": ", ".svg");
    bytes_format(bytes,
                 ", \"confirm\": \"%s/v1/materials/%s/revisions\", \"material\": "
                 "\"%s/v1/materials/%s\"}}\n",
                 base, slug, base, slug);
    bytes->is_failed = bytes->is_failed || numbers.is_failed;
    bytes_clear(&numbers);
}

static Status proposal_run(App *app, const Request *request, const Material *before,
                           Selection *selection, int separation, bool is_chart, Reply *reply,
                           Problem *problem) {
    const char *slug = request->parameters[0];
    int form;
    TRY(request_choice(request, "as", proposal_form_names, PROPOSAL_CONSTANT, &form, problem));
    Evaluation evaluation = {.separation = separation};
    MaterialProposal proposal = {.why = NULL};
    Status status = selection_load(app, selection, slug, problem);
    if (status == STATUS_OK)
        status = measurements_evaluate(app, selection->tests, selection->count, separation,
                                       &evaluation, reply, problem);
    if (status == STATUS_OK)
        status = material_proposal_run(&evaluation, selection->tests, selection->count, before,
                                       (ProposalForm)form, &proposal, problem);
    if (status == STATUS_OK) {
        Bytes bytes = {.most = app->reply_most};
        if (is_chart)
            chart_evaluation(&evaluation, slug, &bytes);
        else
            proposal_write(&bytes, request, selection, &evaluation, &proposal);
        status = reply_bytes(reply, 200, is_chart ? format_svg.content_type : type_json, &bytes,
                             problem);
    }
    material_proposal_clear(&proposal);
    evaluation_clear(&evaluation);
    return status;
}

Status proposals_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialState state;
    MaterialRevision before;
    static const TableFormat *const formats[] = {&format_json, &format_svg, NULL};
    const TableFormat *format;
    int separation;
    TRY(columns_format(request, 1, formats, reply, &format, problem));
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(measurement_separation(app, request, &separation, problem));
    TRY(material_latest(app, slug, &before, problem));
    Selection *selection = calloc(1, sizeof *selection);
    Status status = selection != NULL
                        ? selection_read(selection, request, &state, problem)
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurements");
    if (status == STATUS_OK && !material_is_cached(request, reply, &state))
        status = proposal_run(app, request, &before.material, selection, separation,
                              format == &format_svg, reply, problem);
    selection_free(selection);
    material_revision_clear(&before);
    return status;
}

// What is derived for one pair of masses.
typedef struct PairQuery {
    double damper_mass, structure_mass; // [kg]
    int identified_for, separation;
} PairQuery;

static Status pair_query_read(const Request *request, PairQuery *query, Problem *problem) {
    if (request_query(request, "damper_mass") == NULL)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"damper_mass\" is required: the mass of the free "
                           "body [kg]; structure_mass too, unless the structure does not move");
    TRY(request_number(request, "damper_mass", mass_min, mass_max, (double)NAN, &query->damper_mass,
                       problem));
    TRY(request_number(request, "structure_mass", mass_min, mass_max, (double)NAN,
                       &query->structure_mass, problem));
    TRY(request_choice(request, "identified_for", identified_for_names, IDENTIFIED_FOR_SCENE,
                       &query->identified_for, problem));
    return request_choice(request, "separation", separation_names, CHOICE_ABSENT,
                          &query->separation, problem);
}

static void pair_write(Bytes *bytes, const MaterialRevision *revision, const PairParameters *pair) {
    const char *base = base_path(), *slug = revision->slug;
    const unsigned long long number = revision->revision;
    bytes_json(bytes, "{\"material\": \"%s@%llu\", \"status\": %s, ", slug, number,
               revision->status);
    (void)encode_members(bytes, pair_parameters_fields, pair, WRITE_REPORT);
    bytes_text(bytes, ", \"warnings\": ");
    document_warnings(bytes, &pair->warnings);
    bytes_json(bytes,
               ", \"links\": {\"material\": \"%s/v1/materials/%s\", \"revision\": "
               "\"%s/v1/materials/%s@%llu\"}}\n",
               base, slug, base, slug, number);
}

Status derived_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    PairQuery query;
    uint64_t number;
    TRY(material_number(request->parameters[1], "revision", &number, problem));
    TRY(pair_query_read(request, &query, problem));
    MaterialRevision revision;
    PairParameters pair = {.contacts = {NULL, 0}};
    char tag[MATERIAL_TAG];
    Status status = db_material(app->db, request->parameters[0], number, &revision, problem);
    problem->whose = "query";
    if (status == STATUS_OK)
        status = pair_parameters_run(&revision.material, query.damper_mass, query.structure_mass,
                                     query.identified_for, query.separation, &pair, problem);
    if (status == STATUS_OK) {
        material_tag(revision.slug, revision.revision, revision.version, tag);
        if (!reply_tagged(reply, request, tag)) {
            Bytes bytes = {.most = app->reply_most};
            pair_write(&bytes, &revision, &pair);
            status = reply_bytes(reply, 200, type_json, &bytes, problem);
        }
    }
    pair_parameters_clear(&pair);
    material_revision_clear(&revision);
    return status;
}
