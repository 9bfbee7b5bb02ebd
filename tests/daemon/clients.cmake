# SPDX-License-Identifier: BSD-3-Clause
# The clients that a user copies, and the demo, against the real daemon on a fitted body. They run
# alone, since they look at rates; a sanitizer slows the loop down, so there any rate will do.
set(rate_min 500)
set(calm_min 0.8) # share of the ticks in which no limit acts
if(SHCD_SANITIZED) # a stall of more than 20 ticks makes the daemon let go and start softly
    set(rate_min 0)
    set(calm_min 0.1)
endif()
set(client_environment
    SHCD=$<TARGET_FILE:shcd_command> SHCD_FITTER=${SHCD_FITTER}
    SHCDD=$<TARGET_FILE:shcdd> PRESS=$<TARGET_FILE:shcd_press>
    PYTHON=${SHCD_PYTHON} SOURCE=${PROJECT_SOURCE_DIR} BUILD=${PROJECT_BINARY_DIR}
    JAVA=${Java_JAVA_EXECUTABLE} PRESS_JAR=${SHCD_PRESS_JAR} RATE_MIN=${rate_min} CALM_MIN=${calm_min}
    SHCD_MESHES_OPTIONAL=$<BOOL:${SHCD_MESHES_OPTIONAL}>)

add_test(NAME python_client
    COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target python_client)
set_tests_properties(python_client PROPERTIES LABELS daemon TIMEOUT 300 RUN_SERIAL ON
                     FIXTURES_SETUP python_client)

# shcd_add_client_test(NAME SCRIPT ARGUMENTS...); exit status 77: no namespace, or no mesh
function(shcd_add_client_test name script)
    add_test(NAME ${name} COMMAND sh ${CMAKE_CURRENT_SOURCE_DIR}/${script} ${ARGN})
    set_tests_properties(${name} PROPERTIES LABELS daemon TIMEOUT 300 RUN_SERIAL ON
                         SKIP_RETURN_CODE 77 FIXTURES_REQUIRED python_client
                         ENVIRONMENT "${client_environment}")
endfunction()

set(organ test_clients.sh ${PROJECT_SOURCE_DIR}/scenes/organ.obj m)
set(liver test_clients.sh "${SHCD_MESHES}/liver-smooth.obj" cm)
if(SHCD_SANITIZED) # an interpreter is not
    shcd_add_client_test(clients_organ ${organ} c)
else()
    shcd_add_client_test(clients_organ ${organ} c python)
endif()
if(SHCD_JAVA_MISSING)
    shcd_add_client_test(clients_liver ${liver} c python)
    add_test(NAME clients_java COMMAND sh -c
        "echo 'the Java client is not built: ${SHCD_JAVA_MISSING} is missing'; exit 77")
    set_tests_properties(clients_java PROPERTIES LABELS daemon SKIP_RETURN_CODE 77)
else()
    shcd_add_client_test(clients_liver ${liver} c python java)
    shcd_add_client_test(clients_java ${organ} java junk)
endif()
shcd_add_client_test(demo test_demo.sh)
# the same programs again, on another body and by another script, or under an interpreter
set_property(TEST clients_liver clients_java demo APPEND PROPERTY LABELS plain)
