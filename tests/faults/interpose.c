// LD_PRELOAD library for fault injection: fails the N-th allocation or file call below one folder,
// as a mapped control file says.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <link.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <unistd.h>
#include <unwind.h>

// The bits of Control.calls.
enum {
    CALL_ALLOCATE,
    CALL_OPEN,
    CALL_READ,
    CALL_WRITE,
    CALL_SYNC,
    CALL_TRUNCATE,
    CALL_MAP,
    CALL_RENAME,
    CALL_UNLINK,
    CALL_RESERVE,
};

enum { MAX_FILES = 4096, MAX_STACKS = 1 << 16 };

// The control file; tests/faults/control.py writes it. Nothing here allocates.
typedef struct {
    _Atomic uint64_t n;            // the call that fails, from 1 on; 0: none, they are only counted
    _Atomic uint64_t count;        // calls since `calls` was set
    _Atomic uint64_t failed;       // calls of these that failed
    _Atomic uint32_t calls;        // a bit for each kind that is counted; 0: off
    _Atomic uint32_t is_permanent; // all calls from the n-th on fail
    _Atomic int32_t error;         // errno of a failing file call; 0: it reads or writes half
    _Atomic uint32_t lists_stacks; // allocations add their call stack to `stacks`
    _Atomic uint64_t stack; // not 0: allocations are counted from the first with this call stack on
    _Atomic uint64_t stacks[MAX_STACKS]; // hash table; 0: a free place
} Control;

static Control *control;
static char folder[PATH_MAX];
static size_t folder_length;
static _Atomic bool is_inside[MAX_FILES]; // by descriptor

// Code of libraries that abort or crash when an allocation of theirs fails, by themselves: these
// are left out.
static const char *const fragile[] = {"libfftw3", "libsundials", "libnlopt", "liblapack",
                                      "libblas",  "libopenblas", "libtasn1", "libgmp"};
enum { FRAGILE = sizeof fragile / sizeof *fragile, MAX_RANGES = 64 };
static struct { uintptr_t from, to; } ranges[MAX_RANGES];
static size_t range_count;

// The allocator below: the address sanitizer's, if the program has it.
extern void *__interceptor_malloc(size_t) __attribute__((weak));
extern void *__interceptor_calloc(size_t, size_t) __attribute__((weak));
extern void *__interceptor_realloc(void *, size_t) __attribute__((weak));
extern int __interceptor_posix_memalign(void **, size_t, size_t) __attribute__((weak));
extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);

static int ranges_add(struct dl_phdr_info *library, size_t size, void *unused) {
    (void)size, (void)unused;
    for (size_t i = 0; i < FRAGILE; i++)
        for (size_t k = 0;
             strstr(library->dlpi_name, fragile[i]) != NULL && k < library->dlpi_phnum; k++) {
            const ElfW(Phdr) *part = &library->dlpi_phdr[k];
            if (part->p_type != PT_LOAD || (part->p_flags & PF_X) == 0 || range_count == MAX_RANGES)
                continue;
            ranges[range_count].from = library->dlpi_addr + part->p_vaddr;
            ranges[range_count].to = ranges[range_count].from + part->p_memsz;
            range_count++;
        }
    return 0;
}

__attribute__((constructor)) static void interpose_start(void) {
    const char *file = getenv("IMPACTD_FAULTS"), *below = getenv("IMPACTD_FAULTS_BELOW");
    if (file == NULL || below == NULL || strlen(below) >= sizeof folder)
        return;
    int fd = open(file, O_RDWR | O_CLOEXEC);
    if (fd < 0)
        return;
    void *map = mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    strcpy(folder, below);
    folder_length = strlen(folder);
    (void)dl_iterate_phdr(ranges_add, NULL);
    control = map == MAP_FAILED ? NULL : map;
}

static uint64_t hash_add(uint64_t hash, uint64_t number) {
    return (hash ^ number) * 0x100000001B3 ^ hash >> 29;
}

// An address counts from the start of its library, so that it is the same in each run.
static _Unwind_Reason_Code stack_add(struct _Unwind_Context *frame, void *hash) {
    uint64_t address = _Unwind_GetIP(frame);
    struct dl_find_object library;
    if (_dl_find_object((void *)address, &library) == 0) {
        const struct link_map *map = library.dlfo_link_map;
        *(uint64_t *)hash = hash_add(hash_add(*(uint64_t *)hash, address - map->l_addr),
                                     (uintptr_t)map->l_ld - map->l_addr);
    }
    return _URC_NO_REASON;
}

static uint64_t stack_hash(void) {
    uint64_t hash = 0xCBF29CE484222325;
    (void)_Unwind_Backtrace(stack_add, &hash);
    return hash != 0 ? hash : 1;
}

