// SPDX-License-Identifier: BSD-3-Clause
// The visual-inertial filter: window, feature tracks and the order of steps per image (propagate, augment, select
// features, update, marginalise). Source: paper section "Motion Estimation"; Wu et al. 2015.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/calibration_estimate.h"
#include "vip_slam_frontend/filter/calibration_evidence.h"
#include "vip_slam_frontend/filter/disputed_motion.h"
#include "vip_slam_frontend/filter/drift_monitor.h"
#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/filter_options.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/filter/noise_monitor.h"
#include "vip_slam_frontend/filter/observation.h"
#include "vip_slam_frontend/filter/square_root_filter.h"
#include "vip_slam_frontend/filter/surface_rows.h"
#include "vip_slam_frontend/filter/triangulation.h"
#include "vip_slam_frontend/filter/zero_velocity.h"
#include "vip_slam_frontend/inertial/inertial_input.h"

namespace vip_slam {

/// One feature in the present image.
struct FilterMeasurement {
  LandmarkId id = kNoLandmark;
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();             ///< undistorted normalised coordinates
  double depth = 0, depth_sigma = 0;                        ///< z in the camera and its sigma, metres; 0: none
  Eigen::Vector2d depth_slope = Eigen::Vector2d::Zero();    ///< see Observation
  double depth_rate = 0;                                    ///< likewise
  Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity();  ///< likewise
  BearingJacobian by_intrinsics = BearingJacobian::Zero();  ///< likewise
  Eigen::Vector2d by_readout = Eigen::Vector2d::Zero();     ///< likewise
  double depth_shared = 0;                                  ///< likewise
};

/// Initial state and its one-sigma uncertainties.
struct FilterPrior {
  NavState state;
  double sigma_tilt = 0.02;                               ///< rad, about the world's x and y
  double sigma_yaw = 1e-4;                                ///< rad, gauge
  double sigma_position = 1e-4;                           ///< m, gauge
  double sigma_velocity = 0.02;                           ///< m/s
  double sigma_bias_gyro = 0.01, sigma_bias_accel = 0.1;  ///< rad/s and m/s^2, IMU frame
  /// The state was levelled by the mean specific force of a standing body (R^T G + b_a = mean): couples tilt and
  /// accelerometer bias, whose errors are not independent then.
  bool standing = false;
  double sigma_mean_accel = 0.01;  ///< m/s^2, of that mean
  bool at_rest = false;            ///< the body stands still, by the IMU
};

struct StepReport {
  bool healthy = true;
  bool zero_velocity = false;
  int features_tried = 0, features_used = 0, features_gated = 0;
  int surfaces_used = 0;  ///< point-to-patch pairs
  int rows = 0;
  double nis = 0;
  double correction = 0;  ///< normalised squared correction of the predicted motion, see ImuNoiseMonitor
  bool disputed = false;  ///< the corrections of the last second are more than the covariance allows
};

class VioFilter {
 public:
  VioFilter(const FilterOptions& options, const ImuNoise& imu_noise, const SE3& T_I_C, double time_offset,
            double focal_px, double gravity);

  void start(const FilterPrior& prior, CloneId id, const Eigen::Vector3d& omega_I);
  bool started() const { return started_; }
  void stop();
  /// To be called when depth readings are corrected differently from now on: discards the estimate of their offset and
  /// the depth in the tracks. `none`: the offset is held at its given value; else it is estimated anew. Holds for later
  /// starts as well.
  void restartDepthOffset(bool none);

  /// Prediction from the newest clone over `samples` (first at its time); does not change the filter.
  /// `noise`: of these samples, as factors on the configured densities.
  Propagation predict(const std::vector<ImuSample>& samples, const frontend::ChannelNoise& noise = {}) const;
  /// Likewise by the motion that another source saw, see propagateByMotion().
  Propagation predict(const SE3& T_I0_I1, const Matrix6d& covariance, double dt) const;
  /// One image: `propagation` from predict(). Without measurements this coasts. `surfaces` (may be null) ties the new
  /// image's depth to that of an earlier clone. `residual_motion`: see StillnessDetector; empty when the body moves.
  StepReport step(const Propagation& propagation, CloneId id, const std::vector<FilterMeasurement>& measurements,
                  std::optional<ResidualMotion> residual_motion, const SurfaceMatches* surfaces = nullptr);

