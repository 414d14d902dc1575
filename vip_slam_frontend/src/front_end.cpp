// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/front_end.h"

#include "front_end_impl.h"

namespace vip_slam {

FrontEnd::FrontEnd(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing, double clock_jump,
                   std::uint32_t session)
    : impl_(std::make_unique<Impl>(options, sensor, timing, clock_jump, firstNumbers(session))) {}
FrontEnd::~FrontEnd() = default;

bool FrontEnd::addImu(const ImuSample& sample) { return impl_->addImu(sample); }
bool FrontEnd::addGyro(double t, const Eigen::Vector3d& gyro) { return impl_->addGyro(t, gyro); }
bool FrontEnd::addAccel(double t, const Eigen::Vector3d& accel) { return impl_->addAccel(t, accel); }
bool FrontEnd::ready(double t_image, double depth_lag) const { return impl_->ready(t_image, depth_lag); }
FrameOutput FrontEnd::process(const FrameInput& input, const PoseReady& on_pose) {
  return impl_->process(input, on_pose);
}
void FrontEnd::applyMapUpdate(const MapUpdate& update) { impl_->applyMapUpdate(update); }
std::optional<NavState> FrontEnd::predict(double t) const { return impl_->predict(t); }
Eigen::Vector3d FrontEnd::gyro(double t) const { return impl_->gyro(t); }
void FrontEnd::reset(const std::string& reason) { impl_->reset(reason); }
void FrontEnd::clockRanBack(const std::string& reason) { impl_->clockRanBack(reason); }
void FrontEnd::forgetMap() { impl_->forgetMap(); }
CalibrationEstimate FrontEnd::calibration() const { return impl_->calibration(); }
double FrontEnd::timeOffset() const { return impl_->timeOffset(); }
CalibrationEstimate FrontEnd::givenCalibration() const { return impl_->givenCalibration(); }
const FrontEndCounters& FrontEnd::counters() const { return impl_->counters_; }

}  // namespace vip_slam
