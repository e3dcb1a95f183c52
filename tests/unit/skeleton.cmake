# The template of a driver, against a device that is a few variables.
hapticd_test(test_skeleton_device
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/skeleton/skeleton_device_test.cpp ${CMAKE_CURRENT_LIST_DIR}/allocation_counter.cpp
  LINK hapticd_skeleton)
