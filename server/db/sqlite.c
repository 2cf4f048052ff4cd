// A connection keeps the statements it has prepared: there are some hundred texts in all, each a
// constant, so its address identifies it. The settings are those that were measured to pay; FULL
// makes every commit durable.
#include "server/db/sqlite.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <sqlite3.h>

#include "core/base/field.h"
#include "server/util/bytes.h"
#include "server/util/gzip.h"
#include "server/util/process.h"

enum { STATEMENTS = 192, PARAMETERS = 48, APPLICATION = 0x696D7064 }; // "impd"

typedef struct Statement {
    const char *sql;
    sqlite3_stmt *handle;
    const SqlColumn *parameters[PARAMETERS]; // NULL: the checks
    const SqlColumn *results[PARAMETERS];    // NULL: not read
    int parameter_count, result_count;
    int checks; // index of the result that has the checks; -1: none
} Statement;

struct Sqlite {
    sqlite3 *connection;
    Statement *statements[STATEMENTS];
    size_t statement_count;
    ino_t beside[2]; // the numbers of the files beside the database, 0 before the first check
};

static bool is_full(int code) {
    return code == ENOSPC || code == EDQUOT || code == EFBIG;
}

static Status report_full(const char *path, Problem *problem) {
    struct statvfs disk;
    const char *slash = path != NULL ? strrchr(path, '/') : NULL;
    const int size = slash != NULL ? (int)(slash - path) : 0;
    if (slash == NULL || statvfs(path, &disk) != 0)
        return problem_set(problem, STATUS_FULL, "there is no room left for %s",
                           slash != NULL ? path : "the database");
    const unsigned long long left =
        (unsigned long long)disk.f_bavail * (unsigned long long)disk.f_frsize;
    return problem_set(problem, STATUS_FULL,
                       "there is no room left in %.*s: %llu bytes are free on its disk%s; what is "
                       "stored can be read, and writing continues when there is room",
                       size, path, left,
                       left > (1 << 26) ? ", so a quota or a limit on files is reached" : "");
}

static Status report_unreadable(const char *path, Problem *problem) {
    return problem_set(problem, STATUS_IO,
                       "%s could not be read (%s): try again; if that does not help, \"impactd "
                       "check-db\" reports what is damaged",
                       path, strerror(EIO));
}

// Why a call of the system failed on this connection, the last one that did; 0: unknown, or none.
static int system_cause(sqlite3 *connection) {
    static const int files[] = {SQLITE_FCNTL_FILE_POINTER, SQLITE_FCNTL_JOURNAL_POINTER};
    for (size_t i = 0; i < COUNT(files); i++) {
        sqlite3_file *file = NULL;
        int cause = 0;
        if (sqlite3_file_control(connection, "main", files[i], &file) == SQLITE_OK &&
            file != NULL && file->pMethods != NULL && file->pMethods->xFileControl != NULL &&
            file->pMethods->xFileControl(file, SQLITE_FCNTL_LAST_ERRNO, &cause) == SQLITE_OK &&
            cause != 0)
            return cause;
    }
    // A file that cannot be opened is looked for in other ways then.
    const int cause = sqlite3_system_errno(connection);
    return cause != ENOENT ? cause : 0;
}

// What SQLite says of a damaged file may have bytes of it.
static void text_make_ascii(char *text) {
    for (; *text != '\0'; text++)
        if (*text < ' ' || *text > '~')
            *text = '?';
}

// What SQLite says, in words and as a status.
static Status report(sqlite3 *connection, const char *doing, Problem *problem) {
    static const struct {
        int code;
        Status status;
    } known[] = {{SQLITE_CONSTRAINT, STATUS_CONFLICT}, {SQLITE_NOMEM, STATUS_NO_MEMORY},
                 {SQLITE_TOOBIG, STATUS_TOO_LARGE},    {SQLITE_BUSY, STATUS_BUSY},
                 {SQLITE_LOCKED, STATUS_BUSY},         {SQLITE_ERROR, STATUS_INTERNAL},
                 {SQLITE_MISUSE, STATUS_INTERNAL},     {SQLITE_RANGE, STATUS_INTERNAL}};
    const char *path = sqlite3_db_filename(connection, "main");
    const bool has_path = path != NULL && path[0] != '\0';
    const int code = sqlite3_errcode(connection) & 0xFF;
    const bool is_of_system = code == SQLITE_IOERR || code == SQLITE_CANTOPEN;
    const int cause = system_cause(connection);
    Status status = STATUS_IO;
    char message[200];
    // Without memory SQLite also says that a temporary file could not be opened.
    snprintf(message, sizeof message, "%s",
             code == SQLITE_NOMEM ? sqlite3_errstr(code) : sqlite3_errmsg(connection));
    text_make_ascii(message);
    for (size_t i = 0; i < COUNT(known); i++)
        if (known[i].code == code)
            status = known[i].status;
    if (code == SQLITE_INTERRUPT)
        return problem_set(problem, STATUS_CANCELLED, "%s was interrupted", doing);
    // A quota, or a limit on a file's size, is to SQLite an error of writing.
    if (code == SQLITE_FULL || (is_of_system && is_full(cause)))
        return report_full(path, problem);
    // A page that cannot be read is to SQLite one that is damaged.
    if (has_path && (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) && cause == EIO)
        return report_unreadable(path, problem);
    // Of a file that it tries to open in several ways SQLite forgets why the first one failed.
    if (has_path && (code == SQLITE_READONLY || (code == SQLITE_CANTOPEN && cause == 0)))
        return problem_set(problem, status,
                           "%s failed: %s, or a file next to it, could not be opened for writing",
                           doing, path);
    // Of a journal that is gone by now.
    if (has_path && cause == 0 && sqlite3_extended_errcode(connection) == SQLITE_IOERR_FSYNC)
        return problem_set(problem, status,
                           "%s failed: the disk did not confirm what was written to %s; it may be "
                           "full",
                           doing, path);
    if (has_path && (code == SQLITE_NOTADB || code == SQLITE_CORRUPT))
        return problem_set(
            problem, status,
            "%s is damaged, or no database of SQLite (%s): put a copy of it back, or "
            "move it away, with the files next to it, to start with a new database",
            path, message);
    return problem_set(
        problem, status, "%s failed: %s%s%s%s%s%s", doing, message,
        is_of_system && cause != 0 ? " (" : "", is_of_system && cause != 0 ? strerror(cause) : "",
        is_of_system && cause != 0 ? ")" : "", has_path ? ", in " : "", has_path ? path : "");
}

