#include "server/util/hashmap.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#include "core/base/status.h"
#include "server/util/thread_pool.h"
#include "tests/support/test.h"

typedef struct Item {
    LruEntry cached;
    char key[16];
    int released, evicted;
} Item;

static void release(LruEntry *entry, void *owner, bool is_evicted) {
    Item *item = (Item *)(void *)entry;
    item->released++;
    item->evicted += is_evicted;
    ++*(int *)owner;
}

static void add(Lru *lru, Item *item, const char *key, size_t bytes) {
    *item = (Item){.cached = {.bytes = bytes}};
    snprintf(item->key, sizeof item->key, "%s", key);
    item->cached.indexed.key = item->key;
    lru_add(lru, &item->cached);
}

TEST(the_least_recently_used_entry_is_evicted_first) {
    int released = 0;
    Item a, b, c, d, big;
    Lru *lru = lru_new(100, release, &released);
    add(lru, &a, "a", 40);
    add(lru, &b, "b", 40);
    assert_ptr_equal(lru_find(lru, "a"), &a);
    assert_ptr_equal(lru_peek(lru, "b"), &b); // is no use
    add(lru, &c, "c", 40);
    assert_int_equal(b.evicted, 1);
    assert_null(lru_find(lru, "b"));
    add(lru, &d, "a", 10); // replaces
    assert_int_equal(a.released, 1);
    assert_int_equal(a.evicted, 0);
    assert_ptr_equal(lru_find(lru, "a"), &d);
    LruStats stats = lru_stats(lru);
    assert_int_equal(stats.count, 2);
    assert_int_equal(stats.bytes, 50);
    assert_int_equal(stats.hits, 2);
    assert_int_equal(stats.misses, 1);
    assert_int_equal(stats.evictions, 1);
    add(lru, &big, "big", 1000); // evicts all others, not itself
    assert_int_equal(lru_stats(lru).count, 1);
    lru_remove(lru, &big.cached);
    assert_int_equal(lru_stats(lru).bytes, 0);
    add(lru, &a, "a", 1);
    lru_free(lru);
    assert_int_equal(a.released, 1);
    assert_int_equal(released, 6);
}

TEST(a_map_grows_and_finds_all_its_entries) {
    enum { COUNT_OF = 5000 };
    static Item items[COUNT_OF];
    HashMap *map = hashmap_new();
    for (int i = 0; i < COUNT_OF; i++) {
        snprintf(items[i].key, sizeof items[i].key, "k%d", i);
        items[i].cached.indexed.key = items[i].key;
        hashmap_add(map, &items[i].cached.indexed);
    }
    for (int i = 0; i < COUNT_OF; i++)
        assert_ptr_equal(hashmap_find(map, items[i].key), &items[i]);
    for (int i = 0; i < COUNT_OF; i += 2)
        hashmap_remove(map, &items[i].cached.indexed);
    hashmap_remove(map, &items[0].cached.indexed); // is gone already
    for (int i = 0; i < COUNT_OF; i++)
        assert_ptr_equal(hashmap_find(map, items[i].key), i % 2 == 0 ? NULL : &items[i]);
    size_t left = 0;
    for (HashMapEntry *any; (any = hashmap_any(map)) != NULL; left++)
        hashmap_remove(map, any);
    assert_int_equal(left, COUNT_OF / 2);
    hashmap_free(map);
}

typedef struct Job {
    WorkItem item;
    atomic_int *done;
    pthread_mutex_t *gate;
} Job;

static void run(WorkItem *item) {
    Job *job = (Job *)(void *)item;
    pthread_mutex_lock(job->gate);
    pthread_mutex_unlock(job->gate);
    atomic_fetch_add(job->done, 1);
}

TEST(a_pool_runs_everything) {
    atomic_int done = 0;
    pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
    Job jobs[6];
    ThreadPool *pool;
    assert_int_equal(thread_pool_open(2, &pool, NULL), STATUS_OK);
    for (size_t i = 0; i < COUNT(jobs); i++)
        jobs[i] = (Job){{NULL, run}, &done, &gate};
    pthread_mutex_lock(&gate);
    for (size_t i = 0; i < COUNT(jobs); i++)
        thread_pool_add(pool, &jobs[i].item);
    pthread_mutex_unlock(&gate);
    thread_pool_close(pool);
    assert_int_equal(atomic_load(&done), COUNT(jobs));
}
