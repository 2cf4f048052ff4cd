// Timers: no wake-up is lost, no wait is longer than asked, late wakes are harmless, slow senders
// and idle connections are shut down.
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "server/http/connection.h"
#include "server/util/clock.h"
#include "tests/support/test.h"

// Stands for a connection: counts what the TimerList does to it.
typedef struct Connection {
    atomic_int suspended, resumed;
} Connection;

static void suspend(void *context) {
    Connection *connection = context;
    atomic_fetch_add(&connection->suspended, 1);
}

static void resume(void *context) {
    Connection *connection = context;
    atomic_fetch_add(&connection->resumed, 1);
}

static void pause_ms(long ms) {
    const struct timespec time = {.tv_nsec = ms * 1000000};
    nanosleep(&time, NULL);
}

static int changes;

static void changed(void *loop) {
    ++*(int *)loop;
}

static const TimerCallbacks calls = {suspend, resume, changed};

// As the loop does at a time so many milliseconds from now.
static void run_in(TimerList *list, int64_t ms) {
    (void)timer_list_run(list, clock_monotonic_ns() + ms * 1000000);
}

TEST(a_wake_before_the_sleep_is_not_lost) {
    Connection connection = {0};
    TimerList *list = timer_list_new(&calls, &changes);
    ConnectionTimer *timer = timer_take(list, -1);
    const Callback *callback = timer_callback(timer);
    (void)timer_was_woken(timer);
    callback->wake(callback->context);
    assert_false(timer_sleep(timer, &connection, 1000));
    assert_true(timer_was_woken(timer));
    assert_false(timer_was_woken(timer));
    assert_int_equal(connection.suspended, 0);
    timer_list_free(list);
}

TEST(time_ends_a_sleep_and_a_wake_ends_it_sooner) {
    Connection connection = {0};
    changes = 0;
    TimerList *list = timer_list_new(&calls, &changes);
    ConnectionTimer *timer = timer_take(list, -1);
    (void)timer_was_woken(timer);
    assert_true(timer_sleep(timer, &connection, 50));
    assert_int_equal(changes, 1);
    run_in(list, 10);
    assert_int_equal(connection.resumed, 0);
    run_in(list, 51);
    assert_int_equal(connection.resumed, 1);
    assert_false(timer_was_woken(timer));

    assert_true(timer_sleep(timer, &connection, 60000));
    const Callback *callback = timer_callback(timer);
    callback->wake(callback->context);
    callback->wake(callback->context);
    assert_true(timer_was_woken(timer));
    assert_int_equal(connection.resumed, 2); // the second call found no sleeper
    timer_list_free(list);
}

TEST(the_earliest_time_is_served_first_and_reported) {
    Connection late = {0}, early = {0};
    changes = 0;
    TimerList *list = timer_list_new(&calls, &changes);
    ConnectionTimer *first = timer_take(list, -1), *second = timer_take(list, -1);
    (void)timer_was_woken(first);
    (void)timer_was_woken(second);
    assert_true(timer_sleep(first, &late, 60000));
    assert_true(timer_sleep(second, &early, 30));
    assert_int_equal(changes, 2);
    run_in(list, 100);
    assert_int_equal(early.resumed, 1);
    assert_int_equal(late.resumed, 0);
    const int64_t left = timer_list_run(list, clock_monotonic_ns()) - clock_monotonic_ns();
    assert_true(left > 50000000000 && left <= 60000000000);
    timer_list_wake_all(list);
    assert_int_equal(late.resumed, 1);
    assert_false(timer_sleep(first, &late, 60000));
    assert_true(timer_list_is_closing(list));
    timer_list_free(list);
}

TEST(a_late_wake_of_a_free_timer_does_no_harm) {
    Connection next = {0};
    TimerList *list = timer_list_new(&calls, &changes);
    ConnectionTimer *timer = timer_take(list, -1);
    const Callback *callback = timer_callback(timer);
    timer_leave(timer);
    callback->wake(callback->context);
    ConnectionTimer *again = timer_take(list, -1);
    assert_ptr_equal(again, timer);
    (void)timer_was_woken(again);
    assert_true(timer_sleep(again, &next, 60000));
    callback->wake(callback->context); // resumes the next connection, which waits on
    assert_int_equal(next.resumed, 1);
    assert_true(timer_was_woken(again));
    assert_true(timer_sleep(again, &next, 60000));
    timer_list_wake_all(list);
    timer_list_free(list);
}