Status sqlite_execute(Sqlite *database, const char *sql, Problem *problem) {
    if (sqlite3_exec(database->connection, sql, NULL, NULL, NULL) == SQLITE_OK)
        return STATUS_OK;
    return report(database->connection, "writing to the database", problem);
}

bool sqlite_is_in_transaction(Sqlite *database) {
    return sqlite3_get_autocommit(database->connection) == 0;
}

static Status report_moved(const char *path, Problem *problem) {
    return problem_set(problem, STATUS_IO,
                       "%s was deleted, moved or replaced while in use: nothing can be stored; put "
                       "it back, or stop the server and start it again",
                       path);
}

// SQLite makes its log and the index of it when it opens the database, and writes to them, also
// without a name, as long as a connection is open.
static Status sqlite_check_beside(Sqlite *database, const char *path, Problem *problem) {
    static const char *const endings[] = {"-wal", "-shm"};
    char beside[PATH_MAX];
    struct stat facts;
    for (size_t i = 0; i < COUNT(endings); i++) {
        snprintf(beside, sizeof beside, "%.4000s%s", path, endings[i]);
        const bool is_there = stat(beside, &facts) == 0;
        ino_t *number = &database->beside[i];
        if (*number != 0 && (is_there ? facts.st_ino != *number : errno == ENOENT))
            return report_moved(beside, problem);
        if (is_there)
            *number = facts.st_ino;
    }
    return STATUS_OK;
}

Status sqlite_check_place(Sqlite *database, Problem *problem) {
    const char *path = sqlite3_db_filename(database->connection, "main");
    int has_moved = 0;
    (void)sqlite3_file_control(database->connection, "main", SQLITE_FCNTL_HAS_MOVED, &has_moved);
    if (has_moved != 0)
        return report_moved(path, problem);
    return path != NULL && path[0] != '\0' ? sqlite_check_beside(database, path, problem)
                                           : STATUS_OK;
}

uint64_t sqlite_rows_changed(Sqlite *database) {
    return (uint64_t)sqlite3_total_changes64(database->connection);
}

static const SqlColumn *column_find(const SqlColumn *columns, const char *name) {
    for (const SqlColumn *column = columns; column != NULL && column->name != NULL; column++)
        if (strcmp(column->name, name) == 0)
            return column;
    return NULL;
}

static bool columns_are_checked(const SqlColumn *columns) {
    for (; columns->name != NULL; columns++)
        if ((columns->flags & COLUMN_CHECKED) != 0)
            return true;
    return false;
}

// The checks of a row after {set}: new ones of the columns that are set, those stored of the
// others.
static void sql_put_set_checks(const SqlColumn *table, Bytes *bytes) {
    int place = 1;
    bytes_text(bytes, ", checks = CAST(");
    for (const SqlColumn *column = table; column->name != NULL; column++) {
        if ((column->flags & COLUMN_CHECKED) == 0)
            continue;
        if ((column->flags & COLUMN_MUTABLE) == 0)
            bytes_format(bytes, "substr(checks, %d, 4) || ", place);
        else if ((column->flags & COLUMN_KEPT) == 0)
            bytes_format(bytes, "substr(:checks, %d, 4) || ", place);
        else
            bytes_format(bytes, "substr(iif(:%s IS NULL, checks, :checks), %d, 4) || ",
                         column->name, place);
        place += 4;
    }
    bytes_format(bytes, "substr(checks, %d) AS BLOB)", place);
}

static bool sql_has_column(char kind, const SqlColumn *column) {
    switch (kind) {
    case 'i': // {insert}
        return column->read == NULL;
    case 's': // {set}
        return (column->flags & COLUMN_MUTABLE) != 0;
    case 'h': // {head}
        return (column->flags & COLUMN_LONG) == 0;
    case 'k': // {checked}
        return column->read == NULL &&
               (column->flags & (COLUMN_CHECKED | COLUMN_BOUND | COLUMN_ID)) != 0;
    default: // {columns}
        return true;
    }
}

