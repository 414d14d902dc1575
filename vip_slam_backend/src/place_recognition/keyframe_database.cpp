// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/place_recognition/keyframe_database.h"

#include <algorithm>
#include <stdexcept>

namespace vip_slam {

void KeyframeDatabase::add(KeyframeId id, BowResult bow) {
  for (const auto& word : bow.bow)
    if (word.first >= index_.size())
      throw std::out_of_range("word " + std::to_string(word.first) + " is not in the vocabulary of this database");
  remove(id);
  std::uint32_t slot;
  if (free_.empty()) {
    slot = static_cast<std::uint32_t>(entries_.size());
    entries_.emplace_back();
  } else {
    slot = free_.back();
    free_.pop_back();
  }
  for (const auto& word : bow.bow) index_[word.first].push_back({slot, word.second});
  entries_[slot] = {id, std::move(bow)};
  slots_[id] = slot;
}

void KeyframeDatabase::remove(KeyframeId id) {
  const auto it = slots_.find(id);
  if (it == slots_.end()) return;
  const std::uint32_t slot = it->second;
  for (const auto& word : entries_[slot].bow.bow) {
    auto& postings = index_[word.first];
    postings.erase(
        std::remove_if(postings.begin(), postings.end(), [slot](const Posting& p) { return p.slot == slot; }),
        postings.end());
  }
  entries_[slot] = {};
  free_.push_back(slot);
  slots_.erase(it);
}

void KeyframeDatabase::clear() { *this = KeyframeDatabase(index_.size()); }

const BowResult& KeyframeDatabase::bow(KeyframeId id) const {
  const auto it = slots_.find(id);
  if (it == slots_.end()) throw std::out_of_range("keyframe " + std::to_string(id) + " is not in the database");
  return entries_[it->second].bow;
}

std::vector<DatabaseMatch> KeyframeDatabase::query(const BowVector& bow, std::size_t max_results,
                                                   const std::function<bool(KeyframeId)>& allowed) const {
  std::vector<double> score(entries_.size(), 0.0);
  for (const auto& word : bow) {
    if (word.first >= index_.size()) continue;
    for (const Posting& p : index_[word.first]) score[p.slot] += std::min(p.weight, word.second);
  }
  std::vector<DatabaseMatch> matches;
  for (std::size_t slot = 0; slot < score.size(); ++slot)
    if (score[slot] > 0 && (!allowed || allowed(entries_[slot].id)))
      matches.push_back({entries_[slot].id, score[slot]});
  const std::size_t keep = std::min(max_results, matches.size());
  std::partial_sort(matches.begin(), matches.begin() + static_cast<std::ptrdiff_t>(keep), matches.end(),
                    [](const DatabaseMatch& a, const DatabaseMatch& b) {
                      return a.score != b.score ? a.score > b.score : a.keyframe < b.keyframe;
                    });
  matches.resize(keep);
  return matches;
}

}  // namespace vip_slam
