// Whole answers kept: found by target and packing, evicted by age, alive as long as they are held.
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/reply.h"
#include "server/http/response_cache.h"
#include "tests/support/test.h"

static const Route route = {.scope = "read"};

static atomic_int released;

static void release(void *body) {
    atomic_fetch_add(&released, 1);
    free(body);
}

static Reply fresh(const char *text, size_t size) {
    Reply reply;
    reply_default(&reply);
    char *body = calloc(1, size);
    snprintf(body, size, "%s", text);
    reply_borrow(&reply, 200, "text/plain", body, size);
    reply.release = release;
    reply.context = body;
    return reply;
}

static void put(ResponseCache *response_cache, const char *target, bool is_packed, const char *text,
                size_t size) {
    Reply reply = fresh(text, size);
    response_cache_put(response_cache, response_cache_age(response_cache), target, is_packed,
                       &route, &reply);
    assert_string_equal(reply.body, text);
    reply_clear(&reply);
}

static bool finds(ResponseCache *response_cache, const char *target, bool is_packed,
                  const char *text) {
    Reply reply;
    const Route *found;
    if (!response_cache_find(response_cache, target, is_packed, &reply, &found))
        return false;
    assert_string_equal(reply.body, text);
    assert_ptr_equal(found, &route);
    reply_clear(&reply);
    return true;
}

TEST(an_answer_is_found_by_target_and_packing) {
    ResponseCache *response_cache = response_cache_new(1 << 20);
    put(response_cache, "/a", false, "plain", 100);
    put(response_cache, "/a", true, "packed", 100);
    assert_true(finds(response_cache, "/a", false, "plain"));
    assert_true(finds(response_cache, "/a", true, "packed"));
    assert_false(finds(response_cache, "/a?x=1", false, ""));
    put(response_cache, "/a", false, "newer", 100);
    assert_true(finds(response_cache, "/a", false, "newer"));
    assert_int_equal(response_cache_stats(response_cache).count, 2);
    assert_int_equal(response_cache_stats(response_cache).hits, 3);
    assert_int_equal(response_cache_stats(response_cache).misses, 1);
    response_cache_free(response_cache);
}

TEST(the_longest_unused_goes_first_and_the_budget_holds) {
    ResponseCache *response_cache = response_cache_new(100000);
    put(response_cache, "/1", false, "1", 20000);
    put(response_cache, "/2", false, "2", 20000);
    put(response_cache, "/3", false, "3", 20000);
    put(response_cache, "/4", false, "4", 20000);
    assert_true(finds(response_cache, "/1", false, "1"));
    put(response_cache, "/5", false, "5", 20000);
    assert_false(finds(response_cache, "/2", false, ""));
    assert_true(finds(response_cache, "/1", false, "1"));
    assert_true(response_cache_stats(response_cache).bytes <= 100000);
    assert_int_equal(response_cache_stats(response_cache).evictions, 1);
    put(response_cache, "/large", false, "large", 26000); // above its share: stays its owner's
    assert_false(finds(response_cache, "/large", false, ""));
    response_cache_free(response_cache);
}

TEST(what_is_held_outlives_the_cache) {
    atomic_store(&released, 0);
    ResponseCache *response_cache = response_cache_new(1 << 20);
    Reply reply = fresh("held", 100);
    response_cache_put(response_cache, response_cache_age(response_cache), "/held", false, &route,
                       &reply);
    response_cache_clear(response_cache);
    assert_false(finds(response_cache, "/held", false, ""));
    response_cache_free(response_cache);
    assert_int_equal(released, 0);
    assert_string_equal(reply.body, "held");
    reply_clear(&reply);
    assert_int_equal(released, 1);
}

static void *ask_and_put(void *context) {
    ResponseCache *response_cache = context;
    for (int i = 0; i < 20000; i++) {
        char target[16];
        snprintf(target, sizeof target, "/%d", i * 7 % 50);
        if (!finds(response_cache, target, false, target))
            put(response_cache, target, false, target, 1000);
        if (i % 5000 == 4999)
            response_cache_clear(response_cache);
    }
    return NULL;
}

TEST(many_threads_share_it) {
    ResponseCache *response_cache = response_cache_new(20000);
    pthread_t threads[4];
    for (size_t i = 0; i < COUNT(threads); i++)
        assert_int_equal(pthread_create(&threads[i], NULL, ask_and_put, response_cache), 0);
    for (size_t i = 0; i < COUNT(threads); i++)
        pthread_join(threads[i], NULL);
    assert_true(response_cache_stats(response_cache).bytes <= 20000);
    response_cache_free(response_cache);
}

TEST(an_answer_that_is_too_large_is_told_from_one_for_which_memory_ran_out) {
    Reply reply = {.code = 0};
    Problem problem;
    Bytes bytes = {.most = 10};
    bytes_text(&bytes, "eleven bytes");
    problem_clear(&problem);
    assert_int_equal(reply_bytes(&reply, 200, "text/plain", &bytes, &problem), STATUS_LIMIT);
    bytes = (Bytes){.most = 10, .is_failed = true}; // as after a failed malloc
    problem_clear(&problem);
    assert_int_equal(reply_bytes(&reply, 201, "text/plain", &bytes, &problem), STATUS_NO_MEMORY);
    assert_non_null(strstr(problem.detail, "may have been stored"));
}