// Replaces {insert}, {set}, {columns}, {head} and {checked}.
static void sql_expand(const char *sql, const SqlColumn *keys, const SqlColumn *columns,
                       Bytes *bytes) {
    for (const char *brace; (brace = strchr(sql, '{')) != NULL; sql = strchr(brace, '}') + 1) {
        const bool is_checked = strncmp(brace, "{ch", 3) == 0;
        const char kind = is_checked ? 'k' : brace[1];
        const bool is_insert = kind == 'i', is_set = kind == 's';
        const SqlColumn *table = is_insert || is_set ? keys : columns;
        const char *separator = is_checked ? ", " : "";
        Bytes values = {0};
        bytes_put(bytes, sql, (size_t)(brace - sql));
        bytes_text(bytes, is_insert ? "(" : is_checked ? "number" : "");
        for (const SqlColumn *column = table; column->name != NULL; column++) {
            if (!sql_has_column(kind, column))
                continue;
            if (column->read != NULL)
                bytes_format(bytes, "%s%s AS %s", separator, column->read, column->name);
            else
                bytes_format(bytes, "%s%s", separator, column->name);
            bytes_text(is_set ? bytes : &values, is_set ? " = " : separator);
            if (column->write != NULL && (is_set || (column->flags & COLUMN_KEPT) == 0))
                bytes_text(is_set ? bytes : &values, column->write);
            else
                bytes_format(is_set ? bytes : &values, ":%s", column->name);
            separator = ", ";
        }
        if (columns_are_checked(table)) {
            if (is_set)
                sql_put_set_checks(table, bytes);
            else
                bytes_text(bytes, ", checks");
            bytes_text(&values, ", :checks");
        }
        if (is_insert && !values.is_failed) {
            bytes_text(bytes, ") VALUES (");
            bytes_text(bytes, values.at);
            bytes_text(bytes, ")");
        }
        bytes->is_failed = bytes->is_failed || values.is_failed;
        bytes_clear(&values);
    }
    bytes_text(bytes, sql);
}

// Finds the members of the parameters and of the results.
static void statement_resolve(Statement *statement, const SqlColumn *keys,
                              const SqlColumn *columns) {
    statement->parameter_count = sqlite3_bind_parameter_count(statement->handle);
    statement->result_count = sqlite3_column_count(statement->handle);
    statement->checks = -1;
    assert(statement->parameter_count <= PARAMETERS && statement->result_count <= PARAMETERS);
    for (int i = 0; i < statement->parameter_count; i++) {
        const char *name = sqlite3_bind_parameter_name(statement->handle, i + 1);
        statement->parameters[i] = column_find(keys, name + 1);
        assert(statement->parameters[i] != NULL || strcmp(name, ":checks") == 0);
    }
    for (int i = 0; i < statement->result_count; i++) {
        const char *name = sqlite3_column_name(statement->handle, i);
        statement->results[i] = column_find(columns, name);
        if (strcmp(name, "checks") == 0)
            statement->checks = i;
    }
}

static Status statement_find(Sqlite *database, const char *sql, const SqlColumn *keys,
                             const SqlColumn *columns, Statement **statement, Problem *problem) {
    for (size_t i = 0; i < database->statement_count; i++)
        if (database->statements[i]->sql == sql) {
            *statement = database->statements[i];
            return STATUS_OK;
        }
    assert(database->statement_count < STATEMENTS);
    Bytes text = {0};
    sql_expand(sql, keys, columns, &text);
    Statement *made = text.is_failed ? NULL : calloc(1, sizeof *made);
    Status status = made != NULL
                        ? STATUS_OK
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for a statement");
    if (status == STATUS_OK &&
        sqlite3_prepare_v3(database->connection, text.at, -1, SQLITE_PREPARE_PERSISTENT,
                           &made->handle, NULL) != SQLITE_OK)
        status = report(database->connection, "preparing a statement", problem);
    bytes_clear(&text);
    if (status != STATUS_OK) {
        free(made);
        return status;
    }
    statement_resolve(made, keys, columns);
    made->sql = sql;
    *statement = database->statements[database->statement_count++] = made;
    return STATUS_OK;
}

static uint32_t column_check(const SqlColumn *column, const char *member) {
    const void *at = member;
    size_t size = column->size;
    double real;
    if (column->kind == COLUMN_TEXT || column->kind == COLUMN_NAME) {
        at = column->kind == COLUMN_TEXT ? *(char *const *)at : member;
        size = at != NULL ? strlen(at) : 0;
    } else if (column->kind == COLUMN_BYTES) {
        size = ((const StoredBytes *)at)->size;
        at = ((const StoredBytes *)at)->at;
    } else if (column->kind == COLUMN_REAL) {
        real = *(const double *)at + 0.0; // SQLite stores -0 as 0
        at = &real;
        size = isnan(real) ? 0 : sizeof real;
    }
    return size > 0 ? gzip_crc32(0, at, size) : 0;
}

// The order of checks: the bound columns follow the others.
static const int check_flags[] = {COLUMN_CHECKED, COLUMN_BOUND};

static int bind_checks(sqlite3_stmt *statement, int index, const SqlColumn *columns,
                       const char *item) {
    uint32_t checks[PARAMETERS];
    int count = 0;
    for (size_t i = 0; i < COUNT(check_flags); i++)
        for (const SqlColumn *column = columns; column->name != NULL && count < PARAMETERS;
             column++)
            if ((column->flags & check_flags[i]) != 0)
                checks[count++] = column_check(column, item + column->offset);
    return sqlite3_bind_blob(statement, index, checks, 4 * count, SQLITE_TRANSIENT);
}

