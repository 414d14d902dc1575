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
  src/preflight/check_images.cpp
  src/preflight/check_imu.cpp
  src/preflight/check_motion.cpp
  src/preflight/check_streams.cpp
  src/preflight/check_tf.cpp
  src/preflight/findings.cpp
  src/preflight/image_rotation.cpp
  src/preflight/readout.cpp
  src/preflight/record_sources.cpp
  src/preflight/recorder.cpp
  src/stereo/disparity_refinement.cpp
  src/stereo/stereo_calibration.cpp
  src/stereo/stereo_depth.cpp
)
target_link_libraries(vip_slam_bringup ${catkin_LIBRARIES} ${OpenCV_LIBS} yaml-cpp)

add_library(vip_slam_bringup_nodelets src/nodelets/stereo_depth_nodelet.cpp)
target_link_libraries(vip_slam_bringup_nodelets vip_slam_bringup ${catkin_LIBRARIES})

add_executable(convert_to_bag src/apps/convert_to_bag.cpp)
target_link_libraries(convert_to_bag vip_slam_bringup)

install(TARGETS vip_slam_bringup vip_slam_bringup_nodelets
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
add_executable(check_bag src/apps/check_bag.cpp)
target_link_libraries(check_bag vip_slam_bringup)

add_executable(parameter_reference src/apps/parameter_reference.cpp)
target_link_libraries(parameter_reference vip_slam_bringup)

catkin_install_python(PROGRAMS scripts/make_report DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY report DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(TARGETS check_bag convert_to_bag parameter_reference RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
install(DIRECTORY config launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_stereo_depth test/test_stereo_depth.cpp)
  target_link_libraries(test_stereo_depth vip_slam_bringup)
  target_compile_definitions(test_stereo_depth PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")

  catkin_add_gtest(test_converters test/test_converters.cpp)
  target_link_libraries(test_converters vip_slam_bringup)

  catkin_add_gtest(test_sensor_files test/test_sensor_files.cpp)
  target_link_libraries(test_sensor_files vip_slam_bringup)
  target_compile_definitions(test_sensor_files PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")

  catkin_add_gtest(test_readout test/test_readout.cpp)
  target_link_libraries(test_readout vip_slam_bringup gtest_main)

  add_library(${PROJECT_NAME}_driver_bag test/driver_bag.cpp)
  target_link_libraries(${PROJECT_NAME}_driver_bag vip_slam_bringup)
  foreach(thing bag_extrinsics bag_reader check_bag driver_bags)
    catkin_add_gtest(test_${thing} test/test_${thing}.cpp)
    target_link_libraries(test_${thing} ${PROJECT_NAME}_driver_bag vip_slam_bringup vip_slam_runner)
    target_compile_definitions(test_${thing} PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")
  endforeach()

  catkin_add_gtest(test_pipeline test/test_pipeline.cpp)
  target_link_libraries(test_pipeline vip_slam_bringup vip_slam_runner gtest_main)

  catkin_add_gtest(test_documents test/test_documents.cpp)
  target_link_libraries(test_documents vip_slam_bringup)
  target_compile_definitions(test_documents PRIVATE ROOT="${CMAKE_CURRENT_SOURCE_DIR}/..")

  catkin_add_gtest(test_report test/test_report.cpp)
  target_link_libraries(test_report yaml-cpp)
  target_compile_definitions(test_report PRIVATE SCRIPT="${CMAKE_CURRENT_SOURCE_DIR}/scripts/make_report")

  find_package(rostest REQUIRED)
  add_rostest_gtest(test_live_tools test/live_tools.test test/test_live_tools.cpp)
  target_link_libraries(test_live_tools ${PROJECT_NAME}_driver_bag vip_slam_bringup)
  target_compile_definitions(test_live_tools PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")
endif()
