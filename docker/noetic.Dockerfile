# SPDX-License-Identifier: BSD-3-Clause
# VIP-SLAM on Ubuntu 20.04 with ROS Noetic. From the top of the repository:
#   docker build -f docker/noetic.Dockerfile -t vip_slam:noetic .
#   docker run --rm -it --network host vip_slam:noetic roslaunch vip_slam_bringup vip_slam.launch sensor:=d435i
# The simulator and the evaluation are left out where the distribution has no Embree.
FROM ros:noetic-perception
SHELL ["/bin/bash", "-euo", "pipefail", "-c"]
COPY . /ws/src/vip_slam
RUN /ws/src/vip_slam/scripts/setup && rm -rf /var/lib/apt/lists/*
WORKDIR /ws
RUN set +u && . /opt/ros/noetic/setup.bash && catkin_make install -DCMAKE_INSTALL_PREFIX=/opt/vip_slam \
    -DCATKIN_ENABLE_TESTING=OFF -DCMAKE_PROJECT_INCLUDE=/ws/src/vip_slam/scripts/faster_build.cmake && \
    rm -rf build devel
RUN sed -i '/^exec/i source /opt/vip_slam/setup.bash' /ros_entrypoint.sh