static int bind_column(sqlite3_stmt *statement, int index, const SqlColumn *column,
                       const void *member) {
    const StoredBytes *bytes = member;
    const char *text = column->kind == COLUMN_TEXT ? *(char *const *)member : member;
    const double real = column->kind == COLUMN_REAL ? *(const double *)member : 0;
    switch (column->kind) {
    case COLUMN_TEXT:
    case COLUMN_NAME: // The length is given: SQLite would count in an int.
        return sqlite3_bind_text64(statement, index, text, text != NULL ? strlen(text) : 0,
                                   SQLITE_STATIC, SQLITE_UTF8);
    case COLUMN_REAL: // NAN is NULL to SQLite
        return sqlite3_bind_double(statement, index, real);
    case COLUMN_INTEGER:
    case COLUMN_COUNT:
        return sqlite3_bind_int64(statement, index, *(const int64_t *)member);
    case COLUMN_CHOICE:
        return *(const int *)member < 0 ? sqlite3_bind_null(statement, index)
                                        : sqlite3_bind_int(statement, index, *(const int *)member);
    case COLUMN_FLAG:
        return sqlite3_bind_int(statement, index, *(const bool *)member);
    case COLUMN_BYTES:
        return sqlite3_bind_blob64(statement, index, bytes->at, bytes->size, SQLITE_STATIC);
    case COLUMN_NONE:
        break;
    }
    return SQLITE_MISUSE;
}

static Status statement_step(Statement *statement, bool *has_row, Problem *problem) {
    const int code = sqlite3_step(statement->handle);
    *has_row = code == SQLITE_ROW;
    if (code == SQLITE_ROW || code == SQLITE_DONE)
        return STATUS_OK;
    return report(sqlite3_db_handle(statement->handle),
                  statement->result_count > 0 ? "reading the database" : "writing to the database",
                  problem);
}

static void statement_end(Statement *statement) {
    sqlite3_reset(statement->handle);
    sqlite3_clear_bindings(statement->handle);
}

static Status statement_begin(Sqlite *database, const char *sql, const SqlColumn *keys,
                              const void *item, const SqlColumn *columns, Statement **statement,
                              Problem *problem) {
    TRY(statement_find(database, sql, keys, columns, statement, problem));
    for (int i = 0; i < (*statement)->parameter_count; i++) {
        const SqlColumn *key = (*statement)->parameters[i];
        sqlite3_stmt *handle = (*statement)->handle;
        const char *name = key != NULL ? key->name : "checks";
        const int code = key == NULL
                             ? bind_checks(handle, i + 1, keys, item)
                             : bind_column(handle, i + 1, key, (const char *)item + key->offset);
        if (code == SQLITE_OK)
            continue;
        statement_end(*statement);
        return code == SQLITE_TOOBIG
                   ? problem_set(problem, STATUS_TOO_LARGE,
                                 "%s is too long to be stored; must be at most a billion bytes",
                                 name)
                   : problem_set(problem, code == SQLITE_NOMEM ? STATUS_NO_MEMORY : STATUS_INTERNAL,
                                 "binding %s: %s", name, sqlite3_errstr(code));
    }
    return STATUS_OK;
}

// A text, or a blob of *size bytes, as the caller's own; false without memory.
static bool read_owned(sqlite3_stmt *statement, int index, bool is_text, char **at, size_t *size) {
    if (sqlite3_column_type(statement, index) == SQLITE_NULL)
        return true;
    const void *bytes = is_text ? (const void *)sqlite3_column_text(statement, index)
                                : sqlite3_column_blob(statement, index);
    const size_t count = (size_t)sqlite3_column_bytes(statement, index);
    *at = bytes == NULL && (is_text || count > 0) ? NULL : malloc(count + 1);
    if (*at == NULL)
        return false;
    if (count > 0)
        memcpy(*at, bytes, count);
    (*at)[count] = '\0';
    *size = count;
    return true;
}

// False without memory.
static bool read_column(sqlite3_stmt *statement, int index, const SqlColumn *column, void *member) {
    const bool is_null = sqlite3_column_type(statement, index) == SQLITE_NULL;
    const char *text;
    size_t size = 0;
    char *at = NULL;
    switch (column->kind) {
    case COLUMN_TEXT:
        return read_owned(statement, index, true, member, &size);
    case COLUMN_BYTES:
        if (!read_owned(statement, index, false, &at, &size))
            return false;
        *(StoredBytes *)member = (StoredBytes){at, size};
        return true;
    case COLUMN_NAME: // A text that does not fit was not written by this program; it is cut.
        text = (const char *)sqlite3_column_text(statement, index);
        snprintf(member, column->size, "%s", text != NULL ? text : "");
        return text != NULL || is_null;
    case COLUMN_REAL:
        *(double *)member = is_null ? (double)NAN : sqlite3_column_double(statement, index);
        return true;
    case COLUMN_INTEGER:
    case COLUMN_COUNT:
        *(int64_t *)member = sqlite3_column_int64(statement, index);
        return true;
    case COLUMN_CHOICE:
        *(int *)member = is_null ? -1 : sqlite3_column_int(statement, index);
        return true;
    case COLUMN_FLAG:
        *(bool *)member = sqlite3_column_int(statement, index) != 0;
        return true;
    case COLUMN_NONE:
        break;
    }
    return true;
}

