// Whoever closes comes before those who enter after him, so that a steady stream of scenes does not
// keep him waiting.
#include "server/jobs/naming.h"

void naming_init(Naming *naming) {
    *naming = (Naming){.readers = 0};
    pthread_mutex_init(&naming->lock, NULL);
    pthread_cond_init(&naming->changed, NULL);
}

void naming_destroy(Naming *naming) {
    pthread_cond_destroy(&naming->changed);
    pthread_mutex_destroy(&naming->lock);
}

void naming_enter(Naming *naming) {
    pthread_mutex_lock(&naming->lock);
    while (naming->is_closed)
        pthread_cond_wait(&naming->changed, &naming->lock);
    naming->readers++;
    pthread_mutex_unlock(&naming->lock);
}

void naming_leave(Naming *naming) {
    pthread_mutex_lock(&naming->lock);
    if (--naming->readers == 0 && naming->is_closed)
        pthread_cond_broadcast(&naming->changed);
    pthread_mutex_unlock(&naming->lock);
}

void naming_close(Naming *naming) {
    pthread_mutex_lock(&naming->lock);
    while (naming->is_closed)
        pthread_cond_wait(&naming->changed, &naming->lock);
    naming->is_closed = true;
    while (naming->readers > 0)
        pthread_cond_wait(&naming->changed, &naming->lock);
    pthread_mutex_unlock(&naming->lock);
}

void naming_open(Naming *naming) {
    pthread_mutex_lock(&naming->lock);
    naming->is_closed = false;
    pthread_cond_broadcast(&naming->changed);
    pthread_mutex_unlock(&naming->lock);
}
