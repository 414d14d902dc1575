// The visual-inertial filter: window, feature tracks and the order of steps per image (propagate, augment, select
// features, update, marginalise). Source: paper section "Motion Estimation"; Wu et al. 2015.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/filter_options.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/filter/mounting_estimate.h"
#include "vip_slam_frontend/filter/noise_monitor.h"
#include "vip_slam_frontend/filter/observation.h"
#include "vip_slam_frontend/filter/square_root_filter.h"
#include "vip_slam_frontend/filter/surface_rows.h"
#include "vip_slam_frontend/filter/triangulation.h"
#include "vip_slam_frontend/filter/zero_velocity.h"

namespace vip_slam {

/// One feature in the present image.
struct FilterMeasurement {
  LandmarkId id = kNoLandmark;
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();
  double depth = 0, depth_sigma = 0;
  Eigen::Vector2d depth_slope = Eigen::Vector2d::Zero();    ///< see Observation
  Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity();  ///< likewise
  BearingJacobian by_intrinsics = BearingJacobian::Zero();  ///< likewise
};

/// Where the estimate starts and how well that is known.
struct FilterPrior {
  NavState state;
  double sigma_tilt = 0.02;      ///< rad, about the world's x and y
  double sigma_yaw = 1e-4;       ///< rad, gauge
  double sigma_position = 1e-4;  ///< m, gauge
  double sigma_velocity = 0.02;  ///< m/s
  double sigma_bias_gyro = 0.01, sigma_bias_accel = 0.1;
  /// The state was levelled by the mean specific force of a standing body (R^T G + b_a = mean): ties tilt to the
  /// accelerometer bias instead of counting their errors apart.
  bool standing = false;
  double sigma_mean_accel = 0.01;
};

struct StepReport {
  bool healthy = true;
  bool zero_velocity = false;
  int features_tried = 0, features_used = 0, features_gated = 0;
  int surfaces_used = 0, surfaces_gated = 0;  ///< point-to-patch pairs
  int rows = 0;
  double nis = 0;
  double correction = 0;  ///< of the predicted motion, see ImuNoiseMonitor
};

class VioFilter {
 public:
  VioFilter(const FilterOptions& options, const ImuNoise& imu_noise, const SE3& T_I_C, double time_offset,
            double focal_px, double gravity);

  void start(const FilterPrior& prior, CloneId id, const Eigen::Vector3d& omega_I);
  bool started() const { return started_; }
  void stop();
  /// Readings mean something else from now on: what was known of their offset is void, and so is depth in the tracks.
  /// `none`: they have no offset any more; else it is estimated anew. Holds for later starts as well.
  void restartDepthOffset(bool none);

  /// Prediction from the newest clone over `samples` (first at its time); does not change the filter.
  Propagation predict(const std::vector<ImuSample>& samples) const;
  /// One image: `propagation` from predict(). Without measurements this coasts. `surfaces` (may be null) ties the new
  /// image's depth to that of an earlier clone. `unrest`: see StillnessDetector; nothing when the body moves.
  StepReport step(const Propagation& propagation, CloneId id, const std::vector<FilterMeasurement>& measurements,
                  std::optional<Unrest> unrest, const SurfaceMatches* surfaces = nullptr);

  const WindowState& window() const { return filter_.window(); }
  /// How the camera is mounted, as known now; also between two starts.
  MountingEstimate mounting() const;
  NavState nav() const { return filter_.window().nav(); }
  Matrix15d covariance() const { return filter_.navCovariance(); }
  /// From now on the motion since the newest clone is asked for (its image became a keyframe).
  void markNewest();
  /// The motion from the marked clone to the newest. When the marked one has left the window meanwhile it is put
  /// together from pieces as long as the window, whose errors count as independent. Unknown when nothing was marked.
  RelativeMotion motionSinceMark() const;
  /// Its pose alone, at next to no cost; empty when nothing was marked.
  std::optional<SE3> poseSinceMark() const;
  double sigmaPx() const { return noise_.sigma(); }
  double imuNoiseScale() const { return imu_monitor_.scale(); }
  double stampSigma() const { return stamp_monitor_.sigma(); }  ///< s
  /// What is to be added to depth readings for others, m: the offset once it is beyond doubt and large enough to
  /// matter, else 0. The estimate itself wanders by a millimetre before it is known, which a map of exact depth would
  /// keep.
  double depthCorrection() const { return depth_is_off_ ? filter_.window().depth_offset : 0.0; }
  /// The gyro's correction for others: of each entry the estimate once it is beyond doubt and large enough to matter,
  /// else zero.
  Eigen::Matrix3d gyroCorrection() const;
  /// What bearings mean, for others: of each entry the estimate once it is beyond doubt and large enough to matter,
  /// else zero.
  BearingCorrection bearingCorrection() const;
  /// How far the depth image lies beside the colour image (WindowState::depth_shift), for readings to come: nothing
  /// until it is known to a tenth of a pixel and beyond doubt, then what is still found of it. From then on the filter
  /// estimates the rest.
  const Eigen::Vector2d& takeDepthShift();
  double depthScale() const;  ///< adapted factor on the depth noise, 1 or more
  const SquareRootFilter& algebra() const { return filter_; }

