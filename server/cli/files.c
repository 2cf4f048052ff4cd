// Ctrl-C must end the program at once, also within a transform or a write. The only thing it owns
// outside its memory is the temporary file, so the signal handler removes that and exits.
#include "server/cli/files.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/util/clock.h"

const char *input_name(const char *path) {
    return strcmp(path, "-") == 0 ? "standard input" : path;
}

// The files that were read, which no output replaces.
static struct {
    dev_t device;
    ino_t number;
} inputs[RECORD_FILES + 1];
static size_t input_count;

static void input_note(FILE *file) {
    struct stat facts;
    if (input_count < COUNT(inputs) && fstat(fileno(file), &facts) == 0 && S_ISREG(facts.st_mode)) {
        inputs[input_count].device = facts.st_dev;
        inputs[input_count++].number = facts.st_ino;
    }
}

static bool input_is(const char *path) {
    struct stat facts;
    size_t i = 0;
    if (stat(path, &facts) != 0)
        return false;
    while (i < input_count &&
           (inputs[i].device != facts.st_dev || inputs[i].number != facts.st_ino))
        i++;
    return i < input_count;
}

Status input_read(const char *path, Bytes *text, Problem *problem) {
    *text = (Bytes){.most = INPUT_BYTES};
    const bool is_input = strcmp(path, "-") == 0;
    FILE *file = is_input ? stdin : fopen(path, "rb");
    if (file == NULL)
        return problem_set(problem,
                           errno == ENOENT   ? STATUS_NOT_FOUND
                           : errno == EACCES ? STATUS_FORBIDDEN
                                             : STATUS_IO,
                           "cannot be read: %s", strerror(errno));
    input_note(file);
    char piece[65536];
    size_t count = 0;
    while (!text->is_failed && (count = fread(piece, 1, sizeof piece, file)) > 0)
        bytes_put(text, piece, count);
    const int error = ferror(file) ? errno : 0;
    if (!is_input)
        fclose(file);
    if (error != 0)
        return problem_set(problem, STATUS_IO, "cannot be read: %s", strerror(error));
    if (text->is_over)
        return problem_set(problem, STATUS_TOO_LARGE, "is larger than %d bytes", INPUT_BYTES);
    return text->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for it") : STATUS_OK;
}

int input_command(const Command *self, const char *what, const Options *options, void *settings,
                  Status (*run)(const char *path, const Bytes *text, void *settings,
                                Problem *problem),
                  Problem *problem) {
    if (options->operand_count != 1) {
        (void)problem_set(problem, STATUS_USAGE, "takes one %s, is given %zu: impactd %s %s", what,
                          options->operand_count, self->name, self->operands);
        return command_error(self->name, problem);
    }
    const char *path = options->operands[0];
    Bytes text;
    output_guard();
    Status status = input_read(path, &text, problem);
    if (status == STATUS_OK)
        status = scene_edit(self, settings, &text, problem);
    const bool is_edited = status == STATUS_OK;
    if (is_edited)
        status = run(path, &text, settings, problem);
    bytes_clear(&text);
    if (!is_edited && status == STATUS_USAGE)
        return command_error(self->name, problem);
    if (status != STATUS_OK) {
        scene_edit_name_axes(self, settings, problem);
        command_print_faults(input_name(path), ": ", "\"", problem);
    }
    return command_exit(status);
}

const char *path_extension(const char *path) {
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    const char *point = strrchr(name, '.');
    return point != NULL && point > name ? point + 1 : NULL;
}

enum { PATH_SIZE = 4096 };

// Of an open output: its file `part`, -1 for standard output; with has_part it is at part_path.
static char final_path[PATH_SIZE], part_path[PATH_SIZE];
static volatile sig_atomic_t has_part;
static int part = -1;
static bool is_raw; // all bytes may go to a terminal
static char farewell[512];
static volatile sig_atomic_t farewell_size;

static void interrupted(int number) {
    (void)number;
    if (has_part)
        (void)unlink(part_path);
    if (isatty(STDERR_FILENO))
        (void)!write(STDERR_FILENO, "\n", 1);
    (void)!write(STDERR_FILENO, farewell, (size_t)farewell_size);
    _exit(COMMAND_INTERRUPTED);
}

void output_guard(void) {
    struct sigaction action = {.sa_handler = interrupted};
    sigemptyset(&action.sa_mask);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
}

// Blocks both signals while the file and has_part do not agree.
static void signals_hold(sigset_t *before) {
    sigset_t held;
    sigemptyset(&held);
    sigaddset(&held, SIGINT);
    sigaddset(&held, SIGTERM);
    (void)sigprocmask(SIG_BLOCK, &held, before);
}

void output_farewell(const char *text) {
    sigset_t before;
    signals_hold(&before);
    snprintf(farewell, sizeof farewell, "%s", text != NULL ? text : "");
    farewell_size = (sig_atomic_t)strlen(farewell);
    (void)sigprocmask(SIG_SETMASK, &before, NULL);
}

bool output_is_standard(const char *path) {
    return strcmp(path, "-") == 0 || strcmp(path, "/dev/stdout") == 0;
}

