// Levenberg-Marquardt that knows the structure of a bundle adjustment: fixed-size blocks, points eliminated while they
// are linearised, plane factors reduced to small dense blocks, one symbolic factorisation for all iterations.
#pragma once

#include <functional>

#include <Eigen/Core>

#include "imu_kernels.h"
#include "plane_kernels.h"
#include "point_kernels.h"
#include "system_structure.h"
#include "vip_slam_backend/solver/ba_solver.h"
#include "vip_slam_backend/solver/kernel_array.h"
#include "worker.h"

namespace vip_slam {

class StructuredSolver : public BaSolver {
 public:
  std::string name() const override { return "structured"; }
  SolverSummary solve(BaProblem& problem, const SolverOptions& options) override;

  /// For tests: the damped, reduced normal equations and the step at the problem's present state.
  struct Step {
    Eigen::VectorXd gradient;      ///< J^T r of poses, motions, planes in node order, before elimination
    Eigen::VectorXd diagonal;      ///< diag(J^T J) of the same
    Eigen::VectorXd step;          ///< of the same
    Eigen::VectorXd point_step;    ///< 3 per point
  };
  Step stepAt(const BaProblem& problem, double radius);
  const SystemStructure& structure() const { return structure_; }

 private:
  // structured_arrays.cpp
  void prepare(const BaProblem& problem);
  void packHomographies(const BaProblem& problem);
  void packImu(const BaProblem& problem);
  void loadFrames(const BaProblem& problem);
  void loadImu(const BaProblem& problem);
  PointKernelArguments arguments(const BaProblem& problem, double radius);
  HomographyKernelArguments homographyArguments() const;
  ImuKernelArguments imuArguments() const;

  // structured_linearize.cpp
  void linearize(const BaProblem& problem, double radius, Worker* worker);
  void storeDiagonal();
  void addPoints();
  void damp(double radius);
  void forEachNode(const std::function<void(int size, int unknown, double* block)>& f);

  double cost(const BaProblem& problem, Worker* worker);
  bool solveStep(Worker* worker);
  /// Predicted decrease of the cost by the present step.
  double modelDecrease() const;
  struct State {
    std::vector<BaFrame> frames;
    std::vector<BaPoint> points;
    std::vector<BaPlane> planes;
  };
  void apply(const BaProblem& from, State* to) const;
  double stepNorm() const;

  // linearize_factors.cpp
  void linearizeImu(const BaProblem& problem);
  void linearizePlanes(const BaProblem& problem);
  void linearizePriors(const BaProblem& problem);
  double factorCost(const BaProblem& problem) const;

  SystemStructure structure_;
  bool loaded_ = false;  ///< the arrays below hold the present variables
  std::vector<KernelFrame> frames_;
  std::vector<FrameGeometry> geometry_;
  std::vector<Eigen::Matrix<double, 3, 2>> basis_;
  std::vector<BaObservation> observations_;
  std::vector<KernelPlane> planes_;
  std::vector<KernelHomography> homographies_;
  std::vector<double> homography_sums_;
  std::vector<KernelImu> imu_;
  std::vector<double> imu_constants_, imu_states_;
  KernelArray values_, W_, frame_sums_, eliminated_;
  std::vector<double> points_, gradient_, full_gradient_, diagonal_, damping_, point_inverse_, point_gradient_,
      point_damping_, step_, point_step_;
};

}  // namespace vip_slam