  const WindowState& window() const { return filter_.window(); }
  /// Present estimate of extrinsics and calibration; valid also between two starts.
  CalibrationEstimate calibration() const;
  SE3 extrinsics() const { return started_ ? filter_.window().T_I_C : learnt_.T_I_C; }                 ///< likewise
  double timeOffset() const { return started_ ? filter_.window().time_offset : learnt_.time_offset; }  ///< likewise, s
  NavState nav() const { return filter_.window().nav(); }
  Matrix15d covariance() const { return filter_.navCovariance(); }
  /// What the scale of depth adds to it beyond what the filter holds: by as much as the adopted scale may be wrong, by
  /// the prior and the accelerometer, the displacement from the start and the velocity may be.
  Matrix15d covarianceOfScale() const;
  /// Whether the corrections of the last second are more than the covariance allows.
  bool isDisputed() const { return disputed_.isSignificant(); }
  /// What a vertical that is not known adds: a radian about the start, to each side.
  Matrix15d covarianceOfVertical() const;
  /// The accelerometer is sure of a scale of depth beyond belief.
  bool scaleContradicts() const { return evidence_.contradicts(kDepthScale); }
  /// The oldest clone whose image still has measurements to come: the marked one stays in the state beyond its time.
  const Clone& oldest() const;
  /// Marks the newest clone (its image became a keyframe) as the start of motionSinceMark().
  void markNewest();
  /// The motion from the marked clone to the newest. Unknown when nothing was marked.
  RelativeMotion motionSinceMark() const;
  /// The pose of motionSinceMark() without the cost of its covariance; empty when nothing was marked.
  std::optional<SE3> poseSinceMark() const;
  double sigmaPx() const { return noise_.sigma(); }
  double imuNoiseScale() const { return imu_monitor_.scale(); }  ///< on the densities
  ImuNoiseScale imuNoise() const;
  /// Adopted offset of the readings of depth, m, and the factor on them.
  double depthCorrection() const { return evidence_.adopted(kDepthOffset); }
  double depthScale() const { return evidence_.adopted(kDepthScale); }
  /// The gyro's correction for use outside the filter: each entry's estimate once it is significant, else zero.
  Eigen::Matrix3d gyroCorrection() const;
  BearingCorrection bearingCorrection() const;  ///< adopted correction of bearings
  /// Shift of the depth image (WindowState::depth_shift) to apply to the readings to come: zero until it is
  /// significant. The part taken is removed from the state, and the filter estimates the rest.
  const Eigen::Vector2d& takeDepthShift();
  /// Seconds by which depth images show an earlier moment than their stamps say, to apply to the images to come.
  double depthDelay() const { return evidence_.adopted(kDepthDelay); }
  /// Seconds that reading the rows of an image takes beyond what the sensor's configuration says.
  double readout() const { return evidence_.adopted(kReadout); }
  double depthNoiseScale() const;  ///< adapted factor on the depth noise, 1 or more
  const SquareRootFilter& algebra() const { return filter_; }

