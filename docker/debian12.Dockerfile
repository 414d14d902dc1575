# SPDX-License-Identifier: BSD-3-Clause
# VIP-SLAM on Debian 12, from its own packages alone. From the top of the repository:
#   docker build -f docker/debian12.Dockerfile -t vip_slam:debian12 .
#   docker run --rm -it --network host vip_slam:debian12 roslaunch vip_slam_bringup vip_slam.launch sensor:=d435i
FROM debian:12
SHELL ["/bin/bash", "-euo", "pipefail", "-c"]
COPY . /ws/src/vip_slam
RUN /ws/src/vip_slam/scripts/setup && rm -rf /var/lib/apt/lists/*
WORKDIR /ws
RUN catkin_make install -DCMAKE_INSTALL_PREFIX=/opt/vip_slam -DCATKIN_ENABLE_TESTING=OFF \
    -DCMAKE_PROJECT_INCLUDE=/ws/src/vip_slam/scripts/faster_build.cmake && rm -rf build devel
RUN printf '#!/bin/bash\nsource /opt/vip_slam/setup.bash\nexec "$@"\n' >/entrypoint && chmod +x /entrypoint
ENTRYPOINT ["/entrypoint"]
CMD ["bash"]
