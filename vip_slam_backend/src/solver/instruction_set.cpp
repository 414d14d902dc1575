// SPDX-License-Identifier: BSD-3-Clause
#include "instruction_set.h"

namespace vip_slam {
namespace {

InstructionSet choose() {
  if (runsHere(InstructionSet::kAvx512)) return InstructionSet::kAvx512;
  return runsHere(InstructionSet::kAvx2) ? InstructionSet::kAvx2 : InstructionSet::kBaseline;
}

}  // namespace

const char* instructionSetName(InstructionSet set) {
  return set == InstructionSet::kAvx512 ? "avx512" : set == InstructionSet::kAvx2 ? "avx2" : "baseline";
}

bool runsHere(InstructionSet set) {
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (set == InstructionSet::kAvx2) return avx2;
  if (set == InstructionSet::kAvx512)
    return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#endif
  return set == InstructionSet::kBaseline;
}

InstructionSet fastestInstructionSet() {
  static const InstructionSet fastest = choose();
  return fastest;
}

}  // namespace vip_slam
