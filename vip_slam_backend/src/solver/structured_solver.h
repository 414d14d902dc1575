// SPDX-License-Identifier: BSD-3-Clause
// Levenberg-Marquardt that exploits the structure of a bundle adjustment: fixed-size blocks, points eliminated while
// they are linearised, plane factors reduced to small dense blocks, one symbolic factorisation for all iterations.
#pragma once

#include <functional>
#include <memory>

#include <Eigen/Core>

#include "imu_kernels.h"
#include "instruction_set.h"
#include "plane_kernels.h"
#include "point_kernels.h"
#include "system_structure.h"
#include "vip_slam_backend/solver/ba_solver.h"
#include "vip_slam_backend/solver/kernel_array.h"
#include "worker.h"

namespace vip_slam {

class StructuredSolver : public BaSolver {
 public:
  /// Kernels of points and factors for `set`, which this processor must support; another than the fastest is for tests.
  explicit StructuredSolver(InstructionSet set = fastestInstructionSet()) : instruction_set_(set) {}
  SolverSummary solve(BaProblem& problem, const SolverOptions& options) override;

  /// For tests: the damped, reduced normal equations and the step at the problem's present state.
  struct Step {
    Eigen::VectorXd gradient;        ///< J^T r of poses, motions, planes in node order, before elimination
    Eigen::VectorXd diagonal;        ///< diag(J^T J) of the same
    Eigen::VectorXd step;            ///< of the same
    Eigen::VectorXd point_gradient;  ///< J^T r, 3 per point
    Eigen::VectorXd point_step;      ///< of the same
  };
  Step stepAt(const BaProblem& problem, double radius);

 private:
  // structured_arrays.cpp
  void prepare(const BaProblem& problem);
  void packHomographies(const BaProblem& problem);
  void packPointToPlane(const BaProblem& problem);
  void packImu(const BaProblem& problem);
  void loadFrames(const BaProblem& problem);
  void loadImu(const BaProblem& problem);
  PointKernelArguments arguments(const BaProblem& problem, double radius);
  HomographyKernelArguments homographyArguments() const;
  PointToPlaneKernelArguments pointToPlaneArguments();
  ImuKernelArguments imuArguments(const BaProblem& problem);

  // structured_linearize.cpp
  void linearize(const BaProblem& problem, double radius, Worker* worker);
  double linearizeFactors(const BaProblem& problem);
  double linearizePoints(PointKernelArguments a, int part);
  void storeDiagonal();
  void addPoints();
  void damp(double radius);
  void forEachNode(const std::function<void(int size, int unknown, double* block)>& f);

  /// `ahead`: also computes the parts of the next linearisation at this state that do not depend on the radius, which
  /// is everything except the elimination of the points.
  double cost(const BaProblem& problem, bool ahead, Worker* worker);
  bool solveStep(const BaProblem& problem, double radius, Worker* worker);
  /// Predicted decrease of the cost by the present step.
  double modelDecrease() const;
  struct State {
    std::vector<BaFrame> frames;
    std::vector<BaPoint> points;
    std::vector<BaPlane> planes;
  };
  void apply(const BaProblem& from, State* to) const;
  double stepNorm() const;
  double largestGradient() const;
  /// The damping of Levenberg and Marquardt by Ceres' rule.
  struct TrustRegion {
    double radius, decrease_factor = 2;
    /// `ratio`: decrease of the cost over the predicted one.
    void accept(double ratio);
    /// False when the trust region has become too small.
    bool refuse();
  };
  struct Trial {
    bool accepted = false, converged = false;
    double cost = 0, step_norm = 0;
    double ratio = 0;  ///< decrease over predicted decrease
  };
  /// Takes the present step and keeps it when the cost falls; `present`: the cost before it, `other`: work space.
  Trial tryStep(BaProblem& problem, const SolverOptions& options, bool last, double present, State* other);

  // linearize_factors.cpp; the cost of the factors (not halved)
  double linearizeImu(const BaProblem& problem);
  double linearizePlanes(const BaProblem& problem);
  double linearizeRelativePoses(const BaProblem& problem);
  double linearizePriors(const BaProblem& problem);
  double factorCost(const BaProblem& problem);

  const InstructionSet instruction_set_;
  std::unique_ptr<Worker> worker_;
  bool helper_ = false;  ///< whether the worker has a helper thread
  SystemStructure structure_;
  bool loaded_ = false;  ///< the arrays below hold the present variables
  bool ahead_ = false;   ///< points and factors are linearised at the present variables, points not yet eliminated
  double ahead_ms_ = 0;  ///< total time spent on that
  std::vector<KernelFrame> frames_;
  std::vector<FrameGeometry> geometry_;
  std::vector<Eigen::Matrix<double, 3, 2>> basis_;
  std::vector<BaObservation> observations_;
  std::vector<KernelPlane> planes_;
  std::vector<KernelHomography> homographies_;
  bool shared_extrinsics_ = false;  ///< all frames have the same T_I_C
  std::vector<KernelPointToPlane> point_to_plane_;
  std::vector<double> homography_sums_, point_to_plane_sums_;
  std::vector<KernelImu> imu_;
  std::vector<double> imu_constants_, imu_states_, imu_frames_;
  KernelArray values_, W_, frame_sums_[SystemStructure::kPointParts], eliminated_;
  std::vector<double> points_, gradient_, full_gradient_, diagonal_, damping_, point_system_, point_gradient_,
      point_damping_, step_, point_step_;
};

}  // namespace vip_slam