static void free_owned(const SqlColumn *column, void *item) {
    void *member = (char *)item + column->offset;
    if (column->kind == COLUMN_TEXT) {
        free(*(char **)member);
        *(char **)member = NULL;
    } else if (column->kind == COLUMN_BYTES) {
        free(((StoredBytes *)member)->at);
        *(StoredBytes *)member = (StoredBytes){NULL, 0};
    }
}

// a stored "labels" of table jobs (id j-...) differs from its checksum
static void damage_describe(Statement *statement, const SqlColumn *column, const char *fault,
                            char damage[DAMAGE_SIZE]) {
    const int place = statement->checks >= 0 ? statement->checks : 0;
    const char *table = sqlite3_column_table_name(statement->handle, place);
    char row[160] = "";
    for (int i = 0; i < statement->result_count; i++) {
        const char *name = sqlite3_column_name(statement->handle, i);
        const SqlColumn *result = statement->results[i];
        const size_t used = strlen(row);
        if (result != NULL ? (result->flags & COLUMN_ID) != 0 : strcmp(name, "number") == 0)
            snprintf(row + used, sizeof row - used, "%s%s %.80s", used > 0 ? ", " : " (", name,
                     (const char *)sqlite3_column_text(statement->handle, i));
    }
    snprintf(damage, DAMAGE_SIZE, "a stored \"%s\" of table %s%s%s %s", column->name,
             table != NULL ? table : "?", row, row[0] != '\0' ? ")" : "", fault);
    text_make_ascii(damage);
}

// Also logged: readers of parts of a page do not look into its problem.
static Status report_damage(Statement *statement, const char *damage, Problem *problem) {
    char detail[sizeof problem->detail];
    Bytes line = {0};
    snprintf(detail, sizeof detail,
             "%s is damaged: %s; put a backup in its place (impactd restore)",
             sqlite3_db_filename(sqlite3_db_handle(statement->handle), "main"), damage);
    log_put(&line, "error", detail, sizeof detail);
    log_write(&line);
    bytes_clear(&line);
    return problem_set(problem, STATUS_INTERNAL, "%s", detail);
}

static bool statement_reads(const Statement *statement, const SqlColumn *column) {
    for (int i = 0; i < statement->result_count; i++)
        if (statement->results[i] == column)
            return true;
    return false;
}

// Compares what was read of the row with its checks, which are those of all checked columns.
static bool row_is_damaged(Statement *statement, const SqlColumn *columns, const void *item,
                           char damage[DAMAGE_SIZE]) {
    for (int i = 0; i < statement->result_count; i++) {
        const SqlColumn *column = statement->results[i];
        if (column != NULL && column->kind == COLUMN_TEXT &&
            (column->flags & (COLUMN_ID | COLUMN_BOUND)) != 0 &&
            *(char *const *)((const char *)item + column->offset) == NULL) {
            damage_describe(statement, column, "is missing", damage);
            return true;
        }
    }
    if (statement->checks < 0)
        return false;
    const char *checks = sqlite3_column_blob(statement->handle, statement->checks);
    const size_t size = (size_t)sqlite3_column_bytes(statement->handle, statement->checks);
    size_t at = 0;
    for (size_t pass = 0; pass < COUNT(check_flags); pass++)
        for (const SqlColumn *column = columns; column->name != NULL; column++) {
            if ((column->flags & check_flags[pass]) == 0)
                continue;
            uint32_t check;
            if (at + sizeof check > size) {
                if (check_flags[pass] == COLUMN_BOUND)
                    return false; // of an earlier version
                damage_describe(statement, column, "has no checksum", damage);
                return true;
            }
            memcpy(&check, checks + at, sizeof check);
            at += sizeof check;
            if (statement_reads(statement, column) &&
                check != column_check(column, (const char *)item + column->offset)) {
                damage_describe(statement, column, "differs from its checksum", damage);
                return true;
            }
        }
    return false;
}

// The present row, without comparing it. `item` owns nothing before.
static Status row_read_members(Statement *statement, void *item, Problem *problem) {
    for (int i = 0; i < statement->result_count; i++) {
        const SqlColumn *column = statement->results[i];
        if (column != NULL &&
            !read_column(statement->handle, i, column, (char *)item + column->offset))
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for a row of the database");
    }
    return STATUS_OK;
}

// On failure what the columns own of it is freed.
static Status row_read(Statement *statement, const SqlColumn *columns, void *item,
                       Problem *problem) {
    char damage[DAMAGE_SIZE];
    Status status = row_read_members(statement, item, problem);
    if (status == STATUS_OK && row_is_damaged(statement, columns, item, damage)) {
        const SqlColumn *flag = column_find(columns, "is_damaged");
        if (flag != NULL)
            *(bool *)((char *)item + flag->offset) = true;
        else
            status = report_damage(statement, damage, problem);
    }
    for (const SqlColumn *column = columns; status != STATUS_OK && column->name != NULL; column++)
        free_owned(column, item);
    return status;
}

