// SPDX-License-Identifier: BSD-3-Clause
// Files that appear completely or not at all: written next to the target and renamed on commit().
#pragma once

#include <fstream>
#include <string>

namespace vip_slam {

class AtomicFile {
 public:
  /// Opens a temporary file next to `path`. Throws std::runtime_error naming the path when it cannot.
  explicit AtomicFile(std::string path, bool binary = false);
  /// Removes the temporary file when commit() was not reached.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  std::ofstream& stream() { return stream_; }
  /// For writers that open files themselves: they write this one, nothing goes to stream().
  const std::string& temporary() const { return temporary_; }
  /// Flushes and renames. Throws std::runtime_error naming the path on a failed write.
  void commit();

 private:
  std::string path_, temporary_;
  std::ofstream stream_;
  bool committed_ = false;
};

/// A whole text file; throws as AtomicFile does.
void writeText(const std::string& path, const std::string& text);

}  // namespace vip_slam
