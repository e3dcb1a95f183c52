# hal/phantom against its emulated peer.
set(HERE ${CMAKE_CURRENT_LIST_DIR}/phantom)
hapticd_test(test_phantom_model
  SOURCES ${HERE}/kinematics_test.cpp ${HERE}/dynamics_test.cpp ${HERE}/drive_test.cpp
          ${HERE}/config_test.cpp ${HERE}/winding_heat_test.cpp ${HERE}/motion_check_test.cpp
  LINK hapticd_phantom hapticd_emulator_board)
hapticd_test(test_phantom_device
  SOURCES ${HERE}/device_test.cpp ${HERE}/device_fault_test.cpp ${HERE}/device_exit_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/allocation_counter.cpp
  LINK hapticd_phantom hapticd_daq hapticd_emulator_board hapticd_test_support Threads::Threads)
