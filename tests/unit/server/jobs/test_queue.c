// Whose turn it is.
#include <stdlib.h>

#include "server/jobs/queue.h"
#include "tests/support/test.h"

static QueueEntry *put(Queue *queue, QueueEntry *entry, const char *name, double seconds,
                       double now) {
    *entry = (QueueEntry){.seconds = seconds};
    queue_put(queue, entry, queue_client(queue, name), now);
    return entry;
}

TEST(equal_jobs_of_one_client_go_in_the_order_of_arrival) {
    Queue *queue = queue_new();
    QueueEntry at[100];
    for (size_t i = 0; i < 100; i++)
        put(queue, &at[i], "", 0.01, 5);
    assert_int_equal(queue_count(queue), 100);
    for (size_t i = 0; i < 100; i++)
        assert_ptr_equal(queue_take(queue, false), &at[i]);
    assert_null(queue_take(queue, false));
    assert_true(queue_seconds(queue) == 0);
    queue_free(queue);
}

TEST(the_quick_pass_the_slow_until_these_have_waited_long_enough) {
    Queue *queue = queue_new();
    QueueEntry slow, soon, late;
    put(queue, &slow, "", 2, 0);
    put(queue, &soon, "", 0.01, 19); // within ten times the 2 s
    put(queue, &late, "", 0.01, 21);
    assert_ptr_equal(queue_take(queue, false), &soon);
    assert_ptr_equal(queue_take(queue, false), &slow);
    assert_ptr_equal(queue_take(queue, false), &late);
    queue_free(queue);
}

TEST(clients_are_served_in_turn_however_much_one_of_them_sends) {
    Queue *queue = queue_new();
    QueueEntry many[50], few[3];
    for (size_t i = 0; i < 50; i++)
        put(queue, &many[i], "many", 0.01, 0);
    assert_ptr_equal(queue_take(queue, false), &many[0]);
    for (size_t i = 0; i < 3; i++)
        put(queue, &few[i], "few", 0.01, 1);
    for (size_t i = 0; i < 3; i++) {
        assert_ptr_equal(queue_take(queue, false), &few[i]);
        assert_ptr_equal(queue_take(queue, false), &many[i + 1]);
    }
    queue_free(queue);
}

TEST(a_turn_is_counted_in_time_not_in_jobs) {
    Queue *queue = queue_new();
    QueueEntry slow[2], quick[101];
    for (size_t i = 0; i < 2; i++)
        put(queue, &slow[i], "slow", 1, 0);
    for (size_t i = 0; i < 101; i++)
        put(queue, &quick[i], "quick", 0.01, 0);
    assert_ptr_equal(queue_take(queue, false), &slow[0]);
    for (size_t i = 0; i < 99; i++)
        assert_ptr_equal(queue_take(queue, false), &quick[i]);
    queue_free(queue);
}

TEST(turns_of_long_work_go_between_the_ordinary_jobs_of_their_client) {
    Queue *queue = queue_new();
    QueueEntry turn = {.seconds = 0.01, .is_turn = true}, jobs[20], other;
    for (size_t i = 0; i < 20; i++)
        put(queue, &jobs[i], "", 0.01, 100);
    QueueClient *client = queue_client(queue, "");
    queue_put(queue, &turn, client, 0);
    // The spare worker leaves them alone; the others take one of six.
    assert_ptr_equal(queue_take(queue, true), &jobs[0]);
    for (size_t i = 1; i < 5; i++)
        assert_ptr_equal(queue_take(queue, false), &jobs[i]);
    assert_ptr_equal(queue_take(queue, false), &turn);
    queue_put(queue, &turn, client, 0);
    // Another client has its share all the same.
    put(queue, &other, "other", 5, 1000);
    assert_ptr_equal(queue_take(queue, false), &other);
    for (size_t i = 5; i < 10; i++)
        assert_ptr_equal(queue_take(queue, false), &jobs[i]);
    assert_ptr_equal(queue_take(queue, false), &turn);
    for (size_t i = 10; i < 20; i++)
        assert_ptr_equal(queue_take(queue, false), &jobs[i]);
    queue_put(queue, &turn, client, 0);
    assert_null(queue_take(queue, true));
    assert_ptr_equal(queue_take(queue, false), &turn);
    assert_int_equal(queue_count(queue), 0);
    queue_free(queue);
}

