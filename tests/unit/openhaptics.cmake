# hal/openhaptics against a stand-in for the vendor's library, met by dlopen as the real one would be.
hapticd_test(test_openhaptics
  SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/calibration_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/configuration_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/faults_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/force_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/frame_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/library_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/scheduler_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/openhaptics/two_devices_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/allocation_counter.cpp
  LINK hapticd_openhaptics hapticd_hd_page hapticd_test_support)
hd_stand_in_test(test_openhaptics)
# The simulated physics between emulated peers, with this driver at their other end.
hapticd_test(test_emulated_bench
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/openhaptics/bench_test.cpp
  LINK hapticd_openhaptics hapticd_emulated_bench hapticd_hd_page hapticd_test_support)
hd_stand_in_test(test_emulated_bench)
