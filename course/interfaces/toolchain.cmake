# What CMake needs to build any ROS 2 package against the wheels.  The variable CMAKE_TOOLCHAIN_FILE names this file, so
# that `colcon build` needs no options here that a robot would not need, and options that the reader adds are kept.
get_property(trying GLOBAL PROPERTY IN_TRY_COMPILE)
if(NOT trying)
  set(CMAKE_PROJECT_INCLUDE "${CMAKE_CURRENT_LIST_DIR}/wheels.cmake")
  # The wheels have no linters, which packages made by `ros2 pkg create` look for when they build their tests.
  set(BUILD_TESTING OFF CACHE BOOL "Build the tests")
endif()
