#include "core/solve/workspace.h"

#include <stdint.h>
#include <stdlib.h>

enum { KEPT_MAX = 1 << 18 }; // values

double *workspace_values(Workspace *workspace, size_t count) {
    if (count > workspace->room) {
        free(workspace->values);
        workspace->room = 0;
        workspace->values =
            count > SIZE_MAX / sizeof(double) ? NULL : malloc(count * sizeof(double));
        if (workspace->values != NULL)
            workspace->room = count;
    }
    return workspace->values;
}

void workspace_tidy(Workspace *workspace) {
    if (workspace->room <= KEPT_MAX)
        return;
    free(workspace->values);
    workspace->values = NULL;
    workspace->room = 0;
}

void workspace_clear(Workspace *workspace) {
    fft_cache_clear(&workspace->transforms);
    free(workspace->single);
    workspace->single = NULL;
    free(workspace->values);
    workspace->values = NULL;
    workspace->room = 0;
}
