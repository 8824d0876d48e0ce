# Finds ONNX Runtime and defines the target onnxruntime::onnxruntime.
#
# Looked for in this order: the folder ONNXRUNTIME_ROOT, what `./dev` unpacked, the system. The library may lie there as
# libonnxruntime.so.1, without the plain name that development packages add.
set(ONNXRUNTIME_ROOT "" CACHE PATH "Folder with include/ and lib/ of an ONNX Runtime to use before any other")
set(ONNXRuntime_FOLDERS ${ONNXRUNTIME_ROOT} ${PROJECT_SOURCE_DIR}/build/third_party/onnxruntime)

find_path(ONNXRuntime_INCLUDE_DIR onnxruntime_cxx_api.h
  HINTS ${ONNXRuntime_FOLDERS}
  PATH_SUFFIXES include include/onnxruntime onnxruntime onnxruntime/core/session include/onnxruntime/core/session)
find_library(ONNXRuntime_LIBRARY NAMES onnxruntime libonnxruntime.so.1
  HINTS ${ONNXRuntime_FOLDERS} PATH_SUFFIXES lib)
mark_as_advanced(ONNXRuntime_INCLUDE_DIR ONNXRuntime_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(ONNXRuntime REQUIRED_VARS ONNXRuntime_LIBRARY ONNXRuntime_INCLUDE_DIR)
if(ONNXRuntime_FOUND AND NOT TARGET onnxruntime::onnxruntime)
  add_library(onnxruntime::onnxruntime UNKNOWN IMPORTED)
  set_target_properties(onnxruntime::onnxruntime PROPERTIES
    IMPORTED_LOCATION ${ONNXRuntime_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${ONNXRuntime_INCLUDE_DIR})
endif()
