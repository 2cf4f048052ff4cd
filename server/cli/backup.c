// backup, restore and check-db. A first Ctrl-C asks the copying to stop, which then removes what it
// has written; a second one, on a disk that does not answer, ends the program at once.
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "server/cli/files.h"
#include "server/db/db.h"

typedef struct BackupSettings {
    char *data;
    bool force;
} BackupSettings;

// clang-format off
#define DATA_FIELD \
    FIELD_TEXT(BackupSettings, data, 4000, PRESENCE_OPTIONAL, 0, "directory of the server's database ($IMPACTD_DATA, else that of impactd serve)")
static const Field backup_fields[] = {
    DATA_FIELD,
    FIELD_FLAG(BackupSettings, force, false, "replace FILE if it is there"),
    FIELD_END,
};
static const Field check_db_fields[] = {DATA_FIELD, FIELD_END};
static const Field restore_fields[] = {
    DATA_FIELD,
    FIELD_FLAG(BackupSettings, force, false, "replace the folder's database if it has one"),
    FIELD_END,
};
// clang-format on

static volatile sig_atomic_t is_interrupted;

static void backup_interrupt(int number) {
    (void)number;
    is_interrupted = 1;
}

static void backup_catch_signals(void) {
    struct sigaction action = {.sa_handler = backup_interrupt, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    (void)sigaction(SIGHUP, &action, NULL);
}

static bool backup_advance(void *bar, double fraction) {
    const Progress drawn = progress_bar_watch(bar);
    (void)progress_advance(&drawn, fraction);
    return is_interrupted == 0;
}

typedef Status BackupCopy(const BackupRequest *request, Backup *backup, Problem *problem);

static int backup_run_copy(const Command *self, BackupSettings *settings, const Options *options,
                           const char *what, BackupCopy *copy, Problem *problem) {
    if (options->operand_count != 1)
        (void)problem_set(problem, STATUS_USAGE, "takes one file to %s, is given %zu", what,
                          options->operand_count);
    else if (strcmp(options->operands[0], "-") == 0)
        (void)problem_set(problem, STATUS_USAGE, "needs a file to %s, not %s", what,
                          strcmp(what, "read") == 0
                              ? "standard input: it is checked as a whole"
                              : "standard output: it appears whole or not at all");
    if (problem->status != STATUS_OK)
        return command_error(self->name, problem);
    const char *path = options->operands[0];
    Backup made = {0};
    ProgressBar bar;
    const Progress watch = {&bar, backup_advance};
    backup_catch_signals();
    progress_bar_start(&bar);
    Status status = command_data_folder(&settings->data, problem);
    if (status == STATUS_OK) {
        const BackupRequest request = {settings->data, path, settings->force, &watch};
        status = copy(&request, &made, problem);
    }
    progress_bar_stop(&bar);
    if (status == STATUS_OK)
        command_print_line(stdout,
                           "%s: %" PRIu64 " bytes, checked; %" PRIu64 " jobs, %" PRIu64
                           " results, %" PRIu64 " materials",
                           path, made.bytes, made.jobs, made.results, made.materials);
    if (status == STATUS_CANCELLED) {
        problem_clear(problem);
        (void)problem_set(problem, status, "interrupted; nothing is left of it");
    }
    return command_end(self, status, problem);
}

static int backup(const Command *self, void *of, const Options *options, Problem *problem) {
    return backup_run_copy(self, of, options, "write", backup_write, problem);
}

static int restore(const Command *self, void *of, const Options *options, Problem *problem) {
    return backup_run_copy(self, of, options, "read", backup_restore, problem);
}

static void check_db_print_table(void *context, const char *name, uint64_t rows, uint64_t damaged) {
    (void)context;
    printf("%-22s %10" PRIu64 " rows %6" PRIu64 " damaged\n", name, rows, damaged);
}

static void check_db_print_damage(void *context, const char *damage) {
    (void)context;
    printf("%s\n", damage);
}

static int check_db(const Command *self, void *of, const Options *options, Problem *problem) {
    BackupSettings *settings = of;
    const DbCheck check = {check_db_print_table, check_db_print_damage, NULL};
    if (options->operand_count != 0) {
        (void)problem_set(problem, STATUS_USAGE, "takes no file; --data DIR names the folder");
        return command_error(self->name, problem);
    }
    Status status = command_data_folder(&settings->data, problem);
    if (status == STATUS_OK)
        status = db_check(settings->data, &check, problem);
    if (status == STATUS_OK)
        puts("the file, the references between tables and all checksums are as they should be");
    return command_end(self, status, problem);
}

const Command command_backup = {
    .name = "backup",
    .operands = "FILE",
    .summary = "copy the database of a server, also while it runs",
    .help = "  impactd backup lab.db\n"
            "  impactd backup lab.db --force               # replace the previous backup\n"
            "  impactd backup /backups/lab-$(date +%F).db --data /var/lib/impactd\n"
            "\n"
            "The server answers requests meanwhile. The copy has the state of one moment. It\n"
            "is checked, and is written completely or not at all. It contains the digests of\n"
            "the tokens and can be read only by its owner. \"impactd restore\" restores it.\n",
    .options = backup_fields,
    .size = sizeof(BackupSettings),
    .run = backup,
};

const Command command_restore = {
    .name = "restore",
    .operands = "FILE",
    .summary = "restore the database of a server from a backup",
    .help = "  impactd restore lab.db --data DIR           # into a directory without one\n"
            "  impactd restore lab.db --force              # replace the database\n"
            "\n"
            "Stop the server first. FILE is copied and checked. After a crash the directory\n"
            "has either the previous database or the restored one. FILE is not changed. Jobs\n"
            "that were unfinished in the backup continue when the server starts.\n",
    .options = restore_fields,
    .size = sizeof(BackupSettings),
    .run = restore,
};

const Command command_check_db = {
    .name = "check-db",
    .summary = "check the database of a server, also while it runs",
    .help = "  impactd check-db --data /var/lib/impactd\n"
            "\n"
            "Checks the file with its indices as SQLite does, the references between tables,\n"
            "and all rows that have checksums. Prints each fault and each damaged row. Exit\n"
            "code 1 if there is one, 4 without a database. backup and restore make the same\n"
            "check. A server does not show a damaged row. Delete the damaged job or result,\n"
            "or restore a backup.\n",
    .options = check_db_fields,
    .size = sizeof(BackupSettings),
    .run = check_db,
};
