#include "vip_slam_backend/map_io/point_files.h"

#include <ostream>

#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {
namespace {

void writeRows(std::ostream& out, const Map& map) {
  out.precision(9);
  for (const LandmarkId id : map.landmarkIds()) {
    const MapLandmark& l = map.landmark(id);
    out << l.p_W.x() << ' ' << l.p_W.y() << ' ' << l.p_W.z() << ' ' << l.plane << '\n';
  }
}

}  // namespace

void writePointsPly(const std::string& path, const Map& map) {
  AtomicFile file(path);
  file.stream() << "ply\nformat ascii 1.0\ncomment points of a VIP-SLAM map, metres\nelement vertex "
                << map.landmarks().size()
                << "\nproperty double x\nproperty double y\nproperty double z\nproperty uint plane\nend_header\n";
  writeRows(file.stream(), map);
  file.commit();
}

void writePointsPcd(const std::string& path, const Map& map) {
  AtomicFile file(path);
  const std::size_t n = map.landmarks().size();
  file.stream() << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH "
                << n << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << n << "\nDATA ascii\n";
  writeRows(file.stream(), map);
  file.commit();
}

}  // namespace vip_slam
