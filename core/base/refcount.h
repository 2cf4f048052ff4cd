// Reference counting of immutable data that several structs share, from any thread. The first
// member of such a struct; a row of FIELD_REFCOUNT carries a reference.
#ifndef CORE_BASE_REFCOUNT_H
#define CORE_BASE_REFCOUNT_H

#include <stdatomic.h>
#include <stddef.h>

typedef struct Refcount {
    atomic_size_t count; // set to 1 by the creator
    void (*free)(struct Refcount *shared);
} Refcount;

// Adds a reference and returns `shared`. NULL is allowed.
static inline Refcount *refcount_ref(Refcount *shared) {
    if (shared != NULL)
        atomic_fetch_add(&shared->count, 1);
    return shared;
}

// Removes a reference; the last one frees `shared`. NULL is allowed.
static inline void refcount_unref(Refcount *shared) {
    if (shared != NULL && atomic_fetch_sub(&shared->count, 1) == 1)
        shared->free(shared);
}

#endif
