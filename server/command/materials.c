// One table of actions; what each takes is counted here, what it means is the action's.
#include "server/command/command.h"

#include <stdio.h>
#include <string.h>

#include "core/base/spelling.h"
#include "core/drop_test/evaluation.h"
#include "core/scene/damper.h"
#include "server/command/materials_ask.h"

static const char *const statuses[] = {"draft", "approved", "deprecated", NULL};

// clang-format off
static const Field materials_fields[] = {
    DAEMON_ROWS(MaterialsSettings),
    FIELD_REAL(MaterialsSettings, wait, "s", AT_MIN(0), 60, "wait so long for a busy daemon"),
    FIELD_FLAG(MaterialsSettings, json, false, "print what the daemon answers, as JSON"),
    FIELD_TEXT(MaterialsSettings, q, 200, PRESENCE_OPTIONAL, 0, "words in slug, name, kind, supplier, source, tags or notes"),
    FIELD_TEXT(MaterialsSettings, kind, 60, PRESENCE_OPTIONAL, 0, "those of one kind: foam, rubber, metal ..."),
    FIELD_CHOICE(MaterialsSettings, status, statuses, OPTIONAL, "draft, approved or deprecated"),
    FIELD_TEXT(MaterialsSettings, e, 60, PRESENCE_OPTIONAL, 0, "those whose coefficient of restitution lies in a range: 0.4..0.7, ..0.3, 0.9.."),
    FIELD_TEXT(MaterialsSettings, T_c, 60, PRESENCE_OPTIONAL, 0, "those whose contact time in s lies in a range"),
    FIELD_FLAG(MaterialsSettings, editable, false, "what the revision says and nothing else, as revise takes it"),
    FIELD_TEXT(MaterialsSettings, comment, 1000, PRESENCE_OPTIONAL, 0, "why, for those who come later"),
    FIELD_COUNT(MaterialsSettings, from, NULL, AT_MIN(1), OPTIONAL, "the newest revision you saw: nothing is written if there is a newer one"),
    FIELD_TEXT(MaterialsSettings, reason, 1000, PRESENCE_OPTIONAL, 0, "why it is approved or deprecated"),
    FIELD_TEXTS(MaterialsSettings, trace, NULL, NULL, TRACES_MAX, PRESENCE_OPTIONAL, 0, "a force trace's file: a time in s and a force in N, or the force alone; may be given again"),
    FIELD_REAL(MaterialsSettings, interval, "s", ABOVE(0), OPTIONAL, "between samples, where a trace has forces alone"),
    FIELD_FLAG(MaterialsSettings, dry_run, false, "show what would come of it; keep nothing"),
    FIELD_TEXT(MaterialsSettings, measurements, 4000, PRESENCE_OPTIONAL, 0, "the numbers of those that count, as 1,2 (all)"),
    FIELD_CHOICE(MaterialsSettings, separation, separation_names, OPTIONAL, "the rule by which a contact ends: zero_penetration, zero_force"),
    FIELD_CHOICE(MaterialsSettings, as, proposal_form_names, OPTIONAL, "constant, or a table over approach speed"),
    FIELD_FLAG(MaterialsSettings, confirm, false, "make it a revision"),
    FIELD_REAL(MaterialsSettings, damper_mass, "kg", ABOVE(0), OPTIONAL, "the free mass of a pair"),
    FIELD_REAL(MaterialsSettings, structure_mass, "kg", ABOVE(0), OPTIONAL, "what it strikes; without, that does not move"),
    FIELD_CHOICE(MaterialsSettings, identified_for, identified_for_names, OPTIONAL, "whose e and T_c they are: this pair's (scene), or the test's (rig)"),
    FIELD_FLAG(MaterialsSettings, force, false, "replace FILE if it is there"),
    FIELD_END,
};
static const OptionGroup groups[] = {
    {"server", "The daemon:"},
    {"q", "list:"},
    {"editable", "show:"},
    {"comment", "add, revise, revert, measure, propose --confirm:"},
    {"reason", "approve, deprecate:"},
    {"trace", "measure:"},
    {"dry_run", "measure, import:"},
    {"measurements", "propose:"},
    {"damper_mass", "derived:"},
    {"force", "export:"},
    {NULL, NULL},
};

static const struct Action {
    const char *name, *takes;
    size_t least, most; // operands
    MaterialsAct *act;
} actions[] = {
    {"list",      "nothing more",                          0, 0, materials_list_act},
    {"show",      "SLUG or SLUG@REVISION",                 1, 1, materials_show_act},
    {"add",       "FILE.json",                             1, 1, materials_add_act},
    {"revise",    "SLUG FILE.json",                        2, 2, materials_revise_act},
    {"revert",    "SLUG REVISION",                         2, 2, materials_revert_act},
    {"approve",   "SLUG@REVISION",                         1, 1, materials_approve_act},
    {"deprecate", "SLUG@REVISION",                         1, 1, materials_deprecate_act},
    {"history",   "SLUG",                                  1, 1, materials_history_act},
    {"diff",      "SLUG, and perhaps two revisions",       1, 3, materials_diff_act},
    {"used-by",   "SLUG or SLUG@REVISION",                 1, 1, materials_used_by_act},
    {"measure",   "SLUG TEST.json",                        2, 2, materials_measure_act},
    {"measurements", "SLUG",                               1, 1, materials_measurements_act},
    {"propose",   "SLUG",                                  1, 1, materials_propose_act},
    {"derived",   "SLUG or SLUG@REVISION",                 1, 1, materials_derived_act},
    {"export",    "FILE.json or FILE.csv",                 1, 1, materials_export_act},
    {"import",    "FILE.json or FILE.csv",                 1, 1, materials_import_act},
};
// clang-format on

