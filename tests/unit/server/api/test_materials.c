// A write whose reply cannot be made: nothing is written, so that the client may try again.
#include "server/api/materials.h"

#include <stdio.h>
#include <string.h>

#include "server/http/reply.h"
#include "tests/support/test.h"

static App app;
static Problem problem;

static int open_app(void **state) {
    (void)state;
    return db_open(NULL, &app.db, NULL) == STATUS_OK ? 0 : 1;
}

static int close_app(void **state) {
    (void)state;
    db_close(app.db);
    return 0;
}

typedef struct Write {
    Handler *handler;
    const char *slug, *revision, *type, *body;
} Write;

static Status run(const Write *write, size_t reply_max) {
    Request request = {.method = "POST",
                       .parameters = {write->slug, write->revision},
                       .body = write->body,
                       .body_size = strlen(write->body),
                       .content_type = write->type,
                       .if_match = "*"};
    Reply reply;
    reply_default(&reply);
    problem_clear(&problem);
    app.reply_most = reply_max;
    const Status status = write->handler(&app, &request, &reply, &problem);
    reply_clear(&reply);
    return status;
}

TEST(a_write_whose_reply_cannot_be_made_writes_nothing) {
    static const char json[] = "application/json";
    static const Write writes[] = {
        {materials_create, NULL, NULL, json,
         "{\"slug\": \"felt\", \"name\": \"Felt\", \"restitution\": 0.5, \"source\": \"s\"}"},
        {materials_revise, "felt", NULL, json,
         "{\"name\": \"Felt\", \"restitution\": 0.4, \"source\": \"s\", \"comment\": \"c\"}"},
        {materials_revert, "felt", NULL, json, "{\"to\": 1, \"comment\": \"c\"}"},
        {materials_review, "felt", "1", json, "{\"status\": \"approved\", \"reason\": \"r\"}"},
        {measurements_create, "felt", NULL, json, "{\"drops\": [{\"contact_time\": 0.01}]}"},
        {materials_import, NULL, NULL, "text/csv",
         "slug,name,source,restitution\nfelt,Felt,s,0.3\n"},
    };
    for (size_t i = 0; i < COUNT(writes); i++) {
        MaterialState before, after;
        (void)db_material_state(app.db, "felt", &before, NULL);
        assert_int_equal(run(&writes[i], 10), STATUS_LIMIT);
        (void)db_material_state(app.db, "felt", &after, NULL);
        assert_int_equal(after.version, before.version);
        assert_int_equal(run(&writes[i], 1 << 20), STATUS_OK);
        assert_int_equal(db_material_state(app.db, "felt", &after, NULL), STATUS_OK);
        assert_int_equal(after.version, before.version + 1);
    }
}

TEST_GROUP(open_app, close_app)
