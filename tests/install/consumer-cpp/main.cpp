/* SPDX-License-Identifier: BSD-3-Clause */
/* A program outside the project, in C++11: consumer BODY.shcd loads a body, makes the same from
 * coefficients, queries both and steps a scene with the first. */
#include <shcd/shcd.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Model = std::unique_ptr<shcd_model, decltype(&shcd_model_free)>;
using Scene = std::unique_ptr<shcd_scene, decltype(&shcd_scene_free)>;

void check(shcd_status status, const char *what, const shcd_error *error = nullptr) {
    if (status != SHCD_OK) {
        throw std::runtime_error(std::string(what) + ": " +
                                 (error ? error->message : shcd_status_string(status)));
    }
}

void expect(const char *what, double actual, double expected, double tolerance) {
    std::cout << what << ' ' << actual << '\n';
    if (!(std::fabs(actual - expected) <= tolerance)) {
        throw std::runtime_error(std::string(what) + ": expected " + std::to_string(expected));
    }
}

Model load(const char *path) {
    shcd_model *model = nullptr;
    shcd_error error;
    check(shcd_model_load(path, nullptr, &model, &error), "shcd_model_load", &error);
    return Model(model, &shcd_model_free);
}

/* Ellipsoid with half axes of 30, 20 and 10 mm along x, y and z: degree 1. */
Model make_ellipsoid() {
    const double axis = 2.0466534158929770; // sqrt(4 pi / 3)
    std::vector<double> coefficients(3 * SHCD_COUNT(1));
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = 0.03 * axis;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = 0.02 * axis;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = 0.01 * axis;
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    def.degree = 1;
    def.coefficients = coefficients.data();
    shcd_model *model = nullptr;
    shcd_error error;
    check(shcd_model_create(&def, nullptr, &model, &error), "shcd_model_create", &error);
    return Model(model, &shcd_model_free);
}

double distance(const shcd_model *model, shcd_vec3 point) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.tier = SHCD_TIER_EXACT;
    shcd_proximity out;
    check(shcd_closest(model, point, &options, &out), "shcd_closest");
    return out.distance_m;
}

/* Force on a ball of 5 mm pressed 1 mm deep onto the end of the long axis, against 1 N/mm. */
double press(const shcd_model *model) {
    const shcd_parameter_value stiffness = SHCD_PARAMETER("k_n_per_m", 1000.0);
    const shcd_effect_def spring = {"stiffness", &stiffness, 1};
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    body.name = "body";
    body.model = model;
    body.effects = &spring;
    body.n_effects = 1;
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    tool.name = "ball";
    tool.kind = SHCD_TOOL_SPHERE;
    tool.radius_m = 0.005;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    shcd_scene *made = nullptr;
    shcd_error error;
    check(shcd_scene_create(&def, nullptr, &made, &error), "shcd_scene_create", &error);
    const Scene scene(made, &shcd_scene_free);

    std::vector<char> memory(shcd_state_size(made) + 16);
    void *aligned = memory.data();
    std::size_t room = memory.size();
    std::align(16, shcd_state_size(made), aligned, room);
    shcd_state *state = nullptr;
    check(shcd_state_init(made, aligned, room, &state), "shcd_state_init");
    const shcd_tool_input pressed = {
        {{0.034, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}, {0.0, 0.0, 0.0}, SHCD_TOOL_INPUT_ACTIVE, 0,
        {0.0, 0.0, 0.0}, {0, 0}};
    shcd_tool_output felt;
    const shcd_input input = SHCD_INPUT(0.001, &pressed, 1);
    shcd_output output = SHCD_OUTPUT(&felt, 1);
    check(shcd_step(made, state, &input, &output), "shcd_step");
    return felt.wrench.force_n.x;
}

} // namespace

int main(int argc, char **argv) {
    try {
        if (argc != 2) {
            throw std::runtime_error("usage: consumer BODY.shcd");
        }
        const Model loaded = load(argv[1]), made = make_ellipsoid();
        shcd_model_info info = SHCD_MODEL_INFO_INIT;
        check(shcd_model_describe(loaded.get(), &info), "shcd_model_describe");
        expect("degree", info.degree, 1.0, 0.0);
        const shcd_vec3 on_long_axis = {0.05, 0.0, 0.0}, elsewhere = {0.02, -0.03, 0.04};
        // 1e-9 of the diagonal, 75 mm, is the default tolerance of a query
        expect("distance", distance(loaded.get(), on_long_axis), 0.02, 1e-10);
        expect("same", distance(loaded.get(), elsewhere), distance(made.get(), elsewhere), 0.0);
        expect("force", press(loaded.get()), 1.0, 1e-6);
    } catch (const std::exception &problem) {
        std::cerr << "consumer: " << problem.what() << '\n';
        return 1;
    }
    return 0;
}
