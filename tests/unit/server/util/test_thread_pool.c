// Threads that cannot be started.
#define _GNU_SOURCE
#include <pthread.h>

#include "server/util/thread_pool.h"
#include "tests/support/test.h"

static void *nothing(void *item) {
    return item;
}

TEST(a_thread_that_cannot_be_started_is_named_with_the_reason) {
    static Problem problem;
    pthread_attr_t attributes, before;
    pthread_t thread;
    ThreadPool *pool;
    assert_int_equal(pthread_getattr_default_np(&before), 0);
    assert_int_equal(pthread_attr_init(&attributes), 0);
    assert_int_equal(pthread_attr_setstacksize(&attributes, (size_t)1 << 50),
                     0); // more than any address
    assert_int_equal(pthread_setattr_default_np(&attributes), 0);
    assert_int_equal(thread_start(&thread, nothing, NULL, "a worker", &problem), STATUS_NO_MEMORY);
    assert_string_equal(problem.detail,
                        "a worker cannot be started: too little memory or too many threads");
    assert_int_equal(thread_pool_open(3, &pool, NULL), STATUS_NO_MEMORY);
    assert_null(pool);
    assert_int_equal(pthread_setattr_default_np(&before), 0);
    assert_int_equal(thread_start(&thread, nothing, NULL, "a worker", &problem), STATUS_OK);
    assert_int_equal(pthread_join(thread, NULL), 0);
    pthread_attr_destroy(&attributes);
    pthread_attr_destroy(&before);
}
