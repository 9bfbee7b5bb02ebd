# SPDX-License-Identifier: BSD-3-Clause
# What makes an installation usable by others: the CMake package, the pkg-config files, run paths.
# Everything finds its neighbours relative to itself, so that a prefix may be moved.
include(CMakePackageConfigHelpers)
set(SHCD_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/shcd)
set(SHCD_PKGCONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# ---- pkg-config ----
# Absolute folders (some distributions split a package over several prefixes) are kept as they are.
if(IS_ABSOLUTE ${CMAKE_INSTALL_LIBDIR})
    set(SHCD_PC_PREFIX ${CMAKE_INSTALL_PREFIX})
else()
    file(RELATIVE_PATH up /prefix/${SHCD_PKGCONFIG_DIR} /prefix)
    string(REGEX REPLACE "/$" "" up "${up}")
    set(SHCD_PC_PREFIX "\${pcfiledir}/${up}")
endif()
foreach(folder LIBDIR INCLUDEDIR)
    if(IS_ABSOLUTE ${CMAKE_INSTALL_${folder}})
        set(SHCD_PC_${folder} ${CMAKE_INSTALL_${folder}})
    else()
        set(SHCD_PC_${folder} "\${prefix}/${CMAKE_INSTALL_${folder}}")
    endif()
endforeach()

# ---- CMake package: one export set for each component ----
# shcd_install_library(TARGET COMPONENT): the library, its export set, its pkg-config file
function(shcd_install_library target component)
    install(TARGETS ${target} EXPORT shcd-${component}
            LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
    install(EXPORT shcd-${component} NAMESPACE shcd:: FILE shcd-${component}Targets.cmake
            DESTINATION ${SHCD_CMAKE_DIR})
    get_target_property(name ${target} OUTPUT_NAME)
    if(NOT name)
        set(name ${target})
    endif()
    configure_file(${PROJECT_SOURCE_DIR}/cmake/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${SHCD_PKGCONFIG_DIR})
endfunction()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/shcdConfig.cmake.in
    ${PROJECT_BINARY_DIR}/shcdConfig.cmake INSTALL_DESTINATION ${SHCD_CMAKE_DIR})
# Before 1.0 each minor version may break its callers.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/shcdConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/shcdConfig.cmake ${PROJECT_BINARY_DIR}/shcdConfigVersion.cmake
        DESTINATION ${SHCD_CMAKE_DIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

# ---- run paths ----
# The commands find the libraries of their own prefix, libshcd-fit finds the libshcd beside it.
# CMAKE_SKIP_INSTALL_RPATH=ON leaves this to the system's loader.
function(shcd_install_rpath)
    file(RELATIVE_PATH up ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    foreach(target shcd_command shcdd)
        if(TARGET ${target})
            set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${up}")
        endif()
    endforeach()
    if(TARGET shcd_fit)
        set_target_properties(shcd_fit PROPERTIES INSTALL_RPATH "$ORIGIN")
    endif()
endfunction()
