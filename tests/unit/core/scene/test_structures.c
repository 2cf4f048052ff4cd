#include <math.h>

#include "core/scene/structure.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static Problem problem;

static SdofStructure sdof(double damping, double ratio) {
    return (SdofStructure){.structure = {{&structure_sdof.kind}, ratio},
                           .mass = 1.35,
                           .stiffness = 865,
                           .damping = damping};
}

static double structure_damping(const SdofStructure *structure) {
    double all[4] = {0};
    structure_assemble(&structure->structure,
                       &(const StructureMatrices){all, all + 1, all + 2, all + 3});
    assert_true(all[0] == structure->mass && all[1] == structure->stiffness && all[3] == 1);
    return all[2];
}

static Status complete(SdofStructure *structure) {
    problem_clear(&problem);
    return structure_complete(&structure->structure, "/structure", &problem);
}

TEST(no_damping_is_damping_of_zero) {
    SdofStructure structure = sdof((double)NAN, (double)NAN);
    assert_int_equal(complete(&structure), STATUS_OK);
    assert_true(structure.damping == 0);
    assert_true(structure_damping(&structure) == 0);
}

TEST(damping_may_be_given_by_its_ratio) {
    SdofStructure structure = sdof((double)NAN, 0.016);
    assert_int_equal(complete(&structure), STATUS_OK);
    assert_true(isnan(structure.damping));
    assert_true(fabs(structure_damping(&structure) - 0.032 * sqrt(865 * 1.35)) < 1e-15);
    structure = sdof(1.092, (double)NAN);
    assert_true(structure_damping(&structure) == 1.092);
    structure = sdof((double)NAN, 0.5);
    structure.mass = 1e200;
    structure.stiffness = 1e200;
    assert_true(fabs(structure_damping(&structure) / 1e200 - 1) < 1e-15);
}

TEST(both_at_once_are_a_fault) {
    SdofStructure structure = sdof(1, 0.016);
    assert_int_equal(complete(&structure), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/structure/damping_ratio"),
                        "excludes damping: give one of the two");
    assert_string_equal(problem.faults[0].value, "0.016");
}

TEST(the_rows_refuse_what_is_no_structure) {
    SdofStructure structure = sdof(-1, (double)NAN);
    structure.mass = 0;
    structure.stiffness = -865;
    problem_clear(&problem);
    fields_validate(structure_sdof.kind.fields, &structure, "/structure", &problem);
    assert_int_equal(problem.count, 3);
    assert_string_equal(detail_at(&problem, "/structure/mass"), "must be above 0 kg, is 0");
    assert_string_equal(detail_at(&problem, "/structure/stiffness"),
                        "must be at least 0 N/m, is -865");
    assert_string_equal(detail_at(&problem, "/structure/damping"),
                        "must be at least 0 N s/m, is -1");
}
