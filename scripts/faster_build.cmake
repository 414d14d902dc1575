# Makes the build of the whole workspace faster: what takes the compiler's time is not our code but Eigen, which every
# file reads and of which many instantiate the same, so libraries are compiled six files at a time (planes: 62 s instead
# of 113), and so are test programs, those without most of the optimisation: they run as long as before, their time goes
# into the libraries. The workspace's catkin profile includes this file at each project(). A package that is built
# elsewhere does without, so every file has to include what it uses; here two neighbours may not give the same name to
# something of their own. Precompiled headers save little: of a hundred megabytes too many have to be read again.
if(CMAKE_VERSION VERSION_LESS 3.19)
  return()  # no cmake_language(DEFER)
endif()

function(vip_slam_faster_build)
  get_property(targets DIRECTORY PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    if(type MATCHES "^(STATIC|SHARED)_LIBRARY$")
      set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
      # Not what the speed hangs on: the solver seemed to take longer, on a machine too busy to be sure.
      get_target_property(sources ${target} SOURCES)
      foreach(source ${sources})
        if(source MATCHES "src/(solver|filter|tracking)/")
          set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
        endif()
      endforeach()
    elseif(type STREQUAL "EXECUTABLE" AND target MATCHES "(^|_)test_")
      set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 6)
      target_compile_options(${target} PRIVATE -O1)  # follows the build type's -O3 and wins
    endif()
  endforeach()
endfunction()

cmake_language(DEFER CALL vip_slam_faster_build)
