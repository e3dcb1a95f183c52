# hal/daq against its emulated peer.
set(HERE ${CMAKE_CURRENT_LIST_DIR}/daq)
hapticd_test(test_daq_calibration
  SOURCES ${HERE}/calibration_test.cpp
  LINK hapticd_daq hapticd_emulator_board hapticd_test_support)
hapticd_test(test_daq_board
  SOURCES ${HERE}/board_instrument_test.cpp ${HERE}/board_test.cpp ${HERE}/scan_ring_test.cpp
  LINK hapticd_daq hapticd_emulator_board hapticd_test_support Threads::Threads)
hapticd_test(test_daq_sensor
  SOURCES ${HERE}/daq_sensor_test.cpp ${HERE}/daq_sensor_fault_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/allocation_counter.cpp
  LINK hapticd_daq hapticd_emulator_board hapticd_test_support Threads::Threads)

hapticd_test(test_board_sections
  SOURCES ${HERE}/board_sections_test.cpp
  LINK hapticd_server_files)
target_compile_definitions(test_board_sections PRIVATE HAPTICD_SOURCE_FOLDER="${CMAKE_SOURCE_DIR}")

# The comedi board needs a stand-in for the kernel's side, compiled in so that it goes before libcomedi.
if(HAPTICD_HAS_COMEDI)
  hapticd_test(test_daq_comedi
    SOURCES ${HERE}/comedi_board_test.cpp ${CMAKE_SOURCE_DIR}/tests/emulators/board/comedi_stand_in.cpp
    LINK hapticd_daq hapticd_emulator_board hapticd_test_support Threads::Threads)
  target_link_options(test_daq_comedi PRIVATE -Wl,--wrap=read)
endif()
