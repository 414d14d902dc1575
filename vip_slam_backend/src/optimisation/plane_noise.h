// How well the depth points of keyframes on planes agree with the planes, against what their noise model expects.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam {

/// Squared, weighted distance and tilt (three degrees of freedom) between the plane (n, d) in the observation's camera
/// and the best plane through the points behind G: what the points' own scatter leaves out.
double planeMisfit(const Eigen::Matrix4d& G, const Eigen::Vector4d& plane_C);

/// Factor on the information of all point-to-plane blocks. A depth camera's floor of systematic error is a figure that
/// many cameras keep far below and some exceed, and the points of one image share it, so that it does not average out:
/// the map itself tells. The factor brings the median of the observations' misfits to that of a chi square with three
/// degrees of freedom. 1 with too few observations to tell.
double planeInformationScale(std::vector<double> misfits);

}  // namespace vip_slam
