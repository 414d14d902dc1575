# SPDX-License-Identifier: BSD-3-Clause
# The plane module as a nodelet. Included last: ROS stays out of the library above.
#catkin_lint: ignore order_violation duplicate_find shadowed_find
find_package(catkin REQUIRED COMPONENTS
  diagnostic_updater dynamic_reconfigure nodelet pluginlib roscpp sensor_msgs std_msgs visualization_msgs
  vip_slam_core vip_slam_msgs vip_slam_ros)
find_package(PCL QUIET REQUIRED COMPONENTS common)
find_package(pcl_conversions REQUIRED)  # headers alone: its list of libraries has VTK and Qt

add_library(vip_slam_planes_nodelets nodelet/plane_display.cpp nodelet/planes_nodelet.cpp)
target_include_directories(vip_slam_planes_nodelets PRIVATE nodelet)
target_include_directories(vip_slam_planes_nodelets SYSTEM PRIVATE ${catkin_INCLUDE_DIRS} ${PCL_INCLUDE_DIRS})
target_compile_options(vip_slam_planes_nodelets PRIVATE -Wall -Wextra)
target_link_libraries(vip_slam_planes_nodelets vip_slam_planes ${catkin_LIBRARIES})
add_dependencies(vip_slam_planes_nodelets vip_slam_planes_gencfg ${catkin_EXPORTED_TARGETS})

install(TARGETS vip_slam_planes_nodelets LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(FILES nodelet/nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/nodelet)

if(TARGET ${PROJECT_NAME}_test_nodelet)
  target_include_directories(${PROJECT_NAME}_test_nodelet PRIVATE nodelet)
  target_include_directories(${PROJECT_NAME}_test_nodelet SYSTEM PRIVATE ${catkin_INCLUDE_DIRS} ${PCL_INCLUDE_DIRS}
    ${pcl_conversions_INCLUDE_DIRS})
  target_link_libraries(${PROJECT_NAME}_test_nodelet vip_slam_planes_nodelets ${PCL_COMMON_LIBRARIES})
endif()
