// SPDX-License-Identifier: BSD-3-Clause
// Follows features from image to image: KLT from a start predicted by gyro, depth and the filter, forward-backward
// check, alignment with the patch of first appearance, gyro-aided outlier rejection, and new corners where features are
// missing. Track ids live as long as the track and are never reused.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_core/util/timing.h"
#include "vip_slam_frontend/tracking/feature_depth.h"
#include "vip_slam_frontend/tracking/moving_regions.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"
#include "vip_slam_frontend/tracking/patch_surface.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"
#include "vip_slam_frontend/tracking/row_camera.h"
#include "vip_slam_frontend/tracking/tracking_options.h"

namespace vip_slam {

/// The image that a track is aligned with, and its camera pose.
struct ReferenceImage {
  cv::Mat gray;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< pixel of gray's first element, when it is a cut-out
  SE3 T_odom_C;
  RowCamera camera{nullptr};  ///< with the row poses of this image
};

struct Track {
  Feature feature;  ///< of the newest image; descriptor and angle only on keyframes
  std::shared_ptr<const ReferenceImage> reference;
  Eigen::Vector2d reference_pixel = Eigen::Vector2d::Zero();
  PatchSurface surface;  ///< what the reference patch shows
  /// Depth at the newest pixel, m, propagated from the last image with depth there when this one has none; for
  /// prediction and outlier rejection. 0: unknown.
  double carried_depth = 0;
  /// Slope of the depth at the newest pixel, m/px; zero where no plane explains the readings around it.
  Eigen::Vector2d depth_slope = Eigen::Vector2d::Zero();
  double reference_variance = 0;  ///< of the reference pixel against the point that the track began with, px^2
  double magnification = 1;       ///< of the newest over the reference image at the patch, along the larger axis
  Eigen::Matrix2d texture = Eigen::Matrix2d::Zero();        ///< of the patch in the newest image (patch_alignment.h)
  int missed = 0;                                           ///< images in a row in which the patch was not found
  double residual = 0;                                      ///< of its match with the reference, grey levels
  Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity();  ///< of the newest pixel (pixel_noise.h)
};

struct TrackingResult {
  int tracked = 0;  ///< survived everything
  int lost_outlier = 0;
  bool pose_ok = false;  ///< RANSAC gave a metric pose
  SE3 T_current_previous;
  MotionFit motion;  ///< between the images, by the points with depth that agree
  /// Most of the view moves independently of the camera: only points that agree with the IMU were kept.
  bool moves_by_itself = false;
  MovingRegions regions;
};

class FeatureTracker {
 public:
  static constexpr double kMaxFromPrediction = 3.0;  ///< px, of a match from where its point is expected

  /// No features where `mask` is zero; empty: anywhere. `first_id`: of the first track.
  FeatureTracker(const TrackingOptions& options, std::shared_ptr<const CameraModel> camera, const DepthNoise& noise,
                 TimingLog* timing, const cv::Mat& mask = cv::Mat(), LandmarkId first_id = 1);

  /// Tracks into `gray`. `predicted` is the camera motion since the last image, `T_odom_C` the predicted pose of this
  /// one; when the translation is unknown give only a rotation and `has_translation` false. Unless it `judges`,
  /// `predicted` is only the starting point of the search.
  /// `rows`: how the camera moves while the image is read, null: global shutter. `depth` belongs to the stamp.
  TrackingResult track(const cv::Mat& gray, const cv::Mat& depth, const PredictedMotion& predicted,
                       bool has_translation, const SE3& T_odom_C, const std::shared_ptr<const RowPoses>& rows,
                       double t);
  /// Adds corners where features are missing; `T_odom_C`: updated pose of the newest image. `force`: also when few are
  /// missing. Returns the indices of the new tracks.
  std::vector<std::size_t> replenish(const SE3& T_odom_C, bool force, double t);
  /// Moves the track's pixel by at most `most_px` to where its reference patch lies in the newest image; false when it
  /// does not fit there.
  bool alignTrack(Track* track, const SE3& T_odom_C, double most_px) const {
    return match(track, T_odom_C, most_px) == Match::kFound;
  }
  /// Adds a track found by others in the newest image (which becomes its reference when it has none).
  void addTrack(Track track, const SE3& T_odom_C);
  /// The newest image becomes the reference of all tracks, with its updated row poses.
  void restartReferences(const SE3& T_odom_C, const std::shared_ptr<const RowPoses>& rows);
  /// Tracks that ended with the last track() call.
  const std::vector<Track>& ended() const { return ended_; }
  /// Forgets all tracks and images; ids go on.
  void clear();

