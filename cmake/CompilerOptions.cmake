# Flags shared by every target of the project, as the interface target ipl_slam_options.
add_library(ipl_slam_options INTERFACE)
target_compile_options(ipl_slam_options INTERFACE -Wall -Wextra -Wpedantic -Werror=return-type)
if(IPL_SLAM_WERROR)
  target_compile_options(ipl_slam_options INTERFACE -Werror)
endif()

# No fused multiply-add contraction: the portable and the vectorised code paths must give the same bits.
target_compile_options(ipl_slam_options INTERFACE -ffp-contract=off -fno-math-errno)

# popcnt and SSE4.2, which every x86-64 processor since 2009 has. Wider instruction sets are chosen at run time
# in the few functions that profit; raising the baseline itself would change Eigen's alignment, and with it the
# binary interface to the distribution's Ceres.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_options(ipl_slam_options INTERFACE -march=x86-64-v2)
endif()

if(IPL_SLAM_SANITIZE)
  target_compile_options(ipl_slam_options INTERFACE
    -fsanitize=${IPL_SLAM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -g)
  target_link_options(ipl_slam_options INTERFACE -fsanitize=${IPL_SLAM_SANITIZE})
  # Under AddressSanitizer Eigen turns to an allocator of its own; matrices that the distribution's Ceres
  # allocates and we free would then be freed by the wrong one.
  target_compile_definitions(ipl_slam_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

# The compiler cache works for every checkout of the project, wherever it lies: paths are taken relative to the
# checkout, and what the compiler itself writes down of them (assertions, debug information) is made relative, too.
target_compile_options(ipl_slam_options INTERFACE "-ffile-prefix-map=${PROJECT_SOURCE_DIR}/=")
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
endif()
