#include "server/json/material_bodies.h"

enum { COMMENT_MAX = 2000 };

const char *const material_verdicts[] = {"approved", "deprecated", NULL};

// clang-format off
const Field new_material_fields[] = {
    FIELD_TEXT(MaterialBody, slug, MATERIAL_SLUG_MAX, PRESENCE_REQUIRED, 0, "what scenes name it by: [a-z0-9_-]+, for good"),
    FIELD_BASE(MaterialBody, material, material_fields),
    FIELD_TEXT(MaterialBody, comment, COMMENT_MAX, PRESENCE_OPTIONAL, 0, "why it was added; \"new material\" without"),
    FIELD_END
};

const Field material_revision_fields[] = {
    FIELD_BASE(MaterialBody, material, material_fields),
    FIELD_TEXT(MaterialBody, comment, COMMENT_MAX, PRESENCE_REQUIRED, 0, "what was changed, and why"),
    FIELD_END
};

const Field material_revert_fields[] = {
    FIELD_COUNT(MaterialRevertBody, to, NULL, WITHIN(1, 9007199254740992.0), REQUIRED, "the revision that the new one says again"),
    FIELD_TEXT(MaterialRevertBody, comment, COMMENT_MAX, PRESENCE_REQUIRED, 0, "why what came after is undone"),
    FIELD_END
};

const Field material_review_fields[] = {
    FIELD_CHOICE(MaterialReviewBody, status, material_verdicts, REQUIRED, "what becomes of the revision"),
    FIELD_TEXT(MaterialReviewBody, reason, COMMENT_MAX, PRESENCE_REQUIRED, 0, "why"),
    FIELD_END
};

const Field measurement_body_fields[] = {
    FIELD_BASE(MeasurementBody, test, drop_test_fields),
    FIELD_TEXT(MeasurementBody, comment, COMMENT_MAX, PRESENCE_OPTIONAL, 0, "why it was made; \"drop test\" without"),
    FIELD_END
};
// clang-format on
