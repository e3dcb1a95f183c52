# hal/turntable and hal/modbus against an emulated drive, over sockets and pty pairs.
hapticd_library(hapticd_driven_rig
  FOLDERS tests/unit/modbus
  LINK hapticd_turntable_config hapticd_emulated_drive_library)
set(folder ${CMAKE_CURRENT_LIST_DIR}/modbus)
hapticd_test(test_modbus_turntable
  SOURCES ${folder}/modbus_turntable_test.cpp
  LINK hapticd_driven_rig)
