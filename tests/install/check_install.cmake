# Installs the build into an empty prefix, configures examples/ against it as a stranger would, builds and runs it.
#   cmake -DBUILD_DIR=... -DSOURCE_DIR=... -DWORK_DIR=... -DGENERATOR=... -DCXX=... -DCXX_FLAGS=... -P check_install.cmake
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nfailed with ${result}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
set(prefix ${WORK_DIR}/prefix)
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})

# What the public headers include must be the standard library or themselves.
file(GLOB headers ${prefix}/include/ipl_slam/*.hpp)
if(NOT headers)
  message(FATAL_ERROR "no header was installed under ${prefix}/include/ipl_slam")
endif()
foreach(header IN LISTS headers)
  file(STRINGS ${header} foreign REGEX "#include.*(opencv|Eigen|ceres|yaml|spdlog|fmt|nlohmann|\")")
  if(foreign)
    message(FATAL_ERROR "${header} must not need anything but the standard library: ${foreign}")
  endif()
endforeach()

run(${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE_DIR}/examples -B ${WORK_DIR}/build
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=Release
    "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}")
run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run(${CMAKE_COMMAND} -E chdir ${WORK_DIR}/build ${WORK_DIR}/build/minimal)

# The camera moved 0.29 m to the right. 2 cm is far above what the noise-free pictures cost and far below the way.
if(NOT output MATCHES "frame 29: tracking, x = \\+0\\.(2[789]|30)")
  message(FATAL_ERROR "the example did not find its way:\n${output}")
endif()
file(STRINGS ${WORK_DIR}/build/trajectory.txt poses REGEX "^[0-9]")
list(LENGTH poses count)
if(NOT count EQUAL 30)
  message(FATAL_ERROR "trajectory.txt holds ${count} poses, 30 frames were given")
endif()

run(${prefix}/bin/ipl_slam --version)
if(NOT output MATCHES "^ipl_slam [0-9]+\\.[0-9]+\\.[0-9]+")
  message(FATAL_ERROR "the installed program does not tell its version: ${output}")
endif()
