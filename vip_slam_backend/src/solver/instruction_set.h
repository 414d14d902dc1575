// Which vector instructions the kernels use. Each kernel is built once per set (kernel_builds.inc) and chosen when the
// program runs, so that nothing depends on -march; only plain pointers cross, so that no Eigen object meets another
// alignment.
#pragma once

namespace vip_slam {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

const char* instructionSetName(InstructionSet set);
/// Whether this processor runs it.
bool runsHere(InstructionSet set);
/// Of those that this processor runs.
InstructionSet fastestInstructionSet();

}  // namespace vip_slam
