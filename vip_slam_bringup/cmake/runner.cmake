# SPDX-License-Identifier: BSD-3-Clause
# The offline runner.

add_library(vip_slam_runner
  src/runner/bag_extrinsics.cpp
  src/runner/bag_decoding.cpp
  src/runner/bag_reader.cpp
  src/runner/mapping_thread.cpp
  src/runner/pipeline.cpp
  src/runner/plane_files.cpp
  src/runner/plane_history.cpp
  src/runner/run_output.cpp
  src/runner/run_warnings.cpp
  src/runner/trial_run.cpp
)
target_link_libraries(vip_slam_runner ${catkin_LIBRARIES} ${OpenCV_LIBRARIES} yaml-cpp)

add_executable(run_bag src/apps/run_bag.cpp)
target_link_libraries(run_bag vip_slam_runner)

install(TARGETS vip_slam_runner LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(DIRECTORY rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
add_executable(train_vocabulary src/apps/train_vocabulary.cpp)
target_link_libraries(train_vocabulary vip_slam_runner)

install(TARGETS run_bag train_vocabulary RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
catkin_install_python(PROGRAMS scripts/record_run scripts/start_when_ready
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
# Both import it from their own folder, which in the devel space is the source folder.
install(FILES scripts/sensor_topics.py DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
