#include "tests/support/felt.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

Db *felt_store(const char *directory) {
    Db *db;
    static Problem problem;
    problem_clear(&problem);
    if (db_open(directory, &db, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return db;
}

MaterialRevision felt_saying(double restitution) {
    static char tag[] = "lab", *tags[] = {tag}, name[] = "Felt", source[] = "us", slug[] = "felt",
                comment[] = "why";
    MaterialRevision revision;
    memset(&revision, 0, sizeof revision);
    fields_clear(material_fields, &revision.material); // nothing is known
    revision.slug = slug;
    revision.comment = comment;
    revision.created_unix_ms = 5000;
    revision.material.name = name;
    revision.material.source = source;
    revision.material.restitution = restitution;
    revision.material.tags = (Texts){tags, COUNT(tags)};
    return revision;
}

Status felt_review(Db *db, uint64_t revision, const char *status, const char *reviewer,
                   uint64_t version) {
    const MaterialReview asked = {.slug = "felt",
                                  .revision = revision,
                                  .status = (char *)status,
                                  .reason = "because",
                                  .reviewer = (char *)reviewer,
                                  .created_unix_ms = 6000};
    return db_material_review(db, &asked, version, NULL);
}
