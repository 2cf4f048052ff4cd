// What commands share: usage faults, exit codes, actions, the data directory.
#include "server/cli/command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "server/json/table.h"

void command_print_faults(const char *name, const char *separator, const char *quote,
                          const Problem *problem) {
    char shown[1024];
    text_fit(shown, sizeof shown, name);
    text_make_printable(shown);
    name = shown;
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        Fault fault = problem->faults[i];
        text_make_printable(fault.pointer);
        text_make_printable(fault.detail);
        fprintf(stderr, "%s: %s%s%s", name, fault.pointer,
                fault.pointer[0] != '\0' ? separator : "", fault.detail);
        if (fault.did_you_mean[0] != '\0')
            fprintf(stderr, " (did you mean %s%s%s?)", quote, fault.did_you_mean, quote);
        fputc('\n', stderr);
    }
    if (problem->count > PROBLEM_FAULTS)
        fprintf(stderr, "%s: and %zu more faults\n", name, problem->count - PROBLEM_FAULTS);
    if (problem->count == 0)
        fprintf(stderr, "%s: %s\n", name, problem->detail);
}

int command_error(const char *name, const Problem *problem) {
    char full[40];
    snprintf(full, sizeof full, "impactd %.20s", name);
    command_print_faults(full, " ", "", problem);
    fprintf(stderr, "see impactd help %s\n", name);
    return COMMAND_USAGE;
}

int command_exit(Status status) {
    static const struct {
        Status status;
        CommandExit code;
    } rows[] = {{STATUS_OK, COMMAND_OK},
                {STATUS_UNREADABLE, COMMAND_BAD_SCENE},
                {STATUS_INVALID, COMMAND_BAD_SCENE},
                {STATUS_TOO_LARGE, COMMAND_BAD_SCENE},
                {STATUS_USAGE, COMMAND_USAGE},
                {STATUS_NOT_FOUND, COMMAND_NOT_FOUND},
                {STATUS_UNAUTHORIZED, COMMAND_NOT_ALLOWED},
                {STATUS_FORBIDDEN, COMMAND_NOT_ALLOWED},
                {STATUS_UNREACHABLE, COMMAND_UNREACHABLE},
                {STATUS_TIMEOUT, COMMAND_TIMED_OUT},
                {STATUS_CANCELLED, COMMAND_INTERRUPTED}};
    for (size_t i = 0; i < COUNT(rows); i++)
        if (rows[i].status == status)
            return (int)rows[i].code;
    return COMMAND_FAILED;
}

int command_end(const Command *self, Status status, const Problem *problem) {
    if (status == STATUS_USAGE)
        return command_error(self->name, problem);
    if (status != STATUS_OK)
        fprintf(stderr, "impactd %s: %s\n", self->name,
                problem->detail[0] != '\0' ? problem->detail : status_title(status));
    return command_exit(status);
}

Status command_action(const Options *options, const char *const *names, size_t stride,
                      size_t *index, Problem *problem) {
    enum { ACTIONS_MAX = 32 };
    const char *known[ACTIONS_MAX + 1] = {names[0]}, *last = "";
    const char *given = options->operand_count > 0 ? options->operands[0] : "";
    char all[200] = "";
    for (*index = 0; known[*index] != NULL && *index < ACTIONS_MAX; (*index)++) {
        if (strcmp(given, known[*index]) == 0)
            return STATUS_OK;
        if (*index > 0)
            text_list(all, sizeof all, last);
        last = known[*index];
        names = (const char *const *)(const void *)((const char *)names + stride);
        known[*index + 1] = *names;
    }
    const char *near = spelling_nearest(known, given);
    return problem_set(problem, STATUS_USAGE,
                       "the first operand must be %s or %s, is \"%.60s\"%s%s%s", all, last, given,
                       near != NULL ? " (did you mean " : "", near != NULL ? near : "",
                       near != NULL ? "?)" : "");
}

Status command_data_folder(char **folder, Problem *problem) {
    char text[4096];
    const char *given = getenv("IMPACTD_DATA");
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    int size = -1;
    if (*folder != NULL)
        return STATUS_OK;
    if (given != NULL)
        size = snprintf(text, sizeof text, "%s", given);
    // The XDG specification ignores relative paths.
    else if (state != NULL && state[0] == '/')
        size = snprintf(text, sizeof text, "%s/impactd", state);
    else if (home != NULL && home[0] == '/')
        size = snprintf(text, sizeof text, "%s/.local/state/impactd", home);
    if (size < 0 || (size_t)size >= sizeof text)
        return problem_set(
            problem, STATUS_USAGE,
            "no data directory: neither XDG_STATE_HOME nor HOME is set; use --data DIR");
    *folder = strdup(text);
    return *folder != NULL ? STATUS_OK : problem_set(problem, STATUS_NO_MEMORY, "no memory");
}