  std::vector<Track>& tracks() { return tracks_; }
  const std::vector<Track>& tracks() const { return tracks_; }
  const cv::Mat& gray() const { return gray_; }
  const cv::Mat& mask() const { return mask_; }
  /// Whether features may be at this pixel of the image.
  bool allowed(const Eigen::Vector2d& pixel) const {
    return mask_.empty() || mask_.at<std::uint8_t>(cvRound(pixel.y()), cvRound(pixel.x())) != 0;
  }
  const cv::Mat& depth() const { return depth_; }
  /// The camera with the row poses of the newest image.
  const RowCamera& camera() const { return view_; }
  /// Where the camera at the stamp sees a measured feature, px: what its pixel would be with a global shutter.
  Eigen::Vector2d pixelAtStamp(const Feature& feature) const;
  /// Fills xy, depth and depth_sigma, all at the stamp, from the pixel and the newest depth image; returns the depth's
  /// source.
  FeatureDepth::Source measure(Feature* feature) const;
  /// Same for a track, with the whitening of its pixel.
  void measure(Track* track) const;

  /// Of optical flow, px.
  static cv::Size flowWindow() { return {2 * kNarrowPatch + 1, 2 * kNarrowPatch + 1}; }

 private:
  static constexpr int kFlowLevels = 3;  ///< of the pyramid of optical flow above the image
  /// After a jump of the exposure: gives the last image's pyramid the contrast and brightness of the new image. Medians
  /// over the tracks' surroundings, there and at the predicted pixels, so that new content in view has no influence.
  void matchExposure(const cv::Mat& gray, const SE3& predicted, bool has_translation);
  /// Where optical flow begins; false outside the image.
  bool predictMotion(const Track& track, const SE3& predicted, bool has_translation, Eigen::Vector2d* uv) const;
  void runKlt(const cv::Mat& gray, const SE3& predicted, bool has_translation, std::vector<cv::Point2f>* next,
              std::vector<char>* found);
  /// Looks for tracks that optical flow lost at their predicted pixels, with the reference patch.
  void findLost(const SE3& predicted, const SE3& T_odom_C, std::vector<cv::Point2f>* next,
                std::vector<char>* found) const;
  enum class Match { kFound, kNotFound, kOtherView };
  Match match(Track* track, const SE3& T_odom_C, double most_px) const;
  void alignWithReferences(const SE3& T_odom_C);
  void setReference(Track* track, const std::shared_ptr<const ReferenceImage>& reference) const;
  std::shared_ptr<ReferenceImage> referenceHere(const SE3& T_odom_C) const;
  /// Whether the newest image shows one plane over the whole wide patch: an object that covers two columns of it would
  /// shift the match by a sixth of a pixel. True without a depth image. `prediction`: depth predicted from the
  /// reference, m, used where the depth image has a hole.
  bool isWideHere(Feature feature, double prediction) const;
  /// What outlier rejection sees of the tracks that were found; `index`: their numbers.
  std::vector<PointPair> pairsOf(const std::vector<cv::Point2f>& next, const std::vector<char>& found,
                                 std::vector<std::size_t>* index) const;
  /// Moves the inliers among the tracks `index` to their new pixels; all other tracks end.
  void keepInliers(const std::vector<std::size_t>& index, const std::vector<char>& inlier,
                   const std::vector<cv::Point2f>& next, const SE3& T_current_previous);
  /// Whether the track's patch in the newest image lies on one plane of the depth image; measures the feature.
  bool surfaceIsKnown(Track* track) const;

  TrackingOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  RowCamera view_;
  DepthNoise noise_;
  TimingLog* timing_;
  std::vector<Track> tracks_, ended_;
  std::vector<cv::Mat> pyramid_, last_pyramid_;
  cv::Mat gray_, depth_, mask_;
  LandmarkId next_id_;
  std::uint32_t image_count_ = 0;
};

}  // namespace vip_slam
