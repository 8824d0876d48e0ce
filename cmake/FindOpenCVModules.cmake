# Finds single OpenCV 4 modules and defines the targets opencv_<module>.
#
# OpenCV's own config file is used where it is installed. Debian ships that file only in libopencv-dev, which pulls in
# almost a gigabyte; with the small per-module packages (libopencv-core-dev, ...) headers and libraries are looked up here.
find_package(OpenCV 4 QUIET CONFIG COMPONENTS ${OpenCVModules_FIND_COMPONENTS})
if(OpenCV_FOUND)
  set(OpenCVModules_FOUND TRUE)
  return()
endif()

find_path(OpenCVModules_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
foreach(module IN LISTS OpenCVModules_FIND_COMPONENTS)
  find_library(OpenCVModules_${module}_LIBRARY opencv_${module})
  if(OpenCVModules_${module}_LIBRARY AND EXISTS ${OpenCVModules_INCLUDE_DIR}/opencv2/${module}.hpp)
    set(OpenCVModules_${module}_FOUND TRUE)
    if(NOT TARGET opencv_${module})
      add_library(opencv_${module} UNKNOWN IMPORTED)
      set_target_properties(opencv_${module} PROPERTIES
        IMPORTED_LOCATION ${OpenCVModules_${module}_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${OpenCVModules_INCLUDE_DIR})
    endif()
  endif()
  mark_as_advanced(OpenCVModules_${module}_LIBRARY)
endforeach()
mark_as_advanced(OpenCVModules_INCLUDE_DIR)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCVModules REQUIRED_VARS OpenCVModules_INCLUDE_DIR HANDLE_COMPONENTS)
