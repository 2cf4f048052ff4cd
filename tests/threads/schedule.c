// LD_PRELOAD library that runs one thread of a program at a time: the one of the highest priority,
// and priorities are drawn from a seed in a mapped control file, anew at random points. A thread
// gives up its turn while it waits for a mutex, a condition, a descriptor or the disk; one that
// computes for long without any call loses it to the next in line. Now and then one is stopped for
// some milliseconds, so that others answer whole requests meanwhile.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum {
    MAX_THREADS = 256,
    PATIENCE_MS = 5, // then a turn is taken from a thread that makes no call
    RATES = 7,       // priorities change at every 2nd to every 128th point
    STOP_RATE = 512, // a thread stops at every 512th to every 4,096th
    STOP_RATES = 4,
    STOP_MS = 16, // at most
};

// The control file; tests/threads/schedules.py writes the seed and reads the counts.
typedef struct {
    _Atomic uint64_t seed;     // of the schedule; another one begins another schedule
    _Atomic uint64_t switches; // of this schedule: calls at which another thread was chosen
    _Atomic uint64_t digest;   // of the order of threads
} Control;

typedef enum { THREAD_FREE, THREAD_OUTSIDE, THREAD_READY, THREAD_RUNNING } ThreadState;

typedef struct {
    ThreadState state;
    uint64_t priority;
    pthread_cond_t turn;
} Thread;

static Control *control;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; // of what follows
static Thread threads[MAX_THREADS];
static size_t thread_count;
static Thread *running;
static uint64_t seed, chance, rate, stop_rate;
static _Thread_local Thread *self;

