// Seats: no wake-up is lost, nobody sleeps longer than asked, late wakes do no harm, slow senders
// are cut off.
#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/http/timer.h"
#include "server/util/clock.h"

// Stands for a connection: counts what the TimerWheel does to it.
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

static const TimerCallbacks calls = {suspend, resume};

static void pause_ms(long ms) {
    const struct timespec time = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

// Waits until it was resumed `count` times; the time it took [ms], or -1 after 5 s.
static double wait_resumed(Connection *connection, int count) {
    const int64_t begin = clock_monotonic_ns();
    while (atomic_load(&connection->resumed) < count) {
        if (clock_monotonic_ns() - begin > 5000000000)
            return -1;
        pause_ms(1);
    }
    return 1e-6 * (double)(clock_monotonic_ns() - begin);
}

static void a_wake_before_the_sleep_is_not_lost(void **state) {
    (void)state;
    TimerWheel *wheel;
    Connection connection = {0};
    assert_int_equal(timer_wheel_open(&calls, &wheel, NULL), STATUS_OK);
    ConnectionTimer *timer = timer_take(wheel, -1);
    const Callback *callback = timer_callback(timer);
    timer_begin(timer);
    callback->wake(callback->context);
    assert_false(timer_sleep(timer, &connection, 1000));
    assert_true(timer_was_woken(timer));
    assert_false(timer_was_woken(timer));
    assert_int_equal(connection.suspended, 0);
    timer_wheel_close(wheel);
}

static void time_ends_a_sleep_and_a_wake_ends_it_sooner(void **state) {
    (void)state;
    TimerWheel *wheel;
    Connection connection = {0};
    assert_int_equal(timer_wheel_open(&calls, &wheel, NULL), STATUS_OK);
    ConnectionTimer *timer = timer_take(wheel, -1);
    timer_begin(timer);
    assert_true(timer_sleep(timer, &connection, 50));
    const double took = wait_resumed(&connection, 1);
    assert_true(took >= 40 && took < 2000);
    assert_false(timer_was_woken(timer));

    assert_true(timer_sleep(timer, &connection, 60000));
    const Callback *callback = timer_callback(timer);
    callback->wake(callback->context);
    callback->wake(callback->context);
    assert_true(wait_resumed(&connection, 2) < 2000);
    assert_true(timer_was_woken(timer));
    assert_int_equal(connection.resumed, 2); // the second call found nobody asleep
    timer_wheel_close(wheel);
}

static void an_earlier_time_overtakes_a_later_one(void **state) {
    (void)state;
    TimerWheel *wheel;
    Connection late = {0}, early = {0};
    assert_int_equal(timer_wheel_open(&calls, &wheel, NULL), STATUS_OK);
    ConnectionTimer *first = timer_take(wheel, -1), *second = timer_take(wheel, -1);
    timer_begin(first);
    timer_begin(second);
    assert_true(timer_sleep(first, &late, 60000));
    pause_ms(20);
    assert_true(timer_sleep(second, &early, 30));
    const double took = wait_resumed(&early, 1);
    assert_true(took >= 0 && took < 2000);
    assert_int_equal(late.resumed, 0);
    timer_wheel_wake_all(wheel);
    assert_int_equal(late.resumed, 1);
    assert_false(timer_sleep(first, &late, 60000));
    assert_true(timer_wheel_is_closing(wheel));
    timer_wheel_close(wheel);
}

static void a_late_wake_of_a_left_seat_does_no_harm(void **state) {
    (void)state;
    TimerWheel *wheel;
    Connection next = {0};
    assert_int_equal(timer_wheel_open(&calls, &wheel, NULL), STATUS_OK);
    ConnectionTimer *timer = timer_take(wheel, -1);
    const Callback *callback = timer_callback(timer);
    timer_leave(timer);
    callback->wake(callback->context);
    ConnectionTimer *again = timer_take(wheel, -1);
    assert_ptr_equal(again, timer);
    timer_begin(again);
    assert_true(timer_sleep(again, &next, 60000));
    callback->wake(callback->context); // wakes the next one, who looks and sleeps on
    assert_int_equal(next.resumed, 1);
    assert_true(timer_was_woken(again));
    assert_true(timer_sleep(again, &next, 60000));
    timer_wheel_wake_all(wheel);
    timer_wheel_close(wheel);
}

static void a_peer_that_is_too_slow_is_shut_down(void **state) {
    (void)state;
    TimerWheel *wheel;
    int pair[2];
    char byte;
    assert_int_equal(timer_wheel_open(&calls, &wheel, NULL), STATUS_OK);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    ConnectionTimer *timer = timer_take(wheel, pair[0]);
    timer_limit(timer, 10000);
    timer_limit(timer, 0);
    timer_limit(timer, 30);
    assert_int_equal(read(pair[1], &byte, 1), 0); // the other end sees it closed
    timer_leave(timer);
    close(pair[0]);
    close(pair[1]);
    timer_wheel_close(wheel);
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

static void no_wake_is_lost_between_two_threads(void **state) {
    (void)state;
    TimerWheel *wheel;
    Connection connection = {0};
    pthread_t thread;
    assert_int_equal(timer_wheel_open(&calls, &wheel, NULL), STATUS_OK);
    ConnectionTimer *timer = timer_take(wheel, -1);
    Alarm alarm = {.callback = timer_callback(timer)};
    timer_begin(timer);
    assert_int_equal(pthread_create(&thread, NULL, ring, &alarm), 0);
    int slept = 0, lost = 0;
    for (int i = 0; i < ROUNDS && lost == 0; i++) {
        if (timer_sleep(timer, &connection, 5000)) {
            slept++;
            while (atomic_load(&connection.resumed) < slept)
                sched_yield();
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
    timer_wheel_close(wheel);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wake_before_the_sleep_is_not_lost),
        cmocka_unit_test(time_ends_a_sleep_and_a_wake_ends_it_sooner),
        cmocka_unit_test(an_earlier_time_overtakes_a_later_one),
        cmocka_unit_test(a_late_wake_of_a_left_seat_does_no_harm),
        cmocka_unit_test(a_peer_that_is_too_slow_is_shut_down),
        cmocka_unit_test(no_wake_is_lost_between_two_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