// Of the present row of a CheckedTable, whose first column is its number.
static Status row_store_checks(Statement *statement, const CheckedTable *table, const void *item,
                               Problem *problem) {
    sqlite3 *connection = sqlite3_db_handle(statement->handle);
    sqlite3_stmt *update = NULL;
    char sql[96];
    snprintf(sql, sizeof sql, "UPDATE %s SET checks = ? WHERE number = ?", table->name);
    const bool is_stored =
        sqlite3_prepare_v2(connection, sql, -1, &update, NULL) == SQLITE_OK &&
        bind_checks(update, 1, table->columns, item) == SQLITE_OK &&
        sqlite3_bind_int64(update, 2, sqlite3_column_int64(statement->handle, 0)) == SQLITE_OK &&
        sqlite3_step(update) == SQLITE_DONE;
    const Status status =
        is_stored ? STATUS_OK : report(connection, "writing to the database", problem);
    sqlite3_finalize(update);
    return status;
}

Status sqlite_check_table(Sqlite *database, const CheckedTable *table, TableCheck *check,
                          Problem *problem) {
    Statement *statement;
    char damage[DAMAGE_SIZE];
    bool has_row;
    void *item = calloc(1, table->size);
    Status status = item == NULL ? problem_set(problem, STATUS_NO_MEMORY, "no memory for a row")
                                 : statement_begin(database, table->sql, check->keys, check->key,
                                                   table->columns, &statement, problem);
    if (status != STATUS_OK) {
        free(item);
        return status;
    }
    while ((status = statement_step(statement, &has_row, problem)) == STATUS_OK && has_row) {
        status = row_read_members(statement, item, problem);
        if (status == STATUS_OK && check->stores) {
            status = row_store_checks(statement, table, item, problem);
        } else if (status == STATUS_OK && row_is_damaged(statement, table->columns, item, damage)) {
            check->damaged++;
            if (check->report != NULL)
                check->report(check->context, damage);
            else
                status = report_damage(statement, damage, problem);
        }
        check->rows++;
        row_clear(table->columns, item, table->size);
        if (status != STATUS_OK)
            break;
    }
    statement_end(statement);
    free(item);
    return status;
}

void row_clear(const SqlColumn *columns, void *item, size_t size) {
    for (const SqlColumn *column = columns; column->name != NULL; column++)
        free_owned(column, item);
    memset(item, 0, size);
}

void rows_clear(const SqlColumn *columns, size_t size, void *list) {
    List *rows = list;
    for (size_t i = 0; i < rows->count; i++)
        row_clear(columns, (char *)rows->at + i * size, size);
    free(rows->at);
    *rows = (List){NULL, 0};
}

Status sqlite_change(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                     int *changes, Problem *problem) {
    Statement *statement;
    bool has_row;
    TRY(statement_begin(database, sql, keys, item, NULL, &statement, problem));
    const Status status = statement_step(statement, &has_row, problem);
    if (changes != NULL)
        *changes = status == STATUS_OK ? sqlite3_changes(database->connection) : 0;
    statement_end(statement);
    return status;
}

Status sqlite_prepare(Sqlite *database, const char *const *texts, Problem *problem) {
    Statement *statement;
    for (; *texts != NULL; texts++)
        TRY(statement_find(database, *texts, NULL, NULL, &statement, problem));
    return STATUS_OK;
}

