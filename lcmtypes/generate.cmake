# SPDX-License-Identifier: BSD-3-Clause
# Runs lcm-gen for one type:
#     cmake -D LCM_GEN=.. -D TYPE=.. -D SOURCE=.. -D C_DIR=.. -D PYTHON_DIR=.. -D JAVA_DIR=.. -P
# lcm-gen exits 0 on errors, hence: remove the outputs first, look for them afterwards.
set(outputs ${C_DIR}/shcdmsg_${TYPE}.c ${C_DIR}/shcdmsg_${TYPE}.h ${PYTHON_DIR}/shcdmsg/${TYPE}.py
            ${JAVA_DIR}/shcdmsg/${TYPE}.java)
file(REMOVE ${outputs})
file(MAKE_DIRECTORY ${C_DIR} ${PYTHON_DIR} ${JAVA_DIR})
execute_process(
    COMMAND ${LCM_GEN} -c --c-cpath ${C_DIR} --c-hpath ${C_DIR} -p --ppath ${PYTHON_DIR} -j --jpath ${JAVA_DIR}
            ${SOURCE}
    RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
foreach(output IN LISTS outputs)
    if(NOT result EQUAL 0 OR NOT EXISTS ${output})
        message(FATAL_ERROR "lcm-gen (exit ${result}) did not make ${output} from ${SOURCE}\n${text}")
    endif()
endforeach()
