// A list is walked by (created, number), downwards. Which index leads is chosen by the rarest thing
// asked for; all else is looked at row by row. Words are searched as they are, so nothing in them
// can be a pattern: "\n" fences the lines of what is searched, and no text holds one there.
#include "server/db/job_search.h"

#include <stdlib.h>
#include <string.h>

#include "server/db/jobs.h"
#include "server/util/utf8_fold.h"

typedef struct Asked {
    char *id, *words, *label, *key, *result, *study;
    int64_t since, until, before_ms, before_number;
    int least_state, most_state;
    uint64_t most;
} Asked;

// clang-format off
static const RowColumn asked_columns[] = {
    ROW_COLUMN(Asked, id, COLUMN_TEXT),
    ROW_COLUMN(Asked, words, COLUMN_TEXT),
    ROW_COLUMN(Asked, label, COLUMN_TEXT),
    ROW_COLUMN(Asked, key, COLUMN_TEXT),
    ROW_COLUMN(Asked, result, COLUMN_TEXT),
    ROW_COLUMN(Asked, study, COLUMN_TEXT),
    ROW_COLUMN(Asked, since, COLUMN_INTEGER),
    ROW_COLUMN(Asked, until, COLUMN_INTEGER),
    ROW_COLUMN(Asked, before_ms, COLUMN_INTEGER),
    ROW_COLUMN(Asked, before_number, COLUMN_INTEGER),
    ROW_COLUMN(Asked, least_state, COLUMN_CHOICE),
    ROW_COLUMN(Asked, most_state, COLUMN_CHOICE),
    ROW_COLUMN(Asked, most, COLUMN_COUNT),
    ROW_END
};
// clang-format on

// created_unix_ms <= :before_ms says nothing new, but lets an index begin there.
#define PLACE                                                                                      \
    "created_unix_ms <= :before_ms AND created_unix_ms >= :since AND created_unix_ms <= :until "   \
    "AND (created_unix_ms < :before_ms OR number < :before_number) "
#define WORDS                                                                                      \
    "AND (:words IS NULL OR instr(words, :words) > 0) "                                            \
    "AND (:label IS NULL OR instr(words, :label) > 0 OR instr(words, :key) > 0) "
#define KIND                                                                                       \
    "AND state BETWEEN :least_state AND :most_state "                                              \
    "AND (:result IS NULL OR result = :result) "                                                   \
    "AND (:study IS NULL OR coalesce(study, 'none') = :study) "
#define ORDER "ORDER BY created_unix_ms DESC, number DESC LIMIT :most"
#define SELECT "SELECT " JOB_SHOWN " FROM jobs "

static const char plain_sql[] = SELECT "INDEXED BY jobs_created WHERE " PLACE KIND ORDER;
static const char words_sql[] =
    SELECT "INDEXED BY jobs_worded WHERE words IS NOT NULL AND " PLACE WORDS KIND ORDER;
static const char result_sql[] = SELECT
    "INDEXED BY jobs_of_result WHERE substr(result, 3, 12) = substr(:result, 3, 12) AND " PLACE
        WORDS KIND ORDER;
static const char study_sql[] =
    SELECT "INDEXED BY jobs_studied WHERE study = :study AND " PLACE WORDS KIND ORDER;
static const char unsuccessful_sql[] =
    SELECT "INDEXED BY jobs_unsuccessful WHERE state > 2 AND state = :least_state AND " PLACE WORDS
        KIND ORDER;
static const char unfinished_sql[] =
    SELECT "INDEXED BY jobs_unfinished WHERE state < 2 AND " PLACE WORDS KIND ORDER;

static const char *choose(const JobSearch *search) {
    if (search->result != NULL)
        return result_sql;
    if (search->most_state < 2)
        return unfinished_sql;
    if (search->words != NULL || search->label != NULL)
        return words_sql;
    if (search->study != NULL && strcmp(search->study, "none") != 0)
        return study_sql;
    if (search->least_state > 2 && search->least_state == search->most_state)
        return unsuccessful_sql;
    return plain_sql;
}

JobSearch job_search_all(size_t most) {
    return (JobSearch){
        .before_unix_ms = -1, .most_state = 4, .until_unix_ms = INT64_MAX, .most = most};
}

void job_words(Bytes *bytes, const char *title, const char *const *labels, size_t label_count) {
    if (title != NULL)
        utf8_fold(bytes, title);
    if (title != NULL || label_count > 0)
        bytes_text(bytes, "\n");
    for (size_t i = 0; i < label_count; i++) {
        utf8_fold(bytes, labels[i]);
        bytes_text(bytes, "\n");
    }
}

// `before` and `after` fence the folded text.
static Status fold(const char *text, const char *before, const char *after, char **folded) {
    Bytes bytes = {0};
    *folded = NULL;
    if (text == NULL)
        return STATUS_OK;
    bytes_text(&bytes, before);
    utf8_fold(&bytes, text);
    bytes_text(&bytes, after);
    *folded = bytes_take(&bytes, NULL);
    return *folded != NULL ? STATUS_OK : STATUS_NO_MEMORY;
}

static Status find_place(Db *db, const JobSearch *search, Asked *asked, Problem *problem) {
    static const char sql[] = "SELECT created_unix_ms AS before_ms, number AS before_number "
                              "FROM jobs WHERE id = :id";
    const char *before = search->before;
    bool is_found = true;
    asked->before_ms = asked->before_number = INT64_MAX;
    if (before != NULL)
        TRY(db_first(db, sql, asked_columns, &(Asked){.id = (char *)before}, asked_columns, asked,
                     &is_found, problem));
    if (is_found)
        return STATUS_OK;
    if (search->before_unix_ms < 0)
        return problem_set(problem, STATUS_NOT_FOUND, "there is no job \"%.40s\"", before);
    // It went between two pages: its place is where it came.
    asked->before_ms = search->before_unix_ms;
    asked->before_number = 0;
    return STATUS_OK;
}

Status db_job_search(Db *db, const JobSearch *search, JobRows *rows, Problem *problem) {
    Asked asked = {.result = (char *)search->result,
                   .study = (char *)search->study,
                   .since = search->since_unix_ms,
                   .until = search->until_unix_ms,
                   .least_state = search->least_state,
                   .most_state = search->most_state,
                   .most = search->most};
    *rows = (JobRows){0};
    TRY(find_place(db, search, &asked, problem));
    Status status = fold(search->words, "", "", &asked.words);
    if (status == STATUS_OK)
        status = fold(search->label, "\n", "\n", &asked.label);
    if (status == STATUS_OK)
        status = fold(search->label, "\n", "=", &asked.key);
    void *at = NULL;
    if (status == STATUS_OK)
        status = db_all(db, choose(search), asked_columns, &asked, job_columns, sizeof *rows->at,
                        &at, &rows->count, problem);
    else
        (void)problem_set(problem, status, "no memory for a search");
    rows->at = at;
    if (status != STATUS_OK)
        job_rows_clear(rows);
    free(asked.words);
    free(asked.label);
    free(asked.key);
    return status;
}