static struct {
    int (*mutex_lock)(pthread_mutex_t *);
    int (*mutex_trylock)(pthread_mutex_t *);
    int (*mutex_unlock)(pthread_mutex_t *);
    int (*cond_wait)(pthread_cond_t *, pthread_mutex_t *);
    int (*cond_timedwait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
    int (*cond_signal)(pthread_cond_t *);
    int (*cond_broadcast)(pthread_cond_t *);
} next;

// The C library of some machines has two versions of the functions of conditions, and the older one
// may be found first.
static void *next_find(const char *name) {
    void *found = dlvsym(RTLD_NEXT, name, "GLIBC_2.3.2");
    return found != NULL ? found : dlsym(RTLD_NEXT, name);
}

static void next_find_all(void) {
    if (next.cond_broadcast != NULL)
        return;
    *(void **)&next.mutex_lock = dlsym(RTLD_NEXT, "pthread_mutex_lock");
    *(void **)&next.mutex_trylock = dlsym(RTLD_NEXT, "pthread_mutex_trylock");
    *(void **)&next.mutex_unlock = dlsym(RTLD_NEXT, "pthread_mutex_unlock");
    *(void **)&next.cond_wait = next_find("pthread_cond_wait");
    *(void **)&next.cond_timedwait = next_find("pthread_cond_timedwait");
    *(void **)&next.cond_signal = next_find("pthread_cond_signal");
    *(void **)&next.cond_broadcast = next_find("pthread_cond_broadcast");
}

// Where the program's own code is. The locks of its libraries are no points: SQLite has some
// hundred for each query.
static uintptr_t code_begin, code_end;

static int code_find(struct dl_phdr_info *program, size_t size, void *unused) {
    (void)size, (void)unused;
    for (size_t i = 0; i < program->dlpi_phnum; i++) {
        const ElfW(Phdr) *part = &program->dlpi_phdr[i];
        if (part->p_type != PT_LOAD || (part->p_flags & PF_X) == 0)
            continue;
        code_begin = program->dlpi_addr + part->p_vaddr;
        code_end = code_begin + part->p_memsz;
    }
    return 1; // the program itself is the first
}

static bool is_own(const void *caller) {
    return (uintptr_t)caller >= code_begin && (uintptr_t)caller < code_end;
}

__attribute__((constructor)) static void schedule_start(void) {
    next_find_all();
    (void)dl_iterate_phdr(code_find, NULL);
    const char *file = getenv("IMPACTD_SCHEDULE");
    const int fd = file != NULL ? open(file, O_RDWR | O_CLOEXEC) : -1;
    if (fd < 0)
        return;
    void *map = mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    control = map == MAP_FAILED ? NULL : map;
}

// splitmix64
static uint64_t draw(void) {
    uint64_t z = chance += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

// The slot of the calling thread. NULL if there are too many: it runs freely.
static Thread *thread_self(void) {
    if (self != NULL)
        return self;
    for (size_t i = 0; i < MAX_THREADS; i++)
        if (threads[i].state == THREAD_FREE) {
            self = &threads[i];
            if (i == thread_count) {
                pthread_condattr_t monotonic;
                pthread_condattr_init(&monotonic);
                pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
                pthread_cond_init(&self->turn, &monotonic);
                pthread_condattr_destroy(&monotonic);
                thread_count++;
            }
            self->state = THREAD_OUTSIDE;
            self->priority = draw();
            return self;
        }
    return NULL;
}

static void seed_read(void) {
    const uint64_t now = atomic_load(&control->seed);
    if (now == seed)
        return;
    seed = chance = now;
    rate = (uint64_t)2 << draw() % RATES;
    stop_rate = (uint64_t)STOP_RATE << draw() % STOP_RATES;
    for (size_t i = 0; i < thread_count; i++)
        threads[i].priority = draw();
}

static Thread *thread_first_ready(void) {
    Thread *first = NULL;
    for (size_t i = 0; i < thread_count; i++)
        if (threads[i].state == THREAD_READY &&
            (first == NULL || threads[i].priority > first->priority))
            first = &threads[i];
    return first;
}

static void turn_give(Thread *thread) {
    running = thread;
    if (thread == NULL)
        return;
    atomic_fetch_add(&control->switches, 1);
    atomic_store(&control->digest,
                 (atomic_load(&control->digest) ^ (uint64_t)(thread - threads)) * 0x100000001b3u);
    next.cond_signal(&thread->turn);
}

// Until the calling thread has its turn, or has waited for one that makes no call.
static void turn_wait(Thread *thread) {
    struct timespec end;
    clock_gettime(CLOCK_MONOTONIC, &end);
    end.tv_nsec += PATIENCE_MS * 1000000L;
    end.tv_sec += end.tv_nsec / 1000000000L;
    end.tv_nsec %= 1000000000L;
    thread->state = THREAD_READY;
    if (running == NULL)
        turn_give(thread_first_ready());
    while (running != thread)
        if (next.cond_timedwait(&thread->turn, &lock, &end) == ETIMEDOUT && running != thread)
            running = thread;
    thread->state = THREAD_RUNNING;
}

// With the lock held, which is released meanwhile.
static void thread_stop(Thread *thread) {
    const struct timespec time = {.tv_nsec = (long)(draw() % STOP_MS + 1) * 1000000L};
    thread->state = THREAD_OUTSIDE;
    if (running == thread)
        turn_give(thread_first_ready());
    next.mutex_unlock(&lock);
    clock_nanosleep(CLOCK_MONOTONIC, 0, &time, NULL);
    next.mutex_lock(&lock);
    turn_wait(thread);
}

// A call at which another thread may be chosen. errno stays.
static void point(void) {
    const int error = errno;
    if (control == NULL)
        return;
    next.mutex_lock(&lock);
    Thread *thread = thread_self();
    if (thread != NULL) {
        seed_read();
        if (draw() % rate == 0)
            thread->priority = draw();
        if (draw() % stop_rate == 0)
            thread_stop(thread);
        Thread *first = thread_first_ready();
        if (running == thread && first != NULL && first->priority > thread->priority)
            turn_give(first);
        if (running != thread)
            turn_wait(thread);
    }
    next.mutex_unlock(&lock);
    errno = error;
}

// The calling thread is going to wait for something else than its turn.
static void leave(ThreadState state) {
    if (control == NULL)
        return;
    next.mutex_lock(&lock);
    Thread *thread = thread_self();
    if (thread != NULL) {
        thread->state = state;
        if (running == thread)
            turn_give(thread_first_ready());
    }
    next.mutex_unlock(&lock);
}

static void enter(void) {
    const int error = errno;
    if (control == NULL)
        return;
    next.mutex_lock(&lock);
    Thread *thread = thread_self();
    if (thread != NULL)
        turn_wait(thread);
    next.mutex_unlock(&lock);
    errno = error;
}

int pthread_mutex_lock(pthread_mutex_t *mutex) {
    next_find_all();
    if (is_own(__builtin_return_address(0)))
        point();
    int code = next.mutex_trylock(mutex);
    if (code != EBUSY)
        return code;
    leave(THREAD_OUTSIDE);
    code = next.mutex_lock(mutex);
    enter();
    return code;
}

int pthread_mutex_unlock(pthread_mutex_t *mutex) {
    next_find_all();
    const int code = next.mutex_unlock(mutex);
    if (is_own(__builtin_return_address(0)))
        point();
    return code;
}

int pthread_cond_wait(pthread_cond_t *condition, pthread_mutex_t *mutex) {
    next_find_all();
    leave(THREAD_OUTSIDE);
    const int code = next.cond_wait(condition, mutex);
    enter();
    return code;
}

int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex,
                           const struct timespec *end) {
    next_find_all();
    leave(THREAD_OUTSIDE);
    const int code = next.cond_timedwait(condition, mutex, end);
    enter();
    return code;
}

int pthread_cond_signal(pthread_cond_t *condition) {
    next_find_all();
    point();
    return next.cond_signal(condition);
}

int pthread_cond_broadcast(pthread_cond_t *condition) {
    next_find_all();
    point();
    return next.cond_broadcast(condition);
}

typedef struct {
    void *(*run)(void *);
    void *context;
} Start;

static void *thread_main(void *context) {
    const Start start = *(Start *)context;
    free(context);
    point();
    void *result = start.run(start.context);
    leave(THREAD_FREE);
    return result;
}

#define NEXT(name)                                                                                 \
    static __typeof__(name) *follows;                                                              \
    if (follows == NULL)                                                                           \
    *(void **)&follows = dlsym(RTLD_NEXT, #name)

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                   void *context) {
    NEXT(pthread_create);
    Start *start = malloc(sizeof *start);
    if (start == NULL)
        return EAGAIN;
    *start = (Start){run, context};
    const int code = follows(thread, attributes, thread_main, start);
    if (code != 0)
        free(start);
    point();
    return code;
}

// Calls that wait: others have their turns meanwhile.
#define WAITS(type, name, arguments, values)                                                       \
    type name arguments {                                                                          \
        NEXT(name);                                                                                \
        leave(THREAD_OUTSIDE);                                                                     \
        const type result = follows values;                                                        \
        enter();                                                                                   \
        return result;                                                                             \
    }
WAITS(int, pthread_join, (pthread_t thread, void **result_of), (thread, result_of))
WAITS(int, poll, (struct pollfd * events, nfds_t count, int timeout), (events, count, timeout))
WAITS(int, epoll_wait, (int fd, struct epoll_event *events, int count, int timeout),
      (fd, events, count, timeout))
WAITS(int, sigwaitinfo, (const sigset_t *signals, siginfo_t *signal), (signals, signal))
WAITS(int, nanosleep, (const struct timespec *time, struct timespec *rest), (time, rest))
WAITS(int, usleep, (useconds_t time), (time))
WAITS(int, fsync, (int fd), (fd))
WAITS(int, fdatasync, (int fd), (fd))

// Calls that do not wait, and that another thread may notice.
#define POINT(type, name, arguments, values)                                                       \
    type name arguments {                                                                          \
        NEXT(name);                                                                                \
        point();                                                                                   \
        return follows values;                                                                     \
    }
POINT(ssize_t, write, (int fd, const void *bytes, size_t size), (fd, bytes, size))
POINT(ssize_t, recv, (int fd, void *bytes, size_t size, int flags), (fd, bytes, size, flags))
POINT(ssize_t, send, (int fd, const void *bytes, size_t size, int flags), (fd, bytes, size, flags))
POINT(ssize_t, sendmsg, (int fd, const struct msghdr *message, int flags), (fd, message, flags))
POINT(ssize_t, pread64, (int fd, void *bytes, size_t size, off_t offset), (fd, bytes, size, offset))
POINT(ssize_t, pwrite64, (int fd, const void *bytes, size_t size, off_t offset),
      (fd, bytes, size, offset))
