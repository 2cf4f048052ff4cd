// What commands share: usage faults, exit codes, actions, the data directory.
#include "server/cli/command.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/base/spelling.h"
#include "server/json/table.h"

void command_print_line(FILE *file, const char *format, ...) {
    enum { LINE_SIZE = 8192, COLUMNS_MIN = 30, INDENT = 2 };
    char line[LINE_SIZE];
    struct winsize size = {.ws_col = 0};
    va_list arguments;
    va_start(arguments, format);
    text_fit_format(line, sizeof line, format, arguments);
    va_end(arguments);
    text_make_printable(line);
    const bool has_columns =
        ioctl(fileno(file), TIOCGWINSZ, &size) == 0 && size.ws_col >= COLUMNS_MIN;
    size_t used = 0;
    for (const char *word = line; *word != '\0';) {
        char piece[LINE_SIZE];
        const size_t blanks = strspn(word, " "), length = blanks + strcspn(word + blanks, " ");
        snprintf(piece, sizeof piece, "%.*s", (int)length, word);
        if (has_columns && used > INDENT && used + text_width(piece) > size.ws_col) {
            fprintf(file, "\n%*s", INDENT, "");
            used = INDENT;
            memmove(piece, piece + blanks, length - blanks + 1);
        }
        fputs(piece, file);
        used += text_width(piece);
        word += length;
    }
    fputc('\n', file);
}

void command_print_faults(const char *name, const char *separator, const char *quote,
                          const Problem *problem) {
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        const Fault *fault = &problem->faults[i];
        const bool has_near = fault->did_you_mean[0] != '\0';
        command_print_line(stderr, "%s: %s%s%s%s%s%s%s%s", name, fault->pointer,
                           fault->pointer[0] != '\0' ? separator : "", fault->detail,
                           has_near ? " (did you mean " : "", has_near ? quote : "",
                           fault->did_you_mean, has_near ? quote : "", has_near ? "?)" : "");
    }
    if (problem->count > PROBLEM_FAULTS)
        command_print_line(stderr, "%s: and %zu more faults", name,
                           problem->count - PROBLEM_FAULTS);
    if (problem->count == 0)
        command_print_line(stderr, "%s: %s", name, problem->detail);
}

int command_error(const char *name, const Problem *problem) {
    char full[40];
    snprintf(full, sizeof full, "impactd %.20s", name);
    command_print_faults(full, " ", "", problem);
    command_print_line(stderr, "see impactd help %s", name);
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
        command_print_line(stderr, "impactd %s: %s", self->name,
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