// Sets final_path to the file that a path leads to over symbolic links, also if it is missing.
static bool output_resolve(const char *path) {
    enum { LINKS_MAX = 40 };
    char target[PATH_SIZE];
    ssize_t size;
    snprintf(final_path, sizeof final_path, "%s", path);
    for (int i = 0; i < LINKS_MAX; i++) {
        if ((size = readlink(final_path, target, sizeof target - 1)) < 0)
            return strlen(final_path) + sizeof ".XXXXXX" <= PATH_SIZE;
        const char *slash = strrchr(final_path, '/');
        const size_t folder =
            target[0] != '/' && slash != NULL ? (size_t)(slash - final_path) + 1 : 0;
        if (folder + (size_t)size >= PATH_SIZE)
            return false;
        target[size] = '\0';
        memcpy(final_path + folder, target, (size_t)size + 1);
    }
    return false;
}

// A rename would put a file in the place of a device or a pipe.
static bool output_is_special(const char *path) {
    struct stat what;
    return stat(path, &what) == 0 && !S_ISREG(what.st_mode);
}

Status output_open(const char *path, Problem *problem) {
    is_raw = path != NULL && output_is_standard(path);
    if (path == NULL || is_raw)
        return STATUS_OK;
    if (strlen(path) >= PATH_SIZE || !output_resolve(path))
        return problem_set(problem, STATUS_IO,
                           "%.200s cannot be written: the name, or that of its target, is too long",
                           path);
    if (input_is(path))
        return problem_set(problem, STATUS_USAGE,
                           "%s cannot be written: it was read as an input; choose another name",
                           path);
    snprintf(part_path, sizeof part_path, "%.*s.XXXXXX", PATH_SIZE - 8, final_path);
    const bool is_special = output_is_special(path);
    sigset_t before;
    if (!is_special)
        signals_hold(&before);
    part = is_special ? open(path, O_WRONLY | O_CLOEXEC) : mkstemp(part_path);
    const int error = errno;
    has_part = part >= 0 && !is_special;
    if (!is_special)
        (void)sigprocmask(SIG_SETMASK, &before, NULL);
    if (part < 0)
        return problem_set(problem, STATUS_IO, "%s cannot be written: %s", path, strerror(error));
    return STATUS_OK;
}

Status output_write(const void *bytes, size_t size, Problem *problem) {
    const char *at = bytes;
    const bool is_plain = part < 0 && !is_raw && isatty(STDOUT_FILENO);
    bool is_whole = true;
    for (size_t i = 0; part < 0 && is_plain && i < size && is_whole; i++) {
        const unsigned char c = (unsigned char)at[i];
        is_whole = putchar((c < ' ' && strchr("\n\r\t", c) == NULL) || c == 0x7f ? '?' : c) != EOF;
    }
    if (part < 0 && !is_plain)
        is_whole = size == 0 || fwrite(bytes, 1, size, stdout) == size;
    if (!is_whole)
        return problem_set(problem, STATUS_IO, "standard output cannot be written");
    while (part >= 0 && size > 0) {
        const ssize_t done = write(part, at, size);
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            return problem_set(problem, STATUS_IO, "%s cannot be written: %s", final_path,
                               strerror(errno));
        at += done;
        size -= (size_t)done;
    }
    return STATUS_OK;
}

Status output_close(Problem *problem) {
    if (!has_part) {
        const bool is_written = part < 0 || close(part) == 0;
        part = -1;
        return is_written ? STATUS_OK
                          : problem_set(problem, STATUS_IO, "%s cannot be written: %s", final_path,
                                        strerror(errno));
    }
    // mkstemp gives 0600; the file gets what any new file would get.
    const mode_t mask = umask(0);
    (void)umask(mask);
    const bool is_whole = fchmod(part, 0666 & ~mask) == 0 && fsync(part) == 0;
    int error = errno;
    sigset_t before;
    signals_hold(&before);
    const bool is_named = is_whole && rename(part_path, final_path) == 0;
    if (is_whole && !is_named)
        error = errno;
    if (is_named)
        has_part = 0;
    (void)sigprocmask(SIG_SETMASK, &before, NULL);
    output_drop();
    if (!is_named)
        return problem_set(problem, STATUS_IO, "%s cannot be written: %s", final_path,
                           strerror(error));
    return STATUS_OK;
}

void output_drop(void) {
    sigset_t before;
    signals_hold(&before);
    if (has_part)
        (void)unlink(part_path);
    has_part = 0;
    if (part >= 0)
        (void)close(part);
    part = -1;
    (void)sigprocmask(SIG_SETMASK, &before, NULL);
}

Status output_put(const char *path, const Bytes *bytes, Problem *problem) {
    Status status = output_open(path, problem);
    if (status == STATUS_OK)
        status = output_write(bytes->at, bytes->count, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    return status;
}

Status output_check(const char *path, Problem *problem) {
    // To open a pipe and close it would end its reader.
    if (output_is_special(path) && access(path, W_OK) == 0)
        return STATUS_OK;
    const Status status = output_open(path, problem);
    output_drop();
    return status;
}

// "  [##########----------]  52 %  3.1 s left", redrawn at most ten times a second.
enum { BAR_WIDTH = 40 };
static const int64_t appears_after_ns = 300000000, redraws_after_ns = 100000000;

void progress_bar_start(ProgressBar *bar) {
    *bar = (ProgressBar){.is_terminal = isatty(STDERR_FILENO) != 0,
                         .started_ns = clock_monotonic_ns()};
}

static bool bar_advance(void *context, double fraction) {
    ProgressBar *bar = context;
    if (!bar->is_terminal)
        return true;
    const int64_t now = clock_monotonic_ns(), took = now - bar->started_ns;
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
        fprintf(stderr, "\r%*s\r", BAR_WIDTH + 32, "");
    bar->is_drawn = false;
}
