// Shear frames: what is refused of them, what they default to, and their matrices.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/document.h"
#include "tests/support/test.h"

#define FRAME(rest) "\"structure\": {\"kind\": \"frame\", \"masses\": [1, 2, 3], " rest "}"
#define SPRINGS "\"stiffnesses\": [10, 20, 30]"

TEST(matrices_follow_the_storeys_from_the_ground_up) {
    Simulation simulation;
    document_pass(&simulation, FRAME(SPRINGS ", \"dampings\": [1, 0, 2]"));
    double all[30] = {0};
    const Structure *structure = scene_structure(&simulation.scene);
    assert_int_equal(structure_storeys(structure), 3);
    structure_assemble(structure, &(const StructureMatrices){all, all + 9, all + 18, all + 27});
    const double wanted[30] = {1, 0,   0,  0, 2, 0, 0, 0, 3,  30, -20, 0, -20, 50, -30,
                               0, -30, 30, 1, 0, 0, 0, 2, -2, 0,  -2,  2, 1,   1,  1};
    for (size_t i = 0; i < 30; i++)
        assert_true(all[i] == wanted[i]);
    double mass;
    assert_int_equal(structure_kind(structure)->moved_mass(structure, 1, &mass), STATUS_OK);
    assert_true(mass == 2);
    simulation_clear(&simulation);
}

TEST(no_damping_is_a_list_of_zeros) {
    Simulation simulation;
    document_pass(&simulation, FRAME(SPRINGS));
    const ShearFrame *frame = (const ShearFrame *)(void *)simulation.scene.structure;
    assert_int_equal(frame->dampings.count, 3);
    assert_true(frame->dampings.at[0] == 0 && frame->dampings.at[2] == 0);
    simulation_clear(&simulation);
    document_pass(&simulation, FRAME(SPRINGS ", \"damping_ratio\": 0.05"));
    frame = (const ShearFrame *)(void *)simulation.scene.structure;
    assert_int_equal(frame->dampings.count, 0);
    simulation_clear(&simulation);
}

TEST(lists_must_be_as_long_as_the_masses) {
    document_refuse(FRAME("\"stiffnesses\": [10, 20]"), "/structure/stiffnesses",
                    "must have 3 numbers, one per storey, has 2");
    document_refuse(FRAME(SPRINGS ", \"dampings\": [1, 2, 3, 4]"), "/structure/dampings",
                    "must have 3 numbers, one per storey, has 4");
    document_refuse(FRAME("\"damping_ratio\": 0.1"), "/structure/stiffnesses",
                    "is required, with at least one: of the springs below the storeys, from the "
                    "ground up [N/m]");
    document_refuse("\"structure\": {\"kind\": \"frame\", \"masses\": [], " SPRINGS "}",
                    "/structure/masses",
                    "is required, with at least one: of the storeys, from the ground up [kg]");
}

TEST(every_number_has_its_place) {
    document_refuse("\"structure\": {\"kind\": \"frame\", \"masses\": [1, 0, 3], " SPRINGS "}",
                    "/structure/masses/1", "must be above 0 kg, is 0");
    document_refuse(FRAME("\"stiffnesses\": [10, -20, 30]"), "/structure/stiffnesses/1",
                    "must be at least 0 N/m, is -20");
    document_refuse(FRAME("\"stiffnesses\": [10, 1e308, 1e308]"), "/structure/stiffnesses/2",
                    "and the one below must have a sum that numbers can hold");
    document_refuse(FRAME(SPRINGS ", \"dampings\": [0, 0, 0], \"damping_ratio\": 0.1"),
                    "/structure/damping_ratio", "excludes dampings: give one of the two");
}

TEST(two_hundred_storeys_are_the_most) {
    for (size_t storeys = 200; storeys <= 201; storeys++) {
        char list[1024] = "1", text[4096];
        for (size_t i = 1; i < storeys; i++)
            memcpy(list + strlen(list), ",1", 3);
        snprintf(text, sizeof text,
                 "\"structure\": {\"kind\": \"frame\", \"masses\": [%s], \"stiffnesses\": [%s]}",
                 list, list);
        static Problem problem;
        Simulation simulation;
        const Status status = document_complete(&simulation, text, &problem);
        assert_int_equal(status, storeys == 200 ? STATUS_OK : STATUS_INVALID);
        if (storeys == 200)
            assert_int_equal(simulation.output.channels.count, 600);
        else
            assert_string_equal(problem.faults[0].detail, "must have at most 200 numbers, has 201");
        simulation_clear(&simulation);
    }
}

