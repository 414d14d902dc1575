// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/map/views.h"
#include "vip_slam_backend/place_recognition/vocabulary_io.h"

namespace vip_slam {
namespace {

// A place other than the expected one is refused when another candidate or view fits the query as well, with at least
// this share of its points.
constexpr double kRivalShare = 0.7;

// A keyframe with the neighbours that show the same place.
std::set<KeyframeId> placeOf(const Map& map, KeyframeId id) {
  std::set<KeyframeId> place{id};
  const MapKeyframe& kf = map.keyframe(id);
  for (const KeyframeId neighbour : {kf.previous, kf.next})
    if (neighbour != 0) place.insert(neighbour);
  for (const auto& neighbour : map.covisible(id, 15)) place.insert(neighbour.first);
  return place;
}

bool touch(const std::set<KeyframeId>& a, const std::set<KeyframeId>& b) {
  return std::any_of(a.begin(), a.end(), [&b](KeyframeId id) { return b.count(id) != 0; });
}

}  // namespace

LoopCloser::LoopCloser(const LoopOptions& options, std::shared_ptr<const CameraModel> camera, TimingLog* timing)
    : options_(options),
      timing_(timing),
      vocabulary_(openVocabulary(options.vocabulary)),
      database_(vocabulary_->words()),
      verifier_(options.verification, camera),
      joins_(options.relocalisation) {}

BowResult LoopCloser::describe(const Keyframe& keyframe) const {
  std::vector<Descriptor> descriptors;
  descriptors.reserve(keyframe.frame.features.size());
  for (const Feature& f : keyframe.frame.features) descriptors.push_back(f.descriptor);
  return vocabulary_->transform(descriptors, 1);
}

void LoopCloser::add(const Map& map, KeyframeId id) {
  ScopedTimer timer(timing_, "backend.bow", map.keyframe(id).data->frame.t);
  database_.add(id, describe(*map.keyframe(id).data));
}

void LoopCloser::rebuild(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  clear();
  for (const auto& entry : map.keyframes()) database_.add(entry.first, describe(*entry.second.data));
  loops_ = loops;
}

void LoopCloser::remove(KeyframeId id) {
  database_.remove(id);
  loops_.erase(std::remove_if(loops_.begin(), loops_.end(),
                              [id](const auto& loop) { return loop.first == id || loop.second == id; }),
               loops_.end());
}

void LoopCloser::tie(Map& map, KeyframeId query, KeyframeId match) {
  map.keyframe(query).loop_keyframe = map.keyframe(match).loop_keyframe = true;
  loops_.emplace_back(query, match);
}

bool LoopCloser::tied(const Map& map, KeyframeId id) const {
  return connectedKeyframes(map, id, loops_).size() == map.keyframes().size();
}

void LoopCloser::clear() {
  database_.clear();
  loops_.clear();
  recent_places_.clear();
  joins_.clear();
}

std::vector<KeyframeId> LoopCloser::candidates(const Map& map, KeyframeId query, const std::set<KeyframeId>& part) {
  const MapKeyframe& kf = map.keyframe(query);
  const BowVector& bow = database_.bow(query).bow;
  std::set<KeyframeId> joined;
  for (const auto& neighbour : map.covisible(query, options_.max_shared + 1)) joined.insert(neighbour.first);
  const auto old = [&](KeyframeId id) {
    return id != query && !joined.count(id) && part.count(id) != 0 && isOld(map, id, *kf.data);
  };
  // Words are shared by chance, too: the score of the previous keyframe is the reference for two views of one place.
  double reference = 0;
  if (kf.previous != 0 && database_.has(kf.previous)) reference = bowScore(bow, database_.bow(kf.previous).bow);
  const auto matches = database_.query(bow, 30, old);

  std::vector<KeyframeId> chosen;
  std::vector<std::set<KeyframeId>> places;
  std::set<KeyframeId> pointed_to;
  for (const DatabaseMatch& match : matches) {
    if (match.score < options_.relative_score * reference) break;
    if (static_cast<int>(places.size()) >= options_.candidates) break;
    // One candidate per place: its best keyframe.
    if (std::any_of(places.begin(), places.end(), [&](const auto& place) { return place.count(match.keyframe) != 0; }))
      continue;
    places.push_back(placeOf(map, match.keyframe));
    pointed_to.insert(places.back().begin(), places.back().end());
    int agreeing = 0;
    for (auto recent = recent_places_.rbegin(); recent != recent_places_.rend(); ++recent)
      agreeing += touch(places.back(), *recent);
    if (agreeing >= options_.consistency) chosen.push_back(match.keyframe);
  }
  recent_places_.push_back(std::move(pointed_to));
  while (recent_places_.size() > static_cast<std::size_t>(options_.consistency) + 1) recent_places_.pop_front();
  return chosen;
}

bool LoopCloser::isOld(const Map& map, KeyframeId id, const Keyframe& query) const {
  const TrackedFrame& frame = map.keyframe(id).data->frame;
  return frame.epoch != query.frame.epoch || query.frame.t - frame.t > options_.min_seconds;
}

std::vector<LoopEvent> LoopCloser::close(Map& map, KeyframeId query) {
  const MapKeyframe& kf = map.keyframe(query);
  ScopedTimer timer(timing_, "backend.loop", kf.data->frame.t);
  const std::set<KeyframeId> part = connectedKeyframes(map, query, loops_);
  std::vector<LoopEvent> events;
  if (part.size() < map.keyframes().size()) {
    events.push_back(joinParts(map, query, part));
    if (events.back().accepted) return events;
  }
  const std::vector<KeyframeId> matches = candidates(map, query, part);
  for (const KeyframeId match : matches) {
    // The pose must be computed from old landmarks alone, otherwise it would confirm the drift.
    const auto old = [&](KeyframeId id) { return part.count(id) != 0 && isOld(map, id, *kf.data); };
    PlaceVerification place =
        verifier_.verify(map, *kf.data, kf.state.T_W_I, database_.bow(query), match, database_, old);
    const std::string as_well = place.accepted ? rival(map, query, place, matches, old) : "";
    if (!as_well.empty()) {
      place.accepted = false;
      place.reason += "; " + as_well;
    }
    events.push_back(correct(map, query, place));
    if (events.back().accepted) break;
  }
  return events;
}

std::string LoopCloser::rival(const Map& map, KeyframeId query, const PlaceVerification& place,
                              const std::vector<KeyframeId>& candidates,
                              const std::function<bool(KeyframeId)>& old) const {
  const MapKeyframe& kf = map.keyframe(query);
  const auto elsewhere = [&place](const SE3& T_W_I) { return !samePlace(T_W_I, place.T_W_I); };
  if (!elsewhere(kf.state.T_W_I)) return "";
  const auto rivals = [&](const PlaceVerification& other) {
    return other.accepted && elsewhere(other.T_W_I) && other.inliers > kRivalShare * place.inliers;
  };
  if (const auto nearest = viewsAlong(map, kf.T_W_C(), 1, old); !nearest.empty()) {
    const PlaceVerification other = verifier_.track(map, *kf.data, kf.state.T_W_I, nearest.front(), old);
    if (rivals(other)) return "where the map has it fits as well, " + std::to_string(other.inliers) + " points";
  }
  for (const KeyframeId match : candidates) {
    if (match == place.match) continue;
    const PlaceVerification other =
        verifier_.verify(map, *kf.data, kf.state.T_W_I, database_.bow(query), match, database_, old);
    if (rivals(other)) {
      return "keyframe " + std::to_string(match) + " shows it elsewhere as well, " + std::to_string(other.inliers) +
             " points";
    }
  }
  return "";
}

LoopEvent LoopCloser::joinParts(Map& map, KeyframeId query, const std::set<KeyframeId>& part) {
  const auto elsewhere = [&part](KeyframeId id) { return part.count(id) == 0; };
  std::map<std::uint32_t, std::uint32_t> part_of_epoch;
  for (const EpochPart& told : epochParts(map, loops_)) part_of_epoch[told.epoch] = told.part;
  const auto part_of = [&](KeyframeId id) { return part_of_epoch.at(map.keyframe(id).data->frame.epoch); };
  return correct(
      map, query,
      joins_.add(map, database_, verifier_, map.keyframe(query).data, database_.bow(query), elsewhere, part_of));
}

}  // namespace vip_slam
