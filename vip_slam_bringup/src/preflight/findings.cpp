// SPDX-License-Identifier: BSD-3-Clause
// All checks together, and their findings as text.
#include <algorithm>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

const char* label(Severity severity) {
  switch (severity) {
    case Severity::kGood:
      return "ok     ";
    case Severity::kNote:
      return "note   ";
    case Severity::kWarning:
      return "WARNING";
    case Severity::kError:
      return "ERROR  ";
  }
  return "";
}

const char* paint(Severity severity) {
  switch (severity) {
    case Severity::kGood:
      return "\033[32m";
    case Severity::kNote:
      return "\033[36m";
    case Severity::kWarning:
      return "\033[33m";
    case Severity::kError:
      return "\033[31m";
  }
  return "";
}

}  // namespace

Findings checkAll(const Recording& r) {
  Findings out;
  bool images_fit = true;  // else what motion they show follows from the error that is named
  for (const auto check : {checkTopics, checkRates, checkImages, checkDepthGeometry, checkSkew, checkImu}) {
    const Findings found = check(r);
    if (check == checkImages || check == checkDepthGeometry) images_fit &= worst(found) < Severity::kError;
    out.insert(out.end(), found.begin(), found.end());
  }
  if (!r.color.stamps.empty() && !r.gyro_samples.empty() && r.color_camera_error.empty()) {
    for (const auto check : {checkShaking, checkMotion}) {
      if (!images_fit) continue;
      const Findings found = check(r);
      out.insert(out.end(), found.begin(), found.end());
    }
    if (!images_fit)
      out.push_back({Severity::kNote, "camera-IMU delay", "not measured: the images have an error, see above", ""});
  }
  const Findings tf = checkTf(r);
  out.insert(out.end(), tf.begin(), tf.end());
  return out;
}

Severity worst(const Findings& findings) {
  Severity out = Severity::kGood;
  for (const Finding& f : findings) out = std::max(out, f.severity);
  return out;
}

std::string toText(const Findings& findings, bool color) {
  std::string out;
  std::size_t errors = 0, warnings = 0;
  for (const Finding& f : findings) {
    errors += f.severity == Severity::kError;
    warnings += f.severity == Severity::kWarning;
    const std::string head = color ? std::string(paint(f.severity)) + label(f.severity) + "\033[0m" : label(f.severity);
    out += head + "  " + f.about + ": " + f.text + "\n";
    if (!f.advice.empty()) out += "           -> " + f.advice + "\n";
  }
  if (errors > 0)
    out += formatted("Not ready: %zu error%s, %zu warning%s.\n", errors, errors == 1 ? "" : "s", warnings,
                     warnings == 1 ? "" : "s");
  else if (warnings > 0)
    out += formatted("Ready, with %zu warning%s.\n", warnings, warnings == 1 ? "" : "s");
  else
    out += "Ready.\n";
  return out;
}

}  // namespace vip_slam
