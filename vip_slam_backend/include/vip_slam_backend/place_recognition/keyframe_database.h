// SPDX-License-Identifier: BSD-3-Clause
// Inverse index from words to keyframes, to find keyframes of similar appearance.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "vip_slam_backend/place_recognition/vocabulary.h"

namespace vip_slam {

struct DatabaseMatch {
  KeyframeId keyframe = 0;
  double score = 0;  ///< L1 score, 0..1
};

class KeyframeDatabase {
 public:
  KeyframeDatabase() = default;
  explicit KeyframeDatabase(std::size_t words) : index_(words) {}

  /// Replaces an entry of the same id. Words beyond the vocabulary are refused with std::out_of_range.
  void add(KeyframeId id, BowResult bow);
  void remove(KeyframeId id);
  void clear();
  bool has(KeyframeId id) const { return slots_.count(id) != 0; }
  std::size_t size() const { return slots_.size(); }
  /// Throws std::out_of_range when it is not there.
  const BowResult& bow(KeyframeId id) const;

  /// Keyframes sharing words with `bow`, best first (ties: smaller id), at most `max_results`; only those that
  /// `allowed` lets pass (empty: all).
  std::vector<DatabaseMatch> query(const BowVector& bow, std::size_t max_results,
                                   const std::function<bool(KeyframeId)>& allowed = {}) const;

 private:
  struct Entry {
    KeyframeId id = 0;  ///< 0: free
    BowResult bow;
  };
  struct Posting {
    std::uint32_t slot;
    float weight;
  };
  std::vector<std::vector<Posting>> index_;  ///< per word
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> free_;
  std::map<KeyframeId, std::uint32_t> slots_;
};

}  // namespace vip_slam
