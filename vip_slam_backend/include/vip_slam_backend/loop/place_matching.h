// SPDX-License-Identifier: BSD-3-Clause
// Descriptor matches between two keyframes that may show the same place, guided by the direct index: only features
// below the same vocabulary node are compared.
#pragma once

#include <utility>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/place_recognition/vocabulary.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

/// (feature of a, feature of b), each used once, ascending a. Best distance below max_hamming and clearly better than
/// the second best; matches whose change of ORB angle differs from the bulk are dropped.
std::vector<std::pair<std::uint32_t, std::uint32_t>> matchByDirectIndex(const std::vector<Feature>& a,
                                                                        const DirectIndex& index_a,
                                                                        const std::vector<Feature>& b,
                                                                        const DirectIndex& index_b,
                                                                        const PlaceVerificationOptions& options);

}  // namespace vip_slam