Status sqlite_first(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                    const SqlColumn *columns, void *target, bool *is_found, Problem *problem) {
    Statement *statement;
    bool has_row = false;
    if (is_found != NULL)
        *is_found = false;
    TRY(statement_begin(database, sql, keys, item, columns, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, columns, target, problem);
    statement_end(statement);
    if (is_found != NULL)
        *is_found = has_row;
    return status;
}

Status sqlite_list(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                   const SqlColumn *columns, size_t size, void *list, Problem *problem) {
    Statement *statement;
    bool has_row = true;
    *(List *)list = (List){NULL, 0};
    TRY(statement_begin(database, sql, keys, item, columns, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    while (status == STATUS_OK && has_row) {
        void *row = list_grow(list, size);
        status = row != NULL ? row_read(statement, columns, row, problem)
                             : problem_set(problem, STATUS_NO_MEMORY,
                                           "no memory for the rows of the database");
        if (status == STATUS_OK)
            status = statement_step(statement, &has_row, problem);
    }
    statement_end(statement);
    if (status != STATUS_OK)
        rows_clear(columns, size, list);
    return status;
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

// Page size and vacuum take effect in an empty file only, and before the journal's mode is set.
// Pages of 4 or 8 KiB save 10 to 20% of the CPU time of a lone small commit, and nothing with 8
// clients; but summaries of results, about 3 KiB each, then take 4.8 KiB of the file instead
// of 3.9.
static const char writer_settings[] = "PRAGMA page_size = 16384;"
                                      "PRAGMA auto_vacuum = INCREMENTAL;"
                                      "PRAGMA journal_mode = WAL;";
// Nothing is mapped: where a disk cannot read a page, or the file was cut, a mapping ends the
// process (SIGBUS), and reading by it was no faster. The cache grows to its size with the database.
// Four times as much was no faster for the writer; readers, of whom there are many, have a quarter.
static const char settings[] = "PRAGMA synchronous = FULL;"
                               "PRAGMA secure_delete = OFF;"
                               "PRAGMA mmap_size = 0;"
                               "PRAGMA cache_size = -8192;"
                               "PRAGMA temp_store = MEMORY;"
                               "PRAGMA trusted_schema = OFF;"
                               "PRAGMA foreign_keys = ON;";

// For a file that is filled once and then synced by the caller.
static const char copy_settings[] = "PRAGMA locking_mode = EXCLUSIVE;"
                                    "PRAGMA journal_mode = MEMORY;"
                                    "PRAGMA synchronous = OFF;";

// SQLite would make it readable for all; its other files follow this one.
static Status make_file(const char *path, Problem *problem) {
    const int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0)
        return is_full(errno) ? report_full(path, problem)
                              : problem_set(problem, STATUS_IO, "cannot open %s for writing: %s",
                                            path, strerror(errno));
    close(file);
    return STATUS_OK;
}

static Status read_number(Sqlite *database, const char *sql, int64_t *number, Problem *problem) {
    static const SqlColumn columns[] = {{.name = "number", .kind = COLUMN_INTEGER}, COLUMN_END};
    bool is_found;
    return sqlite_first(database, sql, NULL, NULL, columns, number, &is_found, problem);
}

Status sqlite_touch(Sqlite *database, Problem *problem) {
    int64_t version = 0;
    char sql[64];
    TRY(read_number(database, "SELECT user_version AS number FROM pragma_user_version", &version,
                    problem));
    sqlite3_snprintf(sizeof sql, sql, "PRAGMA user_version = %lld", (long long)version);
    return sqlite_execute(database, sql, problem);
}

static Status check_owner(Sqlite *database, Problem *problem) {
    int64_t application = 0, tables = 0;
    TRY(read_number(database, "SELECT application_id AS number FROM pragma_application_id",
                    &application, problem));
    TRY(read_number(database, "SELECT count(*) AS number FROM sqlite_schema", &tables, problem));
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
    const int cause = made->connection != NULL ? system_cause(made->connection) : 0;
    if (code != SQLITE_OK) {
        status = problem_set(problem, code == SQLITE_NOMEM ? STATUS_NO_MEMORY : STATUS_IO,
                             "cannot open %s: %s%s%s", path != NULL ? path : "a database in memory",
                             sqlite3_errstr(code), cause != 0 ? ": " : "",
                             cause != 0 ? strerror(cause) : "");
    } else if (mode != DATABASE_READER && sqlite3_db_readonly(made->connection, "main") == 1) {
        // SQLite tries that where opening it for writing fails.
        status = problem_set(problem, STATUS_IO, "cannot open %s for writing", path);
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
            status =
                sqlite_execute(made, "PRAGMA query_only = ON; PRAGMA cache_size = -2048", problem);
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
    for (size_t i = 0; i < database->statement_count; i++) {
        sqlite3_finalize(database->statements[i]->handle);
        free(database->statements[i]);
    }
    sqlite3_close(database->connection);
    free(database);
}

// Gives the rows that a new database begins with their checks.
static Status store_checks(Sqlite *database, const CheckedTable *const *tables, Problem *problem) {
    TableCheck check = {.stores = true};
    Status status = STATUS_OK;
    // Triggers refuse every change of these rows.
    (void)sqlite3_db_config(database->connection, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, NULL);
    for (; status == STATUS_OK && tables != NULL && *tables != NULL; tables++)
        status = sqlite_check_table(database, *tables, &check, problem);
    (void)sqlite3_db_config(database->connection, SQLITE_DBCONFIG_ENABLE_TRIGGER, 1, NULL);
    return status;
}

static Status migrate_step(Sqlite *database, const EmbeddedFile *file, int64_t version,
                           const CheckedTable *const *tables, Problem *problem) {
    char footer[96];
    TRY(sqlite_execute(database, "BEGIN IMMEDIATE", problem));
    Status status = sqlite_execute(database, file->bytes, problem);
    if (status == STATUS_OK && version == 1)
        status = store_checks(database, tables, problem);
    sqlite3_snprintf(sizeof footer, footer,
                     "PRAGMA application_id = %d; PRAGMA user_version = %lld; COMMIT", APPLICATION,
                     (long long)version);
    if (status == STATUS_OK)
        status = sqlite_execute(database, footer, problem);
    if (status != STATUS_OK && sqlite_is_in_transaction(database))
        (void)sqlite_execute(database, "ROLLBACK", NULL);
    return status;
}

typedef struct SchemaColumn {
    char table_name[64], name[64];
} SchemaColumn;

typedef struct SchemaColumns {
    SchemaColumn *at;
    size_t count;
} SchemaColumns;

static Status schema_list(Sqlite *database, SchemaColumns *columns, Problem *problem) {
    static const char sql[] =
        "SELECT t.name AS table_name, c.name AS name FROM sqlite_schema AS t JOIN "
        "pragma_table_info(t.name) AS c WHERE t.type = 'table' ORDER BY t.name, c.name";
    static const SqlColumn row[] = {COLUMN(SchemaColumn, table_name), COLUMN(SchemaColumn, name),
                                    COLUMN_END};
    return sqlite_list(database, sql, NULL, NULL, row, sizeof *columns->at, columns, problem);
}

static int schema_compare(const SchemaColumn *a, const SchemaColumn *b) {
    const int order = strcmp(a->table_name, b->table_name);
    return order != 0 ? order : strcmp(a->name, b->name);
}

// Whether the database has all columns of its version. Before the first release the version stayed
// 1 while the schema changed.
static Status check_schema(Sqlite *database, const EmbeddedFile *files, int64_t version,
                           Problem *problem) {
    Sqlite *made = NULL;
    SchemaColumns wanted = {0}, stored = {0};
    Status status = sqlite_open(NULL, DATABASE_WRITER, &made, problem);
    for (int64_t i = 0; status == STATUS_OK && i < version; i++)
        status = sqlite_execute(made, files[i].bytes, problem);
    if (status == STATUS_OK)
        status = schema_list(made, &wanted, problem);
    if (status == STATUS_OK)
        status = schema_list(database, &stored, problem);
    for (size_t i = 0, k = 0; status == STATUS_OK && i < wanted.count; i++) {
        while (k < stored.count && schema_compare(&stored.at[k], &wanted.at[i]) < 0)
            k++;
        if (k == stored.count || schema_compare(&stored.at[k], &wanted.at[i]) != 0)
            status = problem_set(
                problem, STATUS_CONFLICT,
                "%s was written by an impactd from before the first release: there is no column "
                "%s.%s; export materials with that program to import them here, and use another "
                "folder",
                sqlite3_db_filename(database->connection, "main"), wanted.at[i].table_name,
                wanted.at[i].name);
    }
    free(wanted.at);
    free(stored.at);
    sqlite_close(made);
    return status;
}

static Status read_version(Sqlite *database, const EmbeddedFile *files, int64_t *version,
                           int64_t *last, Problem *problem) {
    int64_t tables = 0;
    while (files[*last].path != NULL)
        ++*last;
    TRY(read_number(database, "SELECT user_version AS number FROM pragma_user_version", version,
                    problem));
    TRY(read_number(database, "SELECT count(*) AS number FROM sqlite_schema", &tables, problem));
    const char *path = sqlite3_db_filename(database->connection, "main");
    if (*version < 0 || (*version == 0 && tables > 0))
        return problem_set(problem, STATUS_CONFLICT,
                           "%s is damaged: its schema's version is %lld, must be 1 to %lld; "
                           "restore a backup or use another folder",
                           path, (long long)*version, (long long)*last);
    if (*version <= *last)
        return check_schema(database, files, *version, problem);
    return problem_set(problem, STATUS_CONFLICT,
                       "%s was written by a newer impactd, or by one from before the first "
                       "release: its schema's version is %lld, this program's is %lld; use that "
                       "program or another folder",
                       path, (long long)*version, (long long)*last);
}

Status sqlite_is_current(Sqlite *database, const EmbeddedFile *files, bool *is_current,
                         Problem *problem) {
    int64_t version = 0, last = 0;
    TRY(read_version(database, files, &version, &last, problem));
    *is_current = version == last;
    return STATUS_OK;
}

Status sqlite_migrate(Sqlite *database, const EmbeddedFile *files,
                      const CheckedTable *const *tables, Problem *problem) {
    int64_t version = 0, last = 0;
    TRY(read_version(database, files, &version, &last, problem));
    for (; version < last; version++)
        TRY(migrate_step(database, &files[version], version + 1, tables, problem));
    return STATUS_OK;
}

// The open transaction is what makes it one moment: without it the copy would begin anew whenever
// another process has written.
static Status copy_pages(Sqlite *from, Sqlite *to, const Progress *watch, Problem *problem) {
    enum { PAGES = 64 };
    int64_t tables;
    TRY(read_number(from, "SELECT count(*) AS number FROM sqlite_schema", &tables, problem));
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
    if (code != SQLITE_DONE && system_cause(from->connection) == EIO)
        return report_unreadable(sqlite3_db_filename(from->connection, "main"), problem);
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

typedef struct CheckLine {
    char text[256];
} CheckLine;

typedef struct CheckLines {
    CheckLine *at;
    size_t count;
} CheckLines;

static Status check_file(Sqlite *database, CheckLines *lines, Problem *problem) {
    static const char sql[] = "SELECT integrity_check AS text FROM pragma_integrity_check(100)";
    static const SqlColumn columns[] = {COLUMN(CheckLine, text), COLUMN_END};
    return sqlite_list(database, sql, NULL, NULL, columns, sizeof *lines->at, lines, problem);
}

static bool check_is_passed(const CheckLines *lines) {
    return lines->count == 1 && strcmp(lines->at[0].text, "ok") == 0;
}

Status sqlite_check(Sqlite *database, void (*report_found)(void *context, const char *damage),
                    void *context, uint64_t *count, Problem *problem) {
    CheckLines lines = {.at = NULL};
    *count = 0;
    TRY(check_file(database, &lines, problem));
    // To SQLite a page is also damaged where memory for it was lacking: that is not found again.
    if (!check_is_passed(&lines)) {
        free(lines.at);
        TRY(check_file(database, &lines, problem));
    }
    *count = check_is_passed(&lines) ? 0 : lines.count;
    for (size_t i = 0; i < *count; i++) {
        text_make_ascii(lines.at[i].text);
        report_found(context, lines.at[i].text);
    }
    free(lines.at);
    return STATUS_OK;
}

bool sqlite_could_not_read(Sqlite *database) {
    return system_cause(database->connection) == EIO;
}

static int ask(void *watch) {
    return !progress_advance(watch, 0);
}

void sqlite_watch(Sqlite *database, const Progress *watch) {
    enum { OPERATIONS = 20000 };
    sqlite3_progress_handler(database->connection, OPERATIONS, watch != NULL ? ask : NULL,
                             (void *)(uintptr_t)watch);
}
