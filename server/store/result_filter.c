// A Bloom filter. An id is "r-" and the digits of a digest, so that any of them are as good as a
// hash: four times six digits number four bits. Of a million results one in 500 others is taken for
// known, of four million one in six; with more than these it is not worth the reading.
#include "server/store/result_filter.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "server/store/row.h"

enum { DIGITS = 6, PLACES = 4, BITS = 1 << (4 * DIGITS), RESULTS_MAX = 4000000 };

struct ResultFilter {
    bool says_no;
    _Atomic(uint64_t) words[BITS / 64];
};

ResultFilter *result_filter_new(void) {
    return calloc(1, sizeof(ResultFilter));
}

void result_filter_free(ResultFilter *filter) {
    free(filter);
}

// False for what is no id of ours.
static bool find_places(const char *id, uint32_t places[PLACES]) {
    if (strncmp(id, "r-", 2) != 0)
        return false;
    const char *digit = id + 2;
    for (size_t i = 0; i < PLACES; i++) {
        places[i] = 0;
        for (size_t k = 0; k < DIGITS; k++, digit++) {
            if ((*digit < '0' || *digit > '9') && (*digit < 'a' || *digit > 'f'))
                return false;
            places[i] =
                16 * places[i] + (uint32_t)(*digit <= '9' ? *digit - '0' : *digit - 'a' + 10);
        }
    }
    return true;
}

void result_filter_add(ResultFilter *filter, const char *id) {
    uint32_t places[PLACES];
    for (size_t i = 0; i < PLACES && find_places(id, places); i++)
        atomic_fetch_or(&filter->words[places[i] / 64], (uint64_t)1 << places[i] % 64);
}

bool result_filter_may_have(const ResultFilter *filter, const char *id) {
    uint32_t places[PLACES];
    bool may_have = true;
    if (!filter->says_no || !find_places(id, places))
        return true;
    for (size_t i = 0; i < PLACES; i++)
        may_have = may_have && (atomic_load(&filter->words[places[i] / 64]) >> places[i] % 64 & 1);
    return may_have;
}

typedef struct Row {
    char id[72];
    int64_t number;
} Row;
static const RowColumn row_columns[] = {ROW_COLUMN(Row, id, COLUMN_NAME),
                                        ROW_COLUMN(Row, number, COLUMN_INTEGER), ROW_END};

static Status fill(ResultFilter *filter, Statement *statement, Problem *problem) {
    for (;;) {
        Row row = {.number = 0};
        bool has_row;
        TRY(statement_step(statement, &has_row, problem));
        if (!has_row)
            return STATUS_OK;
        TRY(row_read(statement, row_columns, &row, problem));
        result_filter_add(filter, row.id);
    }
}

Status result_filter_fill(ResultFilter *filter, Database *database, Problem *problem) {
    static const char last_sql[] = "SELECT coalesce(max(number), 0) AS number FROM results";
    static const char ids_sql[] = "SELECT id FROM results"; // of their index alone
    Row last = {.number = 0};
    Statement *statement;
    bool has_row;
    TRY(statement_begin(database, last_sql, NULL, NULL, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, row_columns, &last, problem);
    statement_end(statement);
    if (status != STATUS_OK || last.number > RESULTS_MAX)
        return status;
    TRY(statement_begin(database, ids_sql, NULL, NULL, &statement, problem));
    status = fill(filter, statement, problem);
    statement_end(statement);
    filter->says_no = status == STATUS_OK;
    return status;
}
