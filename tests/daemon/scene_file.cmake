# SPDX-License-Identifier: BSD-3-Clause
# What a scene file may say: refusals by a corpus, values by the public accessors.
foreach(name scene_file scene_values scene_effects scene_material
             scene_accuracy)
    shcd_add_test(NAME ${name} LABEL daemon TIMEOUT 120 SOURCES test_${name}.c
                  LIBRARIES shcdd_parts)
    target_compile_definitions(test_${name} PRIVATE
        SHCD_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
        SHCD_TEST_SCENES="${CMAKE_CURRENT_SOURCE_DIR}/scenes")
endforeach()
