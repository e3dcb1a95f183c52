# hal/turntable and hal/modbus against an emulated drive, over sockets and pty pairs.
hapticd_library(hapticd_driven_rig
  FOLDERS tests/unit/modbus
  LINK hapticd_turntable_config hapticd_emulated_drive_library hapticd_test_support)
set(folder ${CMAKE_CURRENT_LIST_DIR}/modbus)
hapticd_test(test_modbus_turntable
  SOURCES ${folder}/modbus_turntable_test.cpp
  LINK hapticd_driven_rig)
hapticd_test(test_modbus_faults
  SOURCES ${folder}/modbus_faults_test.cpp
  LINK hapticd_driven_rig)
hapticd_test(test_register_map
  SOURCES ${folder}/register_codec_test.cpp ${folder}/register_map_test.cpp ${folder}/turntable_section_test.cpp
  LINK hapticd_driven_rig)
hapticd_test(test_motion_supervisor
  SOURCES ${folder}/motion_supervisor_test.cpp
  LINK hapticd_turntable)
hapticd_test(test_simulated_turntable SOURCES ${folder}/simulated_turntable_test.cpp LINK hapticd_sim)
hapticd_test(test_modbus_peers
  SOURCES ${folder}/modbus_peers_test.cpp
  LINK hapticd_driven_rig)
target_compile_definitions(test_modbus_peers PRIVATE
  PYMODBUS_DRIVE="${CMAKE_SOURCE_DIR}/tests/emulators/modbus/pymodbus_drive.py")
