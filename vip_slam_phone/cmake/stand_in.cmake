# SPDX-License-Identifier: BSD-3-Clause
# A program that plays a bag as the phone would. What it sends with is what the tests of the library send with too.
add_library(${PROJECT_NAME}_sending STATIC src/stand_in/rtp_writer.cpp src/stand_in/rtsp_server.cpp
  src/stand_in/server.cpp src/stand_in/video_encoder.cpp)
target_include_directories(${PROJECT_NAME}_sending PUBLIC src/stand_in PRIVATE src/video)
target_link_libraries(${PROJECT_NAME}_sending ${PROJECT_NAME} ${OpenCV_LIBRARIES} PkgConfig::AV Threads::Threads)

#catkin_lint: ignore order_violation duplicate_find shadowed_find
find_package(catkin REQUIRED COMPONENTS rosbag roscpp sensor_msgs vip_slam_core vip_slam_ros)
find_package(Boost REQUIRED COMPONENTS program_options)

add_executable(phone_stand_in src/stand_in/phone_stand_in.cpp)
target_include_directories(phone_stand_in SYSTEM PRIVATE ${catkin_INCLUDE_DIRS})
target_link_libraries(phone_stand_in ${PROJECT_NAME}_sending ${catkin_LIBRARIES} ${OpenCV_LIBRARIES}
  Boost::program_options ZLIB::ZLIB)
add_dependencies(phone_stand_in ${catkin_EXPORTED_TARGETS})
install(TARGETS phone_stand_in RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

# The nodelet against the stand-in.
if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)
  add_rostest(test/live/phone.test DEPENDENCIES phone_stand_in vip_slam_phone_nodelets)
endif()
