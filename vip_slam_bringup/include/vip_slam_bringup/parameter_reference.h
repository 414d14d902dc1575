// The parameter reference of the documents, made from the option structs.
#pragma once

#include <string>

namespace vip_slam {

/// All of docs/parameters.md.
std::string parameterReference();

}  // namespace vip_slam
