// Names of channels where there are several storeys or dampers, and where there are not.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/document.h"
#include "tests/support/test.h"

#define ONE "\"structure\": {\"mass\": 1, \"stiffness\": 100}"
#define FRAME                                                                                      \
    "\"structure\": {\"kind\": \"frame\", \"masses\": [1, 2, 3], \"stiffnesses\": [10, 20, 30]}"
#define DAMPER                                                                                     \
    "{\"mass\": 0.1, \"clearance\": 0.1, \"buffer\": {\"restitution\": 0.5, \"contact_time\": "    \
    "0.01}}"
#define WANT(names) ", \"output\": {\"channels\": [" names "]}"
#define WANT_PSD(names) ", \"output\": {\"psd\": {\"channels\": [" names "]}}"

static void assert_names(const char *members, const char *sampled, const char *spectra) {
    Simulation simulation;
    document_pass(&simulation, members);
    const Texts *lists[] = {&simulation.output.channels, &simulation.output.psd.channels};
    const char *wanted[] = {sampled, spectra};
    for (size_t i = 0; i < 2; i++) {
        char all[1024] = "";
        for (size_t j = 0; j < lists[i]->count; j++)
            snprintf(all + strlen(all), sizeof all - strlen(all), "%s%s", j > 0 ? " " : "",
                     lists[i]->at[j]);
        assert_string_equal(all, wanted[i]);
    }
    simulation_clear(&simulation);
}

TEST(one_storey_and_one_damper_have_bare_names) {
    assert_names(ONE ", \"dampers\": [" DAMPER "]",
                 "displacement velocity acceleration damper_displacement contact_force",
                 "mean_acceleration");
    assert_names(ONE, "displacement velocity acceleration", "mean_acceleration");
    document_refuse(ONE WANT("\"velocity_1\""), "/output/channels/0",
                    "must be velocity, without a number: there is only one");
    document_refuse(ONE WANT("\"penetration\""), "/output/channels/0",
                    "penetration needs a damper, the scene has none");
}

TEST(several_storeys_or_dampers_are_numbered_throughout) {
    assert_names(FRAME ", \"dampers\": [" DAMPER "]",
                 "displacement_1 displacement_2 displacement_3 velocity_1 velocity_2 velocity_3 "
                 "acceleration_1 acceleration_2 acceleration_3 damper_displacement_1 "
                 "contact_force_1",
                 "mean_acceleration_3");
    assert_names(ONE ", \"dampers\": [" DAMPER ", " DAMPER "]",
                 "displacement_1 velocity_1 acceleration_1 damper_displacement_1 "
                 "damper_displacement_2 contact_force_1 contact_force_2",
                 "mean_acceleration_1");
    assert_names(FRAME WANT("\"velocity_2\", \"base_acceleration\""),
                 "velocity_2 base_acceleration", "mean_acceleration_3");
    assert_names(FRAME WANT(""), "", "mean_acceleration_3");
}

TEST(a_bare_name_among_several_is_a_fault) {
    static const char detail[] =
        "must carry the number of a storey, from displacement_1 to displacement_3: the scene has 3 "
        "storeys and 0 dampers";
    document_refuse(FRAME WANT("\"displacement\""), "/output/channels/0", detail);
    document_refuse(FRAME WANT("\"displacement_4\""), "/output/channels/0", detail);
    document_refuse(FRAME WANT_PSD("\"displacement\""), "/output/psd/channels/0", detail);
    document_refuse(FRAME WANT("\"base_acceleration_1\""), "/output/channels/0",
                    "must be base_acceleration, without a number: there is only one");
    document_refuse(FRAME ", \"dampers\": [" DAMPER "]" WANT("\"contact_force\""),
                    "/output/channels/0",
                    "must be contact_force_1: the scene has 3 storeys and 1 damper");
    static Problem problem;
    Simulation simulation;
    assert_int_equal(
        document_complete(&simulation, FRAME WANT("\"velocty_2\", \"velocity\""), &problem),
        STATUS_INVALID);
    assert_int_equal(problem.count, 2);
    assert_string_equal(problem.faults[0].did_you_mean, "velocity_2");
    assert_string_equal(problem.faults[1].did_you_mean, "velocity_3");
    assert_string_equal(problem.faults[1].value, "\"velocity\"");
    simulation_clear(&simulation);
}

