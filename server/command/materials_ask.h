// What the actions of `impactd materials` share: their settings, addresses, questions and answers.
// No action itself. Used by materials*.c.
#ifndef SERVER_COMMAND_MATERIALS_ASK_H
#define SERVER_COMMAND_MATERIALS_ASK_H

#include "server/codec/outline.h"
#include "server/command/daemon.h"

typedef struct MaterialsSettings {
    char *server, *token_file, *ca_file;
    double wait;
    bool json, dry_run, confirm;
    char *q, *kind, *e, *T_c;
    int status; // of those listed; CHOICE_ABSENT: any
    char *comment, *reason;
    Texts trace;
    double interval;
    char *measurements;
    int separation, as; // CHOICE_ABSENT: as the daemon has it
    double damper_mass, structure_mass;
    int identified_for;
    bool editable;
    uint64_t from; // the newest revision that its writer saw; COUNT_ABSENT
    bool force;
} MaterialsSettings;

// One action at work.
typedef struct MaterialsCall {
    const MaterialsSettings *settings;
    Daemon *daemon;
    const char *const *operands; // behind the action's name
    size_t operand_count;
    const char *about; // what faults are told of; the action may name a file
} MaterialsCall;

enum { MATERIALS_MAX = 1000 }; // of a list that is asked for

// Whether `text` is a slug, or where that is allowed SLUG@REVISION. STATUS_USAGE says what would be
// right.
Status materials_name(const char *text, bool may_have_revision, Problem *problem);
// "1", "12": a revision's number.
Status materials_number(const char *text, const char *what, Problem *problem);

// "/v1/materials/sponge@2" and what follows.
void materials_path(Bytes *path, const char *name, const char *rest);
// "?name=value", then "&name=value"; nothing where `value` is NULL.
void materials_query(Bytes *path, const char *name, const char *value);
void materials_query_real(Bytes *path, const char *name, double value); // NAN: nothing

// Asks and clears `path`, in any case. `body` (NULL: none) is JSON, `tag` (NULL: none) the state
// that it holds for. The answer is cleared by http_answer_clear in any case.
Status materials_ask(MaterialsCall *call, const char *method, Bytes *path, const Bytes *body,
                     const char *tag, HttpAnswer *answer, Problem *problem);
// Writes to `name` of the material `slug` in the state that `tag` tells: that of what its writer
// was shown. STATUS_STALE where somebody was faster, with what to do. The answer is cleared by
// http_answer_clear in any case.
Status materials_write_seen(MaterialsCall *call, const char *slug, const char *name,
                            const char *rest, const Bytes *body, const char *tag,
                            HttpAnswer *answer, Problem *problem);

// The answer for people, or with --json as it came.
Status materials_print(const MaterialsCall *call, const HttpAnswer *answer,
                       const OutlineTable *tables, Problem *problem);
// "sponge@2 draft" of an answer that is a revision.
Status materials_print_revision(const MaterialsCall *call, const HttpAnswer *answer,
                                Problem *problem);

// The actions: each a question or two. Operands are counted already.
typedef Status MaterialsAct(MaterialsCall *call, Problem *problem);
MaterialsAct materials_list_act, materials_show_act, materials_history_act, materials_diff_act,
    materials_used_by_act, materials_derived_act;
MaterialsAct materials_add_act, materials_revise_act, materials_revert_act, materials_approve_act,
    materials_deprecate_act;
MaterialsAct materials_measure_act, materials_measurements_act, materials_propose_act;
MaterialsAct materials_export_act, materials_import_act;

// A JSON object from a file, with the comment in it if there is one.
Status materials_body(MaterialsCall *call, const char *path, Bytes *body, Problem *problem);

#endif
