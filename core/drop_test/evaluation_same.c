// Tests are compared by digests of what they say, each read once.
#include "core/drop_test/evaluation_same.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/base/canonical.h"

// FNV-1a; of a hundred tests no two that differ meet in 64 bits.
static void digest(void *context, const void *bytes, size_t size) {
    uint64_t *sum = context;
    const unsigned char *at = bytes;
    for (size_t i = 0; i < size; i++)
        *sum = (*sum ^ at[i]) * 1099511628211u;
}

static Status warn(const Measurement *here, const Measurement *before, Evaluation *evaluation) {
    char pointer[sizeof((Fault){0}.pointer)] = "", other[40] = "a test before it";
    if (here->number != COUNT_ABSENT)
        snprintf(pointer, sizeof pointer, "/measurements/%llu", (unsigned long long)here->number);
    if (before->number != COUNT_ABSENT)
        snprintf(other, sizeof other, "measurement %llu", (unsigned long long)before->number);
    return warnings_add(&evaluation->warnings, pointer,
                        "is %s once more, the same in every member, and both count: if it was "
                        "sent twice the standard errors come out too small; leave one out",
                        other);
}

Status evaluation_warn_same(const Measurement *tests, size_t count, Evaluation *evaluation) {
    uint64_t *sums = calloc(count + 1, sizeof *sums);
    bool *count_in = calloc(count + 1, sizeof *count_in);
    Status status = sums != NULL && count_in != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    for (size_t i = 0; status == STATUS_OK && i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row_counts(row))
            count_in[row->test] = true;
    }
    for (size_t i = 0; status == STATUS_OK && i < count; i++) {
        sums[i] = 14695981039346656037u;
        if (count_in[i])
            canonical_write(drop_test_fields, tests[i].test, digest, &sums[i]);
        for (size_t k = 0; k < i && count_in[i]; k++) {
            if (!count_in[k] || sums[k] != sums[i])
                continue;
            status = warn(&tests[i], &tests[k], evaluation);
            break;
        }
    }
    free(count_in);
    free(sums);
    return status;
}
