# SPDX-License-Identifier: BSD-3-Clause
# Makes the build of the whole workspace faster: what takes the compiler's time is not our code but Eigen, which every
# file reads and of which many instantiate the same, so libraries and tests are compiled six files at a time (planes:
# 62 s instead of 113). The workspace's catkin profile includes this file at each project(), and so does
# scripts/test_on. A package that is built elsewhere does without, so every file has to include what it uses; here two
# neighbours may not give the same name to something of their own. Precompiled headers save little: of a hundred
# megabytes too many have to be read again.
set(CMAKE_UNITY_BUILD ON)
set(CMAKE_UNITY_BUILD_BATCH_SIZE 6)
# Not what the speed hangs on: the solver seemed to take longer, on a machine too busy to be sure.
file(GLOB vip_slam_measured CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/solver/*.cpp
  ${PROJECT_SOURCE_DIR}/src/filter/*.cpp ${PROJECT_SOURCE_DIR}/src/tracking/*.cpp)
set_source_files_properties(${vip_slam_measured} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
