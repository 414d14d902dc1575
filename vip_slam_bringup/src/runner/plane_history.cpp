// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/plane_history.h"

#include <iomanip>

#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {

void writePlaneHistory(const std::string& path, const std::vector<PlaneRecord>& history) {
  AtomicFile file(path);
  file.stream() << "t,id,nx,ny,nz,d\n" << std::fixed;
  for (const PlaneRecord& record : history) {
    const Eigen::Vector3d& n = record.plane.n;
    file.stream() << std::setprecision(9) << record.t << ',' << record.id << std::setprecision(6) << ',' << n.x() << ','
                  << n.y() << ',' << n.z() << ',' << record.plane.d << '\n';
  }
  file.commit();
}

}  // namespace vip_slam
