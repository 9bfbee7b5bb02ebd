# SPDX-License-Identifier: BSD-3-Clause
# Compile options that every target of the project shares; never exported.
# Structures grow at their ends, and a member that an initialiser does not name is zero on purpose.
add_library(shcd_warnings INTERFACE)
target_compile_options(shcd_warnings INTERFACE
    -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wdouble-promotion -Wfloat-conversion
    -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wcast-align -Wcast-qual -Wvla -Wundef
    -Wno-missing-field-initializers
    $<$<BOOL:${SHCD_WARNINGS_AS_ERRORS}>:-Werror>)

# C17 without extensions, hidden symbols, and no contraction of a*b+c: the same source gives the
# same bits whatever the optimisation level and compiler. Where the target has FMA, gcc 12 makes
# vfmaddsub out of alternating sums when it vectorises straight-line code, contraction or not.
function(shcd_target name)
    set_target_properties(${name} PROPERTIES
        C_STANDARD 17 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF
        C_VISIBILITY_PRESET hidden POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${name} PRIVATE -ffp-contract=off -fno-tree-slp-vectorize)
    target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:shcd_warnings>)
endfunction()
