

#include "core/contact/contact.h"
#include "tests/support/test.h"

TEST(the_walkers_table_is_the_list_with_auto_first) {
    size_t i = 0;
    for (; contacts[i] != NULL; i++)
        assert_ptr_equal(contact_kinds.at(i), &contacts[i]->kind);
    assert_null(contact_kinds.at(i));
    assert_string_equal(contact_kinds.at(0)->name, "auto");
    assert_string_equal(contact_kinds.tag, "model");
}

TEST(laws_are_found_by_name_and_know_their_form) {
    assert_ptr_equal(kind_find(&contact_kinds, "impulse"), &contact_impulse.kind);
    assert_ptr_equal(kind_find(&contact_kinds, "spring_damper"), &contact_spring_damper.kind);
    assert_int_equal(contact_impulse.form, CONTACT_IMPULSIVE);
    assert_int_equal(contact_spring_damper.form, CONTACT_LINEAR);
    assert_int_equal(contact_auto.form, CONTACT_CHOSEN);
}

TEST(a_power_law_has_what_it_takes) {
    size_t count = 0;
    for (size_t i = 0; contacts[i] != NULL; i++) {
        if (contacts[i]->form != CONTACT_POWER)
            continue;
        count++;
        assert_non_null(contacts[i]->restitution);
        assert_non_null(contacts[i]->duration);
        assert_non_null(contacts[i]->force);
    }
    assert_true(count > 0);
    assert_ptr_equal(kind_find(&contact_kinds, "hunt_crossley"), &contact_hunt_crossley.kind);
    assert_null(contact_hertz.factor);
}

TEST(a_law_starts_with_zero_penetration) {
    for (size_t i = 0; contacts[i] != NULL; i++) {
        Variant *variant = variant_new(&contacts[i]->kind);
        assert_non_null(variant);
        const Contact *contact = (const Contact *)(const void *)variant;
        assert_ptr_equal(contact_law(contact), contacts[i]);
        assert_int_equal(contact->separation, SEPARATION_ZERO_PENETRATION);
        variant_free(variant);
    }
}
