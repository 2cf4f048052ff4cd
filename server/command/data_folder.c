#include "server/command/data_folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Status data_folder_default(char **folder, Problem *problem) {
    char text[4096];
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    int size = -1;
    if (*folder != NULL)
        return STATUS_OK;
    // The specification of XDG has relative paths ignored.
    if (state != NULL && state[0] == '/')
        size = snprintf(text, sizeof text, "%s/impactd", state);
    else if (home != NULL && home[0] == '/')
        size = snprintf(text, sizeof text, "%s/.local/state/impactd", home);
    if (size < 0 || (size_t)size >= sizeof text)
        return problem_set(
            problem, STATUS_USAGE,
            "no place for the data: neither XDG_STATE_HOME nor HOME is set; use --data DIR");
    *folder = strdup(text);
    return *folder != NULL ? STATUS_OK : problem_set(problem, STATUS_NO_MEMORY, "no memory");
}

Status data_folder_find(char **folder, Problem *problem) {
    const char *environment = getenv("IMPACTD_DATA");
    if (*folder == NULL && environment != NULL) {
        *folder = strdup(environment);
        if (*folder == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    }
    return data_folder_default(folder, problem);
}
