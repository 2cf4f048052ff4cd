// Work for readers: a limited number at once, woken when done, stopped when the reader has left.
#include "server/jobs/background.h"
#include "tests/support/test.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>

static atomic_int woken, released;

static void wake(void *context) {
    (void)context;
    atomic_fetch_add(&woken, 1);
}

static const Callback callback = {NULL, wake};

typedef struct Work {
    atomic_bool may_end;
    bool was_stopped;
} Work;

static void rest(void) {
    const struct timespec pause = {.tv_nsec = 1000000};
    nanosleep(&pause, NULL);
}

static void work_run(void *context, const Progress *watch) {
    Work *work = context;
    while (!atomic_load(&work->may_end) && !work->was_stopped) {
        work->was_stopped = !watch->advance(watch->context, 0);
        rest();
    }
}

static void work_release(void *context) {
    atomic_fetch_add(&released, 1);
    free(context);
}

static Status begin(BackgroundTasks *tasks, bool may_end, BackgroundTask **task) {
    Work *work = calloc(1, sizeof *work);
    atomic_init(&work->may_end, may_end);
    return background_start(tasks, &(BackgroundWork){work, work_run, work_release}, &callback, task,
                            NULL);
}

TEST(a_reader_is_woken_when_it_is_done_and_beyond_the_limit_it_is_refused) {
    BackgroundTasks *tasks;
    BackgroundTask *task, *other;
    assert_int_equal(background_open(1, &tasks, NULL), STATUS_OK);
    assert_int_equal(begin(tasks, true, &task), STATUS_OK);
    while (atomic_load(&woken) == 0)
        rest();
    assert_true(background_is_done(task));
    assert_false(((Work *)background_context(task))->was_stopped);
    assert_int_equal(atomic_load(&released), 0);
    background_unref(task);
    assert_int_equal(atomic_load(&released), 1);
    assert_int_equal(begin(tasks, false, &task), STATUS_OK);
    assert_int_equal(begin(tasks, false, &other), STATUS_BUSY);
    assert_int_equal(atomic_load(&released), 2);
    assert_false(background_is_done(task));
    background_unref(task); // stops it
    while (begin(tasks, true, &other) != STATUS_OK)
        rest();
    background_unref(other);
    background_close(tasks);
}

TEST(many_come_and_go_and_the_end_stops_what_runs) {
    BackgroundTasks *tasks;
    assert_int_equal(background_open(4, &tasks, NULL), STATUS_OK);
    atomic_store(&released, 0);
    for (int i = 0; i < 500; i++) {
        BackgroundTask *task;
        if (begin(tasks, i % 2 == 0, &task) == STATUS_OK)
            background_unref(task);
    }
    background_close(tasks);
    assert_int_equal(atomic_load(&released), 500);
}
