# Real drivers and emulated peers as one rig, under the guard.
set(HERE ${CMAKE_CURRENT_LIST_DIR}/emulated_rig)
hapticd_test(test_emulated_rig
  SOURCES ${HERE}/board_faults_test.cpp ${HERE}/live_faults_test.cpp
  LINK hapticd_emulated_rig)
hapticd_test(test_emulated_identification
  SOURCES ${HERE}/identification_test.cpp ${HERE}/wished_scene_test.cpp
  LINK hapticd_emulated_rig)