 private:
  struct Candidate {
    const FilterTrack* track;
    bool lost;
  };
  void addMeasurements(CloneId id, const std::vector<FilterMeasurement>& measurements);
  /// Tracks that have ended and those that are about to leave the window; `all`: the others as well.
  std::vector<Candidate> chooseCandidates(CloneId id, bool window_full, bool all);
  /// Per-feature scale of the pixel sigma, 1 or more, where the common noise does not explain the residuals: the patch
  /// shows no fixed point (an occluding edge, a reflection). Such patches also drift with the motion by much more than
  /// their residuals: measured against true poses about as the square, hence chi2 per dof and not its root.
  double ownNoise(const Triangulation& point) const;
  /// The same scale when the state's uncertainty explains its share of the residuals; `feature`: rows whitened with the
  /// common noise.
  double beyondState(const FeatureRows& feature) const;
  /// Displacement by the velocity's uncertainty over the time of the window, as image motion: px at one metre.
  double openPixels() const;
  /// Which residuals go into a feature's own noise scale: none, all that the common noise does not explain, or only
  /// those that the state's uncertainty does not explain either.
  enum class OwnNoise { kNone, kResiduals, kBeyondState };
  /// An image's features, ready for an update, with their residual statistics for the noise monitors.
  struct FeatureBatch {
    std::vector<FeatureRows> accepted;
    int rows = 0, tried = 0, gated = 0;
    std::vector<double> chi2, depth_chi2;  ///< per degree of freedom, of single features
    int chi2_rows = 0, depth_rows = 0;
    /// z of the nearest feature with a noise scale above 1, m; infinite: there is none.
    double nearest_noisy = std::numeric_limits<double>::infinity();
  };
  /// Rows linearised at `window`, for an update of the filter's prior; `moved`: error state from the prior to `window`.
  FeatureBatch judgeFeatures(const std::vector<Candidate>& candidates, const WindowState& window,
                             const Eigen::VectorXd& moved, OwnNoise own_noise) const;
  UpdateResult apply(FeatureBatch& batch);
  /// Iterated Kalman update, for when the velocity is poorly known (after a stretch on the IMU alone) and all poses are
  /// off by more than the linearisation allows. The first pass attributes to the state all residuals that it may
  /// explain; the next ones start from the same prior, but linearise and judge the features' noise at the result of the
  /// pass before. The first estimates are reset to the result.
  UpdateResult updateRelinearised(const std::vector<Candidate>& candidates, FeatureBatch* batch);
  void updateWithFeatures(const std::vector<Candidate>& candidates, bool after_step, StepReport* report);
  void updateWithSurfaces(const SurfaceMatches& surfaces, StepReport* report);
  /// Numbers of the calibration that the filter keeps at adopted values while their evidence is gathered, in the order
  /// of their columns. The bearings' four come last.
  enum HeldIndex { kDepthOffset, kDepthScale, kDepthDelay, kReadout, kBearing, kHeldNumbers = kBearing + 4 };
  struct HeldNumber {
    int index;
    double* state;
    bool applied;  ///< to the readings outside: the state is what remains
  };
  /// All that are estimated, in the order of their columns.
  static std::vector<HeldNumber> heldNumbers(WindowState* state);
  /// Takes what this step said of the held numbers out of the filter and adds it to their evidence; `inertial`: the IMU
  /// predicted the motion of a body that moves.
  void learnHeldNumbers(bool inertial);
  /// Takes them back to what is adopted.
  void hold();
  /// Resets the camera-IMU delay and its sigma to delay_before_: while the rate hardly changes, noise alone would drive
  /// its estimate.
  void holdDelay();
  /// Camera-IMU delay, s; to be called while it is estimated.
  frontend::Estimate delay() const {
    return {filter_.window().time_offset, filter_.sigma(filter_.window().timeOffsetColumn())};
  }
  /// Resets an implausibly large shift of the depth image and stops applying it.
  void judgeDepthShift();
  /// Adjusts the depth in the tracks to readings that are shifted by this much more, in bearings, and taken for this
  /// much older, s.
  void moveDepth(const Eigen::Vector2d& shift, double delay);
  void judgeGyroCorrection();
  /// Keeps the estimated extrinsics and calibration for the next start, unless they are implausibly far from the given
  /// ones: then they are as wrong as the estimate that failed.
  void learnCalibration();
  void forgetClone(CloneId id);
  /// Adds what predictions and updates dispute to the covariance, as one motion of the whole window against the world
  /// and the marked clone.
  void admitDispute();
  /// Inflates the window's motion over the refuted seconds: each interval errs on its own.
  void admitRefuted(const RefutedMotion& refuted);
  /// After the updates of an image whose pose was `predicted`; `removed`: from the covariance, by them.
  void noteCorrection(const NavState& predicted, const Matrix15d& removed);

  FilterOptions options_;
  ImuNoise imu_noise_;
  const CalibrationEstimate given_;         ///< by the sensor's configuration
  CalibrationEstimate learnt_;              ///< initial values at a start: given_, or the estimate of an earlier run
  frontend::CalibrationEvidence evidence_;  ///< of the numbers that are held
  /// Time of the newest clone that the IMU did not predict, that is at rest, or whose first estimate no longer agrees
  /// with those of the others; empty: none is left, what steps say of scale and delay counts.
  std::optional<double> motion_unmeasured_;
  double focal_;
  Eigen::Vector3d G_;
  Gate gate_;
  NoiseMonitor noise_, depth_noise_;
  ImuNoiseMonitor imu_monitor_;
  frontend::DriftMonitor drift_;
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();  ///< position in W at start()
  frontend::DisputedMotion disputed_;
  SquareRootFilter filter_;
  std::map<LandmarkId, FilterTrack> tracks_;
  bool started_ = false;
  Eigen::Vector2d depth_shift_ = Eigen::Vector2d::Zero();  ///< already applied to the readings, in bearings
  bool shift_contradicts_ = false;                         ///< it became implausibly large
  Eigen::Array<bool, 3, 3> gyro_is_off_ = Eigen::Array<bool, 3, 3>::Constant(false);  ///< likewise, by entries
  int still_images_ = 0;                            ///< images since standing still began; 0 when moving
  bool after_open_ = false;                         ///< the propagation before left the motion open
  std::optional<frontend::Estimate> delay_before_;  ///< the value held; empty while the delay is estimated
  CloneId still_anchor_ = 0;
  CloneId mark_ = 0;        ///< 0: none
  bool mark_kept_ = false;  ///< its clone is beyond its time in the window, and stays in the state alone
};

}  // namespace vip_slam
