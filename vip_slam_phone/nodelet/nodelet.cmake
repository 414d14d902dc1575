# SPDX-License-Identifier: BSD-3-Clause
# The phone as a nodelet. Included last: ROS stays out of the library above.
#catkin_lint: ignore order_violation duplicate_find shadowed_find
find_package(catkin REQUIRED COMPONENTS
  diagnostic_msgs diagnostic_updater nav_msgs nodelet pluginlib roscpp sensor_msgs tf2_ros vip_slam_core vip_slam_ros)
find_package(OpenCV REQUIRED COMPONENTS core imgcodecs)

add_library(vip_slam_phone_nodelets nodelet/phone_nodelet.cpp)
target_include_directories(vip_slam_phone_nodelets SYSTEM PRIVATE ${catkin_INCLUDE_DIRS} ${OpenCV_INCLUDE_DIRS})
target_link_libraries(vip_slam_phone_nodelets vip_slam_phone ${catkin_LIBRARIES} ${OpenCV_LIBRARIES})
add_dependencies(vip_slam_phone_nodelets ${catkin_EXPORTED_TARGETS})

install(TARGETS vip_slam_phone_nodelets LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(FILES nodelet/nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/nodelet)
