# SPDX-License-Identifier: BSD-3-Clause
#catkin_lint: ignore duplicate_find uninstalled_target
# Tests of the whole system, on a sequence that is rendered when the tests are built.
if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)
  find_package(vip_slam_sim QUIET)
endif()
if(CATKIN_ENABLE_TESTING AND NOT vip_slam_sim_FOUND)
  message(STATUS "vip_slam_bringup: without vip_slam_sim, which needs Embree, the tests of the whole system are left out")
elseif(CATKIN_ENABLE_TESTING)
  set(test_data ${CMAKE_CURRENT_BINARY_DIR}/test_data)
  add_custom_command(OUTPUT ${test_data}/smoke.bag
    COMMAND ${CATKIN_ENV} rosrun vip_slam_sim render_sequence smoke --out ${test_data}
    COMMENT "Rendering the test sequence" VERBATIM)
  add_custom_command(OUTPUT ${test_data}/other_room.bag
    COMMAND ${CATKIN_ENV} rosrun vip_slam_sim render_sequence ${CMAKE_CURRENT_SOURCE_DIR}/test/system/other_room.yaml
      --out ${test_data}
    DEPENDS test/system/other_room.yaml
    COMMENT "Rendering another room" VERBATIM)
  add_custom_target(vip_slam_bringup_test_data DEPENDS ${test_data}/smoke.bag ${test_data}/other_room.bag)
  add_executable(render_euroc_folder EXCLUDE_FROM_ALL test/render_euroc_folder.cpp)
  target_include_directories(render_euroc_folder PRIVATE ${vip_slam_sim_INCLUDE_DIRS})
  target_link_libraries(render_euroc_folder vip_slam_bringup ${vip_slam_sim_LIBRARIES})
  target_compile_definitions(render_euroc_folder PRIVATE CONFIG_DIR="${CMAKE_CURRENT_SOURCE_DIR}/config")
  add_dependencies(tests render_euroc_folder)
  foreach(test system restart bad_input compressed offline euroc rviz phone)
    add_rostest(test/system/${test}.test ARGS data:=${test_data} DEPENDENCIES vip_slam_bringup_test_data)
  endforeach()
  # In one CMake project with the simulator, as of catkin_make, the program has to be there first.
  if(TARGET render_sequence)
    add_dependencies(vip_slam_bringup_test_data render_sequence)
  endif()
  add_dependencies(tests vip_slam_bringup_test_data)
endif()
