// SPDX-License-Identifier: BSD-3-Clause
// What the solver tests run over: the variants of the system, and solvers that do not stop early.
#pragma once

#include <vector>

#include "../../src/solver/instruction_set.h"
#include "solver/synthetic_problem.h"
#include "vip_slam_backend/solver/ba_solver.h"

namespace vip_slam {

struct SolverVariant {
  const char* name;
  SyntheticOptions options;
};

inline std::vector<SolverVariant> variants() {
  std::vector<SolverVariant> list;
  SyntheticOptions vi;
  list.push_back({"vi", vi});
  SyntheticOptions p = vi;
  p.uncompressed = true;
  list.push_back({"vi_p", p});
  SyntheticOptions cp = vi;
  cp.compressed = true;
  list.push_back({"vi_cp", cp});
  SyntheticOptions vip = cp;
  vip.plane_point_states = false;
  list.push_back({"vip", vip});
  return list;
}

/// Another structure: more frames than a batch of the kernels, a camera of its own in each, and the fixed world.
inline SyntheticOptions withDifferentCameras(SyntheticOptions options) {
  options.frames = 11;
  options.different_cameras = options.world_frame = true;
  return options;
}

/// Those that this processor supports.
inline std::vector<InstructionSet> instructionSets() {
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512})
    if (runsHere(set)) sets.push_back(set);
  return sets;
}

inline SolverOptions exact(int iterations) {
  SolverOptions o;
  o.max_iterations = iterations;
  o.keep_iterating = true;
  return o;
}

}  // namespace vip_slam
