// SPDX-License-Identifier: BSD-3-Clause
// Vector instruction sets of the kernels. Each kernel is built once per set (kernel_builds.inc) and chosen at run time,
// so that nothing depends on -march; only plain pointers are passed to them, so that no Eigen object is used with
// different alignments.
#pragma once

namespace vip_slam {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

const char* instructionSetName(InstructionSet set);
/// Whether this processor supports it.
bool runsHere(InstructionSet set);
/// The fastest set that this processor supports.
InstructionSet fastestInstructionSet();

}  // namespace vip_slam
