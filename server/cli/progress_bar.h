// A progress bar on a terminal: appears when the work takes long, goes when it ends.
// Draws nothing where stderr is a file.
#ifndef SERVER_CLI_PROGRESS_BAR_H
#define SERVER_CLI_PROGRESS_BAR_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/progress.h"

typedef struct ProgressBar {
    bool is_terminal, is_drawn;
    int64_t began_ns, drawn_ns;
} ProgressBar;

void progress_bar_start(ProgressBar *bar);
// A Progress that draws; it never asks to stop. Borrows `bar`.
Progress progress_bar_watch(ProgressBar *bar);
void progress_bar_stop(ProgressBar *bar);

#endif
