// Structures by their matrices: what makes matrices a structure, and what they default to.
#include <math.h>
#include <stdlib.h>

#include "tests/support/document.h"
#include "tests/support/test.h"

#define MATRICES(members) "\"structure\": {\"kind\": \"matrices\", " members "}"
#define MASS "\"mass\": [[2, 0.5], [0.5, 1]]"
#define STIFFNESS "\"stiffness\": [[5, -3], [-3, 4]]"

TEST(what_is_not_given_is_no_damping_and_a_base_that_carries_all) {
    Simulation simulation;
    document_pass(&simulation, MATRICES(MASS ", " STIFFNESS));
    double all[14] = {0};
    const Structure *structure = scene_structure(&simulation.scene);
    structure_assemble(structure, &(const StructureMatrices){all, all + 4, all + 8, all + 12});
    const double wanted[14] = {2, .5, .5, 1, 5, -3, -3, 4, 0, 0, 0, 0, 1, 1};
    for (size_t i = 0; i < 14; i++)
        assert_true(all[i] == wanted[i]);
    double mass; // the determinant over the other's mass: 1.75 / 1
    assert_int_equal(structure_kind(structure)->moved_mass(structure, 0, &mass), STATUS_OK);
    assert_true(fabs(mass - 1.75) < 1e-15);
    simulation_clear(&simulation);
}

TEST(matrices_are_square_and_of_one_size) {
    document_refuse(MATRICES("\"mass\": [[2, 0.5], [0.5]], " STIFFNESS), "/structure/mass/1",
                    "must have 2 numbers, one per row of the matrix, has 1");
    document_refuse(MATRICES(MASS ", \"stiffness\": [[5]]"), "/structure/stiffness",
                    "must have 2 rows, as many as mass, has 1");
    document_refuse(MATRICES(MASS ", " STIFFNESS ", \"influence\": [1]"), "/structure/influence",
                    "must have 2 numbers, one per storey, has 1");
    document_refuse(MATRICES(MASS ", " STIFFNESS ", \"damping\": [[1, 0], [0, 1], [0, 0]]"),
                    "/structure/damping", "must have 2 rows, as many as mass, has 3");
    document_refuse(MATRICES("\"mass\": [], " STIFFNESS), "/structure/mass",
                    "is required, with at least one: mass matrix M, row after row: symmetric, "
                    "positive definite [kg]");
}

TEST(mass_and_stiffness_are_symmetric) {
    document_refuse(MATRICES("\"mass\": [[2, 0.5], [0.25, 1]], " STIFFNESS), "/structure/mass/1/0",
                    "must equal its mirror /structure/mass/0/1, 0.5: the matrix must be "
                    "symmetric, is 0.25");
    // To rounding; of damping nothing of the kind is asked.
    Simulation simulation;
    document_pass(&simulation, MATRICES("\"mass\": [[2, 0.5], [0.50000000000001, 1]], " STIFFNESS
                                        ", \"damping\": [[1, 7], [-7, 0]]"));
    simulation_clear(&simulation);
}

TEST(each_matrix_is_as_definite_as_it_must_be) {
    document_refuse(MATRICES("\"mass\": [[2, 2], [2, 1]], " STIFFNESS), "/structure/mass/1",
                    "must keep the matrix positive definite: with this row the leading 2 by 2 "
                    "block is not (or is within 1e-12 of singular)");
    document_refuse(MATRICES("\"mass\": [[2, 0], [0, 0]], " STIFFNESS), "/structure/mass/1",
                    "must keep the matrix positive definite: with this row the leading 2 by 2 "
                    "block is not (or is within 1e-12 of singular)");
    document_refuse(MATRICES(MASS ", \"stiffness\": [[5, -5], [-5, 4]]"), "/structure/stiffness/1",
                    "must keep the matrix positive semi-definite: with this row the leading 2 by "
                    "2 block is not");
    document_refuse(MATRICES(MASS ", " STIFFNESS ", \"damping\": [[1, 3], [0, 1]]"),
                    "/structure/damping/1",
                    "must keep the matrix dissipative (its symmetric part positive "
                    "semi-definite): with this row the leading 2 by 2 block is not");
    Simulation simulation;
    document_pass(&simulation, MATRICES(MASS ", \"stiffness\": [[5, -5], [-5, 5]]"));
    simulation_clear(&simulation);
    document_pass(&simulation, MATRICES(MASS ", \"stiffness\": [[0, 0], [0, 0]]"));
    simulation_clear(&simulation);
}

TEST(hostile_entries_are_told) {
    static const char *const texts[] = {
        MATRICES("\"mass\": [[1e308, 1e308], [1e308, 1e308]], " STIFFNESS),
        MATRICES("\"mass\": [[1e308, -1e308], [-1e308, 1e-308]], " STIFFNESS),
        MATRICES("\"mass\": [[1e-308, 0], [0, 1e308]], \"stiffness\": [[1e308, 1e308], [1e308, "
                 "-1e308]]"),
        MATRICES("\"mass\": [[[]]], " STIFFNESS),
        MATRICES("\"mass\": [[], []], \"stiffness\": [[], []]"),
        MATRICES("\"mass\": [1, 2], \"stiffness\": 3, \"damping\": null, \"influence\": [[1]]"),
        MATRICES("\"mass\": [[-1, 0], [0, -1]], \"stiffness\": [[-1, 0], [0, -1]]"),
    };
    static Problem problem;
    for (size_t i = 0; i < COUNT(texts); i++) {
        Simulation simulation;
        assert_int_equal(document_complete(&simulation, texts[i], &problem), STATUS_INVALID);
        assert_true(problem.count > 0 && problem.faults[0].pointer[0] == '/');
        simulation_clear(&simulation);
    }
}