TEST(nobody_saves_turns_up_by_being_away) {
    Queue *queue = queue_new();
    QueueEntry at[40], back[20];
    QueueEntry first;
    put(queue, &first, "away", 0.01, 0);
    assert_ptr_equal(queue_take(queue, false), &first);
    for (size_t i = 0; i < 40; i++)
        put(queue, &at[i], "busy", 1, 0);
    for (size_t i = 0; i < 20; i++)
        assert_ptr_equal(queue_take(queue, false), &at[i]);
    for (size_t i = 0; i < 20; i++)
        put(queue, &back[i], "away", 1, 0);
    // It begins where the others are, and does not catch up on 20 s.
    size_t of_away = 0;
    for (size_t i = 0; i < 10; i++) {
        const QueueEntry *entry = queue_take(queue, false);
        of_away += entry >= back && entry < back + 20;
    }
    assert_in_range(of_away, 5, 6);
    queue_free(queue);
}

TEST(the_kept_worker_takes_quick_ones_alone) {
    Queue *queue = queue_new();
    QueueEntry slow, quick, urgent = {.seconds = 9};
    put(queue, &slow, "a", 5, 0);
    assert_null(queue_take(queue, true));
    put(queue, &quick, "b", 0.01, 500);
    queue_push_front(queue, &urgent);
    assert_ptr_equal(queue_take(queue, true), &quick);
    assert_null(queue_take(queue, true));
    assert_ptr_equal(queue_take(queue, false), &urgent);
    assert_ptr_equal(queue_take(queue, false), &slow);
    queue_free(queue);
}

TEST(any_of_the_urgent_can_be_removed) {
    Queue *queue = queue_new();
    for (size_t gone = 0; gone < 3; gone++) {
        QueueEntry at[3] = {{.seconds = 9}, {.seconds = 9}, {.seconds = 9}};
        for (size_t i = 0; i < 3; i++)
            queue_push_front(queue, &at[i]);
        queue_remove(queue, &at[gone]);
        assert_null(queue_take(queue, true)); // none is quick
        for (size_t i = 0; i < 3; i++)
            if (i != gone)
                assert_ptr_equal(queue_take(queue, false), &at[i]);
        assert_int_equal(queue_count(queue), 0);
    }
    queue_free(queue);
}

TEST(what_others_want_too_moves_to_whoever_waits_less) {
    Queue *queue = queue_new();
    QueueEntry at[20];
    for (size_t i = 0; i < 20; i++)
        put(queue, &at[i], "many", 0.01, 0);
    queue_rebalance(queue, &at[15], queue_client(queue, "few"));
    assert_ptr_equal(queue_take(queue, false), &at[0]);
    assert_ptr_equal(queue_take(queue, false), &at[15]);
    queue_rebalance(queue, &at[15], queue_client(queue, "many")); // waits no more: nothing happens
    assert_int_equal(queue_count(queue), 18);
    queue_free(queue);
}

TEST(any_order_of_coming_and_going_keeps_the_ranks) {
    enum { COUNT_ = 2000 };
    Queue *queue = queue_new();
    QueueEntry *at = calloc(COUNT_, sizeof *at);
    uint32_t seed = 7;
    size_t waiting = 0;
    for (size_t i = 0; i < COUNT_; i++) {
        seed = seed * 1664525u + 1013904223u;
        put(queue, &at[i], "", (seed >> 8) % 7 == 0 ? 3 : 0.001 * ((seed >> 8) % 90), (double)i);
        waiting++;
        const size_t other = (seed >> 16) % (i + 1);
        if (seed % 3 == 0 && at[other].number != 0) {
            queue_remove(queue, &at[other]);
            queue_remove(queue, &at[other]); // once more does nothing
            waiting--;
        }
    }
    assert_int_equal(queue_count(queue), waiting);
    double last = -1;
    for (QueueEntry *entry; (entry = queue_take(queue, false)) != NULL; waiting--) {
        assert_true(entry->rank >= last);
        assert_int_equal(entry->number, 0);
        last = entry->rank;
    }
    assert_int_equal(waiting, 0);
    free(at);
    queue_free(queue);
}
