// What a material comes to for one pair of masses.
#include <math.h>
#include <stdlib.h>

#include "core/drop_test/pair_parameters.h"
#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"

static const double mass_min = 1e-12, mass_max = 1e15; // [kg]

typedef struct Asked {
    double damper_mass, structure_mass; // [kg]
    int identified_for, separation;
} Asked;

static Status read_query(const Request *request, Asked *asked, Problem *problem) {
    if (request_query(request, "damper_mass") == NULL)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"damper_mass\" is required: mass of the free "
                           "body [kg]; structure_mass too unless what it strikes does not move");
    TRY(request_number(request, "damper_mass", mass_min, mass_max, (double)NAN, &asked->damper_mass,
                       problem));
    TRY(request_number(request, "structure_mass", mass_min, mass_max, (double)NAN,
                       &asked->structure_mass, problem));
    TRY(query_choice(request, "identified_for", identified_for_names, IDENTIFIED_FOR_SCENE,
                     &asked->identified_for, problem));
    return query_choice(request, "separation", separation_names, CHOICE_ABSENT, &asked->separation,
                        problem);
}

static void write_answer(Bytes *bytes, const MaterialRevision *material,
                         const PairParameters *pair) {
    const char *base = base_path();
    const unsigned long long revision = material->revision;
    bytes_format(bytes, "{\"material\": \"%s@%llu\", \"status\": \"%s\", ", material->slug,
                 revision, material->status);
    (void)encode_members(bytes, pair_parameters_fields, pair, WRITE_REPORT);
    bytes_text(bytes, ", \"warnings\": ");
    encode_list(bytes, warning_fields, pair->warnings.at, pair->warnings.count,
                sizeof *pair->warnings.at, WRITE_REPORT);
    bytes_format(bytes,
                 ", \"links\": {\"material\": \"%s/v1/materials/%s\", \"revision\": "
                 "\"%s/v1/materials/%s@%llu\"}}\n",
                 base, material->slug, base, material->slug, revision);
}

static Status show(App *app, const Request *request, uint64_t revision, Reply *reply,
                   Problem *problem) {
    Asked asked;
    TRY(read_query(request, &asked, problem));
    MaterialRevision material = {.slug = NULL};
    PairParameters pair = {.contacts = {NULL, 0}};
    Status status = material_find(app->db, request->parameters[0], revision, &material, problem);
    problem->whose = "query";
    if (status == STATUS_OK)
        status = pair_parameters_run(&material.material, asked.damper_mass, asked.structure_mass,
                                     asked.identified_for, asked.separation, &pair, problem);
    if (status == STATUS_OK) {
        char tag[MATERIAL_TAG];
        material_tag(material.slug, material.revision, material.version, tag);
        if (!reply_tagged(reply, request, tag)) {
            Bytes bytes = {.most = app->reply_most};
            write_answer(&bytes, &material, &pair);
            status = reply_bytes(reply, 200, type_json, &bytes, problem);
        }
    }
    pair_parameters_clear(&pair);
    material_revision_clear(&material);
    return status;
}

Status derived_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, 0, reply, problem);
}

Status derived_show_revision(App *app, const Request *request, Reply *reply, Problem *problem) {
    uint64_t revision;
    TRY(material_revision_number(request->parameters[1], &revision, problem));
    return show(app, request, revision, reply, problem);
}
