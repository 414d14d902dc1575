// SPDX-License-Identifier: BSD-3-Clause
// Encodings, sizes, calibration, depth values, colour against depth.
#include <algorithm>
#include <cmath>

#include "vip_slam_bringup/preflight/camera_readings.h"
#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_ros/image_pairer.h"

namespace vip_slam {
namespace {

std::string sizeText(const std::pair<int, int>& size) { return vip_slam::sizeText({size.first, size.second}); }

void checkEncoding(const std::string& role, const StreamRecord& stream, const std::string& expected, Findings* out) {
  if (stream.stamps.empty()) return;
  if (stream.unusable > 0)
    out->push_back({stream.unusable * 2 > stream.stamps.size() ? Severity::kError : Severity::kWarning, role,
                    formatted("%zu images could not be decoded: ", stream.unusable) + stream.unusable_reason,
                    role == "depth image" ? "record depth as the driver has it, 16UC1 or 32FC1, or as compressedDepth; "
                                            "grey levels and JPEG have lost it"
                                          : "record raw images, JPEG or PNG"});
  for (const std::string& encoding : stream.encodings) {
    if (stream.unusable * 2 > stream.stamps.size()) break;  // the cause is named
    const bool same = encoding == expected || (expected == "16UC1" && encoding == "mono16") ||
                      (expected == "mono8" && encoding == "8UC1");
    if (expected == "compressed" || same)
      out->push_back({Severity::kGood, role, "encoding " + encoding, ""});
    else
      out->push_back({Severity::kWarning, role, "encoding is " + encoding + ", the sensor file says " + expected,
                      "correct the sensor file; colours or depth units may be read wrongly"});
  }
  if (stream.sizes.size() > 1)
    out->push_back({Severity::kError, role, "the image size changes during the recording", ""});
}

void checkCamera(const std::string& role, const StreamRecord& info, const CameraIntrinsics& camera,
                 const std::string& error, const StreamRecord& images, bool required, Findings* out) {
  if (info.stamps.empty()) return;  // reported by checkTopics
  if (!error.empty()) {
    out->push_back({required ? Severity::kError : Severity::kWarning, role, error,
                    "calibrate the camera, or put the intrinsics into the sensor file"});
    return;
  }
  if (images.sizes.size() == 1 && *images.sizes.begin() != std::make_pair(camera.width, camera.height))
    out->push_back(
        {Severity::kError, role,
         "says " + sizeText({camera.width, camera.height}) + ", the images are " + sizeText(*images.sizes.begin()),
         "the calibration belongs to another resolution"});
  else if (std::abs(camera.fx / camera.fy - 1) > 0.1 || camera.cx < 0.25 * camera.width ||
           camera.cx > 0.75 * camera.width)
    out->push_back({Severity::kWarning, role,
                    formatted("unusual calibration: fx %.1f, fy %.1f, cx %.1f, cy %.1f", camera.fx, camera.fy,
                              camera.cx, camera.cy),
                    "check it"});
  else
    out->push_back({Severity::kGood, role,
                    formatted("fx %.1f, fy %.1f, cx %.1f, cy %.1f", camera.fx, camera.fy, camera.cx, camera.cy), ""});
}

/// A lens that focuses changes its focal length.
void checkFocus(const Recording& r, Findings* out) {
  constexpr double kMatters = 0.002;
  const double change = r.color_focal_to / std::max(r.color_focal_from, 1e-9) - 1;
  if (r.color_focal_to == 0 || change < kMatters) return;
  const std::string what =
      formatted("K changes: fx from %.2f to %.2f, by %.1f %%", r.color_focal_from, r.color_focal_to, 100 * change);
  if (r.sensor.intrinsics_from_camera_info)
    out->push_back({Severity::kNote, "colour camera_info", what + "; images and depth are brought to one K", ""});
  else
    out->push_back(
        {Severity::kError, "colour camera_info", what + "; the sensor file's is taken for all images",
         "intrinsics_from_camera_info: true, so that each image has its own, or switch off autofocus and zoom"});
}

/// Compares the calibration of the sensor file with the images, and with camera_info where there is one.
void checkSensorFileCamera(const Recording& r, Findings* out) {
  const CameraIntrinsics& camera = r.sensor.camera;
  if (r.color.sizes.size() == 1 && *r.color.sizes.begin() != std::make_pair(camera.width, camera.height))
    out->push_back({Severity::kError, "camera",
                    "the sensor file says " + sizeText({camera.width, camera.height}) + ", the images are " +
                        sizeText(*r.color.sizes.begin()),
                    "calibrate for the resolution that is recorded"});
  const CameraIntrinsics& info = r.color_camera;
  if (info.width != camera.width || info.height != camera.height) return;
  constexpr double kMatters = 0.01;  // of the image's width: 2 % of the focal length
  const double apart = pixelsApart(camera, info);
  if (apart > kMatters * camera.width)
    out->push_back({Severity::kWarning, "camera",
                    formatted("the sensor file says fx %.1f, fy %.1f, cx %.1f, cy %.1f, distortion %s, camera_info fx "
                              "%.1f, fy %.1f, cx %.1f, cy %.1f, distortion %s: ",
                              camera.fx, camera.fy, camera.cx, camera.cy, distortionModelName(camera.model).c_str(),
                              info.fx, info.fy, info.cx, info.cy, distortionModelName(info.model).c_str()) +
                        (std::isfinite(apart) ? formatted("up to %.0f pixels apart", apart)
                                              : std::string("the one sees what the other does not")),
                    "the sensor file's are used; set intrinsics_from_camera_info when the driver is calibrated"});
}

void checkMask(const Recording& r, Findings* out) {
  if (r.sensor.mask.empty() || r.color.sizes.size() != 1) return;
  const std::string problem = maskProblem(r.sensor, r.color.sizes.begin()->first, r.color.sizes.begin()->second);
  if (problem.empty()) {
    const double used = cv::countNonZero(r.sensor.mask) / double(r.sensor.mask.total());
    out->push_back({Severity::kGood, "mask", formatted("leaves %.0f %% of the image", 100 * used), ""});
  } else {
    out->push_back({Severity::kError, "mask", problem.substr(std::string("mask: ").size()),
                    "draw it on an image as the topic carries it"});
  }
}

void checkBrightness(const std::vector<BrightnessSample>& samples, Findings* out) {
  if (samples.empty()) return;
  std::vector<double> mean, spread;
  for (const BrightnessSample& s : samples) {
    mean.push_back(s.mean);
    spread.push_back(s.spread);
  }
  if (upperMedian(spread) < 2)
    out->push_back({Severity::kError, "colour image",
                    formatted("shows nothing: all pixels about %.0f of 255", upperMedian(mean)),
                    "lens cap, exposure, or a wrong encoding?"});
  else if (upperMedian(mean) < 15)
    out->push_back({Severity::kWarning, "colour image", formatted("is dark: %.0f of 255 on average", upperMedian(mean)),
                    "more light or exposure"});
}

void checkRepeats(const Recording& r, Findings* out) {
  constexpr double kShare = 0.01;  // of the images
  if (r.color.repeated > kShare * double(r.color.decoded))
    out->push_back({Severity::kWarning, "colour image",
                    formatted("%zu of %zu images repeat the pixels of the one before while the camera moves",
                              r.color.repeated, r.color.decoded),
                    "the camera is slower than its topic, or froze: the repeats are left out"});
  if (r.depth.repeated > kShare * double(r.depth.decoded))
    out->push_back(
        {Severity::kWarning, "depth image",
         formatted("%zu of %zu images repeat the one before while the camera moves", r.depth.repeated, r.depth.decoded),
         "the depth camera is slower than its topic, or froze: the repeats are left out"});
}

void checkDepth(const Recording& r, Findings* out) {
  std::vector<double> valid, usable, middle, spread;
  for (const DepthSample& d : r.depths) {
    valid.push_back(d.valid);
    usable.push_back(d.usable);
    spread.push_back(d.spread);
    if (d.valid > 0) middle.push_back(d.median);
  }
  const double share = upperMedian(valid);
  const DepthNoise& noise = r.sensor.depth_noise;
  if (middle.empty() || share < 0.02) {
    out->push_back(
        {Severity::kError, "depth image", "holds almost no depth", "emitter off, wrong topic, or out of range?"});
    return;
  }
  const double z = upperMedian(middle);
  const auto swapped = std::count_if(r.depths.begin(), r.depths.end(), [](const DepthSample& d) { return d.swapped; });
  if (2 * swapped > std::ptrdiff_t(r.depths.size()))
    out->push_back({Severity::kError, "depth image",
                    formatted("the two bytes of each value are changed over (median %.4g m): is_bigendian is wrong", z),
                    "set is_bigendian in the driver as the values are"});
  else if (z < 0.05 || z > 50)
    out->push_back({Severity::kError, "depth image", formatted("median depth is %.4g m", z),
                    "depth scale or encoding in the sensor file is wrong (millimetres against metres?)"});
  else if (upperMedian(usable) < 0.02 || z > noise.max_range)
    out->push_back(
        {Severity::kError, "depth image",
         formatted("median depth is %.4g m, the sensor file uses %g to %g m", z, noise.min_range, noise.max_range),
         "depth scale or depth_noise/max_range in the sensor file is wrong"});
  else if (upperMedian(spread) < 1e-6)
    out->push_back({Severity::kError, "depth image", formatted("every pixel says %.4g m", z), "the driver is broken"});
  else if (share < 0.3)
    out->push_back({Severity::kWarning, "depth image", formatted("only %.0f %% of the pixels have depth", 100 * share),
                    "glass, sunlight or range? planes and scale suffer"});
  else
    out->push_back({Severity::kGood, "depth image",
                    formatted("%.0f %% of the pixels have depth, median %.2f m", 100 * share, z), ""});
}

void checkMissingReading(const Recording& r, Findings* out) {
  if (r.missing_reading > 0)
    out->push_back(
        {Severity::kNote, "depth image",
         formatted("exactly %.3f m stands apart from the surfaces around it: taken for \"no reading\", which "
                   "should be 0 (or NaN)",
                   r.missing_reading),
         ""});
}

void checkDepthUnit(const Recording& r, Findings* out) {
  if (r.depth_unit_changes.empty()) return;
  const DepthUnitChange& first = r.depth_unit_changes.front();
  std::string what = formatted("its unit is set anew at %.1f s: readings are %.3g times as long from there",
                               first.t - r.depth.stamps.front(), first.factor);
  if (const std::size_t more = r.depth_unit_changes.size() - 1) what += formatted(", and %zu times more", more);
  out->push_back({Severity::kWarning, "depth image", what,
                  "it is followed, in the unit of the first images; set depth units or preset before recording only"});
}

}  // namespace

Findings checkImages(const Recording& r) {
  Findings out;
  checkEncoding("colour image", r.color, r.sensor.color_encoding, &out);
  if (!r.gray_note.empty()) out.push_back({Severity::kNote, "colour image", r.gray_note, ""});
  checkEncoding("depth image", r.depth, r.sensor.depth_encoding, &out);
  if (r.sensor.intrinsics_from_camera_info)
    checkCamera("colour camera_info", r.color_info, r.color_camera, r.color_camera_error, r.color, true, &out);
  else
    checkSensorFileCamera(r, &out);
  if (!r.color_camera_note.empty()) out.push_back({Severity::kNote, "colour camera_info", r.color_camera_note, ""});
  checkFocus(r, &out);
  checkMask(r, &out);
  checkBrightness(r.brightness, &out);
  checkRepeats(r, &out);
  if (r.sensor.depth_registered && r.color.sizes.size() == 1 && r.depth.sizes.size() == 1) {
    const auto color = *r.color.sizes.begin(), depth = *r.depth.sizes.begin();
    if (color != depth)
      out.push_back({Severity::kError, "depth image",
                     "is " + sizeText(depth) + ", the colour image is " + sizeText(color),
                     "switch on the driver's depth registration (align_depth, depth_registration, depth_to_rgb), or "
                     "set registered: false with the depth camera's calibration"});
    else
      out.push_back({Severity::kGood, "depth image", "same size as colour, " + sizeText(color), ""});
    if (r.depth_camera.width > 0 && r.color_camera.width > 0 &&
        std::abs(r.depth_camera.fx / r.color_camera.fx - 1) > 0.01)
      out.push_back({Severity::kWarning, "depth camera_info",
                     formatted("focal length is %.1f, that of colour %.1f", r.depth_camera.fx, r.color_camera.fx),
                     "the depth image is not registered to colour"});
  }
  if (!r.depths.empty()) checkDepth(r, &out);
  checkMissingReading(r, &out);
  checkDepthUnit(r, &out);
  return out;
}

Findings checkSkew(const Recording& r) {
  Findings out;
  if (r.color.stamps.size() < 3 || r.depth.stamps.size() < 3) return out;
  std::vector<double> depth = r.depth.stamps, skew;
  std::sort(depth.begin(), depth.end());
  const double tolerance = PairerOptions{}.tolerance;
  std::size_t unmatched = 0, all = 0;
  for (const double t : r.color.stamps) {
    if (t < depth.front() - tolerance || t > depth.back() + tolerance) continue;
    const auto after = std::lower_bound(depth.begin(), depth.end(), t);
    double best = after != depth.end() ? *after - t : 1e9;
    if (after != depth.begin() && t - *(after - 1) < std::abs(best)) best = *(after - 1) - t;
    ++all;
    if (std::abs(best) > tolerance)
      ++unmatched;
    else
      skew.push_back(best);
  }
  if (all == 0) return out;  // no time in common, which has been named
  const double share = double(unmatched) / all;
  if (skew.empty() || share > 0.5)
    out.push_back({Severity::kError, "colour and depth",
                   formatted("%.0f %% of the colour images have no depth within %.0f ms", 100 * share, 1e3 * tolerance),
                   "switch on the driver's synchronisation (enable_sync, enable_frame_sync), or equal rates"});
  else if (share > 0.05)
    out.push_back({Severity::kWarning, "colour and depth",
                   formatted("%.0f %% of the colour images have no depth within %.0f ms", 100 * share, 1e3 * tolerance),
                   "these images are tracked without depth"});
  if (!skew.empty()) {
    const double early = quantile(skew, 0.05), late = quantile(skew, 0.95);
    const double most = std::max(std::abs(early), std::abs(late));
    if (most > 0.008)
      out.push_back(
          {Severity::kNote, "colour and depth",
           formatted("depth is stamped %.1f to %.1f ms after colour", 1e3 * early, 1e3 * late),
           "the motion carries depth over to the colour image, as far as these stamps are right; the driver's "
           "synchronisation spares that"});
    else
      out.push_back({Severity::kGood, "colour and depth", formatted("stamps agree within %.1f ms", 1e3 * most), ""});
  }
  return out;
}

}  // namespace vip_slam
