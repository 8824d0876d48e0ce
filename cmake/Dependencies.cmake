# Everything the build needs, found or refused here. `./dev` installs the Debian packages.
find_package(Eigen3 3.4 REQUIRED CONFIG)
find_package(Ceres 2.1 REQUIRED CONFIG)
find_package(yaml-cpp REQUIRED CONFIG)
find_package(CLI11 REQUIRED CONFIG)
find_package(spdlog REQUIRED CONFIG)
find_package(fmt REQUIRED CONFIG)
find_package(nlohmann_json REQUIRED CONFIG)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(OpenCVModules REQUIRED COMPONENTS core imgproc imgcodecs features2d calib3d video)

# Without it there is no YOLO segmenter; all else is the same.
find_package(ONNXRuntime)
if(ONNXRuntime_FOUND)
  message(STATUS "YOLO segmenter: yes, with ${ONNXRuntime_LIBRARY}")
else()
  message(STATUS "YOLO segmenter: no, ONNX Runtime was not found")
endif()