TEST(a_peer_that_is_too_slow_is_shut_down) {
    int pair[2];
    char byte;
    TimerList *list = timer_list_new(&calls, &changes);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    ConnectionTimer *timer = timer_take(list, pair[0]);
    timer_limit(timer, 10000, false);
    timer_limit(timer, 0, false);
    timer_limit(timer, 30, false);
    run_in(list, 31);
    assert_int_equal(read(pair[1], &byte, 1), 0); // the other end sees it closed
    timer_leave(timer);
    close(pair[0]);
    close(pair[1]);
    timer_list_free(list);
}

TEST(an_idle_connection_is_closed_soon_after_its_client_ended_the_stream) {
    int pairs[2][2];
    char byte;
    TimerList *list = timer_list_new(&calls, &changes);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pairs[i]), 0);
        timer_limit(timer_take(list, pairs[i][0]), 60000, true);
    }
    assert_int_equal(shutdown(pairs[1][1], SHUT_WR), 0);
    run_in(list, 1000);
    assert_int_equal(read(pairs[0][1], &byte, 1), -1);
    assert_int_equal(read(pairs[1][1], &byte, 1), 0);
    run_in(list, 59000);
    assert_int_equal(read(pairs[0][1], &byte, 1), -1);
    run_in(list, 61000);
    assert_int_equal(read(pairs[0][1], &byte, 1), 0);
    for (int i = 0; i < 4; i++)
        close(pairs[i / 2][i % 2]);
    timer_list_free(list);
}

TEST(the_longest_idle_connection_makes_room) {
    int pairs[3][2];
    char byte;
    ConnectionTimer *timers[3];
    TimerList *list = timer_list_new(&calls, &changes);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pairs[i]), 0);
        timers[i] = timer_take(list, pairs[i][0]);
        timer_limit(timers[i], 60000, i != 0); // the first has a request under way
        pause_ms(10);
    }
    timer_list_close_idle(list, 1000); // none is idle for so long
    assert_int_equal(read(pairs[1][1], &byte, 1), -1);
    timer_list_close_idle(list, 0);
    assert_int_equal(read(pairs[0][1], &byte, 1), -1);
    assert_int_equal(read(pairs[1][1], &byte, 1), 0);
    assert_int_equal(read(pairs[2][1], &byte, 1), -1);
    timer_list_close_idle(list, 0);
    assert_int_equal(read(pairs[2][1], &byte, 1), 0);
    timer_list_close_idle(list, 0);
    assert_int_equal(read(pairs[0][1], &byte, 1), -1);
    for (int i = 0; i < 3; i++) {
        timer_leave(timers[i]);
        close(pairs[i][0]);
        close(pairs[i][1]);
    }
    timer_list_free(list);
}

// Two threads: one sleeps over and over, the other wakes without end; a sleep that lasts its whole
// time has lost a wake.
enum { ROUNDS = 2000 };

typedef struct Alarm {
    const Callback *callback;
    atomic_bool is_off;
} Alarm;

static void *ring(void *context) {
    Alarm *alarm = context;
    while (!atomic_load(&alarm->is_off))
        alarm->callback->wake(alarm->callback->context);
    return NULL;
}

TEST(no_wake_is_lost_between_two_threads) {
    Connection connection = {0};
    pthread_t thread;
    TimerList *list = timer_list_new(&calls, &changes);
    ConnectionTimer *timer = timer_take(list, -1);
    Alarm alarm = {.callback = timer_callback(timer)};
    (void)timer_was_woken(timer);
    assert_int_equal(pthread_create(&thread, NULL, ring, &alarm), 0);
    int slept = 0, lost = 0;
    for (int i = 0; i < ROUNDS && lost == 0; i++) {
        if (timer_sleep(timer, &connection, 5000)) {
            slept++;
            while (atomic_load(&connection.resumed) < slept) {
                run_in(list, 0);
                sched_yield();
            }
            lost += !timer_was_woken(timer);
        } else {
            timer_was_woken(timer);
        }
    }
    atomic_store(&alarm.is_off, true);
    pthread_join(thread, NULL);
    assert_int_equal(lost, 0);
    assert_int_equal(connection.suspended, slept);
    assert_int_equal(connection.resumed, slept);
    timer_list_free(list);
}
