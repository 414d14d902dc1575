// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>

#include "place_recognition/synthetic_descriptors.h"
#include "vip_slam_backend/place_recognition/keyframe_database.h"
#include "vip_slam_backend/place_recognition/vocabulary_trainer.h"

namespace vip_slam {
namespace {

class DatabaseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int k = 0; k < 3000; ++k) stock_.push_back(randomDescriptor(random_));
    for (int k = 0; k < 200; ++k) places_.push_back(randomImage(stock_, 300, random_));
    VocabularyTrainerOptions options;
    options.levels = 4;
    options.iterations = 4;
    vocabulary_ = trainVocabulary({places_.begin(), places_.begin() + 60}, options);
    database_ = KeyframeDatabase(vocabulary_.words());
    for (std::size_t k = 0; k < places_.size(); ++k) database_.add(k + 1, vocabulary_.transform(places_[k]));
  }
  std::mt19937_64 random_{11};
  std::vector<Descriptor> stock_;
  std::vector<std::vector<Descriptor>> places_;
  Vocabulary vocabulary_;
  KeyframeDatabase database_;
};

TEST_F(DatabaseTest, FindsThePlaceSeenAgain) {
  int found = 0;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const auto matches = database_.query(vocabulary_.transform(sameImage(places_[k], 0.05, random_)).bow, 3);
    ASSERT_FALSE(matches.empty());
    found += matches[0].keyframe == k + 1;
  }
  EXPECT_GE(found, 196);
}

TEST_F(DatabaseTest, ScoresAreThoseOfBowScore) {
  const BowVector q = vocabulary_.transform(sameImage(places_[5], 0.05, random_)).bow;
  for (const DatabaseMatch& m : database_.query(q, 1000))
    EXPECT_NEAR(m.score, bowScore(q, database_.bow(m.keyframe).bow), 1e-6);
}

TEST_F(DatabaseTest, RemovalFilterAndReuse) {
  const BowVector q = vocabulary_.transform(places_[9]).bow;
  EXPECT_EQ(database_.query(q, 1)[0].keyframe, 10u);
  EXPECT_NE(database_.query(q, 1, [](KeyframeId id) { return id != 10; })[0].keyframe, 10u);
  database_.remove(10);
  database_.remove(10);
  EXPECT_FALSE(database_.has(10));
  EXPECT_EQ(database_.size(), 199u);
  for (const DatabaseMatch& m : database_.query(q, 1000)) EXPECT_NE(m.keyframe, 10u);
  database_.add(500, vocabulary_.transform(places_[9]));
  EXPECT_EQ(database_.query(q, 1)[0].keyframe, 500u);
  database_.add(500, vocabulary_.transform(places_[20]));  // replaces
  EXPECT_NE(database_.query(q, 1)[0].keyframe, 500u);
  EXPECT_THROW(database_.bow(10), std::out_of_range);
  EXPECT_THROW(database_.add(501, {{{static_cast<WordId>(vocabulary_.words()), 1.f}}, {}}), std::out_of_range);
  database_.clear();
  EXPECT_TRUE(database_.query(q, 10).empty());
}

TEST_F(DatabaseTest, QueryTimeAtTwoThousandKeyframes) {
  for (KeyframeId id = 1000; database_.size() < 2000; ++id)
    database_.add(id, vocabulary_.transform(randomImage(stock_, 300, random_)));
  std::vector<BowVector> queries;
  for (int k = 0; k < 20; ++k) queries.push_back(vocabulary_.transform(sameImage(places_[k], 0.05, random_)).bow);
  const auto start = std::chrono::steady_clock::now();
  std::size_t results = 0;
  for (const BowVector& q : queries) results += database_.query(q, 20).size();
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count() / queries.size();
  EXPECT_EQ(results, 400u);
  RecordProperty("query_ms", std::to_string(ms));
  std::printf("query at 2,000 keyframes: %.3f ms\n", ms);
  EXPECT_LE(ms, 5.0);
}

}  // namespace
}  // namespace vip_slam