static void stacks_add(uint64_t stack) {
    for (uint64_t i = stack, tried = 0; tried < MAX_STACKS; i++, tried++) {
        uint64_t there = 0;
        if (atomic_compare_exchange_strong(&control->stacks[i % MAX_STACKS], &there, stack) ||
            there == stack)
            return;
    }
}

static bool address_is_fragile(uintptr_t address) {
    for (size_t i = 0; i < range_count; i++)
        if (address >= ranges[i].from && address < ranges[i].to)
            return true;
    return false;
}

typedef struct {
    uintptr_t allocator; // an address in what called malloc
    bool is_passed, is_fragile;
} Caller;

static _Unwind_Reason_Code caller_find(struct _Unwind_Context *frame, void *context) {
    Caller *caller = context;
    const uintptr_t address = _Unwind_GetIP(frame);
    if (caller->is_passed) {
        caller->is_fragile = address_is_fragile(address);
        return _URC_END_OF_STACK;
    }
    caller->is_passed = address == caller->allocator;
    return _URC_NO_REASON;
}

// GnuTLS allocates for GMP, which has no answer to a failure: GnuTLS aborts.
static bool is_for_fragile(uintptr_t allocator) {
    Caller caller = {.allocator = allocator};
    (void)_Unwind_Backtrace(caller_find, &caller);
    return caller.is_fragile;
}

// `allocator` is what called malloc, 0 for a call of files.
static bool call_fails(unsigned call, uintptr_t allocator) {
    if (control == NULL || (atomic_load(&control->calls) & 1u << call) == 0)
        return false;
    uint64_t awaited = atomic_load(&control->count) == 0 ? atomic_load(&control->stack) : 0;
    bool is_listed = atomic_load(&control->lists_stacks) != 0;
    if (call == CALL_ALLOCATE && (is_listed || awaited != 0)) {
        uint64_t stack = stack_hash();
        if (is_listed)
            stacks_add(stack);
        if (awaited != 0 && stack != awaited)
            return false;
    }
    uint64_t number = atomic_fetch_add(&control->count, 1) + 1, n = atomic_load(&control->n);
    bool fails = n > 0 && (number == n || (number > n && atomic_load(&control->is_permanent)));
    if (fails && allocator != 0)
        fails = !is_for_fragile(allocator);
    if (fails)
        atomic_fetch_add(&control->failed, 1);
    return fails;
}

// The address sanitizer asks for each thread's stack and ends the process where that fails.
static __thread bool is_of_sanitizer __attribute__((tls_model("initial-exec")));

static bool allocation_fails(const void *caller) {
    if (is_of_sanitizer || address_is_fragile((uintptr_t)caller))
        return false;
    if (!call_fails(CALL_ALLOCATE, (uintptr_t)caller))
        return false;
    errno = ENOMEM;
    return true;
}

void *malloc(size_t size) {
    if (allocation_fails(__builtin_return_address(0)))
        return NULL;
    return __interceptor_malloc != NULL ? __interceptor_malloc(size) : __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
    if (allocation_fails(__builtin_return_address(0)))
        return NULL;
    return __interceptor_calloc != NULL ? __interceptor_calloc(count, size)
                                        : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) {
    if (size > 0 && allocation_fails(__builtin_return_address(0)))
        return NULL;
    return __interceptor_realloc != NULL ? __interceptor_realloc(old, size)
                                         : __libc_realloc(old, size);
}

static void *aligned(size_t alignment, size_t size) {
    void *memory = NULL;
    if (__interceptor_posix_memalign == NULL)
        return __libc_memalign(alignment, size);
    return __interceptor_posix_memalign(&memory, alignment, size) == 0 ? memory : NULL;
}

int posix_memalign(void **memory, size_t alignment, size_t size) {
    if (allocation_fails(__builtin_return_address(0)))
        return ENOMEM;
    *memory = aligned(alignment, size);
    return *memory == NULL ? ENOMEM : 0;
}

#define ALIGNED(name)                                                                              \
    void *name(size_t alignment, size_t size) {                                                    \
        if (allocation_fails(__builtin_return_address(0)))                                         \
            return NULL;                                                                           \
        return aligned(alignment, size);                                                           \
    }
ALIGNED(memalign)
ALIGNED(aligned_alloc)

