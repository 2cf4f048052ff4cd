// A first Ctrl-C asks the copying to stop, which then removes what it has written; a second one, on
// a disk that answers no more, ends the program there and then.
#include "server/cli/command.h"

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "server/cli/output.h"
#include "server/db/backup.h"

typedef struct BackupSettings {
    char *data;
    bool force;
} BackupSettings;

// clang-format off
static const Field backup_fields[] = {
    FIELD_TEXT(BackupSettings, data, 4000, PRESENCE_OPTIONAL, 0, "the daemon's folder ($IMPACTD_DATA, else as impactd serve has it)"),
    FIELD_FLAG(BackupSettings, force, false, "replace FILE if it is there"),
    FIELD_END,
};
// clang-format on

static volatile sig_atomic_t is_interrupted;

static void interrupted(int number) {
    (void)number;
    is_interrupted = 1;
}

static void interrupts_catch(void) {
    struct sigaction action = {.sa_handler = interrupted, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    (void)sigaction(SIGHUP, &action, NULL);
}

static bool advance(void *bar, double fraction) {
    const Progress drawn = progress_bar_watch(bar);
    (void)progress_advance(&drawn, fraction);
    return is_interrupted == 0;
}

static int backup(const Command *self, void *of, const Options *options, Problem *problem) {
    BackupSettings *settings = of;
    if (options->operand_count != 1)
        (void)problem_set(problem, STATUS_USAGE, "takes one file to write, is given %zu",
                          options->operand_count);
    else if (strcmp(options->operands[0], "-") == 0)
        (void)problem_set(problem, STATUS_USAGE,
                          "writes a file, not standard output: it appears whole or not at all");
    if (problem->status != STATUS_OK)
        return command_error(self->name, problem);
    const char *path = options->operands[0];
    Backup made = {0};
    ProgressBar bar;
    const Progress watch = {&bar, advance};
    interrupts_catch();
    progress_bar_start(&bar);
    Status status = command_data_folder(&settings->data, problem);
    if (status == STATUS_OK) {
        const BackupRequest request = {settings->data, path, settings->force, &watch};
        status = backup_write(&request, &made, problem);
    }
    progress_bar_stop(&bar);
    if (status == STATUS_OK)
        printf("%s: %" PRIu64 " bytes, checked; %" PRIu64 " jobs, %" PRIu64 " results, %" PRIu64
               " materials\n",
               path, made.bytes, made.jobs, made.results, made.materials);
    else if (status == STATUS_CANCELLED)
        fputs("impactd backup: interrupted; nothing is left of it\n", stderr);
    else
        fprintf(stderr, "impactd backup: %s\n",
                problem->detail[0] != '\0' ? problem->detail : status_title(status));
    return command_exit(status);
}

const Command command_backup = {
    .name = "backup",
    .operands = "FILE",
    .summary = "copy the database, while the daemon runs or without it",
    .help =
        "  impactd backup lab.db                          everything that was answered before\n"
        "  impactd backup lab.db --force                  in the place of the last one\n"
        "  impactd backup /backups/lab-$(date +%F).db --data /var/lib/impactd\n"
        "\n"
        "Nobody is held up meanwhile. The copy is of one moment, is checked, and appears whole or "
        "not at\n"
        "all; it holds the tokens' digests and is readable by you alone. Ctrl-C leaves nothing.\n"
        "\n"
        "To go back to it, stop the daemon, move its folder aside and begin a new one with the "
        "copy:\n"
        "\n"
        "  mv DIR DIR.before && mkdir -m 700 DIR && cp -p lab.db DIR/impactd.db\n"
        "\n"
        "DIR is the folder of --data; the other files of the old one belong to the old database. "
        "Jobs that\n"
        "were unfinished in the copy are taken up again.\n",
    .options = backup_fields,
    .size = sizeof(BackupSettings),
    .run = backup,
};
