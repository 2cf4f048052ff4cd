// Materials that are remembered: copies, as long as the catalogue stays as it is.
#include "server/db/material_memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const MaterialRevision sponge = {
    .slug = "sponge",
    .revision = 3,
    .material = {.name = "Sponge", .source = "s", .restitution = 0.61, .contact_time = 0.025},
    .status = "approved"};

static bool has(MaterialMemory *memory, uint64_t catalog_version, const char *slug,
                uint64_t revision) {
    MaterialRevision found = {0};
    const bool is_found = material_memory_find(memory, catalog_version, slug, revision, &found);
    if (is_found) {
        assert_string_equal(found.slug, slug);
        assert_string_equal(found.status, "approved");
        assert_int_equal(found.revision, 3);
        assert_true(found.material.restitution == 0.61 && found.material.contact_time == 0.025);
        material_revision_clear(&found);
    }
    return is_found;
}

static void a_material_is_found_as_it_was_asked_for(void **state) {
    (void)state;
    MaterialMemory *memory = material_memory_new();
    assert_false(has(memory, 0, "sponge", 0));
    material_memory_put(memory, 0, 0, &sponge);
    assert_true(has(memory, 0, "sponge", 0));
    assert_true(has(memory, 0, "sponge", 0));
    assert_false(has(memory, 0, "sponge", 3));
    assert_false(has(memory, 0, "spong", 0));
    material_memory_free(memory);
    material_memory_free(NULL);
}

static void another_catalogue_is_not_the_one_that_was_read(void **state) {
    (void)state;
    MaterialMemory *memory = material_memory_new();
    material_memory_put(memory, 1, 0, &sponge);
    assert_false(has(memory, 2, "sponge", 0));
    material_memory_put(memory, 2, 3, &sponge);
    assert_true(has(memory, 2, "sponge", 3));
    assert_false(has(memory, 2, "sponge", 0));
    // Read before it changed, put after that.
    material_memory_put(memory, 1, 0, &sponge);
    assert_false(has(memory, 2, "sponge", 0));
    assert_true(has(memory, 2, "sponge", 3));
    material_memory_free(memory);
}

static void it_stays_small(void **state) {
    (void)state;
    MaterialMemory *memory = material_memory_new();
    char slug[16];
    MaterialRevision material = sponge;
    material.slug = slug;
    for (int i = 0; i < 1000; i++) {
        snprintf(slug, sizeof slug, "m%d", i);
        material_memory_put(memory, 0, 0, &material);
        assert_true(has(memory, 0, slug, 0));
    }
    assert_false(has(memory, 0, "m0", 0));
    material_memory_free(memory);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_material_is_found_as_it_was_asked_for),
        cmocka_unit_test(another_catalogue_is_not_the_one_that_was_read),
        cmocka_unit_test(it_stays_small),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
