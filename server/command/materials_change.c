// impactd materials add, revise, revert, approve, deprecate. Whoever revises says which state that
// is about; where nothing was shown before, the state is asked for just before, and of two who do
// so at once one is told.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/command/materials_ask.h"

Status materials_add_act(MaterialsCall *call, Problem *problem) {
    Bytes path = {.most = 8000}, body = {0};
    HttpAnswer answer = {0};
    bytes_text(&path, "/v1/materials");
    Status status = materials_body(call, call->operands[0], &body, problem);
    if (status == STATUS_OK)
        status = materials_ask(call, "POST", &path, &body, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print_revision(call, &answer, problem);
    http_answer_clear(&answer);
    bytes_clear(&path);
    bytes_clear(&body);
    return status;
}

// The revision that the tag "SLUG@REVISION-VERSION" names must be the one that was begun with.
static Status check_from(const MaterialsCall *call, const char *slug, const char *tag,
                         Problem *problem) {
    const char *at = strrchr(tag, '@');
    const unsigned long long latest = at != NULL ? strtoull(at + 1, NULL, 10) : 0;
    if (call->settings->from == COUNT_ABSENT || call->settings->from == latest)
        return STATUS_OK;
    return problem_set(problem, STATUS_STALE, "the newest revision is %.63s@%llu, not %.63s@%llu",
                       slug, latest, slug, (unsigned long long)call->settings->from);
}

// Somebody was faster: says so, in words that tell what to do now.
static Status stale_tell(const char *slug, Status status, Problem *problem) {
    char said[sizeof problem->detail];
    if (status != STATUS_STALE)
        return status;
    snprintf(said, sizeof said, "%s", problem->detail);
    problem_clear(problem);
    return problem_set(problem, STATUS_STALE,
                       "somebody was faster, nothing was written: %.250s; \"impactd materials "
                       "history %.63s\" shows who; look at it and do it again",
                       said, slug);
}

Status materials_write_seen(MaterialsCall *call, const char *slug, const char *name,
                            const char *rest, const Bytes *body, const char *tag,
                            HttpAnswer *answer, Problem *problem) {
    Bytes path;
    *answer = (HttpAnswer){0};
    Status status = STATUS_OK;
    if (tag[0] == '\0')
        status = problem_set(problem, STATUS_UNREACHABLE,
                             "the answer tells no state: what answers there is no impactd");
    if (status == STATUS_OK)
        status = check_from(call, slug, tag, problem);
    if (status == STATUS_OK) {
        materials_path(&path, name, rest);
        status = materials_ask(call, "POST", &path, body, tag, answer, problem);
    }
    return stale_tell(slug, status, problem);
}

// In the state as it is now, or, with --from, as its writer saw it.
static Status write_now(MaterialsCall *call, const char *slug, const char *name, const char *rest,
                        const Bytes *body, HttpAnswer *answer, Problem *problem) {
    // The history has a tag whatever became of the revisions.
    Bytes path;
    HttpAnswer history;
    *answer = (HttpAnswer){0};
    materials_path(&path, slug, "/history?limit=1");
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &history, problem);
    if (status == STATUS_OK)
        status = materials_write_seen(call, slug, name, rest, body, history.etag, answer, problem);
    http_answer_clear(&history);
    return status;
}

static Status write_and_tell(MaterialsCall *call, const char *slug, const char *name,
                             const char *rest, const Bytes *body, Problem *problem) {
    HttpAnswer answer;
    Status status = write_now(call, slug, name, rest, body, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print_revision(call, &answer, problem);
    http_answer_clear(&answer);
    return status;
}

Status materials_revise_act(MaterialsCall *call, Problem *problem) {
    const char *slug = call->operands[0];
    Bytes body = {0};
    TRY(materials_name(slug, false, problem));
    Status status = materials_body(call, call->operands[1], &body, problem);
    if (status == STATUS_OK)
        status = write_and_tell(call, slug, slug, "/revisions", &body, problem);
    bytes_clear(&body);
    return status;
}

Status materials_revert_act(MaterialsCall *call, Problem *problem) {
    const char *slug = call->operands[0], *to = call->operands[1];
    Bytes body = {.most = 1 << 16};
    TRY(materials_name(slug, false, problem));
    TRY(materials_number(to, "the revision to go back to", problem));
    if (call->settings->comment == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --comment TEXT: why it goes back");
    bytes_format(&body, "{\"to\": %s, \"comment\": ", to);
    bytes_json_string(&body, call->settings->comment);
    bytes_text(&body, "}");
    const Status status = write_and_tell(call, slug, slug, "/revert", &body, problem);
    bytes_clear(&body);
    return status;
}

static Status review(MaterialsCall *call, const char *verdict, Problem *problem) {
    const char *name = call->operands[0], *at = strchr(name, '@');
    char slug[80];
    Bytes body = {.most = 1 << 16};
    TRY(materials_name(name, true, problem));
    if (at == NULL)
        return problem_set(problem, STATUS_USAGE,
                           "takes one revision, like %.63s@1: a review is of what it says", name);
    if (call->settings->reason == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --reason TEXT, for those who come later");
    snprintf(slug, sizeof slug, "%.*s", (int)(at - name), name);
    bytes_format(&body, "{\"status\": \"%s\", \"reason\": ", verdict);
    bytes_json_string(&body, call->settings->reason);
    bytes_text(&body, "}");
    const Status status = write_and_tell(call, slug, name, "/review", &body, problem);
    bytes_clear(&body);
    return status;
}

Status materials_approve_act(MaterialsCall *call, Problem *problem) {
    return review(call, "approved", problem);
}

Status materials_deprecate_act(MaterialsCall *call, Problem *problem) {
    return review(call, "deprecated", problem);
}