 private:
  struct Candidate {
    const FilterTrack* track;
    bool lost;
  };
  void addMeasurements(CloneId id, const std::vector<FilterMeasurement>& measurements);
  /// Tracks that have ended and those that are about to leave the window; `all`: the others as well.
  std::vector<Candidate> chooseCandidates(CloneId id, bool window_full, bool all);
  /// Factor on the common pixel noise for a feature whose residuals that does not explain: its patch shows something
  /// that is no point (an occluding edge, a reflection). Such patches also wander along with the motion, by much more
  /// than their residuals say: measured against true poses about as the square of them.
  double ownNoise(const Triangulation& point) const;
  /// What is left of that factor when the state's uncertainty has its share; `feature`: with the common noise.
  double beyondState(const FeatureRows& feature) const;
  /// Uncertainty of the velocity over the time of the window, times the focal length: px at one metre.
  double openPixels() const;
  /// Which residuals of a feature are noise of its own: none, all that the common noise does not explain, or of these
  /// what the state's uncertainty does not explain either.
  enum class OwnNoise { kNone, kResiduals, kBeyondState };
  /// An image's features, ready for an update, and what they say about the noise.
  struct FeatureBatch {
    std::vector<FeatureRows> accepted;
    int rows = 0, tried = 0, gated = 0;
    std::vector<double> chi2, depth_chi2;  ///< per degree of freedom, of single features
    int chi2_rows = 0, depth_rows = 0;
    double nearest_noisy = 1e9;  ///< m, z of the nearest feature with a noise of its own
  };
  /// Rows that are linearised at `window`, for an update of the filter's own, which is `moved` away from it.
  FeatureBatch judgeFeatures(const std::vector<Candidate>& candidates, const WindowState& window,
                             const Eigen::VectorXd& moved, OwnNoise own_noise) const;
  UpdateResult apply(FeatureBatch& batch);
  /// Where the velocity is open, poses are wrong together by more than rows linearised there can tell (a stretch on the
  /// IMU alone): a first update takes all residuals that the state may explain for the state's, the next ones begin
  /// from the same prior, but linearise and judge the features' own noise where the one before led to (iterated Kalman
  /// update). First estimates are renewed with it.
  UpdateResult updateRelinearised(const std::vector<Candidate>& candidates, FeatureBatch* batch);
  void updateWithFeatures(const std::vector<Candidate>& candidates, bool after_step, StepReport* report);
  void updateWithSurfaces(const SurfaceMatches& surfaces, StepReport* report);
  /// Whether depth is off beyond doubt. An offset that is beyond belief stands for something else; it is taken back and
  /// estimated no more.
  void judgeDepthOffset();
  bool isSteady(double depth_offset);
  /// While the rate hardly changes, noise alone would tell of the camera-IMU delay: it stays what it was, and as sure.
  struct Delay {
    double value, sigma;  ///< s
  };
  void holdDelay();
  /// The same of the depth image's shift.
  void judgeDepthShift();
  /// Depth in the tracks becomes what is read with so much more of the shift.
  void moveDepth(const Eigen::Vector2d& shift);
  void judgeIntrinsics();
  void judgeGyroCorrection();
  /// Keeps what was found about the mounting for the next start, unless it is further from what was given than that
  /// allows: then whatever broke the estimate broke this as well.
  void learnMounting();
  void forgetClone(CloneId id);
  /// From the marked clone to another one; unknown when nothing is marked.
  RelativeMotion motionFromMark(int clone) const;
  /// Clone `to` stands for the marked one, which is about to go.
  void moveMark(CloneId to);

  FilterOptions options_;
  ImuNoise imu_noise_;
  const MountingEstimate given_;  ///< by the sensor's configuration
  MountingEstimate learnt_;       ///< what a start begins with: given_, or what earlier runs found
  double sigma_depth_offset_;     ///< m, at a start
  double focal_;
  Eigen::Vector3d G_;
  Gate gate_, explained_;
  NoiseMonitor noise_, depth_noise_;
  StampMonitor stamp_monitor_;
  ImuNoiseMonitor imu_monitor_;
  SquareRootFilter filter_;
  std::map<LandmarkId, FilterTrack> tracks_;
  bool started_ = false;
  Eigen::Vector2d depth_shift_ = Eigen::Vector2d::Zero();  ///< that readings have by now
  bool shift_contradicts_ = false;                         ///< it went beyond belief
  struct Offset {
    double t = -1e300, value = 0;  ///< s, m
  };
  Offset offset_before_;  ///< when it was looked at last
  bool offset_is_steady_ = false;
  bool depth_is_off_ = false;                                                            ///< beyond doubt
  Eigen::Array<bool, 3, 3> gyro_is_off_ = Eigen::Array<bool, 3, 3>::Constant(false);     ///< likewise, by entries
  Eigen::Array<bool, 4, 1> bearing_is_off_ = Eigen::Array<bool, 4, 1>::Constant(false);  ///< likewise
  bool depth_contradicts_ = false;     ///< its offset went beyond belief
  int still_images_ = 0;               ///< images since the standing began; 0 when moving
  bool after_step_ = false;            ///< the propagation before admitted a step of the velocity
  std::optional<Delay> delay_before_;  ///< while it is held
  CloneId still_anchor_ = 0;
  CloneId mark_ = 0;                       ///< 0: none
  std::optional<RelativeMotion> to_mark_;  ///< from the clone that was marked, when mark_ is another by now
};

}  // namespace vip_slam
