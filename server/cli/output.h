// Output of the commands: a file that is written completely or not at all (it has a temporary name
// until it is complete, and is removed if the program is interrupted), and a progress bar.
#ifndef SERVER_CLI_OUTPUT_H
#define SERVER_CLI_OUTPUT_H

#include <stdint.h>

#include "core/base/progress.h"
#include "core/base/status.h"
#include "server/util/bytes.h"

// Opens a new file beside `path`. One output at a time. STATUS_IO, with the reason.
Status output_open(const char *path, Problem *problem);
Status output_write(const void *bytes, size_t size, Problem *problem);
// The same as a function of HttpAsk; the context is not used.
Status output_take(void *context, const void *bytes, size_t size, Problem *problem);
// Makes the file durable and gives it its name; removes it if that fails.
Status output_close(Problem *problem);
// Removes an output that is open, if any.
void output_drop(void);

// Writes a whole file.
Status output_file(const char *path, const Bytes *bytes, Problem *problem);

// From here on Ctrl-C and SIGTERM remove the open output and end the program at once with exit code
// 130.
void output_guard(void);

// Sets the line that those two print on stderr; NULL: none.
void output_farewell(const char *text);

// A progress bar on a terminal, shown when the work takes long; nothing if stderr is a file.
typedef struct ProgressBar {
    bool is_terminal, is_drawn;
    int64_t started_ns, drawn_ns;
} ProgressBar;

void progress_bar_start(ProgressBar *bar);
// A Progress that draws and never asks to stop. Borrows `bar`.
Progress progress_bar_watch(ProgressBar *bar);
void progress_bar_stop(ProgressBar *bar);

#endif
