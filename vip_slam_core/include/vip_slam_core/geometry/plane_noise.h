// Agreement of the keyframes' depth points with their planes, compared with their noise model.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam {

/// Chi-square of the distance and tilt (three degrees of freedom) between the plane (n, d) in the observation's camera
/// and the best plane through the points of G, without the points' own scatter.
double planeMisfit(const Eigen::Matrix4d& G, const Eigen::Vector4d& plane_C);

/// Misfit of one keyframe's observation of a plane, which is given by an index.
struct PlaneMisfit {
  int plane;
  double misfit;
  double square = 0;  ///< the same per point, m^2: mean squared distance from the plane
};

/// Factor, at least 1, on the information of all point-to-plane blocks. The configured floor of systematic depth error
/// is far too large for many cameras, and it does not average out, since the points of one image share it. So it is
/// estimated from the map: the factor brings the median of the observations' misfits up to that of a chi-square with
/// three degrees of freedom. 1 with too few observations, and where the floor is too small.
double planeInformationScale(const std::vector<PlaneMisfit>& misfits);

/// Additional factors on the information of single planes. One plane may represent several surfaces: fronts of boxes
/// on a shelf, offset by a hand's breadth, turned by a few degrees. Each keyframe sees other parts of it, and the error
/// is common to most of its observations. So its variance, in units of the map's typical misfit, is unknown with a
/// prior, which makes its misfits jointly Student's t. By index of plane; 1 for planes without observations, and for
/// all with too few observations.
std::vector<double> planeWeights(const std::vector<PlaneMisfit>& misfits, std::size_t planes);

/// Whether each plane, by index, is one surface. It is not when its median misfit is ten times the typical one of the
/// map, more than the noise model expects, and more than the unevenness of real walls. (Single keyframes that saw
/// another surface next to it have no influence on the median.) True for all with too few observations.
std::vector<char> planesAgree(const std::vector<PlaneMisfit>& misfits, std::size_t planes);

}  // namespace vip_slam
