// What the handlers of materials and of their measurements share: entity tags, If-Match, pages of
// lists, and the evaluation of drop tests.
#ifndef SERVER_API_MATERIALS_H
#define SERVER_API_MATERIALS_H

#include "core/drop_test/evaluation.h"
#include "server/api/app.h"
#include "server/db/materials.h"

enum { MATERIAL_TAG = 110 };

// "SLUG@REVISION-VERSION", without quotes. A review changes what is reported of a revision: the
// version changes with it.
void material_tag(const char *slug, uint64_t revision, uint64_t version, char tag[MATERIAL_TAG]);
// Sets the tag of the material in the request's path. True: the client has that version already,
// and the reply is complete.
bool material_is_cached(const Request *request, Reply *reply, const MaterialState *state);

// Checks If-Match: any tag of the material's present version, or "*". *version is what the database
// is to find (ANY_VERSION: any); *state is the present one. STATUS_NOT_FOUND, STATUS_UNCONDITIONAL:
// it is required and missing, STATUS_STALE.
Status material_condition(App *app, const Request *request, bool is_required, uint64_t *version,
                          MaterialState *state, Problem *problem);

// A number from 1 as a path has it, 0 for NULL; `what` is "revision" or "measurement".
// STATUS_NOT_FOUND.
Status material_number(const char *text, const char *what, uint64_t *number, Problem *problem);

// A page of a list numbered from 1 to `newest`, newest first: `limit` items before `before`.
typedef struct MaterialPage {
    size_t limit, before;
} MaterialPage;
Status material_page_read(const Request *request, size_t initial, size_t max, uint64_t newest,
                          MaterialPage *page, Problem *problem);
// Links the next page after the item numbered `last`; 0: there is no item.
void material_page_link(const Request *request, Reply *reply, uint64_t last, Bytes *body);

// The JSON body of a request as `fields`; faults of types and ranges are in `problem`, to which
// more may be added. STATUS_OK: it is an object. Cleared by fields_clear in any case.
Status material_body_read(const Request *request, const char *whose, const Field *fields,
                          void *item, Problem *problem);

// The head, or the newest revision if all are deprecated. STATUS_NOT_FOUND, and then it is empty.
Status material_latest(App *app, const char *slug, MaterialRevision *revision, Problem *problem);

// The separation rule of an evaluation: the query's, else the material's, else zero penetration.
Status measurement_separation(App *app, const Request *request, int *separation, Problem *problem);

// evaluation_run within the CPU time that a request may take, so that a loaded machine answers the
// same: a quick one runs at once, of longer ones some at a time. STATUS_BUSY while others take long
// or the daemon stops, STATUS_LIMIT.
Status measurements_evaluate(App *app, const Measurement *tests, size_t count, int separation,
                             Evaluation *evaluation, Reply *reply, Problem *problem);

#endif