static const struct Action *action_find(const Options *options, Problem *problem) {
    const char *names[COUNT(actions) + 1] = {NULL};
    const char *given = options->operand_count > 0 ? options->operands[0] : "";
    for (size_t i = 0; i < COUNT(actions); i++) {
        names[i] = actions[i].name;
        if (strcmp(given, actions[i].name) == 0)
            return &actions[i];
    }
    char all[200] = "";
    for (size_t i = 0; i < COUNT(actions); i++)
        text_list(all, sizeof all, actions[i].name);
    const char *near = spelling_nearest(names, given);
    (void)problem_set(problem, STATUS_USAGE,
                      "the first operand must be one of %s, is \"%.60s\"%s%s%s", all, given,
                      near != NULL ? " (did you mean " : "", near != NULL ? near : "",
                      near != NULL ? "?)" : "");
    return NULL;
}

static int materials(const Command *self, void *of, const Options *options, Problem *problem) {
    const MaterialsSettings *settings = of;
    const struct Action *action = action_find(options, problem);
    if (action == NULL)
        return command_refuse(self->name, problem);
    const size_t count = options->operand_count - 1;
    Daemon daemon;
    MaterialsCall call = {settings, &daemon, options->operands + 1, count,
                          count > 0 ? options->operands[1] : "materials"};
    Status status = STATUS_OK;
    if (count < action->least || count > action->most)
        status = problem_set(problem, STATUS_USAGE, "%s takes %s, is given %zu operands",
                             action->name, action->takes, count);
    if (status != STATUS_OK)
        return command_refuse(self->name, problem);
    status = daemon_open(settings->server, settings->token_file, settings->ca_file, settings->wait,
                         &daemon, problem);
    if (status == STATUS_OK)
        status = action->act(&call, problem);
    daemon_close(&daemon);
    if (status == STATUS_USAGE && problem->count == 0)
        return command_refuse(self->name, problem);
    return status == STATUS_OK ? COMMAND_OK
                               : daemon_refuse(self->name, call.about, status, problem);
}

const Command command_materials = {
    .name = "materials",
    .operands =
        "list|show|add|revise|revert|approve|deprecate|history|diff|used-by|measure|measurements|"
        "propose|derived|export|import [...]",
    .summary = "the lab's materials: measure, revise, approve, trace, share",
    .help =
        "  impactd materials list --kind rubber --e 0.4..0.7      what there is\n"
        "  impactd materials show sponge                          the revision in use; sponge@1\n"
        "  impactd materials add foam.json                        a new material, a draft\n"
        "  impactd materials measure foam test.json --trace a.csv a drop test, and what it comes "
        "to\n"
        "  impactd materials measurements foam                    those that are kept, by number\n"
        "  impactd materials propose foam                         what all its tests come to\n"
        "  impactd materials propose foam --confirm --comment 'six drops'   and a revision of it\n"
        "  impactd materials show foam --editable > foam.json     to change by hand what it says\n"
        "  impactd materials revise foam foam.json --from 2 --comment 'thickness was 12 mm'\n"
        "  impactd materials diff foam 1 3                        in what two revisions differ\n"
        "  impactd materials revert foam 1 --comment 'wrong test' as it was, as a new revision\n"
        "  impactd materials approve foam@3 --reason 'checked'    scenes take it from now on\n"
        "  impactd materials deprecate foam@2 --reason 'wet'      with a reason that all see\n"
        "  impactd materials history foam                         who did what, when and why\n"
        "  impactd materials used-by foam@2                       results that it went into\n"
        "  impactd materials derived foam --damper-mass 0.11 --structure-mass 1.35   k_b and c_b\n"
        "  impactd materials export lab.csv                       all of it, also as .json\n"
        "  impactd materials import lab.csv --dry-run             judge it; keep nothing\n"
        "\n"
        "FILE.json of add: {\"slug\": \"foam\", \"name\": \"Foam, 12 mm\", \"restitution\": 0.55, "
        "\"contact_time\":\n"
        "0.02, \"source\": \"drop test of 12 May\"}; /schemas/material has all members. What is "
        "written stays:\n"
        "a revision never changes, a new one says better. Exit code 3 if a file has faults (all "
        "are told),\n"
        "4 if there is no such material, 5 if you may not, 1 if somebody was faster.\n",
    .options = materials_fields,
    .groups = groups,
    .size = sizeof(MaterialsSettings),
    .run = materials,
};