TEST(the_usual_ones_have_a_name_and_may_stand_beside_others) {
    assert_names(ONE WANT("\"base_acceleration\", \"usual\""),
                 "base_acceleration displacement velocity acceleration", "mean_acceleration");
    assert_names(FRAME WANT_PSD("\"velocity_1\", \"usual\""),
                 "displacement_1 displacement_2 displacement_3 velocity_1 velocity_2 velocity_3 "
                 "acceleration_1 acceleration_2 acceleration_3",
                 "velocity_1 mean_acceleration_3");
    document_refuse(ONE WANT("\"usual\", \"usual\""), "/output/channels/1", "is asked for twice");
}

TEST(names_that_the_scene_has_are_offered) {
    static const char names[] = "must be one of usual, displacement, velocity, acceleration, "
                                "mean_acceleration, base_acceleration, base_shear";
    static const char of_frame[] = "must be one of usual, displacement, velocity, acceleration, "
                                   "mean_acceleration, base_acceleration, storey_drift, base_shear";
    char long_name[200];
    memset(long_name, 'd', sizeof long_name - 1);
    long_name[sizeof long_name - 1] = '\0';
    char members[400];
    snprintf(members, sizeof members, ONE WANT("\"%s\""), long_name);
    document_refuse(members, "/output/channels/0", names);
    document_refuse(ONE WANT("\"usual_2\""), "/output/channels/0", names);
    document_refuse(FRAME WANT("\"displacment_3\""), "/output/channels/0", of_frame);
    document_refuse(FRAME WANT("\"displacement_0\""), "/output/channels/0", of_frame);
}

// "usual" stands for several names; places are the document's all the same.
TEST(faults_beside_the_usual_ones_stand_where_the_document_has_them) {
    document_refuse(ONE WANT("\"usual\", \"velocity\""), "/output/channels/1",
                    "velocity is asked for twice, first at /output/channels/0");
    document_refuse(ONE WANT("\"penetration\", \"usual\""), "/output/channels/0",
                    "penetration needs a damper, the scene has none");
    document_refuse(ONE WANT("\"usual\", \"base_acceleration\", \"velocity_3\""),
                    "/output/channels/2", "must be velocity, without a number: there is only one");
    document_refuse(ONE WANT("\"base_acceleration\", \"velocity\", \"usual\""),
                    "/output/channels/2",
                    "velocity is asked for twice, first at /output/channels/1");
}

TEST(unknown_storeys_are_no_reason_to_refuse_a_number) {
    document_refuse("\"structure\": {\"kind\": \"frame\", \"masses\": [1, 2], \"stiffnesses\": "
                    "[10]}" WANT("\"displacement_7\", \"velocity\""),
                    "/structure/stiffnesses", "must have 2 numbers, one per storey, has 1");
}

TEST(many_channels_of_many_samples_are_too_many) {
    char list[512] = "1", text[2048];
    for (size_t i = 1; i < 60; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), ",1");
    snprintf(text, sizeof text,
             "\"structure\": {\"kind\": \"frame\", \"masses\": [%s], \"stiffnesses\": [%s], "
             "\"damping_ratio\": 0.1}",
             list, list);
    static Problem problem;
    Simulation simulation;
    document_pass(&simulation, text);
    simulation.scene.duration = 30000;
    problem_clear(&problem);
    static const SimulationLimits limits = {.samples = 1 << 25};
    assert_int_equal(simulation_complete(&simulation, &limits, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/output/channels");
    assert_string_equal(problem.faults[0].detail,
                        "181 channels of 3000001 samples are 5.43e+08 values, must be at most "
                        "4.03e+08: ask for fewer channels or samples");
    simulation_clear(&simulation);
}
