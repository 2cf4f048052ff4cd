// Files of the commands: input that is read whole, output that is written completely or not at all
// (it has a temporary name until it is complete, and is removed if the program is interrupted),
// messages about faults of an input, and a progress bar.
#ifndef SERVER_CLI_FILES_H
#define SERVER_CLI_FILES_H

#include "core/base/progress.h"
#include "core/formats/ground_motion_text.h"
#include "server/cli/command.h"
#include "server/util/bytes.h"

enum { INPUT_BYTES = 16 << 20 };

// Reads the file, or standard input for "-". Cleared by bytes_clear in any case.
Status input_read(const char *path, Bytes *text, Problem *problem);
// The name of the source in messages: the path, or "standard input" for "-".
const char *input_name(const char *path);
// Runs a command on its one operand, a file or standard input; `what` names it in a message.
// Reports faults under the file's name; returns the exit code. Ctrl-C ends the program from here
// on.
int input_command(const Command *self, const char *what, const Options *options, void *settings,
                  Status (*run)(const char *path, const Bytes *text, void *settings,
                                Problem *problem),
                  Problem *problem);
// Adds the ground motions of files, each under its name without folder and extension, to a database
// without a folder: scenes name them. Prints the faults of a file.
struct Db;
enum { RECORD_FILES = 1000 };
typedef struct RecordFiles {
    Texts record; // paths
    int unit;     // of a file that states none; CHOICE_ABSENT: none
} RecordFiles;
// The rows of settings with both members.
#define RECORD_ROWS(Type)                                                                          \
    FIELD_TEXTS(Type, record, NULL, NULL, RECORD_FILES, PRESENCE_OPTIONAL, 0,                      \
                "ground motion file, which the scene names without folder and extension; "         \
                "repeatable"),                                                                     \
        FIELD_CHOICE(Type, unit, acceleration_unit_names, OPTIONAL,                                \
                     "unit of these files, in place of the one they state: g, m/s^2 or cm/s^2")
Status record_files_add(struct Db *db, const RecordFiles *files, Problem *problem);
// "csv" of "/data/out.csv"; NULL if there is none.
const char *path_extension(const char *path);

// Whether an output is "-" or /dev/stdout.
bool output_is_standard(const char *path);
// Opens a new file beside `path` or beside the file that a symbolic link leads to; a device or a
// pipe itself; standard output for NULL and "-". A terminal gets no control characters there,
// except for "-". One output at a time. STATUS_IO, with the reason; STATUS_USAGE for a file that
// was read.
Status output_open(const char *path, Problem *problem);
Status output_write(const void *bytes, size_t size, Problem *problem);
// Makes the file durable and gives it its name; removes it if that fails.
Status output_close(Problem *problem);
// Removes an output that is open, if any.
void output_drop(void);
// Writes a whole file, or to standard output for NULL.
Status output_put(const char *path, const Bytes *bytes, Problem *problem);
// Whether the file can be written; it is not touched.
Status output_check(const char *path, Problem *problem);

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
