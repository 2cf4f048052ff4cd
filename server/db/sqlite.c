// A connection keeps the statements it has prepared: there are some hundred texts in all, each a
// constant, so its address identifies it. The settings are those that were measured to pay; FULL
// makes every commit durable.
#include "server/db/sqlite.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <sqlite3.h>

#include "core/base/field.h"
#include "server/util/bytes.h"
#include "server/util/gzip.h"
#include "server/util/process.h"

enum { STATEMENTS = 192, PARAMETERS = 40, APPLICATION = 0x696D7064 }; // "impd"

struct Statement {
    const char *sql;
    sqlite3_stmt *handle;
    const SqlColumn *keys; // whose members the parameters were found to be
    int parameter_count;
    const SqlColumn *parameters[PARAMETERS]; // NULL: the checks
};

struct Sqlite {
    sqlite3 *connection;
    Statement *statements[STATEMENTS];
    size_t statement_count;
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

static const SqlColumn *column_find(const SqlColumn *columns, const char *name) {
    for (const SqlColumn *column = columns; column != NULL && column->name != NULL; column++)
        if (strcmp(column->name, name) == 0)
            return column;
    return NULL;
}

static bool columns_are_checked(const SqlColumn *columns) {
    for (; columns != NULL && columns->name != NULL; columns++)
        if ((columns->flags & COLUMN_CHECKED) != 0)
            return true;
    return false;
}

// Replaces {insert}, {set}, {columns} and {head}.
static void sql_expand(const char *sql, const SqlColumn *keys, const SqlColumn *columns,
                       Bytes *bytes) {
    for (const char *brace; (brace = strchr(sql, '{')) != NULL; sql = strchr(brace, '}') + 1) {
        const bool is_insert = brace[1] == 'i', is_set = brace[1] == 's', is_head = brace[1] == 'h';
        const SqlColumn *table = is_insert || is_set ? keys : columns;
        const bool has_checks = columns_are_checked(table);
        const char *separator = "";
        bytes_put(bytes, sql, (size_t)(brace - sql));
        if (is_insert)
            bytes_text(bytes, "(");
        for (const SqlColumn *column = table; column->name != NULL; column++) {
            if (is_insert ? column->sql != NULL
                : is_set  ? (column->flags & COLUMN_MUTABLE) == 0
                : is_head ? (column->flags & COLUMN_LONG) != 0
                          : false)
                continue;
            bytes_text(bytes, separator);
            if (is_set)
                bytes_format(bytes, "%s = :%s", column->name, column->name);
            else if (column->sql != NULL)
                bytes_format(bytes, "%s AS %s", column->sql, column->name);
            else
                bytes_text(bytes, column->name);
            separator = ", ";
        }
        if (has_checks)
            bytes_text(bytes, is_set ? ", checks = :checks" : ", checks");
        if (!is_insert)
            continue;
        separator = ") VALUES (:";
        for (const SqlColumn *column = table; column->name != NULL; column++)
            if (column->sql == NULL) {
                bytes_format(bytes, "%s%s", separator, column->name);
                separator = ", :";
            }
        bytes_text(bytes, has_checks ? ", :checks)" : ")");
    }
    bytes_text(bytes, sql);
}

static Status statement_find(Sqlite *database, const char *sql, const SqlColumn *keys,
                             const SqlColumn *columns, Statement **statement, Problem *problem) {
    for (size_t i = 0; i < database->statement_count; i++)
        if (database->statements[i]->sql == sql) {
            *statement = database->statements[i];
            return STATUS_OK;
        }
    if (database->statement_count == STATEMENTS)
        return problem_set(problem, STATUS_INTERNAL, "more than %d SQL texts", STATEMENTS);
    Bytes text = {0};
    sql_expand(sql, keys, columns, &text);
    Statement *made = text.is_failed ? NULL : calloc(1, sizeof *made);
    if (made == NULL) {
        bytes_clear(&text);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a statement");
    }
    made->sql = sql;
    const int code = sqlite3_prepare_v3(database->connection, text.at, -1,
                                        SQLITE_PREPARE_PERSISTENT, &made->handle, NULL);
    bytes_clear(&text);
    if (code != SQLITE_OK) {
        free(made);
        return report(database->connection, "preparing a statement", problem);
    }
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

static int bind_checks(Statement *statement, int index, const SqlColumn *columns,
                       const char *item) {
    uint32_t checks[PARAMETERS];
    int count = 0;
    for (; columns->name != NULL && count < PARAMETERS; columns++)
        if ((columns->flags & COLUMN_CHECKED) != 0)
            checks[count++] = column_check(columns, item + columns->offset);
    return sqlite3_bind_blob(statement->handle, index, checks, 4 * count, SQLITE_TRANSIENT);
}

static int bind(sqlite3_stmt *statement, int index, const SqlColumn *column, const char *member) {
    switch (column->kind) {
    case COLUMN_TEXT: {
        const char *text = *(char *const *)(const void *)member;
        // The length is given: SQLite would count in an int.
        return text == NULL ? sqlite3_bind_null(statement, index)
                            : sqlite3_bind_text64(statement, index, text, strlen(text),
                                                  SQLITE_STATIC, SQLITE_UTF8);
    }
    case COLUMN_NAME:
        return sqlite3_bind_text(statement, index, member, -1, SQLITE_STATIC);
    case COLUMN_REAL: {
        const double value = *(const double *)(const void *)member;
        return isnan(value) ? sqlite3_bind_null(statement, index)
                            : sqlite3_bind_double(statement, index, value);
    }
    case COLUMN_INTEGER:
        return sqlite3_bind_int64(statement, index, *(const int64_t *)(const void *)member);
    case COLUMN_COUNT:
        return sqlite3_bind_int64(statement, index,
                                  (int64_t) * (const uint64_t *)(const void *)member);
    case COLUMN_CHOICE:
        return *(const int *)(const void *)member < 0
                   ? sqlite3_bind_null(statement, index)
                   : sqlite3_bind_int(statement, index, *(const int *)(const void *)member);
    case COLUMN_FLAG:
        return sqlite3_bind_int(statement, index, *(const bool *)(const void *)member);
    case COLUMN_BYTES: {
        const StoredBytes *bytes = (const StoredBytes *)(const void *)member;
        return bytes->at == NULL
                   ? sqlite3_bind_null(statement, index)
                   : sqlite3_bind_blob64(statement, index, bytes->at, bytes->size, SQLITE_STATIC);
    }
    }
    return SQLITE_MISUSE;
}

static Status find_parameters(Statement *statement, const SqlColumn *keys, Problem *problem) {
    statement->keys = NULL;
    statement->parameter_count = sqlite3_bind_parameter_count(statement->handle);
    if (statement->parameter_count > PARAMETERS)
        return problem_set(problem, STATUS_INTERNAL, "more than %d parameters of a statement",
                           PARAMETERS);
    for (int i = 0; i < statement->parameter_count; i++) {
        const char *name = sqlite3_bind_parameter_name(statement->handle, i + 1);
        statement->parameters[i] = name != NULL ? column_find(keys, name + 1) : NULL;
        if (statement->parameters[i] == NULL && (name == NULL || strcmp(name, ":checks") != 0))
            return problem_set(problem, STATUS_INTERNAL, "no member for the parameter %s",
                               name != NULL ? name : "?");
    }
    statement->keys = keys;
    return STATUS_OK;
}

static Status bind_all(Statement *statement, const SqlColumn *keys, const void *item,
                       Problem *problem) {
    if (statement->keys == NULL || statement->keys != keys)
        TRY(find_parameters(statement, keys, problem));
    for (int i = 0; i < statement->parameter_count; i++) {
        const SqlColumn *key = statement->parameters[i];
        const int code =
            key == NULL ? bind_checks(statement, i + 1, keys, item)
                        : bind(statement->handle, i + 1, key, (const char *)item + key->offset);
        if (code == SQLITE_TOOBIG)
            return problem_set(problem, STATUS_TOO_LARGE,
                               "%s is too long to be stored, a billion bytes at most", key->name);
        if (code != SQLITE_OK)
            return problem_set(problem, code == SQLITE_NOMEM ? STATUS_NO_MEMORY : STATUS_INTERNAL,
                               "binding %s: %s", key != NULL ? key->name : "checks",
                               sqlite3_errstr(code));
    }
    return STATUS_OK;
}

static Status begin(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                    const SqlColumn *columns, Statement **statement, Problem *problem) {
    Statement *found = NULL;
    *statement = NULL;
    TRY(statement_find(database, sql, keys, columns, &found, problem));
    const Status status = bind_all(found, keys, item, problem);
    if (status != STATUS_OK)
        statement_end(found);
    else
        *statement = found;
    return status;
}

Status statement_begin(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                       Statement **statement, Problem *problem) {
    return begin(database, sql, keys, item, NULL, statement, problem);
}

Status statement_step(Statement *statement, bool *has_row, Problem *problem) {
    const int code = sqlite3_step(statement->handle);
    *has_row = code == SQLITE_ROW;
    if (code == SQLITE_ROW || code == SQLITE_DONE)
        return STATUS_OK;
    return report(sqlite3_db_handle(statement->handle),
                  sqlite3_column_count(statement->handle) > 0 ? "reading the database"
                                                              : "writing to the database",
                  problem);
}

void statement_end(Statement *statement) {
    if (statement == NULL)
        return;
    sqlite3_reset(statement->handle);
    sqlite3_clear_bindings(statement->handle);
}

static bool read_text(sqlite3_stmt *statement, int index, char **text) {
    if (sqlite3_column_type(statement, index) == SQLITE_NULL)
        return true;
    const unsigned char *bytes = sqlite3_column_text(statement, index);
    const size_t size = (size_t)sqlite3_column_bytes(statement, index);
    *text = bytes == NULL ? NULL : malloc(size + 1);
    if (*text == NULL)
        return false;
    memcpy(*text, bytes, size);
    (*text)[size] = '\0';
    return true;
}

static bool read_bytes(sqlite3_stmt *statement, int index, StoredBytes *bytes) {
    if (sqlite3_column_type(statement, index) == SQLITE_NULL)
        return true;
    const void *blob = sqlite3_column_blob(statement, index);
    bytes->size = (size_t)sqlite3_column_bytes(statement, index);
    bytes->at = malloc(bytes->size + 1);
    if (bytes->at == NULL || (blob == NULL && bytes->size > 0)) {
        bytes->size = 0;
        return false;
    }
    if (bytes->size > 0)
        memcpy(bytes->at, blob, bytes->size);
    return true;
}

// A text that does not fit cannot be one of ours; it is cut.
static void read_name(sqlite3_stmt *statement, int index, char *name, size_t size) {
    const unsigned char *text = sqlite3_column_text(statement, index);
    const size_t length = text == NULL ? 0 : strlen((const char *)text);
    const size_t kept = length < size ? length : size - 1;
    if (kept > 0)
        memcpy(name, text, kept);
    name[kept] = '\0';
}

// False without memory.
static bool read_column(sqlite3_stmt *statement, int index, const SqlColumn *column, char *member) {
    switch (column->kind) {
    case COLUMN_TEXT:
        return read_text(statement, index, (char **)(void *)member);
    case COLUMN_NAME:
        read_name(statement, index, member, column->size);
        return true;
    case COLUMN_REAL:
        *(double *)(void *)member = sqlite3_column_type(statement, index) == SQLITE_NULL
                                        ? (double)NAN
                                        : sqlite3_column_double(statement, index);
        return true;
    case COLUMN_INTEGER:
        *(int64_t *)(void *)member = sqlite3_column_int64(statement, index);
        return true;
    case COLUMN_COUNT:
        *(uint64_t *)(void *)member = (uint64_t)sqlite3_column_int64(statement, index);
        return true;
    case COLUMN_CHOICE:
        *(int *)(void *)member = sqlite3_column_type(statement, index) == SQLITE_NULL
                                     ? -1
                                     : sqlite3_column_int(statement, index);
        return true;
    case COLUMN_FLAG:
        *(bool *)(void *)member = sqlite3_column_int(statement, index) != 0;
        return true;
    case COLUMN_BYTES:
        return read_bytes(statement, index, (StoredBytes *)(void *)member);
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

// Also logged: readers of parts of a page do not look into its problem.
static Status report_damage(Statement *statement, const SqlColumn *column, Problem *problem) {
    Problem damage = {.status = STATUS_OK};
    Bytes line = {0};
    (void)problem_set(&damage, STATUS_INTERNAL,
                      "%s is damaged: a stored \"%s\" differs from its checksum; put a backup in "
                      "its place (impactd restore)",
                      sqlite3_db_filename(sqlite3_db_handle(statement->handle), "main"),
                      column->name);
    log_put(&line, "error", damage.detail, sizeof damage.detail);
    log_write(&line);
    bytes_clear(&line);
    return problem_set(problem, STATUS_INTERNAL, "%s", damage.detail);
}

// Compares what was read of the row with its checks, which are those of all checked columns.
static Status check_row(Statement *statement, int checks_index, const SqlColumn *columns,
                        const void *item, Problem *problem) {
    const char *checks = sqlite3_column_blob(statement->handle, checks_index);
    const size_t size = (size_t)sqlite3_column_bytes(statement->handle, checks_index);
    const int count = sqlite3_column_count(statement->handle);
    size_t at = 0;
    for (const SqlColumn *column = columns; checks != NULL && column->name != NULL; column++) {
        if ((column->flags & COLUMN_CHECKED) == 0)
            continue;
        uint32_t check = 0;
        if (at + sizeof check <= size)
            memcpy(&check, checks + at, sizeof check);
        at += sizeof check;
        bool was_read = false;
        for (int i = 0; i < count && !was_read; i++)
            was_read = strcmp(sqlite3_column_name(statement->handle, i), column->name) == 0;
        if (was_read && check != column_check(column, (const char *)item + column->offset))
            return report_damage(statement, column, problem);
    }
    return STATUS_OK;
}

Status row_read(Statement *statement, const SqlColumn *columns, void *item, Problem *problem) {
    const int count = sqlite3_column_count(statement->handle);
    int checks_index = -1;
    Status status = STATUS_OK;
    for (int index = 0; index < count && status == STATUS_OK; index++) {
        const char *name = sqlite3_column_name(statement->handle, index);
        const SqlColumn *column = name == NULL ? NULL : column_find(columns, name);
        if (column == NULL && name != NULL && strcmp(name, "checks") == 0)
            checks_index = index;
        else if (column != NULL &&
                 !read_column(statement->handle, index, column, (char *)item + column->offset))
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a row of the database");
    }
    if (status == STATUS_OK && checks_index >= 0)
        status = check_row(statement, checks_index, columns, item, problem);
    for (const SqlColumn *column = columns; status != STATUS_OK && column->name != NULL; column++)
        free_owned(column, item);
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

bool row_copy(const SqlColumn *columns, const void *item, void *copy, size_t size) {
    memset(copy, 0, size);
    for (const SqlColumn *column = columns; column->name != NULL; column++) {
        const void *from = (const char *)item + column->offset;
        void *to = (char *)copy + column->offset;
        if (column->kind != COLUMN_TEXT && column->kind != COLUMN_BYTES) {
            memcpy(to, from, column->size);
            continue;
        }
        const bool is_text = column->kind == COLUMN_TEXT;
        const StoredBytes *bytes = from;
        const char *text = is_text ? *(char *const *)from : bytes->at;
        const size_t length = text == NULL ? 0 : is_text ? strlen(text) + 1 : bytes->size;
        char *own = text == NULL ? NULL : malloc(length + 1);
        if (own != NULL)
            memcpy(own, text, length);
        if (is_text)
            *(char **)to = own;
        else
            *(StoredBytes *)to = (StoredBytes){own, length};
        if (own == NULL && text != NULL) {
            row_clear(columns, copy, size);
            return false;
        }
    }
    return true;
}

Status sqlite_change(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                     int *changes, Problem *problem) {
    Statement *statement;
    bool has_row;
    TRY(begin(database, sql, keys, item, NULL, &statement, problem));
    const Status status = statement_step(statement, &has_row, problem);
    if (changes != NULL)
        *changes = status == STATUS_OK ? sqlite3_changes(database->connection) : 0;
    statement_end(statement);
    return status;
}

Status sqlite_first(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                    const SqlColumn *columns, void *target, bool *is_found, Problem *problem) {
    Statement *statement;
    *is_found = false;
    TRY(begin(database, sql, keys, item, columns, &statement, problem));
    Status status = statement_step(statement, is_found, problem);
    if (status == STATUS_OK && *is_found)
        status = row_read(statement, columns, target, problem);
    statement_end(statement);
    return status;
}

static Status read_all(Statement *statement, const SqlColumn *columns, size_t size, List *list,
                       Problem *problem) {
    for (;;) {
        bool has_row;
        TRY(statement_step(statement, &has_row, problem));
        if (!has_row)
            return STATUS_OK;
        void *item = list_grow(list, size);
        if (item == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the rows of the database");
        TRY(row_read(statement, columns, item, problem));
    }
}

Status sqlite_list(Sqlite *database, const char *sql, const SqlColumn *keys, const void *item,
                   const SqlColumn *columns, size_t size, void *list, Problem *problem) {
    Statement *statement;
    *(List *)list = (List){NULL, 0};
    TRY(begin(database, sql, keys, item, columns, &statement, problem));
    const Status status = read_all(statement, columns, size, list, problem);
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
// What is read is mapped; the cache holds pages that are written, and grows to its size with the
// database. Four times as much was no faster.
static const char settings[] = "PRAGMA synchronous = FULL;"
                               "PRAGMA secure_delete = OFF;"
                               "PRAGMA mmap_size = 1073741824;"
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
        return problem_set(problem, STATUS_IO, "cannot make %s: %s", path, strerror(errno));
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
    for (size_t i = 0; i < database->statement_count; i++) {
        sqlite3_finalize(database->statements[i]->handle);
        free(database->statements[i]);
    }
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
        return STATUS_OK;
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

Status sqlite_check(Sqlite *database, Problem *problem) {
    static const char sql[] = "SELECT integrity_check AS text FROM pragma_integrity_check(1)";
    typedef struct Verdict {
        char text[256];
    } Verdict;
    static const SqlColumn columns[] = {COLUMN(Verdict, text), COLUMN_END};
    Verdict verdict = {"it cannot be checked"};
    bool is_found;
    TRY(sqlite_first(database, sql, NULL, NULL, columns, &verdict, &is_found, problem));
    return strcmp(verdict.text, "ok") == 0
               ? STATUS_OK
               : problem_set(problem, STATUS_IO, "the database is damaged (%s)", verdict.text);
}

static int ask(void *watch) {
    return !progress_advance(watch, 0);
}

void sqlite_watch(Sqlite *database, const Progress *watch) {
    enum { OPERATIONS = 20000 };
    sqlite3_progress_handler(database->connection, OPERATIONS, watch != NULL ? ask : NULL,
                             (void *)(uintptr_t)watch);
}
