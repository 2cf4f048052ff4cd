#include "server/jobs/result_summary.h"

#include <stdlib.h>
#include <string.h>

// The texts stand behind the struct, in one block.
ResultSummary *result_summary_new(const ResultRow *row) {
    const char *const texts[] = {row->plan, row->summary, row->work, row->notes};
    size_t bytes = sizeof(ResultSummary);
    for (size_t i = 0; i < COUNT(texts); i++)
        bytes += texts[i] != NULL ? strlen(texts[i]) + 1 : 0;
    ResultSummary *head = malloc(bytes);
    if (head == NULL)
        return NULL;
    char *at = (char *)(head + 1);
    const char *copies[COUNT(texts)] = {NULL};
    for (size_t i = 0; i < COUNT(texts); i++) {
        if (texts[i] == NULL)
            continue;
        const size_t size = strlen(texts[i]) + 1;
        copies[i] = memcpy(at, texts[i], size);
        at += size;
    }
    head->plan = copies[0];
    head->summary = copies[1];
    head->work = copies[2];
    head->notes = copies[3];
    head->bytes = bytes;
    atomic_init(&head->refcount, 1);
    return head;
}

ResultSummary *result_summary_ref(ResultSummary *head) {
    if (head != NULL)
        atomic_fetch_add(&head->refcount, 1);
    return head;
}

void result_summary_unref(ResultSummary *head) {
    if (head != NULL && atomic_fetch_sub(&head->refcount, 1) == 1)
        free(head);
}
