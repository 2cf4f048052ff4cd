#include "core/solve/workspace.h"

#include <stdlib.h>

void workspace_clear(Workspace *workspace) {
    fourier_stock_clear(&workspace->transforms);
    free(workspace->exact);
    workspace->exact = NULL;
}
