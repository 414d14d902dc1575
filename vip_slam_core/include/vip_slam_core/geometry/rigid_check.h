// Checks matrices that users write or files hold before they are taken as transforms.
#pragma once

#include <string>

#include <Eigen/Core>

namespace vip_slam {

/// Why a matrix is no rigid transform, with what was found and expected; empty when it is one.
std::string rigidProblem(const Eigen::Matrix4d& T);

}  // namespace vip_slam
