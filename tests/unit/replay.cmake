# Recordings as a rig: the file and the resampling.
hapticd_test(test_replay_file SOURCES ${CMAKE_CURRENT_LIST_DIR}/replay_file_test.cpp LINK hapticd_replay)
hapticd_test(test_replay_rig
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/replay_rig_test.cpp ${CMAKE_CURRENT_LIST_DIR}/allocation_counter.cpp
  LINK hapticd_replay)
