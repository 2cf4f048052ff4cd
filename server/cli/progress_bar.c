// "  [##########----------]  52 %  3.1 s left", redrawn in place ten times a second at most.
#include "server/cli/progress_bar.h"

#include <stdio.h>
#include <unistd.h>

#include "server/util/clock.h"

enum { BAR_WIDTH = 40 };
static const int64_t appears_after_ns = 300000000, redraws_after_ns = 100000000;

void progress_bar_start(ProgressBar *bar) {
    *bar =
        (ProgressBar){.is_terminal = isatty(STDERR_FILENO) != 0, .began_ns = clock_monotonic_ns()};
}

static bool bar_advance(void *context, double fraction) {
    ProgressBar *bar = context;
    if (!bar->is_terminal)
        return true;
    const int64_t now = clock_monotonic_ns(), took = now - bar->began_ns;
    if (took < appears_after_ns || now - bar->drawn_ns < redraws_after_ns)
        return true;
    bar->drawn_ns = now;
    bar->is_drawn = true;
    if (!(fraction >= 0))
        fraction = 0;
    if (fraction > 1)
        fraction = 1;
    char line[BAR_WIDTH + 1];
    for (int i = 0; i < BAR_WIDTH; i++)
        line[i] = i < fraction * BAR_WIDTH ? '#' : '-';
    line[BAR_WIDTH] = '\0';
    fprintf(stderr, "\r  [%s] %3.0f %%", line, 100 * fraction);
    if (fraction > 0.01)
        fprintf(stderr, "  %.1f s left ", (double)took * 1e-9 * (1 - fraction) / fraction);
    fflush(stderr);
    return true;
}

Progress progress_bar_watch(ProgressBar *bar) {
    return (Progress){bar, bar_advance};
}

void progress_bar_stop(ProgressBar *bar) {
    if (bar->is_drawn)
        fputs("\r\033[K", stderr);
    bar->is_drawn = false;
}
