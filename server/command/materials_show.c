// impactd materials list, show, history, diff, used-by, derived: what a daemon tells of materials.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/scene/damper.h"
#include "core/scene/material.h"
#include "server/codec/json_edit.h"
#include "server/codec/read.h"
#include "server/codec/write.h"
#include "server/command/materials_ask.h"

static const OutlineTable tables[] = {
    {"materials",
     {"slug", "revision", "status", "name", "kind", "restitution", "contact_time", "source"}},
    {"history", {"version", "when", "who", "action", "revision", "measurement", "why"}},
    {"differences", {"pointer", "from", "to", "unit"}},
    {"results", {"id", "created"}},
    {NULL, {NULL}},
};

static Status get(MaterialsCall *call, Bytes *path, Problem *problem) {
    HttpAnswer answer;
    Status status = materials_ask(call, "GET", path, NULL, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print(call, &answer, tables, problem);
    http_answer_clear(&answer);
    return status;
}

static void most_put(Bytes *path) {
    char most[16];
    snprintf(most, sizeof most, "%d", MATERIALS_MAX);
    materials_query(path, "limit", most);
}

Status materials_list_act(MaterialsCall *call, Problem *problem) {
    static const char *const statuses[] = {"draft", "approved", "deprecated"};
    const MaterialsSettings *settings = call->settings;
    Bytes path = {.most = 8000};
    bytes_text(&path, "/v1/materials");
    materials_query(&path, "q", settings->q);
    materials_query(&path, "kind", settings->kind);
    materials_query(&path, "status",
                    settings->status != CHOICE_ABSENT ? statuses[settings->status] : NULL);
    materials_query(&path, "e", settings->e);
    materials_query(&path, "T_c", settings->T_c);
    most_put(&path);
    return get(call, &path, problem);
}

// What the revision says, a line a member, as `revise` takes it.
static Status said_print(HttpAnswer *answer, Problem *problem) {
    Material material = {0};
    const char *between = "{\n  ";
    TRY(json_edit_remove_nulls(&answer->body, problem));
    // What is beside it (who, when, links) is no fault here.
    (void)read_json(answer->body.at, answer->body.count, material_fields, &material, NULL);
    Bytes text = {0};
    for (const Field *row = material_fields; row->kind != FIELD_KIND_END; row++) {
        const Field alone[] = {*row, FIELD_END};
        Bytes member = {0};
        if (write_members(&member, alone, &material, WRITE_SCENE) > 0) {
            bytes_text(&text, between);
            bytes_put(&text, member.at, member.count);
            between = ",\n  ";
        }
        text.is_failed = text.is_failed || member.is_failed;
        bytes_clear(&member);
    }
    fields_clear(material_fields, &material);
    const bool is_whole = !text.is_failed && text.count > 0;
    if (is_whole)
        printf("%s\n}\n", text.at);
    bytes_clear(&text);
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_UNREACHABLE,
                                  "the answer is no material: what answers there is no impactd");
}

Status materials_show_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], true, problem));
    materials_path(&path, call->operands[0], "");
    if (!call->settings->editable)
        return get(call, &path, problem);
    HttpAnswer answer;
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = said_print(&answer, problem);
    http_answer_clear(&answer);
    return status;
}

Status materials_history_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], false, problem));
    materials_path(&path, call->operands[0], "/history");
    most_put(&path);
    return get(call, &path, problem);
}

Status materials_diff_act(MaterialsCall *call, Problem *problem) {
    static const char *const ends[] = {"from", "to"};
    Bytes path;
    TRY(materials_name(call->operands[0], false, problem));
    for (size_t i = 1; i < call->operand_count; i++)
        TRY(materials_number(call->operands[i], "a revision", problem));
    materials_path(&path, call->operands[0], "/diff");
    for (size_t i = 1; i < call->operand_count; i++)
        materials_query(&path, ends[i - 1], call->operands[i]);
    return get(call, &path, problem);
}

Status materials_used_by_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], true, problem));
    materials_path(&path, call->operands[0], "/used-by");
    if (strchr(call->operands[0], '@') != NULL)
        most_put(&path);
    return get(call, &path, problem);
}

Status materials_derived_act(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    Bytes path;
    TRY(materials_name(call->operands[0], true, problem));
    if (isnan(settings->damper_mass))
        return problem_set(
            problem, STATUS_USAGE,
            "needs --damper-mass M in kg, and --structure-mass M unless the structure "
            "does not move");
    materials_path(&path, call->operands[0], "/derived");
    materials_query_real(&path, "damper_mass", settings->damper_mass);
    materials_query_real(&path, "structure_mass", settings->structure_mass);
    if (settings->identified_for != CHOICE_ABSENT)
        materials_query(&path, "identified_for", identified_for_names[settings->identified_for]);
    if (settings->separation != CHOICE_ABSENT)
        materials_query(&path, "separation", separation_names[settings->separation]);
    return get(call, &path, problem);
}
