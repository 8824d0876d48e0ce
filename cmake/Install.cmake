# `cmake --install`: the program, the shared library with its public headers, and the files that let another project
# say find_package(ipl_slam) and link ipl_slam::ipl_slam.
include(CMakePackageConfigHelpers)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ipl_slam)

install(TARGETS ipl_slam_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ipl_slam EXPORT ipl_slam_targets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ipl_slam ${PROJECT_BINARY_DIR}/include/ipl_slam
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.hpp")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(EXPORT ipl_slam_targets NAMESPACE ipl_slam:: FILE ipl_slam-targets.cmake DESTINATION ${config_dir})

# An ONNX Runtime that is not the system's own comes along, in a folder where it cannot be taken for anybody else's.
get_filename_component(onnxruntime_dir "${ONNXRuntime_LIBRARY}" DIRECTORY)
if(ONNXRuntime_FOUND AND NOT onnxruntime_dir IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
  set(private_dir ${CMAKE_INSTALL_LIBDIR}/ipl_slam)
  file(GLOB onnxruntime_files ${onnxruntime_dir}/libonnxruntime.so*)
  install(FILES ${onnxruntime_files} DESTINATION ${private_dir})
  file(RELATIVE_PATH from_program
    ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/ipl_slam)
  set_target_properties(ipl_slam_app PROPERTIES INSTALL_RPATH "$ORIGIN/${from_program}")
  set_target_properties(ipl_slam PROPERTIES INSTALL_RPATH "$ORIGIN/ipl_slam")
endif()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/ipl_slam-config.cmake.in
  ${PROJECT_BINARY_DIR}/ipl_slam-config.cmake INSTALL_DESTINATION ${config_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ipl_slam-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ipl_slam-config.cmake ${PROJECT_BINARY_DIR}/ipl_slam-config-version.cmake
        DESTINATION ${config_dir})
