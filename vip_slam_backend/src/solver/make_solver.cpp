#include <stdexcept>

#include "ceres_solver.h"
#include "structured_solver.h"

namespace vip_slam {

std::unique_ptr<BaSolver> makeSolver(const std::string& name) {
  if (name == "structured") return std::make_unique<StructuredSolver>();
  if (name == "ceres") return std::make_unique<CeresSolver>();
  throw std::invalid_argument("solver: '" + name + "', expected structured or ceres");
}

}  // namespace vip_slam
