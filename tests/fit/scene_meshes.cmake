# SPDX-License-Identifier: BSD-3-Clause
# Writes the meshes of scenes/ anew and compares them byte for byte with the committed ones.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
execute_process(COMMAND ${PYTHON} ${SCENES}/make_organ.py ${WORK} RESULT_VARIABLE result)
if(NOT result EQUAL 0)
    message(FATAL_ERROR "make_organ.py failed: ${result}")
endif()
foreach(name organ.obj hook.obj)
    execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${WORK}/${name} ${SCENES}/${name}
                    RESULT_VARIABLE result)
    if(NOT result EQUAL 0)
        message(FATAL_ERROR "scenes/${name} is not what scenes/make_organ.py writes")
    endif()
endforeach()
