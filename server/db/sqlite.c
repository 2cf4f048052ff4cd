// A connection keeps the statements it has made: there are some fifty texts in all, each a
// constant, so that its address is its name. Settings are those that were measured to pay; FULL
// makes every commit durable.
#include "server/db/sqlite.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <sqlite3.h>

#include "server/db/row.h"

enum { STATEMENTS = 192, APPLICATION = 0x696D7064 }; // "impd"

typedef struct Kept {
    const char *sql;
    Statement *statement;
    RowMap map;
} Kept;

struct Sqlite {
    sqlite3 *connection;
    Kept kept[STATEMENTS];
    size_t kept_count;
};

// A quota, or a limit on a file's size, is to SQLite an error of writing; it does not say which.
static bool is_full(sqlite3 *connection) {
    return (sqlite3_errcode(connection) & 0xFF) == SQLITE_FULL ||
           sqlite3_extended_errcode(connection) == SQLITE_IOERR_WRITE;
}

static Status report_full(const char *path, Problem *problem) {
    struct statvfs disk;
    const char *slash = path != NULL ? strrchr(path, '/') : NULL;
    const int size = slash != NULL ? (int)(slash - path) : 0;
    if (slash == NULL || statvfs(path, &disk) != 0)
        return problem_set(problem, STATUS_FULL, "there is no room left for the database");
    const unsigned long long left =
        (unsigned long long)disk.f_bavail * (unsigned long long)disk.f_frsize;
    return problem_set(problem, STATUS_FULL,
                       "there is no room left in %.*s: %llu bytes are free on its disk%s; what is "
                       "stored can be read, and writing goes on when there is room",
                       size, path, left,
                       left > (1 << 26) ? ", so a quota or a limit on files is reached" : "");
}

// What SQLite says, in words and as a status.
static Status report(sqlite3 *connection, const char *doing, Problem *problem) {
    Status status = STATUS_IO;
    switch (sqlite3_errcode(connection) & 0xFF) {
    case SQLITE_CONSTRAINT:
        status = STATUS_CONFLICT;
        break;
    case SQLITE_NOMEM:
        status = STATUS_NO_MEMORY;
        break;
    case SQLITE_TOOBIG:
        status = STATUS_TOO_LARGE;
        break;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
        status = STATUS_BUSY;
        break;
    case SQLITE_INTERRUPT:
        return problem_set(problem, STATUS_CANCELLED, "%s was interrupted", doing);
    case SQLITE_ERROR:
    case SQLITE_MISUSE:
    case SQLITE_RANGE:
        status = STATUS_INTERNAL;
        break;
    default:
        break;
    }
    const char *path = sqlite3_db_filename(connection, "main");
    if (is_full(connection))
        return report_full(path, problem);
    const bool has_path = path != NULL && path[0] != '\0';
    const int code = sqlite3_errcode(connection) & 0xFF;
    if (has_path && (code == SQLITE_NOTADB || code == SQLITE_CORRUPT))
        return problem_set(
            problem, status,
            "%s is damaged, or no database of SQLite (%s): put a copy of it back, or "
            "move it away, with the files beside it, to begin anew",
            path, sqlite3_errmsg(connection));
    return problem_set(problem, status, "%s failed: %s%s%s", doing, sqlite3_errmsg(connection),
                       has_path ? ", in " : "", has_path ? path : "");
}

Status sqlite_execute(Sqlite *database, const char *sql, Problem *problem) {
    if (sqlite3_exec(database->connection, sql, NULL, NULL, NULL) == SQLITE_OK)
        return STATUS_OK;
    return report(database->connection, "writing to the database", problem);
}

bool sqlite_is_in_transaction(Sqlite *database) {
    return sqlite3_get_autocommit(database->connection) == 0;
}

Status sqlite_check_place(Sqlite *database, Problem *problem) {
    int has_moved = 0;
    (void)sqlite3_file_control(database->connection, "main", SQLITE_FCNTL_HAS_MOVED, &has_moved);
    if (has_moved == 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_IO,
                       "%s was deleted, moved or replaced while in use: nothing can be stored; put "
                       "it back, or stop the daemon and start it again",
                       sqlite3_db_filename(database->connection, "main"));
}

