// The revision of a material that a calibration proposes, which nothing writes until a user sends
// it back: restitution and contact time of one damper's buffer, as fitted.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/calibrate.h"
#include "server/api/materials.h"
#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"

// Of a fitted number from the one before: both a share of it and many standard errors.
static const double far_share = 0.2, far_errors = 4;

// Whether a fitted parameter is this member of a buffer, of damper `damper` (from 1) or, if 0, of
// any.
static bool calibration_is_of(const CalibratedParameter *parameter, uint64_t damper,
                              const char *member) {
    static const char before[] = "/dampers/";
    return strncmp(parameter->member.pointer, before, sizeof before - 1) == 0 &&
           strstr(parameter->member.pointer, "buffer/") != NULL &&
           strcmp(strrchr(parameter->member.pointer, '/') + 1, member) == 0 &&
           (damper == 0 ||
            strtoull(parameter->member.pointer + sizeof before - 1, NULL, 10) + 1 == damper);
}

// The first fitted restitution whose buffer has a fitted contact time too. NULL: none, of both
// without a restitution.
static void calibration_find(const Calibration *calibration, uint64_t damper,
                             const CalibratedParameter **restitution,
                             const CalibratedParameter **contact_time) {
    const CalibratedParameters *all = &calibration->parameters;
    *restitution = *contact_time = NULL;
    for (size_t i = 0; i < all->count; i++) {
        const char *own = all->at[i].member.pointer;
        if (!calibration_is_of(&all->at[i], damper, "restitution"))
            continue;
        *restitution = &all->at[i];
        for (size_t k = 0; k < all->count; k++)
            if (calibration_is_of(&all->at[k], damper, "contact_time") &&
                strncmp(all->at[k].member.pointer, own, (size_t)(strrchr(own, '/') + 1 - own)) ==
                    0) {
                *contact_time = &all->at[k];
                return;
            }
    }
}

// Why there is no proposal; NULL: there is one.
static const char *calibration_refuse(const Calibration *calibration,
                                      const CalibratedParameter *restitution,
                                      const CalibratedParameter *contact_time) {
    if (calibration->verdict == CALIBRATE_NOT_EXPLAINED)
        return "the fitted scene does not explain the measured motions";
    if (!restitution->identifiable)
        return "the measured motions do not determine the restitution";
    if (!contact_time->identifiable)
        return "the measured motions do not determine the contact time";
    return NULL;
}

// The head with the fitted numbers, which hold for the masses of the scene and at any speed: what
// only drop tests tell, as their impactor and base, is removed.
static Status calibration_describe(const Material *head, const char *result,
                                   const CalibratedParameter *restitution,
                                   const CalibratedParameter *contact_time, Material *material) {
    TRY(fields_copy(material_fields, head, material));
    material->restitution = restitution->value;
    material->restitution_deviation = restitution->standard_error;
    material->contact_time = contact_time->value;
    material->contact_time_deviation = contact_time->standard_error;
    material->least_speed = material->most_speed = material->least_temperature =
        material->most_temperature = material->impactor_mass = material->base_mass = (double)NAN;
    material->separation = material->base = CHOICE_ABSENT;
    free(material->impactor);
    material->impactor = NULL;
    free(material->table.at);
    free(material->measurements.at);
    material->table = (MaterialRows){NULL, 0};
    material->measurements = (Reals){NULL, 0};
    return status_made(text_format(&material->source, "calibration %s", result));
}

// That no buffer has both numbers.
static Status calibration_refuse_buffer(const Calibration *calibration, uint64_t damper,
                                        bool has_restitution, Problem *problem) {
    char owner[40] = "a damper", fitted[300] = "";
    if (damper > 0)
        snprintf(owner, sizeof owner, "damper %llu", (unsigned long long)damper);
    for (size_t i = 0; i < calibration->parameters.count; i++)
        text_list(fitted, sizeof fitted, calibration->parameters.at[i].member.pointer);
    return problem_set(problem, STATUS_CONFLICT,
                       "the calibration did not fit the %s of a buffer of %s, it fitted %s: a "
                       "proposal needs the restitution and the contact_time of one buffer",
                       has_restitution ? "contact time" : "restitution", owner, fitted);
}

// That both numbers of another damper were fitted too, where the request names none.
static Status calibration_warn_choice(const Calibration *calibration,
                                      const CalibratedParameter *taken, Warnings *warnings) {
    const CalibratedParameter *restitution, *contact_time;
    for (uint64_t damper = 1; damper <= SCENE_DAMPERS; damper++) {
        calibration_find(calibration, damper, &restitution, &contact_time);
        if (contact_time != NULL && restitution != taken)
            return warnings_add(
                warnings, "/revision", "is of %s; %s was fitted too: choose it with damper=%llu",
                taken->member.pointer, restitution->member.pointer, (unsigned long long)damper);
    }
    return STATUS_OK;
}