TEST(a_damper_stands_on_a_storey_there_is) {
#define DAMPER(rest)                                                                               \
    ", \"dampers\": [{\"mass\": 1, \"clearance\": 1, \"buffer\": {\"restitution\": 0.5, "          \
    "\"contact_time\": 0.01}" rest "}]"
    Simulation simulation;
    document_pass(&simulation, FRAME(SPRINGS) DAMPER(""));
    assert_int_equal(simulation.scene.dampers.at[0].storey, 3);
    simulation_clear(&simulation);
    document_pass(&simulation, FRAME(SPRINGS) DAMPER(", \"storey\": 2"));
    assert_int_equal(simulation.scene.dampers.at[0].storey, 2);
    simulation_clear(&simulation);
    document_refuse(FRAME(SPRINGS) DAMPER(", \"storey\": 4"), "/dampers/0/storey",
                    "must be at most 3, the number of storeys, is 4");
    document_refuse(FRAME(SPRINGS) DAMPER(", \"storey\": 0"), "/dampers/0/storey",
                    "must be at least 1, is 0");
    // A structure with a fault is no reason to refuse a storey.
    document_refuse(FRAME("\"stiffnesses\": [1]") DAMPER(", \"storey\": 3"),
                    "/structure/stiffnesses", "must have 3 numbers, one per storey, has 1");
}

TEST(the_start_is_a_list_of_each_storey) {
    Simulation simulation;
    document_pass(&simulation, FRAME(SPRINGS) ", \"excitation\": {\"displacement\": [1, 0, -1], "
                                              "\"velocity\": 0}");
    const Excitation *excitation = scene_excitation(&simulation.scene);
    assert_true(excitation->displacement.count == 3 && excitation->displacement.at[2] == -1);
    assert_true(excitation->velocity.count == 3 && excitation->velocity.at[1] == 0);
    simulation_clear(&simulation);
    document_refuse(FRAME(SPRINGS) ", \"excitation\": {\"displacement\": 0.1}",
                    "/excitation/displacement",
                    "must be a list of 3 numbers, one per storey, or 0");
    document_refuse(FRAME(SPRINGS) ", \"excitation\": {\"velocity\": [1, 2]}",
                    "/excitation/velocity", "must have 3 numbers, one per storey, has 2");
    document_refuse("\"structure\": {\"mass\": 1, \"stiffness\": 1}, \"excitation\": "
                    "{\"velocity\": [1, 2]}",
                    "/excitation/velocity", "must have 1 number, one per storey, has 2");
}

TEST(rates_are_near_the_first_and_the_last_frequency) {
    // Equal storeys swing at 2 sqrt(k / m) sin((2 k - 1) pi / (2 (2 n + 1))).
    Simulation simulation;
    document_pass(&simulation, "\"structure\": {\"kind\": \"frame\", \"masses\": [2, 2, 2, 2, 2], "
                               "\"stiffnesses\": [800, 800, 800, 800, 800]}");
    StructureRates rates;
    const Structure *structure = scene_structure(&simulation.scene);
    assert_int_equal(structure_rates(structure, SIZE_MAX, &rates), STATUS_OK);
    const double half = acos(-1) / 22;
    assert_true(fabs(rates.slowest / (40 * sin(half)) - 1) < 0.01);
    assert_true(rates.fastest >= 40 * sin(9 * half) && rates.fastest < 41);
    simulation_clear(&simulation);
    document_pass(&simulation, FRAME("\"stiffnesses\": [0, 20, 30], \"damping_ratio\": 50"));
    assert_int_equal(structure_rates(scene_structure(&simulation.scene), SIZE_MAX, &rates),
                     STATUS_OK);
    assert_true(rates.slowest == 0 && rates.fastest > 100);
    simulation_clear(&simulation);
}
