// What several structs hold at once: made once, never changed, gone with the last hold.
// Not a lock: whoever holds it may read it, from any thread. First member of such things
// (excite/record.h), carried by rows of FIELD_SHARED.
#ifndef CORE_BASE_REFCOUNT_H
#define CORE_BASE_REFCOUNT_H

#include <stdatomic.h>
#include <stddef.h>

typedef struct Shared {
    atomic_size_t holds; // 1 when it is made
    void (*free)(struct Shared *shared);
} Shared;

static inline Shared *shared_hold(Shared *shared) {
    if (shared != NULL)
        atomic_fetch_add(&shared->holds, 1);
    return shared;
}

static inline void shared_drop(Shared *shared) {
    if (shared != NULL && atomic_fetch_sub(&shared->holds, 1) == 1)
        shared->free(shared);
}

#endif