// The next definition of a function: the sanitizer's or the library's.
#define NEXT(name)                                                                                 \
    static __typeof__(name) *next;                                                                 \
    if (next == NULL)                                                                              \
    *(void **)&next = dlsym(RTLD_NEXT, #name)

int pthread_getattr_np(pthread_t thread, pthread_attr_t *attributes) {
    NEXT(pthread_getattr_np);
    is_of_sanitizer = true;
    int code = next(thread, attributes);
    is_of_sanitizer = false;
    return code;
}

static bool file_fails(unsigned call) {
    if (!call_fails(call, 0))
        return false;
    errno = atomic_load(&control->error);
    return true;
}

static bool path_is_inside(int at, const char *path) {
    if (path[0] != '/')
        return at >= 0 && at < MAX_FILES && is_inside[at];
    return folder_length > 0 && strncmp(path, folder, folder_length) == 0;
}

static bool fd_is_inside(int fd) {
    return fd >= 0 && fd < MAX_FILES && is_inside[fd];
}

static int opened(int fd, bool inside) {
    if (fd >= 0 && fd < MAX_FILES)
        is_inside[fd] = inside;
    return fd;
}

#define OPEN(name, at, values, ...)                                                                \
    int name(__VA_ARGS__, ...) {                                                                   \
        NEXT(name);                                                                                \
        va_list more;                                                                              \
        va_start(more, flags);                                                                     \
        mode_t mode = flags & (O_CREAT | (O_TMPFILE & ~O_DIRECTORY)) ? va_arg(more, mode_t) : 0;   \
        va_end(more);                                                                              \
        bool inside = path_is_inside(at, path);                                                    \
        return inside && file_fails(CALL_OPEN) ? -1 : opened(next values, inside);                 \
    }
OPEN(open, -1, (path, flags, mode), const char *path, int flags)
OPEN(open64, -1, (path, flags, mode), const char *path, int flags)
OPEN(openat, at, (at, path, flags, mode), int at, const char *path, int flags)
OPEN(openat64, at, (at, path, flags, mode), int at, const char *path, int flags)

int mkstemp(char *path) {
    NEXT(mkstemp);
    bool inside = path_is_inside(-1, path);
    return inside && file_fails(CALL_OPEN) ? -1 : opened(next(path), inside);
}

int close(int fd) {
    NEXT(close);
    opened(fd, false);
    return next(fd);
}

// A failing call of `size` bytes: -1 with errno, or half of them.
#define TRANSFER(fd, call, size, half)                                                             \
    if (fd_is_inside(fd) && file_fails(call))                                                      \
    return errno != 0 || (size) < 2 ? -1 : (half)

ssize_t read(int fd, void *bytes, size_t size) {
    NEXT(read);
    TRANSFER(fd, CALL_READ, size, next(fd, bytes, size / 2));
    return next(fd, bytes, size);
}

ssize_t write(int fd, const void *bytes, size_t size) {
    NEXT(write);
    TRANSFER(fd, CALL_WRITE, size, next(fd, bytes, size / 2));
    return next(fd, bytes, size);
}

#define AT_OFFSET(name, constant, call)                                                            \
    ssize_t name(int fd, constant void *bytes, size_t size, off_t offset) {                        \
        NEXT(name);                                                                                \
        TRANSFER(fd, call, size, next(fd, bytes, size / 2, offset));                               \
        return next(fd, bytes, size, offset);                                                      \
    }
AT_OFFSET(pread, , CALL_READ)
AT_OFFSET(pread64, , CALL_READ)
AT_OFFSET(pwrite, const, CALL_WRITE)
AT_OFFSET(pwrite64, const, CALL_WRITE)

// Calls of a descriptor that have no half: a short count leaves them as they are.
#define OF_FD(name, call, arguments, values)                                                       \
    int name arguments {                                                                           \
        NEXT(name);                                                                                \
        return fd_is_inside(fd) && atomic_load(&control->error) != 0 && file_fails(call)           \
                   ? -1                                                                            \
                   : next values;                                                                  \
    }
OF_FD(fsync, CALL_SYNC, (int fd), (fd))
OF_FD(fdatasync, CALL_SYNC, (int fd), (fd))
OF_FD(ftruncate, CALL_TRUNCATE, (int fd, off_t size), (fd, size))
OF_FD(ftruncate64, CALL_TRUNCATE, (int fd, off_t size), (fd, size))
OF_FD(fallocate, CALL_RESERVE, (int fd, int mode, off_t from, off_t size), (fd, mode, from, size))
OF_FD(fallocate64, CALL_RESERVE, (int fd, int mode, off_t from, off_t size), (fd, mode, from, size))

#define MAP(name)                                                                                  \
    void *name(void *at, size_t size, int protection, int flags, int fd, off_t offset) {           \
        NEXT(name);                                                                                \
        return fd_is_inside(fd) && file_fails(CALL_MAP)                                            \
                   ? MAP_FAILED                                                                    \
                   : next(at, size, protection, flags, fd, offset);                                \
    }
MAP(mmap)
MAP(mmap64)

int rename(const char *from, const char *to) {
    NEXT(rename);
    return path_is_inside(-1, to) && file_fails(CALL_RENAME) ? -1 : next(from, to);
}

int unlink(const char *path) {
    NEXT(unlink);
    return path_is_inside(-1, path) && file_fails(CALL_UNLINK) ? -1 : next(path);
}

int unlinkat(int at, const char *path, int flags) {
    NEXT(unlinkat);
    return path_is_inside(at, path) && file_fails(CALL_UNLINK) ? -1 : next(at, path, flags);
}
