# Tests of the whole system, on a sequence that is rendered when the tests are built.
if(CATKIN_ENABLE_TESTING)
  find_package(rostest REQUIRED)
  set(test_data ${CMAKE_CURRENT_BINARY_DIR}/test_data)
  add_custom_command(OUTPUT ${test_data}/smoke.bag
    COMMAND ${CATKIN_ENV} rosrun vip_slam_sim render_sequence smoke --out ${test_data}
    COMMENT "Rendering the test sequence" VERBATIM)
  add_custom_target(vip_slam_bringup_test_data DEPENDS ${test_data}/smoke.bag)
  foreach(test system restart bad_input offline rviz)
    add_rostest(test/system/${test}.test ARGS data:=${test_data} DEPENDENCIES vip_slam_bringup_test_data)
  endforeach()
  add_dependencies(tests vip_slam_bringup_test_data)
endif()