// A fitted number that is far from that of the head may be another material's.
static Status calibration_compare(const CalibratedParameter *fitted, double head, double deviation,
                                  const char *pointer, Warnings *warnings) {
    const double errors =
        isnan(deviation) ? fitted->standard_error : hypot(fitted->standard_error, deviation);
    const double difference = fabs(fitted->value - head);
    if (!(difference > far_share * fabs(head) && difference > far_errors * errors))
        return STATUS_OK;
    return warnings_add(warnings, pointer,
                        "%.4g, fitted to %s, is far from that of the latest revision, %.4g: is "
                        "the buffer of the scene made of this material?",
                        fitted->value, fitted->member.pointer, head);
}

static Status calibration_write(const MaterialRevision *head, const ResultRow *row,
                                const Calibration *calibration, uint64_t damper, Bytes *bytes,
                                Problem *problem) {
    const CalibratedParameter *restitution, *contact_time;
    calibration_find(calibration, damper, &restitution, &contact_time);
    if (restitution == NULL || contact_time == NULL)
        return calibration_refuse_buffer(calibration, damper, restitution != NULL, problem);
    const char *why = calibration_refuse(calibration, restitution, contact_time);
    const char *base = base_path();
    Material material = {.name = NULL};
    Warnings warnings = {NULL, 0};
    Status status =
        damper > 0 ? STATUS_OK : calibration_warn_choice(calibration, restitution, &warnings);
    bytes_json(bytes, "{\"slug\": %s, \"result\": %s, \"revision\": ", head->slug, row->id);
    if (status == STATUS_OK && why == NULL) { // as POST to /revisions takes it
        status =
            calibration_describe(&head->material, row->id, restitution, contact_time, &material);
        bytes_text(bytes, "{");
        if (status == STATUS_OK)
            (void)encode_members(bytes, material_fields, &material, WRITE_SCENE);
        bytes_json(bytes,
                   ", \"comment\": \"%s %g, %s %g s, fitted for the masses of the scene of "
                   "calibration %s\"}",
                   restitution->member.pointer, restitution->value, contact_time->member.pointer,
                   contact_time->value, row->id);
        fields_clear(material_fields, &material);
        status = status_first(
            (const Status[]){status,
                             calibration_compare(restitution, head->material.restitution,
                                                 head->material.restitution_deviation,
                                                 "/revision/restitution", &warnings),
                             calibration_compare(contact_time, head->material.contact_time,
                                                 head->material.contact_time_deviation,
                                                 "/revision/contact_time", &warnings)},
            3);
    } else {
        bytes_text(bytes, "null");
    }
    bytes_text(bytes, ", \"why\": ");
    bytes_json_string(bytes, why);
    bytes_text(bytes, ", \"warnings\": ");
    document_warnings(bytes, &warnings);
    warnings_clear(&warnings);
    bytes_json(bytes,
               ", \"links\": {\"calibration\": \"%s/v1/results/%s/calibration.json\", "
               "\"confirm\": \"%s/v1/materials/%s/revisions\", \"material\": "
               "\"%s/v1/materials/%s\"}}\n",
               base, row->id, base, head->slug, base, head->slug);
    return status == STATUS_OK ? status
                               : problem_set(problem, status, "no memory for the proposal");
}

Status calibrations_propose(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request_query(request, "material");
    size_t damper;
    if (slug != NULL && !material_slug_is_valid(slug))
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"material\" must be a slug without a revision, is "
                           "\"%.80s\"",
                           slug);
    if (slug == NULL)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"material\" is required: the slug of the material "
                           "that gets the revision");
    TRY(request_count(request, "damper", 1, SCENE_DAMPERS, 0, &damper, problem)); // 0: any
    ResultRow row = {0};
    StudyAnswer answer = {NULL};
    MaterialRevision head = {.slug = NULL};
    MaterialState state = {0, 0, 0};
    char tag[MATERIAL_TAG];
    Bytes bytes = {.most = app->reply_most};
    Status status = study_load(app, request, &study_calibrate, &row, &answer, problem);
    if (status == STATUS_OK)
        status = db_material_state(app->db, slug, &state, problem);
    if (status == STATUS_OK)
        status = material_latest(app, slug, &head, problem);
    if (status == STATUS_OK)
        status = calibration_write(&head, &row, (const Calibration *)(const void *)answer.study,
                                   damper, &bytes, problem);
    if (status == STATUS_OK) {
        // For If-Match of the POST that confirms it.
        material_tag(slug, state.latest, state.version, tag);
        if (!reply_tagged(reply, request, tag))
            status = reply_bytes(reply, 200, type_json, &bytes, problem);
    }
    bytes_clear(&bytes);
    material_revision_clear(&head);
    fields_clear(study_answer_fields, &answer);
    result_row_clear(&row);
    return status;
}
