// Work for readers: so much at once, woken when done, stopped when the reader goes.
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

typedef struct WorkItem {
    atomic_bool may_end;
    bool was_stopped;
} WorkItem;

static void rest(void) {
    const struct timespec pause = {.tv_nsec = 1000000};
    nanosleep(&pause, NULL);
}

static void task_run(void *context, const Progress *watch) {
    WorkItem *task = context;
    while (!atomic_load(&task->may_end) && !task->was_stopped) {
        task->was_stopped = !watch->advance(watch->context, 0);
        rest();
    }
}

static void task_free(void *context) {
    atomic_fetch_add(&released, 1);
    free(context);
}

static Status begin(BackgroundTasks *background_tasks, bool may_end, BackgroundTask **background) {
    WorkItem *task = calloc(1, sizeof *task);
    atomic_init(&task->may_end, may_end);
    const BackgroundWork work = {task, task_run, task_free};
    return background_start(background_tasks, &work, &callback, background, NULL);
}

TEST(a_reader_is_woken_when_it_is_done) {
    BackgroundTasks *background_tasks;
    BackgroundTask *background;
    atomic_store(&woken, 0);
    atomic_store(&released, 0);
    assert_int_equal(background_open(1, &background_tasks, NULL), STATUS_OK);
    assert_int_equal(begin(background_tasks, true, &background), STATUS_OK);
    while (atomic_load(&woken) == 0)
        rest();
    assert_true(background_is_done(background));
    assert_false(((WorkItem *)background_context(background))->was_stopped);
    assert_int_equal(atomic_load(&released), 0);
    background_unref(background);
    assert_int_equal(atomic_load(&released), 1);
    background_close(background_tasks);
}

TEST(beyond_its_room_it_refuses) {
    BackgroundTasks *background_tasks;
    BackgroundTask *background, *other;
    atomic_store(&released, 0);
    assert_int_equal(background_open(1, &background_tasks, NULL), STATUS_OK);
    assert_int_equal(begin(background_tasks, false, &background), STATUS_OK);
    assert_int_equal(begin(background_tasks, false, &other), STATUS_BUSY);
    assert_null(other);
    assert_int_equal(atomic_load(&released), 1);
    assert_false(background_is_done(background));
    background_unref(background); // stops it
    while (begin(background_tasks, true, &other) != STATUS_OK)
        rest();
    background_unref(other);
    background_close(background_tasks);
}

TEST(the_end_stops_what_runs_and_waits) {
    BackgroundTasks *background_tasks;
    BackgroundTask *background;
    atomic_store(&released, 0);
    assert_int_equal(background_open(3, &background_tasks, NULL), STATUS_OK);
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(begin(background_tasks, false, &background), STATUS_OK);
        if (i < 2)
            background_unref(background);
    }
    background_unref(background);
    background_close(background_tasks);
    assert_int_equal(atomic_load(&released), 3);
}

TEST(many_come_and_go) {
    BackgroundTasks *background_tasks;
    assert_int_equal(background_open(4, &background_tasks, NULL), STATUS_OK);
    atomic_store(&released, 0);
    for (int i = 0; i < 500; i++) {
        BackgroundTask *background;
        if (begin(background_tasks, i % 2 == 0, &background) == STATUS_OK)
            background_unref(background);
    }
    background_close(background_tasks);
    assert_int_equal(atomic_load(&released), 500);
}
