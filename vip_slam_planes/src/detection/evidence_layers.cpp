// SPDX-License-Identifier: BSD-3-Clause
#include "evidence_layers.h"

#include <cmath>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

// Median offset from a plane of the evidence that keyframes have told to be another layer beside it; 0: none.
double layerBeside(const PlaneTrack& plane, const std::vector<EvidenceTriangle>& evidence) {
  std::vector<double> offset;
  for (const EvidenceTriangle& e : evidence) {
    if (e.beside == plane.id()) offset.push_back(plane.plane().signedDistance(e.triangle.centre));
  }
  return offset.empty() ? 0.0 : upperMedian(std::move(offset));
}

}  // namespace

std::vector<MapTriangle> trianglesOf(const std::vector<EvidenceTriangle>& evidence) {
  std::vector<MapTriangle> triangles;
  triangles.reserve(evidence.size());
  for (const EvidenceTriangle& e : evidence) triangles.push_back(e.triangle);
  return triangles;
}

std::vector<char> belongsTo(const std::vector<const PlaneTrack*>& known, const std::vector<EvidenceTriangle>& evidence,
                            const std::vector<int>& label) {
  std::vector<double> layer;
  for (const PlaneTrack* plane : known) layer.push_back(layerBeside(*plane, evidence));
  std::vector<char> belongs(evidence.size());
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    if (label[i] < 0 || known[label[i]]->id() == evidence[i].beside) continue;
    const double offset = known[label[i]]->plane().signedDistance(evidence[i].triangle.centre);
    belongs[i] = layer[label[i]] == 0 || std::abs(offset - layer[label[i]]) > std::abs(offset);
  }
  return belongs;
}

}  // namespace vip_slam
