// Parameters and columns are looked up by name in the table; parameters once for each statement,
// which is bound many thousand times a second.
#include "server/db/row.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <sqlite3.h>

#include "server/db/db.h"

static const RowColumn *column_find(const RowColumn *columns, const char *name) {
    for (const RowColumn *column = columns; column != NULL && column->kind != COLUMN_END; column++)
        if (strcmp(column->name, name) == 0)
            return column;
    return NULL;
}

static int bind(Statement *statement, int index, const RowColumn *column, const char *member) {
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
    case COLUMN_END:
        break;
    }
    return SQLITE_MISUSE;
}

static Status find_all(Statement *statement, const RowColumn *columns, RowMap *map,
                       Problem *problem) {
    map->columns = NULL;
    map->count = sqlite3_bind_parameter_count(statement);
    if (map->count > ROW_PARAMETERS)
        return problem_set(problem, STATUS_INTERNAL, "more than %d parameters of a statement",
                           ROW_PARAMETERS);
    for (int i = 0; i < map->count; i++) {
        const char *name = sqlite3_bind_parameter_name(statement, i + 1);
        map->of[i] = name == NULL ? NULL : column_find(columns, name + 1);
        if (map->of[i] == NULL)
            return problem_set(problem, STATUS_INTERNAL, "no member for the parameter %s",
                               name == NULL ? "?" : name);
    }
    map->columns = columns;
    return STATUS_OK;
}

Status row_bind(Statement *statement, RowMap *map, const RowColumn *columns, const void *item,
                Problem *problem) {
    if (map->columns == NULL || map->columns != columns)
        TRY(find_all(statement, columns, map, problem));
    for (int i = 0; i < map->count; i++) {
        const RowColumn *column = map->of[i];
        const int code = bind(statement, i + 1, column, (const char *)item + column->offset);
        if (code == SQLITE_TOOBIG)
            return problem_set(problem, STATUS_TOO_LARGE,
                               "%s is too long to be stored, a billion bytes at most",
                               column->name);
        if (code != SQLITE_OK)
            return problem_set(problem, code == SQLITE_NOMEM ? STATUS_NO_MEMORY : STATUS_INTERNAL,
                               "binding %s: %s", column->name, sqlite3_errstr(code));
    }
    return STATUS_OK;
}

static bool read_text(Statement *statement, int index, char **text) {
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

static bool read_bytes(Statement *statement, int index, StoredBytes *bytes) {
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
static void read_name(Statement *statement, int index, char *name, size_t size) {
    const unsigned char *text = sqlite3_column_text(statement, index);
    const size_t length = text == NULL ? 0 : strlen((const char *)text);
    const size_t kept = length < size ? length : size - 1;
    if (kept > 0)
        memcpy(name, text, kept);
    name[kept] = '\0';
}

// False without memory.
static bool read_column(Statement *statement, int index, const RowColumn *column, char *member) {
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
    case COLUMN_END:
        break;
    }
    return true;
}

static void free_owned(const RowColumn *column, void *item) {
    void *member = (char *)item + column->offset;
    if (column->kind == COLUMN_TEXT) {
        free(*(char **)member);
        *(char **)member = NULL;
    } else if (column->kind == COLUMN_BYTES) {
        free(((StoredBytes *)member)->at);
        *(StoredBytes *)member = (StoredBytes){NULL, 0};
    }
}

Status row_read(Statement *statement, const RowColumn *columns, void *item, Problem *problem) {
    const int count = sqlite3_column_count(statement);
    for (int index = 0; index < count; index++) {
        const char *name = sqlite3_column_name(statement, index);
        const RowColumn *column = name == NULL ? NULL : column_find(columns, name);
        if (column == NULL || read_column(statement, index, column, (char *)item + column->offset))
            continue;
        for (const RowColumn *owner = columns; owner->kind != COLUMN_END; owner++)
            free_owned(owner, item);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a row of the database");
    }
    return STATUS_OK;
}

void row_clear(const RowColumn *columns, void *item, size_t size) {
    for (const RowColumn *column = columns; column->kind != COLUMN_END; column++)
        free_owned(column, item);
    memset(item, 0, size);
}

bool row_copy(const RowColumn *columns, const void *item, void *copy, size_t size) {
    memset(copy, 0, size);
    for (const RowColumn *column = columns; column->kind != COLUMN_END; column++) {
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
