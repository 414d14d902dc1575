# The offline runner.

add_library(vip_slam_runner
  src/runner/bag_reader.cpp
  src/runner/pipeline.cpp
  src/runner/progress_bar.cpp
  src/runner/run_output.cpp
  src/runner/trajectory_assembly.cpp
)
target_link_libraries(vip_slam_runner ${catkin_LIBRARIES} ${OpenCV_LIBRARIES} yaml-cpp)

add_executable(run_bag src/apps/run_bag.cpp)
target_link_libraries(run_bag vip_slam_runner CLI11::CLI11)

install(TARGETS vip_slam_runner LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(TARGETS run_bag RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_trajectory_assembly test/test_trajectory_assembly.cpp)
  target_link_libraries(test_trajectory_assembly vip_slam_runner gtest_main)
endif()
