# SPDX-License-Identifier: BSD-3-Clause
# The front end as a nodelet. Included last: ROS stays out of the library above.
#catkin_lint: ignore order_violation duplicate_find shadowed_find
find_package(catkin REQUIRED COMPONENTS
  diagnostic_updater dynamic_reconfigure geometry_msgs image_transport nav_msgs nodelet pluginlib roscpp sensor_msgs
  std_msgs tf2 tf2_ros
  vip_slam_core vip_slam_msgs vip_slam_ros)
find_package(cv_bridge REQUIRED)  # apart: its list of libraries is all of OpenCV, most of which nobody needs
find_package(OpenCV REQUIRED COMPONENTS core imgproc)

add_library(vip_slam_frontend_nodelets
  nodelet/calibration_source.cpp
  nodelet/depth_alignment.cpp
  nodelet/feature_image.cpp
  nodelet/front_end_diagnostics.cpp
  nodelet/front_end_input.cpp
  nodelet/front_end_nodelet.cpp
  nodelet/front_end_publishing.cpp
  nodelet/odometry_messages.cpp
)
target_include_directories(vip_slam_frontend_nodelets PRIVATE nodelet)
target_include_directories(vip_slam_frontend_nodelets SYSTEM PRIVATE ${catkin_INCLUDE_DIRS} ${OpenCV_INCLUDE_DIRS})
target_compile_options(vip_slam_frontend_nodelets PRIVATE -Wall -Wextra)
target_link_options(vip_slam_frontend_nodelets PRIVATE LINKER:--as-needed)
target_link_libraries(vip_slam_frontend_nodelets PRIVATE vip_slam_frontend ${catkin_LIBRARIES} ${cv_bridge_LIBRARIES}
  ${OpenCV_LIBRARIES})
add_dependencies(vip_slam_frontend_nodelets vip_slam_frontend_gencfg ${catkin_EXPORTED_TARGETS})

install(TARGETS vip_slam_frontend_nodelets LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(FILES nodelet/nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/nodelet)

if(CATKIN_ENABLE_TESTING)
  file(GLOB sources CONFIGURE_DEPENDS test/nodelet/test_*.cpp)
  catkin_add_gtest(${PROJECT_NAME}_test_nodelet ${sources})
  target_include_directories(${PROJECT_NAME}_test_nodelet PRIVATE nodelet)
  target_compile_options(${PROJECT_NAME}_test_nodelet PRIVATE $<$<CONFIG:Release>:-O1>)  # as other tests
  target_include_directories(${PROJECT_NAME}_test_nodelet SYSTEM PRIVATE ${catkin_INCLUDE_DIRS} ${OpenCV_INCLUDE_DIRS})
  target_link_libraries(${PROJECT_NAME}_test_nodelet vip_slam_frontend_nodelets vip_slam_frontend GTest::Main
    ${catkin_LIBRARIES} ${OpenCV_LIBRARIES})
endif()
