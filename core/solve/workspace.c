#include "core/solve/workspace.h"

void workspace_clear(Workspace *workspace) {
    fourier_stock_clear(&workspace->transforms);
}
