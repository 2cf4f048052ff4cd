// What a daemon reads: requests as bytes of a connection, and rows of its database.
#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "server/db/db_private.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/service.h"

static Problem problem;

static int connection_open(const char *url) {
    const struct sockaddr_in address = {.sin_family = AF_INET,
                                        .sin_port = htons((uint16_t)atoi(strrchr(url, ':') + 1)),
                                        .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const struct timeval limit = {.tv_sec = 20};
    const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
    fuzz_check(descriptor >= 0 &&
                   connect(descriptor, (const struct sockaddr *)&address, sizeof address) == 0,
               "the daemon accepts a connection");
    (void)setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    (void)setsockopt(descriptor, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    return descriptor;
}

// All that a client sends on one connection, with the ids that service_fill replaces. The daemon
// closes it in time, answers in HTTP, and finds no fault of its own.
void fuzz_http(const char *text, size_t size) {
    enum { INPUTS = 1000, ANSWER_MAX = 1 << 16 }; // of one daemon, for what is sent stays there
    static Service *service;
    static size_t inputs;
    static char answer[ANSWER_MAX], piece[ANSWER_MAX];
    size_t sent, received = 0;
    ssize_t count = 1;
    if (inputs++ % INPUTS == 0) {
        if (service != NULL)
            service_close(service);
        service = service_open();
    }
    char *all = service_fill(service, text, size, &sent);
    const int descriptor = connection_open(server_url(service->server));
    for (size_t at = 0; at < sent && count > 0; at += count > 0 ? (size_t)count : 0)
        count = send(descriptor, all + at, sent - at, MSG_NOSIGNAL);
    // Behind the beginning of an answer, if there is one soon: an end that comes together with a
    // request is noticed late.
    struct pollfd readable = {.fd = descriptor, .events = POLLIN};
    (void)poll(&readable, 1, 20);
    (void)shutdown(descriptor, SHUT_WR);
    // Of a long answer the beginning is kept.
    while ((count = recv(descriptor, piece, sizeof piece, 0)) > 0) {
        const size_t room = sizeof answer - 1 - received;
        const size_t taken = (size_t)count < room ? (size_t)count : room;
        memcpy(answer + received, piece, taken);
        received += taken;
    }
    fuzz_check(count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK),
               "the daemon ends a connection whose client says no more");
    answer[received] = '\0';
    fuzz_check(received < 8 || strncmp(answer, "HTTP/1.", 7) == 0, "an answer is in HTTP");
    // With the line's end, which no message quotes from a request.
    fuzz_check(strstr(answer, "HTTP/1.1 500 Internal Server Error\r\n") == NULL,
               "a request is no fault of the daemon");
    close(descriptor);
    free(all);
}

// What is read of a column: the paths whose columns begin so.
static const struct {
    const char *columns, *path;
} readings[] = {
    {"results.", "/v1/results/{result}"},
    {"results.", "/v1/results/{result}/manifest"},
    {"results.", "/v1/results/{result}/bundle.zip"},
    {"results.", "/v1/results/{result}/psd.csv"},
    {"results.", "/v1/results/{result}/impacts.json"},
    {"results.", "/v1/results/{result}/energy.json"},
    {"results.", "/v1/results/{result}/impacts/1/force.csv"},
    {"results.", "/v1/results/{result}/series.csv"},
    {"results.", "/v1/compare?a={result}&b={sweep}"},
    {"results.study", "/v1/results/{result}/tradeoff.json"},
    {"results.study", "/v1/results/{result}/tradeoff.svg"},
    {"results.study", "/v1/results/{result}/ensemble.json"},
    {"results.study", "/v1/results/{result}/ensemble.csv"},
    {"results.study", "/v1/results/{result}/ensemble.svg"},
    {"results.study", "/v1/results/{result}/compare.svg"},
    {"results.study", "/v1/results/{result}/compare.csv"},
    {"results.study", "/v1/results/{result}/sensitivity.csv"},
    {"results.study", "/v1/results/{result}/sensitivity.svg"},
    {"results.study", "/v1/results/{result}/response.csv"},
    {"results.study", "/v1/results/{result}/response.svg"},
    {"results.study", "/v1/results/{result}/fragility.csv"},
    {"results.study", "/v1/results/{result}/fragility.svg"},
    {"results.study", "/v1/results/{result}/calibration.csv"},
    {"results.study", "/v1/results/{result}/calibration.svg"},
    {"results.study", "/v1/results/{result}/calibration/scene"},
    {"results.study", "/v1/results/{result}/optimum.csv"},
    {"results.study", "/v1/results/{result}/optimum.svg"},
    {"results.study", "/v1/results/{result}/optimum/scene"},
    {"series_bodies.", "/v1/results/{result}/series.csv"},
    {"jobs.", "/v1/jobs"},
    {"jobs.", "/v1/jobs/{job}"},
    {"jobs.", "/v1/jobs/{job}/scene"},
    {"jobs.", "/v1/jobs/{job}/events"},
    {"sweep", "/v1/jobs/{sweep_job}/table.csv"},
    {"sweep", "/v1/results/{sweep}/table.json"},
    {"sweep", "/v1/results/{sweep}/points/1"},
    {"sweep", "/v1/results/{sweep}/points/1/scene"},
    {"material", "/v1/materials"},
    {"material", "/v1/materials.json"},
    {"material", "/v1/materials.csv"},
    {"material", "/v1/materials/felt"},
    {"material", "/v1/materials/felt@2"},
    {"material", "/v1/materials/felt/history"},
    {"material", "/v1/materials/felt/revisions"},
    {"material", "/v1/materials/felt/diff?from=1&to=2"},
    {"material", "/v1/materials/felt/used-by"},
    {"material", "/v1/materials/felt/derived?damper_mass=1&structure_mass=2"},
    {"material", "/v1/materials/felt/measurements"},
    {"material", "/v1/materials/felt/measurements/1"},
    {"material", "/v1/materials/felt/proposal"},
    {"material", "/v1/materials/felt/proposal.svg"},
    {"record", "/v1/records"},
    {"record", "/v1/records/quake"},
    {"record", "/v1/records/quake/samples.csv"},
    {"record", "/v1/records/quake/spectrum.csv"},
};

static const CheckedTable *const tables[] = {
    &revisions_table, &reviews_table, &measurements_table, &records_table, &samples_table,
    &results_table,   &series_table,  &sweep_rows_table,   &chunks_table,  &jobs_table};

// The columns of a table, and what restores them.
typedef struct RowTable {
    char name[64], columns[1000];
    Bytes restore;
} RowTable;
static RowTable row_tables[COUNT(tables)];
static const SqlColumn row_table_columns[] = {COLUMN(RowTable, name), COLUMN(RowTable, columns),
                                              COLUMN_END};

// Rows may be changed from here on, and are kept as they are.
static Status row_prepare(Sqlite *database, const void *work, Problem *fault) {
    static const char changeable[] =
        "DROP TRIGGER material_revisions_keep; DROP TRIGGER material_reviews_keep;"
        "DROP TRIGGER material_measurements_keep; DROP TRIGGER records_keep;"
        "DROP TRIGGER record_samples_keep; PRAGMA ignore_check_constraints = ON";
    static const char columns_sql[] = "SELECT group_concat(name) AS columns "
                                      "FROM pragma_table_info(:name) WHERE name <> 'number'";
    (void)work;
    TRY(sqlite_execute(database, changeable, fault));
    for (size_t i = 0; i < COUNT(tables); i++) {
        RowTable *row = &row_tables[i];
        Bytes keep = {0};
        snprintf(row->name, sizeof row->name, "%s", tables[i]->name);
        TRY(sqlite_first(database, columns_sql, row_table_columns, row, row_table_columns, row,
                         NULL, fault));
        bytes_format(&keep, "CREATE TEMP TABLE kept_%s AS SELECT * FROM %s", row->name, row->name);
        bytes_clear(&row->restore);
        bytes_format(&row->restore,
                     "UPDATE %s AS t SET (%s) = (SELECT %s FROM kept_%s k WHERE k.number = "
                     "t.number) WHERE number IN (SELECT number FROM kept_%s)",
                     row->name, row->columns, row->columns, row->name, row->name);
        const Status status = sqlite_execute(database, keep.at, fault);
        bytes_clear(&keep);
        TRY(status);
    }
    return STATUS_OK;
}

static Status row_restore(Sqlite *database, const void *work, Problem *fault) {
    return sqlite_execute(database, ((const RowTable *)work)->restore.at, fault);
}

typedef struct RowChange {
    const CheckedTable *table;
    Bytes sql;
} RowChange;

// The table gets its checksums again, so that readers see what was changed.
static Status row_change(Sqlite *database, const void *work, Problem *fault) {
    const RowChange *change = work;
    TableCheck check = {.stores = true};
    TRY(sqlite_execute(database, change->sql.at, fault));
    return sqlite_check_table(database, change->table, &check, fault);
}

// A value as SQL, its type by a letter: n null, i integer, r real, t text, else bytes.
static void value_write(Bytes *sql, char type, const char *value, size_t size) {
    if (type == 'i' || type == 'r') {
        char *copy = fuzz_copy(value, size);
        bytes_format(sql, type == 'i' ? "%.0f" : "%.17e", strtod(copy, NULL));
        free(copy);
        return;
    }
    bytes_text(sql, type == 'n' ? "NULL" : type == 't' ? "CAST(x'" : "x'");
    for (size_t i = 0; i < size && type != 'n'; i++)
        bytes_format(sql, "%02x", (unsigned char)value[i]);
    bytes_text(sql, type == 'n' ? "" : type == 't' ? "' AS TEXT)" : "'");
}

static void rows_read(Service *service, const char *column) {
    for (size_t i = 0; i < COUNT(readings); i++) {
        if (strncmp(column, readings[i].columns, strlen(readings[i].columns)) != 0)
            continue;
        size_t size;
        char *path = service_fill(service, readings[i].path, strlen(readings[i].path), &size);
        (void)service_ask(service, "GET", path, NULL);
        free(path);
    }
}

// "table.column", a line end, the letter of a type, a value: every row of the table has it there
// while the daemon's tables are read anew. Sizes and times of answers are bounded; any is right.
void fuzz_rows(const char *text, size_t size) {
    static Service *service;
    static const char letters[] = "abcdefghijklmnopqrstuvwxyz_";
    const char *end = memchr(text, '\n', size), *dot = memchr(text, '.', size);
    size_t i = 0;
    if (service == NULL) {
        service = service_open();
        problem_clear(&problem);
        fuzz_check(db_write(service->app.db, row_prepare, NULL, &problem) == STATUS_OK,
                   "rows can be kept");
    }
    if (end == NULL || dot == NULL || dot > end || end + 1 == text + size)
        return;
    char *column = fuzz_copy(text, (size_t)(end - text)), *name = column + (dot - text);
    *name++ = '\0';
    while (i < COUNT(tables) && strcmp(tables[i]->name, column) != 0)
        i++;
    if (i < COUNT(tables) && name[0] != '\0' && name[strspn(name, letters)] == '\0' &&
        strcmp(name, "number") != 0) {
        RowChange change = {.table = tables[i]};
        bytes_format(&change.sql, "UPDATE %s SET %s = ", column, name);
        value_write(&change.sql, end[1], end + 2, (size_t)(text + size - (end + 2)));
        // A reader of a database in memory can write, and needs no other thread.
        if (db_read(service->app.db, row_change, &change, NULL) == STATUS_OK) {
            name[-1] = '.';
            service_forget(service, tables[i] == &jobs_table);
            rows_read(service, column);
        }
        fuzz_check(db_read(service->app.db, row_restore, &row_tables[i], &problem) == STATUS_OK,
                   "rows can be restored");
        bytes_clear(&change.sql);
    }
    free(column);
}
