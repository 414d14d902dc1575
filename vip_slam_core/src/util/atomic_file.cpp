// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <locale>
#include <stdexcept>

#include <fcntl.h>
#include <unistd.h>

namespace vip_slam {
namespace {

bool synced(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY);
  if (file < 0) return false;
  const bool done = ::fsync(file) == 0;
  ::close(file);
  return done;
}

}  // namespace

AtomicFile::AtomicFile(std::string path, bool binary)
    : path_(std::move(path)), temporary_(path_ + ".partial-" + std::to_string(::getpid())) {
  stream_.imbue(std::locale::classic());
  stream_.open(temporary_, binary ? std::ios::out | std::ios::binary : std::ios::out);
  if (!stream_) throw std::runtime_error(path_ + ": cannot be written: " + std::strerror(errno));
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  stream_.close();
  std::remove(temporary_.c_str());
}

void AtomicFile::commit() {
  stream_.flush();
  const bool written = stream_.good();
  stream_.close();
  // Synced to disk before the rename: a power cut must not leave an empty file in place of the old one.
  if (!written || stream_.fail() || !synced(temporary_))
    throw std::runtime_error(path_ + ": writing failed, is the disk full?");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) {
    throw std::runtime_error(path_ + ": cannot be written: " + std::strerror(errno));
  }
  committed_ = true;
  const auto slash = path_.find_last_of('/');
  synced(slash == std::string::npos ? "." : path_.substr(0, slash + 1));  // the new name, where supported
}

void writeText(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.stream() << text;
  file.commit();
}

}  // namespace vip_slam
