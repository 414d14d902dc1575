# SPDX-License-Identifier: BSD-3-Clause
# Stereo depth, converters, preflight check, run report.

add_library(vip_slam_bringup
  src/convert/bag_output.cpp
  src/convert/euroc.cpp
  src/convert/finish_conversion.cpp
  src/convert/image_messages.cpp
  src/convert/stray.cpp
  src/convert/text_table.cpp
  src/convert/tum_rgbd.cpp
  src/parameter_reference.cpp
  src/preflight/camera_readings.cpp
  src/preflight/check_camera.cpp
  src/preflight/check_depth_geometry.cpp
  src/preflight/check_images.cpp
  src/preflight/check_imu.cpp
  src/preflight/check_inertial.cpp
  src/preflight/check_motion.cpp
  src/preflight/check_shaking.cpp
  src/preflight/check_streams.cpp
  src/preflight/check_tf.cpp
  src/preflight/depth_edges.cpp
  src/preflight/edge_shift.cpp
  src/preflight/findings.cpp
  src/preflight/image_rotation.cpp
  src/preflight/inertial_motion.cpp
  src/preflight/motion_estimate.cpp
  src/preflight/readout.cpp
  src/preflight/record_sources.cpp
  src/preflight/recorder.cpp
  src/stereo/disparity_refinement.cpp
  src/stereo/stereo_calibration.cpp
  src/stereo/stereo_depth.cpp
)
target_link_options(vip_slam_bringup PRIVATE LINKER:--as-needed)
target_link_libraries(vip_slam_bringup PUBLIC ${catkin_LIBRARIES} ${OpenCV_LIBS} yaml-cpp PRIVATE ${cv_bridge_LIBRARIES})

add_library(vip_slam_bringup_nodelets src/nodelets/stereo_depth_nodelet.cpp)
target_link_libraries(vip_slam_bringup_nodelets vip_slam_bringup ${catkin_LIBRARIES})

add_executable(convert_to_bag src/apps/convert_to_bag.cpp)
target_link_libraries(convert_to_bag vip_slam_bringup)

install(TARGETS vip_slam_bringup vip_slam_bringup_nodelets
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
add_executable(check_bag src/apps/check_bag.cpp)
target_link_libraries(check_bag vip_slam_bringup vip_slam_runner)

add_executable(parameter_reference src/apps/parameter_reference.cpp)
target_link_libraries(parameter_reference vip_slam_bringup)

catkin_install_python(PROGRAMS scripts/make_report DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY report DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(TARGETS check_bag convert_to_bag parameter_reference RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
install(DIRECTORY config launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  add_library(${PROJECT_NAME}_driver_bag test/driver_bag.cpp test/driver_facts.cpp)
  target_link_libraries(${PROJECT_NAME}_driver_bag vip_slam_bringup yaml-cpp)
  target_compile_definitions(${PROJECT_NAME}_driver_bag PRIVATE
    DRIVER_TABLES="${CMAKE_CURRENT_SOURCE_DIR}/test/drivers")
  vip_slam_add_test_folders(${PROJECT_NAME}_driver_bag vip_slam_bringup vip_slam_runner)
  foreach(test ${vip_slam_test_programs})
    target_compile_definitions(${test} PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config"
      ROOT="${CMAKE_CURRENT_SOURCE_DIR}/.." SCRIPT="${CMAKE_CURRENT_SOURCE_DIR}/scripts/make_report")
  endforeach()

  # Talks to running nodes.
  find_package(rostest REQUIRED)
  add_rostest_gtest(${PROJECT_NAME}_test_live_tools test/live_tools.test test/test_live_tools.cpp)
  target_link_libraries(${PROJECT_NAME}_test_live_tools ${PROJECT_NAME}_driver_bag vip_slam_bringup)
  target_compile_definitions(${PROJECT_NAME}_test_live_tools PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")
endif()
