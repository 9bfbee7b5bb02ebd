/* SPDX-License-Identifier: BSD-3-Clause */
/* Every initialiser macro in C99 and C++11, to be compiled with -Wmissing-field-initializers. */
#include "shcd/fit.h"
#include "shcd/map.h"
#include "shcd/shcd.h"

size_t sum_of_sizes(void);

size_t sum_of_sizes(void) {
    const shcd_model_def model_def = SHCD_MODEL_DEF_INIT;
    const shcd_model_info model_info = SHCD_MODEL_INFO_INIT;
    const shcd_query_options query_options = SHCD_QUERY_OPTIONS_INIT;
    const shcd_map_options map_options = SHCD_MAP_OPTIONS_INIT;
    const shcd_map_info map_info = SHCD_MAP_INFO_INIT;
    const shcd_body_def body_def = SHCD_BODY_DEF_INIT;
    const shcd_tool_def tool_def = SHCD_TOOL_DEF_INIT;
    const shcd_scene_def scene_def = SHCD_SCENE_DEF_INIT;
    const shcd_mesh_report mesh_report = SHCD_MESH_REPORT_INIT;
    const shcd_fit_options fit_options = SHCD_FIT_OPTIONS_INIT;
    const shcd_sweep_def sweep_def = SHCD_SWEEP_DEF_INIT;
    const shcd_pair_options pair_options = SHCD_PAIR_OPTIONS_INIT;
    const shcd_tool_geometry_def geometry_def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    const shcd_accuracy_request accuracy_request = SHCD_ACCURACY_REQUEST_INIT;
    const shcd_detect_options detect_options = SHCD_DETECT_OPTIONS_INIT;
    const shcd_shape_info shape_info = SHCD_SHAPE_INFO_INIT;
    const shcd_fit_report fit_report = SHCD_FIT_REPORT_INIT;
    const shcd_train_options train_options = SHCD_TRAIN_OPTIONS_INIT;
    const shcd_modes_options modes_options = SHCD_MODES_OPTIONS_INIT;
    return model_def.struct_size + model_info.struct_size + query_options.struct_size +
           map_options.struct_size + map_info.struct_size + body_def.struct_size +
           tool_def.struct_size + scene_def.struct_size + mesh_report.struct_size +
           fit_options.struct_size + fit_report.struct_size + sweep_def.struct_size +
           pair_options.struct_size + geometry_def.struct_size + accuracy_request.struct_size +
           detect_options.struct_size + shape_info.struct_size + modes_options.struct_size +
           train_options.struct_size;
}