uint64_t sqlite_rows_changed(Sqlite *database) {
    return (uint64_t)sqlite3_total_changes64(database->connection);
}

static Status prepare(Sqlite *database, const char *sql, Kept **kept, Problem *problem) {
    for (size_t i = 0; i < database->kept_count; i++)
        if (database->kept[i].sql == sql) {
            *kept = &database->kept[i];
            return STATUS_OK;
        }
    if (database->kept_count == STATEMENTS)
        return problem_set(problem, STATUS_INTERNAL, "more than %d SQL texts", STATEMENTS);
    Statement *statement;
    if (sqlite3_prepare_v3(database->connection, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement,
                           NULL) != SQLITE_OK)
        return report(database->connection, "preparing a statement", problem);
    *kept = &database->kept[database->kept_count++];
    **kept = (Kept){.sql = sql, .statement = statement};
    return STATUS_OK;
}

Status statement_begin(Sqlite *database, const char *sql, const RowColumn *columns,
                       const void *item, Statement **statement, Problem *problem) {
    *statement = NULL;
    Kept *kept = NULL;
    TRY(prepare(database, sql, &kept, problem));
    const Status status = row_bind(kept->statement, &kept->map, columns, item, problem);
    if (status != STATUS_OK) {
        statement_end(kept->statement);
        return status;
    }
    *statement = kept->statement;
    return STATUS_OK;
}

Status statement_step(Statement *statement, bool *has_row, Problem *problem) {
    const int code = sqlite3_step(statement);
    *has_row = code == SQLITE_ROW;
    if (code == SQLITE_ROW || code == SQLITE_DONE)
        return STATUS_OK;
    sqlite3 *connection = sqlite3_db_handle(statement);
    return report(connection,
                  sqlite3_column_count(statement) > 0 ? "reading the database"
                                                      : "writing to the database",
                  problem);
}

void statement_end(Statement *statement) {
    if (statement == NULL)
        return;
    sqlite3_reset(statement);
    sqlite3_clear_bindings(statement);
}

Status sqlite_read_part(Sqlite *database, const char *table, const char *column, int64_t number,
                        size_t offset, size_t size, void *target, Problem *problem) {
    sqlite3_blob *blob = NULL;
    int code = sqlite3_blob_open(database->connection, "main", table, column, number, 0, &blob);
    const size_t bytes = code == SQLITE_OK ? (size_t)sqlite3_blob_bytes(blob) : 0;
    const size_t left = bytes > offset ? bytes - offset : 0;
    if (left > 0)
        code = sqlite3_blob_read(blob, target, (int)(left < size ? left : size), (int)offset);
    (void)sqlite3_blob_close(blob);
    return code == SQLITE_OK ? STATUS_OK
                             : report(database->connection, "reading the database", problem);
}

Status sqlite_change(Sqlite *database, const char *sql, const RowColumn *columns, const void *item,
                     int *changes, Problem *problem) {
    Statement *statement;
    bool has_row;
    TRY(statement_begin(database, sql, columns, item, &statement, problem));
    const Status status = statement_step(statement, &has_row, problem);
    if (changes != NULL)
        *changes = status == STATUS_OK ? sqlite3_changes(database->connection) : 0;
    statement_end(statement);
    return status;
}

// Page size and vacuum take effect in an empty file only, and before the journal's mode is set.
static const char writer_settings[] = "PRAGMA page_size = 16384;"
                                      "PRAGMA auto_vacuum = INCREMENTAL;"
                                      "PRAGMA journal_mode = WAL;";
// What is read is mapped; the cache holds pages that are written, and grows to its size with the
// database. Four times as much was no faster.
static const char settings[] = "PRAGMA synchronous = FULL;"
                               "PRAGMA secure_delete = OFF;"
                               "PRAGMA mmap_size = 1073741824;"
                               "PRAGMA cache_size = -8192;"
                               "PRAGMA temp_store = MEMORY;"
                               "PRAGMA trusted_schema = OFF;"
                               "PRAGMA foreign_keys = ON;";

