# SPDX-License-Identifier: BSD-3-Clause
# For packages that find vip_slam_core.

# dynamic_reconfigure looks for PythonInterp, which catkin of Debian 13 does not cache: in one CMake project, as of
# catkin_make, it is found for the first package only.
if(PYTHON_EXECUTABLE AND NOT "$CACHE{PYTHON_EXECUTABLE}")
  set(PYTHON_EXECUTABLE "${PYTHON_EXECUTABLE}" CACHE FILEPATH "The Python that catkin found" FORCE)
endif()

# Tests are linked with the installed GoogleTest, as CMake finds it. Catkin of Debian 11 finds another below /usr/src by
# GMockConfig of cmake-extras, whose targets work in the first package of a CMake project only.
if(CATKIN_ENABLE_TESTING)
  find_package(GTest MODULE QUIET)
  if(TARGET GTest::GTest)
    set(GTEST_LIBRARIES GTest::GTest)
  endif()
endif()

# vip_slam_add_test_folders(LIBRARY... [EXCEPT FOLDER...])   makes one test program per folder below test/:
# PACKAGE_test_FOLDER of its test_*.cpp, linked with the given libraries, where tests are enabled. Sets
# vip_slam_test_programs to their names. Files may include what lies in test/. Release builds compile tests without most
# of the optimisation: they run as long as before, their time goes into the libraries.
function(vip_slam_add_test_folders)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "" "EXCEPT")
  set(programs)
  file(GLOB folders RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}/test CONFIGURE_DEPENDS test/*)
  list(REMOVE_ITEM folders "" ${arg_EXCEPT})
  foreach(folder ${folders})
    file(GLOB sources CONFIGURE_DEPENDS test/${folder}/test_*.cpp)
    if(sources)
      catkin_add_gtest(${PROJECT_NAME}_test_${folder} ${sources})
    endif()
    if(TARGET ${PROJECT_NAME}_test_${folder})  # not without gtest
      target_include_directories(${PROJECT_NAME}_test_${folder} PRIVATE test)
      target_link_libraries(${PROJECT_NAME}_test_${folder} ${arg_UNPARSED_ARGUMENTS} GTest::Main)
      target_compile_options(${PROJECT_NAME}_test_${folder} PRIVATE $<$<CONFIG:Release>:-O1>)  # follows -O3 and wins
      list(APPEND programs ${PROJECT_NAME}_test_${folder})
    endif()
  endforeach()
  set(vip_slam_test_programs ${programs} PARENT_SCOPE)
endfunction()
