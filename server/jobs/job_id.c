#include "server/jobs/job_id.h"

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "server/jobs/job.h"
#include "server/util/clock.h"

const char *const job_state_names[] = {"accepted", "running",   "successful",
                                       "failed",   "dismissed", NULL};

bool job_state_is_final(int state) {
    return state != JOB_ACCEPTED && state != JOB_RUNNING;
}

static int64_t next_us(void) {
    static atomic_int_fast64_t last;
    const int64_t now = clock_unix_us();
    int64_t before = atomic_load(&last), next;
    do {
        next = now > before ? now : before + 1;
    } while (!atomic_compare_exchange_weak(&last, &before, next));
    return next;
}

// Each thread draws for many ids at once; a number is used once.
static bool draw(uint64_t *secret) {
    enum { DRAWN = 32 }; // 256 bytes come whole
    static _Thread_local uint64_t drawn[DRAWN];
    static _Thread_local size_t left;
    if (left == 0) {
        if (getrandom(drawn, sizeof drawn, 0) != (ssize_t)sizeof drawn)
            return false;
        left = DRAWN;
    }
    *secret = drawn[--left];
    return true;
}

bool job_id_make(char id[40]) {
    static const char digits[] = "0123456789abcdef";
    uint64_t secret;
    if (!draw(&secret))
        return false;
    uint64_t time = (uint64_t)next_us();
    id[0] = 'j';
    id[1] = '-';
    for (int i = 15; i >= 2; i--, time >>= 4)
        id[i] = digits[time & 15];
    for (int i = 31; i >= 16; i--, secret >>= 4)
        id[i] = digits[secret & 15];
    id[JOB_ID_LENGTH] = '\0';
    return true;
}

int64_t job_id_unix_ms(const char *id) {
    if (strncmp(id, "j-", 2) != 0 || strlen(id) != JOB_ID_LENGTH ||
        strspn(id + 2, "0123456789abcdef") != JOB_ID_LENGTH - 2)
        return -1;
    char time[15];
    memcpy(time, id + 2, 14);
    time[14] = '\0';
    return strtoll(time, NULL, 16) / 1000;
}
