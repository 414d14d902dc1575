// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/back_end_options.h"

#include <stdexcept>

namespace vip_slam {

Variant variantFromName(const std::string& name) {
  for (const Variant v : {Variant::kVi, Variant::kViP, Variant::kViCp, Variant::kVip})
    if (name == variantName(v)) return v;
  throw std::invalid_argument("variant: '" + name + "', expected vi, vi_p, vi_cp or vip");
}

const char* variantName(Variant variant) {
  switch (variant) {
    case Variant::kVi:
      return "vi";
    case Variant::kViP:
      return "vi_p";
    case Variant::kViCp:
      return "vi_cp";
    case Variant::kVip:
      return "vip";
  }
  return "?";
}

}  // namespace vip_slam
