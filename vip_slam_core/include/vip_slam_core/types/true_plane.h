// SPDX-License-Identifier: BSD-3-Clause
// A plane that is known to be there, with how long and how much of it was in view: what found planes are judged by.
#pragma once

#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct TruePlane : PlaneEstimate {
  double seen_seconds = -1;  ///< time in view, s; -1: not known
  double seen_area = -1;     ///< area that was ever in view, m^2; -1: not known
};

}  // namespace vip_slam
