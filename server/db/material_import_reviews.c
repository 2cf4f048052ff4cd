// Reviews: those that are there come first and are the same, the others continue.
#include "server/db/material_import_context.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

typedef struct Reviews {
    MaterialReview *at;
    size_t count, room;
} Reviews;

static void reviews_clear(Reviews *reviews) {
    for (size_t i = 0; i < reviews->count; i++)
        row_clear(material_review_columns, &reviews->at[i], sizeof *reviews->at);
    free(reviews->at);
    *reviews = (Reviews){0};
}

static Status load_reviews(Sqlite *database, const char *slug, uint64_t revision, Reviews *reviews,
                           Problem *problem) {
    static const char sql[] =
        "SELECT v.* FROM materials m JOIN material_reviews v ON v.material = m.number "
        "WHERE m.slug = :slug AND v.revision = :number ORDER BY v.number";
    const ImportKey key = {(char *)slug, revision};
    Statement *statement;
    bool has_row = true;
    Status status = statement_begin(database, sql, import_key_columns, &key, &statement, problem);
    while (status == STATUS_OK && has_row) {
        status = statement_step(statement, &has_row, problem);
        if (status != STATUS_OK || !has_row)
            break;
        if (reviews->count == reviews->room) {
            reviews->room = reviews->room > 0 ? 2 * reviews->room : 4;
            MaterialReview *grown = realloc(reviews->at, reviews->room * sizeof *grown);
            if (grown == NULL) {
                status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the reviews");
                break;
            }
            reviews->at = grown;
        }
        MaterialReview *review = &reviews->at[reviews->count];
        *review = (MaterialReview){0};
        status = row_read(statement, material_review_columns, review, problem);
        reviews->count += status == STATUS_OK;
    }
    statement_end(statement);
    return status;
}

static bool is_review(const ImportReview *ours, const MaterialReview *there) {
    const MaterialReview *review = &ours->review;
    return text_same(review->status, there->status) && text_same(review->reason, there->reason) &&
           (!ours->has_reviewer || text_same(review->reviewer, there->reviewer)) &&
           (!ours->has_created || review->created_unix_ms == there->created_unix_ms);
}

// What a review that is not there yet must not be. One whose reviewer nobody knows may be the
// importer's own.
static Status judge_review(const ImportContext *context, const char *place,
                           const ImportReview *ours, const char *before,
                           const MaterialRevision *said) {
    const MaterialReview *review = &ours->review;
    const bool is_known = ours->has_reviewer && review->reviewer != NULL;
    const char *reviewer = is_known ? review->reviewer : context->import->who;
    if (text_same(review->status, before))
        return import_fault(context, place, "status", "is %s already", before);
    if (strcmp(review->status, "approved") == 0 && reviewer != NULL &&
        text_same(reviewer, said->author))
        return import_fault(context, place, "reviewer",
                            "%s the revision's author, %.64s, and nobody approves their own",
                            is_known ? "is" : "must be told, else it is", said->author);
    if (ours->has_created)
        import_validate_time(context, place, review->created_unix_ms, said->created_unix_ms);
    return STATUS_OK;
}

static Status add_review(const ImportContext *context, Sqlite *database, const char *slug,
                         uint64_t revision, const ImportReview *ours, Problem *problem) {
    MaterialReview review = ours->review;
    review.slug = (char *)slug;
    review.revision = revision;
    if (!ours->has_reviewer)
        review.reviewer = (char *)context->import->who;
    if (!ours->has_created)
        review.created_unix_ms = context->import->now_unix_ms;
    return material_review_add(database, &review, problem);
}

static Status match_reviews(ImportContext *context, Sqlite *database, const ImportRevision *ours,
                            const MaterialRevision *said, const Reviews *there,
                            MaterialGroup *group, Problem *problem) {
    char list[POINTER_SIZE], place[POINTER_SIZE];
    const char *before = there->count > 0 ? there->at[there->count - 1].status : "draft";
    // Of a faulty row the time may be what could not be read.
    MaterialRevision dated = *said; // borrows
    if (ours->mark.is_faulty && !ours->mark.has_created)
        dated.created_unix_ms = 0;
    json_pointer_join(list, sizeof list, ours->mark.place, "reviews");
    for (size_t i = 0; i < ours->review_count; i++) {
        const ImportReview *review = &ours->reviews[i];
        json_pointer_index(place, sizeof place, list, i);
        if (problem_concerns(context->faults, place))
            continue; // it could not be read
        if (i < there->count) {
            if (is_review(review, &there->at[i]))
                group->reviews_done.same++;
            else
                (void)import_fault(
                    context, place, "",
                    "is not the review of %.64s@%llu that is there, and those never change",
                    group->slug, (unsigned long long)said->revision);
            continue;
        }
        const Status judged = judge_review(context, place, review, before, &dated);
        before = review->review.status;
        if (judged != STATUS_OK)
            continue;
        if (!context->import->may_all)
            import_deny(context, ours->mark.place, "reviews", "brings reviews");
        group->reviews_done.added++;
        if (context->writes && context->faults->count == 0)
            TRY(add_review(context, database, group->slug, said->revision, review, problem));
    }
    return STATUS_OK;
}

Status import_reviews(ImportContext *context, Sqlite *database, const ImportRevision *ours,
                      const MaterialRevision *said, MaterialGroup *group, Problem *problem) {
    Reviews there = {0};
    if (ours->review_count == 0)
        return STATUS_OK;
    Status status = STATUS_OK;
    if (said->revision <= group->key.latest)
        status = load_reviews(database, group->slug, said->revision, &there, problem);
    if (status == STATUS_OK)
        status = match_reviews(context, database, ours, said, &there, group, problem);
    reviews_clear(&there);
    return status;
}
