# SPDX-License-Identifier: BSD-3-Clause
# The back end as a nodelet. Included last: ROS stays out of the library above.
#catkin_lint: ignore order_violation duplicate_find shadowed_find
find_package(catkin REQUIRED COMPONENTS
  diagnostic_updater dynamic_reconfigure geometry_msgs nav_msgs nodelet pluginlib roscpp sensor_msgs std_msgs std_srvs
  tf2_ros visualization_msgs vip_slam_core vip_slam_msgs vip_slam_ros)

add_library(vip_slam_backend_nodelets
  nodelet/back_end_nodelet.cpp
  nodelet/back_end_output.cpp
  nodelet/back_end_services.cpp
  nodelet/map_display.cpp
  nodelet/pose_in_map.cpp
)
target_include_directories(vip_slam_backend_nodelets PRIVATE nodelet)
target_include_directories(vip_slam_backend_nodelets SYSTEM PRIVATE ${catkin_INCLUDE_DIRS} ${PCL_INCLUDE_DIRS})
target_compile_options(vip_slam_backend_nodelets PRIVATE -Wall -Wextra)
target_link_libraries(vip_slam_backend_nodelets PRIVATE vip_slam_backend ${catkin_LIBRARIES})
add_dependencies(vip_slam_backend_nodelets vip_slam_backend_gencfg ${catkin_EXPORTED_TARGETS})

install(TARGETS vip_slam_backend_nodelets LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(FILES nodelet/nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/nodelet)
