# hal/netft against its emulated peer.
set(netft ${CMAKE_CURRENT_LIST_DIR}/netft)
hapticd_test(test_netft_protocol
  SOURCES
    ${netft}/axis_map_test.cpp
    ${netft}/netft_config_test.cpp
    ${netft}/netft_configuration_test.cpp
    ${netft}/nano17_calibration_test.cpp
    ${netft}/rdt_record_test.cpp
    ${netft}/rdt_sequence_test.cpp
    ${netft}/rdt_status_test.cpp
    ${netft}/sample_clock_test.cpp
  LINK hapticd_netft)
hapticd_test(test_netft
  SOURCES
    ${netft}/netft_bias_test.cpp
    ${netft}/netft_engage_test.cpp
    ${netft}/netft_faults_test.cpp
    ${netft}/netft_reading_test.cpp
    ${CMAKE_CURRENT_LIST_DIR}/allocation_counter.cpp
  LINK hapticd_netft hapticd_test_support hapticd_emulator_netft)
hapticd_test(test_netft_section SOURCES ${netft}/netft_section_test.cpp LINK hapticd_server_files)
