// Sweeps in the database: stored once, chunks whole and once, opened again where they failed.
#include "server/db/db.h"
#include "tests/support/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Db *db;
static Problem problem;

static int open_store(void **state) {
    (void)state;
    return db_open(NULL, &db, NULL) != STATUS_OK;
}

static int close_store(void **state) {
    (void)state;
    db_close(db);
    return 0;
}

static SweepRow begun(const char *result, uint64_t chunks) {
    SweepRow row = {.points = 100, .metrics = 2, .chunks = chunks, .created_unix_ms = 7};
    snprintf(row.result, sizeof row.result, "%s", result);
    row.scene = strdup("{}");
    problem_clear(&problem);
    if (db_sweep_begin(db, &row, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return row;
}

static void take(int64_t sweep, uint64_t number, uint64_t failed, bool is_open, const char *bytes) {
    char copy[32];
    snprintf(copy, sizeof copy, "%s", bytes);
    const SweepChunkRow chunk = {.sweep = sweep,
                                 .chunk = number,
                                 .failed = failed,
                                 .is_open = is_open,
                                 .rows = {copy, strlen(copy)}};
    problem_clear(&problem);
    if (db_sweep_take(db, &chunk, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static void assert_chunk(int64_t sweep, uint64_t number, const char *bytes) {
    SweepChunkRow chunk;
    assert_int_equal(db_sweep_chunk(db, sweep, number, &chunk, NULL), STATUS_OK);
    assert_int_equal(chunk.rows.size, strlen(bytes));
    assert_memory_equal(chunk.rows.at, bytes, strlen(bytes));
    sweep_chunk_row_clear(&chunk);
}

TEST_IN(what_is_to_be_done_is_written_down_once, open_store, close_store) {
    SweepRow first = begun("r-1", 8), second = begun("r-1", 99);
    assert_true(first.number > 0 && first.number == second.number);
    assert_int_equal(second.chunks, 8);
    sweep_row_clear(&first);
    sweep_row_clear(&second);
    assert_int_equal(db_sweep_load(db, "r-2", &first, NULL), STATUS_NOT_FOUND);
}

TEST_IN(a_chunk_comes_once_and_is_made_again_only_where_it_is_open, open_store, close_store) {
    SweepRow row = begun("r-3", 4);
    take(row.number, 2, 1, false, "first");
    take(row.number, 2, 0, false, "second");
    assert_chunk(row.number, 2, "first");
    assert_int_equal(db_sweep_reopen(db, "r-3", NULL), STATUS_OK);
    take(row.number, 2, 0, false, "third");
    assert_chunk(row.number, 2, "third");
    assert_int_equal(db_sweep_reopen(db, "r-3", NULL), STATUS_CONFLICT);
    take(row.number, 0, 0, false, "zero");
    SweepChunkRows rows;
    assert_int_equal(db_sweep_chunks(db, row.number, &rows, NULL), STATUS_OK);
    assert_int_equal(rows.count, 2);
    assert_true(rows.at[0].chunk == 0 && rows.at[1].chunk == 2);
    assert_null(rows.at[0].rows.at);
    sweep_chunk_rows_clear(&rows);
    sweep_row_clear(&row);
    assert_int_equal(db_sweep_load(db, "r-3", &row, NULL), STATUS_OK);
    assert_int_equal(row.retries, 1);
    sweep_row_clear(&row);
}

TEST_IN(parts_of_chunks_are_read_until_one_of_them_is_not_what_it_was, open_store, close_store) {
    SweepRow row = begun("r-6", 4);
    take(row.number, 0, 0, false, "abcdefgh");
    take(row.number, 2, 1, false, "ABCDE");
    SweepChunkRows chunks;
    unsigned char part[6];
    assert_int_equal(db_sweep_chunks(db, row.number, &chunks, NULL), STATUS_OK);
    memset(part, '-', sizeof part);
    assert_int_equal(db_sweep_read(db, &row, &chunks, 3, 3, part, NULL), STATUS_OK);
    assert_memory_equal(part, "defDE-", sizeof part); // the second one ends there
    assert_int_equal(db_sweep_read(db, &row, &chunks, 9, 3, part, NULL), STATUS_OK);
    assert_memory_equal(part, "defDE-", sizeof part);
    take(row.number, 1, 0, false, "another");
    assert_int_equal(db_sweep_read(db, &row, &chunks, 0, 3, part, NULL), STATUS_OK);
    assert_int_equal(db_sweep_reopen(db, "r-6", NULL), STATUS_OK);
    assert_int_equal(db_sweep_read(db, &row, &chunks, 0, 3, part, NULL), STATUS_CONFLICT);
    sweep_chunk_rows_clear(&chunks);
    assert_int_equal(db_sweep_chunks(db, row.number, &chunks, NULL), STATUS_OK);
    assert_int_equal(chunks.count, 3);
    assert_int_equal(db_sweep_tidy(db, NULL), STATUS_OK);
    assert_int_equal(db_sweep_read(db, &row, &chunks, 0, 2, part, NULL), STATUS_CONFLICT);
    sweep_chunk_rows_clear(&chunks);
    sweep_row_clear(&row);
}

TEST_IN(what_nobody_waits_for_is_tidied_away_with_its_chunks, open_store, close_store) {
    SweepRow row = begun("r-4", 4), other = begun("r-5", 4);
    take(row.number, 0, 0, false, "rows");
    JobRow job = {.scene = "{}", .warnings = "[]"};
    strcpy(job.id, "j-5");
    strcpy(job.result, "r-5");
    assert_int_equal(db_job_add(db, &job, NULL), STATUS_OK);
    assert_int_equal(db_sweep_tidy(db, NULL), STATUS_OK);
    SweepChunkRow chunk;
    assert_int_equal(db_sweep_chunk(db, row.number, 0, &chunk, NULL), STATUS_NOT_FOUND);
    SweepRow found;
    assert_int_equal(db_sweep_load(db, "r-4", &found, NULL), STATUS_NOT_FOUND);
    assert_int_equal(db_sweep_load(db, "r-5", &found, NULL), STATUS_OK);
    sweep_row_clear(&found);
    assert_int_equal(db_sweep_asked(db, "j-5", &found, NULL), STATUS_OK);
    assert_string_equal(found.result, "r-5");
    sweep_row_clear(&found);
    sweep_row_clear(&row);
    sweep_row_clear(&other);
}
