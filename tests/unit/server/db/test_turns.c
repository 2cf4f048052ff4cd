// When posted writes come: now, soon, later or low. The writer is held up meanwhile, so that what
// is seen does not hang on the clock.
#include "server/db/db_private.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <time.h>

#include <cmocka.h>

enum { WRITES = 8 };

static Db *db;
static pthread_mutex_t lock;
static atomic_bool is_held_up;
static atomic_int done_count;
static int order[WRITES];
static uint64_t written_before[WRITES];
static atomic_size_t count;

static int open_store(void **state) {
    (void)state;
    pthread_mutex_init(&lock, NULL);
    atomic_store(&is_held_up, false);
    atomic_store(&done_count, 0);
    atomic_store(&count, 0);
    return db_open(NULL, &db, NULL) != STATUS_OK;
}

static int close_store(void **state) {
    (void)state;
    db_close(db);
    pthread_mutex_destroy(&lock);
    return 0;
}

static Status wait_for_leave(Sqlite *database, const void *work, Problem *problem) {
    (void)database, (void)work, (void)problem;
    atomic_store(&is_held_up, true);
    pthread_mutex_lock(&lock);
    pthread_mutex_unlock(&lock);
    return STATUS_OK;
}

static Status note(Sqlite *database, const void *work, Problem *problem) {
    (void)database, (void)problem;
    const size_t place = atomic_fetch_add(&count, 1);
    order[place] = *(const int *)work;
    written_before[place] = counter_get(&db_totals(db)->writes);
    return STATUS_OK;
}

static void count_done(void *context, Status status, const char *detail) {
    (void)context, (void)detail;
    atomic_fetch_add(&done_count, status == STATUS_OK);
}

static const struct timespec moment = {0, 1000000};
static const WriteDone done = {count_done, NULL};

// The writer is in a transaction of which nothing else is part, until let_go.
static void hold_up(void) {
    pthread_mutex_lock(&lock);
    assert_int_equal(db_enqueue(db, wait_for_leave, NULL, 0, STORE_NOW, &done, NULL), STATUS_OK);
    while (!atomic_load(&is_held_up))
        nanosleep(&moment, NULL);
}

static void let_go(void) {
    pthread_mutex_unlock(&lock);
}

static PendingWrite *post(int number, WritePriority turn) {
    PendingWrite *ticket = NULL;
    assert_int_equal(db_enqueue(db, note, &number, sizeof number, turn, &done, &ticket), STATUS_OK);
    return ticket;
}

static void wait_for(int writes) {
    while (atomic_load(&done_count) < writes)
        nanosleep(&moment, NULL);
}

static void what_is_hurried_comes_before_what_waits(void **state) {
    (void)state;
    hold_up();
    post(1, STORE_LATER);
    PendingWrite *hurried = post(2, STORE_LATER);
    db_expedite(db, hurried);
    db_expedite(db, post(3, STORE_NOW)); // changes nothing
    post(4, STORE_NOW);
    let_go();
    wait_for(5);
    assert_int_equal(order[0], 2);
    assert_int_equal(order[1], 3);
    assert_int_equal(order[2], 4);
    assert_int_equal(order[3], 1);
}

static void what_comes_soon_goes_with_what_comes_now_and_what_is_low_by_itself(void **state) {
    (void)state;
    hold_up();
    post(1, STORE_LOW);
    post(2, STORE_SOON);
    post(3, STORE_NOW);
    let_go();
    wait_for(4);
    assert_int_equal(order[0], 3);
    assert_int_equal(order[1], 2);
    assert_int_equal(order[2], 1);
    assert_int_equal(written_before[0], 1);
    assert_int_equal(written_before[1], 1);
    assert_int_equal(written_before[2], 3);
}

static void what_is_settled_was_all_written(void **state) {
    (void)state;
    post(1, STORE_LATER);
    post(2, STORE_SOON);
    post(3, STORE_LATER);
    db_flush(db);
    assert_int_equal(atomic_load(&count), 3);
    db_flush(db); // there is nothing
    wait_for(3);
}

static void what_was_withdrawn_is_not_written(void **state) {
    (void)state;
    hold_up();
    PendingWrite *const tickets[] = {post(1, STORE_LATER), post(2, STORE_SOON), post(3, STORE_NOW)};
    post(4, STORE_NOW);
    post(5, STORE_LATER);
    for (size_t i = 0; i < COUNT(tickets); i++)
        assert_true(db_cancel_write(db, tickets[i]));
    let_go();
    wait_for(3);
    assert_int_equal(atomic_load(&count), 2);
    assert_int_equal(order[0], 4);
    assert_int_equal(order[1], 5);
}

static void what_waits_is_written_in_the_end(void **state) {
    (void)state;
    post(1, STORE_SOON);
    wait_for(1);
    post(2, STORE_LATER);
    wait_for(2);
    assert_int_equal(order[1], 2);
}

static void closing_writes_what_waits(void **state) {
    (void)state;
    hold_up();
    post(1, STORE_LATER);
    post(2, STORE_SOON);
    post(3, STORE_LOW);
    let_go();
    db_close(db);
    db = NULL;
    assert_int_equal(atomic_load(&done_count), 4);
    assert_int_equal(atomic_load(&count), 3);
}

#define IN_STORE(test) cmocka_unit_test_setup_teardown(test, open_store, close_store)

int main(void) {
    const struct CMUnitTest tests[] = {
        IN_STORE(what_is_hurried_comes_before_what_waits),
        IN_STORE(what_comes_soon_goes_with_what_comes_now_and_what_is_low_by_itself),
        IN_STORE(what_is_settled_was_all_written),
        IN_STORE(what_was_withdrawn_is_not_written),
        IN_STORE(what_waits_is_written_in_the_end),
        IN_STORE(closing_writes_what_waits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