// Of a file that is filled once and then synced by whoever has it filled.
static const char copy_settings[] = "PRAGMA locking_mode = EXCLUSIVE;"
                                    "PRAGMA journal_mode = MEMORY;"
                                    "PRAGMA synchronous = OFF;";

// SQLite would make it readable for all; its other files follow this one.
static Status make_file(const char *path, Problem *problem) {
    const int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0)
        return problem_set(problem, STATUS_IO, "cannot make %s: %s", path, strerror(errno));
    close(file);
    return STATUS_OK;
}

static Status decode_number(Sqlite *database, const char *sql, int64_t *number, Problem *problem) {
    static const RowColumn columns[] = {{.name = "number", .kind = COLUMN_INTEGER}, ROW_END};
    Statement *statement;
    bool has_row = false;
    TRY(statement_begin(database, sql, NULL, NULL, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, number, problem);
    statement_end(statement);
    return status;
}

Status sqlite_touch(Sqlite *database, Problem *problem) {
    int64_t version = 0;
    char sql[64];
    TRY(decode_number(database, "SELECT user_version AS number FROM pragma_user_version", &version,
                      problem));
    sqlite3_snprintf(sizeof sql, sql, "PRAGMA user_version = %lld", (long long)version);
    return sqlite_execute(database, sql, problem);
}

static Status check_owner(Sqlite *database, Problem *problem) {
    int64_t application = 0, tables = 0;
    TRY(decode_number(database, "SELECT application_id AS number FROM pragma_application_id",
                      &application, problem));
    TRY(decode_number(database, "SELECT count(*) AS number FROM sqlite_schema", &tables, problem));
    if (application == APPLICATION || (application == 0 && tables == 0))
        return STATUS_OK;
    return problem_set(problem, STATUS_CONFLICT,
                       "%s is a database of another program; move it away or choose another folder",
                       sqlite3_db_filename(database->connection, "main"));
}

Status sqlite_open(const char *path, SqliteMode mode, Sqlite **database, Problem *problem) {
    *database = NULL;
    if (path != NULL && mode == DATABASE_WRITER)
        TRY(make_file(path, problem));
    Sqlite *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the database");
    const int code = sqlite3_open_v2(path != NULL ? path : ":memory:", &made->connection,
                                     SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, NULL);
    Status status = STATUS_OK;
    if (code != SQLITE_OK) {
        status = problem_set(problem, code == SQLITE_NOMEM ? STATUS_NO_MEMORY : STATUS_IO,
                             "cannot open %s: %s", path != NULL ? path : "a database in memory",
                             sqlite3_errstr(code));
    } else {
        sqlite3_extended_result_codes(made->connection, 1);
        sqlite3_busy_timeout(made->connection, 5000);
        // No statement writes to the schema's own table, where the guards of rows stand.
        (void)sqlite3_db_config(made->connection, SQLITE_DBCONFIG_DEFENSIVE, 1, NULL);
        if (mode != DATABASE_COPY)
            status = check_owner(made, problem);
        if (status == STATUS_OK && mode == DATABASE_WRITER)
            status = sqlite_execute(made, writer_settings, problem);
        if (status == STATUS_OK)
            status = sqlite_execute(made, settings, problem);
        if (status == STATUS_OK && mode == DATABASE_READER)
            status = sqlite_execute(made, "PRAGMA query_only = ON", problem);
        if (status == STATUS_OK && mode == DATABASE_COPY)
            status = sqlite_execute(made, copy_settings, problem);
    }
    if (status != STATUS_OK) {
        sqlite_close(made);
        return status;
    }
    *database = made;
    return STATUS_OK;
}

void sqlite_close(Sqlite *database) {
    if (database == NULL)
        return;
    for (size_t i = 0; i < database->kept_count; i++)
        sqlite3_finalize(database->kept[i].statement);
    sqlite3_close(database->connection);
    free(database);
}

static Status migrate_step(Sqlite *database, const EmbeddedFile *file, int64_t version,
                           Problem *problem) {
    char footer[96];
    TRY(sqlite_execute(database, "BEGIN IMMEDIATE", problem));
    Status status = sqlite_execute(database, file->bytes, problem);
    sqlite3_snprintf(sizeof footer, footer,
                     "PRAGMA application_id = %d; PRAGMA user_version = %lld; COMMIT", APPLICATION,
                     (long long)version);
    if (status == STATUS_OK)
        status = sqlite_execute(database, footer, problem);
    if (status != STATUS_OK && sqlite_is_in_transaction(database))
        (void)sqlite_execute(database, "ROLLBACK", NULL);
    return status;
}

static Status read_version(Sqlite *database, const EmbeddedFile *files, int64_t *version,
                           int64_t *last, Problem *problem) {
    while (files[*last].path != NULL)
        ++*last;
    TRY(decode_number(database, "SELECT user_version AS number FROM pragma_user_version", version,
                      problem));
    if (*version < 0)
        return problem_set(
            problem, STATUS_CONFLICT,
            "%s is damaged: its schema's version is %lld, must be 0 to %lld; restore "
            "a backup or use another folder",
            sqlite3_db_filename(database->connection, "main"), (long long)*version,
            (long long)*last);
    if (*version <= *last)
        return STATUS_OK;
    return problem_set(
        problem, STATUS_CONFLICT,
        "%s was written by a newer impactd: its schema is %lld, this program knows %lld; "
        "use the newer program or another folder",
        sqlite3_db_filename(database->connection, "main"), (long long)*version, (long long)*last);
}

Status sqlite_is_current(Sqlite *database, const EmbeddedFile *files, bool *is_current,
                         Problem *problem) {
    int64_t version = 0, last = 0;
    TRY(read_version(database, files, &version, &last, problem));
    if (is_current != NULL)
        *is_current = version == last;
    return STATUS_OK;
}

Status sqlite_migrate(Sqlite *database, const EmbeddedFile *files, Problem *problem) {
    int64_t version = 0, last = 0;
    TRY(read_version(database, files, &version, &last, problem));
    for (; version < last; version++)
        TRY(migrate_step(database, &files[version], version + 1, problem));
    return STATUS_OK;
}

// The open transaction is what makes it one moment: without it the copy would begin anew whenever
// another process has written.
static Status copy_pages(Sqlite *from, Sqlite *to, const Progress *watch, Problem *problem) {
    enum { PAGES = 64 };
    int64_t tables;
    TRY(decode_number(from, "SELECT count(*) AS number FROM sqlite_schema", &tables, problem));
    sqlite3_backup *backup = sqlite3_backup_init(to->connection, "main", from->connection, "main");
    if (backup == NULL)
        return report(to->connection, "copying the database", problem);
    int code;
    bool is_wanted = true;
    do {
        code = sqlite3_backup_step(backup, PAGES);
        const int all = sqlite3_backup_pagecount(backup);
        is_wanted = progress_advance(
            watch, all > 0 ? 1 - (double)sqlite3_backup_remaining(backup) / (double)all : 0);
    } while (code == SQLITE_OK && is_wanted);
    (void)sqlite3_backup_finish(backup); // the copy's connection has its error
    if (!is_wanted)
        return problem_set(problem, STATUS_CANCELLED, "copying the database was interrupted");
    return code == SQLITE_DONE ? STATUS_OK
                               : report(to->connection, "copying the database", problem);
}

Status sqlite_copy(Sqlite *from, Sqlite *to, const Progress *watch, Problem *problem) {
    TRY(sqlite_execute(from, "BEGIN", problem));
    const Status status = copy_pages(from, to, watch, problem);
    (void)sqlite_execute(from, "ROLLBACK", NULL);
    TRY(status);
    // Its journal's mode came with the first page; so it needs no files beside it.
    return sqlite_execute(to, "PRAGMA journal_mode = MEMORY", problem);
}

static int ask(void *watch) {
    return !progress_advance(watch, 0);
}

void sqlite_watch(Sqlite *database, const Progress *watch) {
    enum { OPERATIONS = 20000 };
    sqlite3_progress_handler(database->connection, OPERATIONS, watch != NULL ? ask : NULL,
                             (void *)(uintptr_t)watch);
}
