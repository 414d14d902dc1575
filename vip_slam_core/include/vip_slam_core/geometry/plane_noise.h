// How well the depth points of keyframes on planes agree with the planes, against what their noise model expects.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam {

/// Squared, weighted distance and tilt (three degrees of freedom) between the plane (n, d) in the observation's camera
/// and the best plane through the points behind G: what the points' own scatter leaves out.
double planeMisfit(const Eigen::Matrix4d& G, const Eigen::Vector4d& plane_C);

/// Of one keyframe's observation of a plane, which is named by an index.
struct PlaneMisfit {
  int plane;
  double misfit;
  double square = 0;  ///< the same per point, m^2: how far the points lie off the plane
};

/// Factor on the information of all point-to-plane blocks. A depth camera's floor of systematic error is a figure that
/// many cameras keep far below and some exceed, and the points of one image share it, so that it does not average out:
/// the map itself tells. The factor brings the median of the observations' misfits to that of a chi square with three
/// degrees of freedom. 1 with too few observations to tell.
double planeInformationScale(const std::vector<PlaneMisfit>& misfits);

/// Factors on the information of single planes, on top of that. What passes for one plane may be several surfaces:
/// fronts of boxes on a shelf, a hand's breadth apart, a few degrees turned. Each keyframe sees other parts of it, and
/// what is wrong with the plane is wrong with most of its observations. So its variance, in units of the map's typical
/// misfit, is a variable of its own with a prior, which makes its misfits jointly Student's t. By index of plane; 1 for
/// those that are not mentioned and for all with too few observations to tell.
std::vector<double> planeWeights(const std::vector<PlaneMisfit>& misfits, std::size_t planes);

/// Whether each plane, by index, is one surface: not when its median misfit is ten times what is typical of the map,
/// more than the noise model expects, and more than real walls are uneven. (Single keyframes that saw something else
/// beside it say nothing about the plane.) All are with too few observations.
std::vector<char> planesAgree(const std::vector<PlaneMisfit>& misfits, std::size_t planes);

}  // namespace vip_slam
