#include "vip_slam_core/util/atomic_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <locale>
#include <stdexcept>

#include <unistd.h>

namespace vip_slam {

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
  if (!written || stream_.fail()) throw std::runtime_error(path_ + ": writing failed, is the disk full?");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) {
    throw std::runtime_error(path_ + ": cannot be written: " + std::strerror(errno));
  }
  committed_ = true;
}

}  // namespace vip_slam
