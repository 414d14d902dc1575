// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <sstream>

#include "place_recognition/synthetic_descriptors.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/place_recognition/vocabulary_io.h"
#include "vip_slam_backend/place_recognition/vocabulary_trainer.h"

namespace vip_slam {
namespace {

class VocabularyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int k = 0; k < 400; ++k) stock_.push_back(randomDescriptor(random_));
    for (int k = 0; k < 60; ++k) images_.push_back(randomImage(stock_, 100, random_));
    options_.levels = 3;
    vocabulary_ = trainVocabulary(images_, options_);
  }
  std::mt19937_64 random_{7};
  std::vector<Descriptor> stock_;
  std::vector<std::vector<Descriptor>> images_;
  VocabularyTrainerOptions options_;
  Vocabulary vocabulary_;
};

TEST_F(VocabularyTest, TrainingIsRepeatableAndSeparatesAppearances) {
  EXPECT_EQ(trainVocabulary(images_, options_).id(), vocabulary_.id());
  options_.seed = 2;
  EXPECT_NE(trainVocabulary(images_, options_).id(), vocabulary_.id());
  EXPECT_GT(vocabulary_.words(), 200u);
  EXPECT_LE(vocabulary_.words(), 1000u);
  // Two noisy views of one appearance mostly fall into one word, different appearances do not.
  int same = 0, different = 0;
  for (int k = 0; k < 400; ++k) {
    const WordId w = vocabulary_.word(stock_[k]);
    same += vocabulary_.word(noisy(stock_[k], 0.05, random_)) == w;
    different += vocabulary_.word(stock_[(k + 1) % 400]) == w;
  }
  EXPECT_GT(same, 340);
  EXPECT_LT(different, 60);
}

TEST_F(VocabularyTest, BowVectorIsNormalisedSortedAndIndexed) {
  const BowResult r = vocabulary_.transform(images_[0], 2);
  double sum = 0;
  for (std::size_t k = 0; k < r.bow.size(); ++k) {
    sum += r.bow[k].second;
    if (k > 0) {
      EXPECT_LT(r.bow[k - 1].first, r.bow[k].first);
    }
  }
  EXPECT_NEAR(sum, 1.0, 1e-5);
  std::vector<int> seen(images_[0].size(), 0);
  for (const auto& node : r.direct)
    for (const std::uint32_t f : node.second) ++seen[f];
  for (const int s : seen) EXPECT_EQ(s, 1);
  EXPECT_NEAR(bowScore(r.bow, r.bow), 1.0, 1e-5);
  EXPECT_TRUE(vocabulary_.transform({}).bow.empty());
}

TEST_F(VocabularyTest, ScoreIsL1) {
  const BowVector a = vocabulary_.transform(images_[0]).bow, b = vocabulary_.transform(images_[1]).bow;
  std::vector<double> dense(vocabulary_.words(), 0.0);
  for (const auto& w : a) dense[w.first] += w.second;
  for (const auto& w : b) dense[w.first] -= w.second;
  double l1 = 0;
  for (const double v : dense) l1 += std::abs(v);
  EXPECT_NEAR(bowScore(a, b), 1.0 - 0.5 * l1, 1e-5);
  EXPECT_NEAR(bowScore(a, b), bowScore(b, a), 1e-12);
}

TEST_F(VocabularyTest, RareWordsWeighMore) {
  // A descriptor that occurs in only one image must get more weight than one that occurs in all.
  const Descriptor common = randomDescriptor(random_), rare = randomDescriptor(random_);
  auto images = images_;
  for (auto& image : images)
    for (int k = 0; k < 8; ++k) image.push_back(common);
  for (int k = 0; k < 8; ++k) images[0].push_back(rare);
  const Vocabulary v = trainVocabulary(images, options_);
  EXPECT_GT(v.weight(v.word(rare)), v.weight(v.word(common)) + 1.0f);
}

TEST_F(VocabularyTest, BinaryRoundTripAndDamage) {
  const std::string bytes = serialiseVocabulary(vocabulary_);
  const auto parse = [](const std::string& b) {
    return parseVocabulary(reinterpret_cast<const std::uint8_t*>(b.data()), b.size(), "test");
  };
  const Vocabulary again = parse(bytes);
  EXPECT_EQ(again.id(), vocabulary_.id());
  EXPECT_EQ(serialiseVocabulary(again), bytes);
  // Every byte position: one flipped bit, and every truncation.
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    std::string bad = bytes;
    bad[k] = static_cast<char>(bad[k] ^ (1 << (k % 8)));
    EXPECT_THROW(parse(bad), std::runtime_error) << "byte " << k;
  }
  for (std::size_t size = 0; size < bytes.size(); size += 17)
    EXPECT_THROW(parse(bytes.substr(0, size)), std::runtime_error) << size;
  EXPECT_THROW(parse(bytes + "x"), std::runtime_error);
}

TEST_F(VocabularyTest, ErrorsNameFileAndReason) {
  try {
    loadVocabulary("/nonexistent/v.voc");
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("/nonexistent/v.voc"), std::string::npos);
  }
  const std::string foreign = "PNG and so on, long enough to have a header of its own";
  try {
    parseVocabulary(reinterpret_cast<const std::uint8_t*>(foreign.data()), foreign.size(), "a.png");
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("a.png: not a vocabulary"), std::string::npos) << e.what();
  }
}

TEST_F(VocabularyTest, ReadsTheTextFormat) {
  // Writes the tree depth-first, as DBoW2 does, to prove that the reader does not depend on our order.
  const Vocabulary::Tree& tree = vocabulary_.tree();
  std::vector<std::uint32_t> first(tree.children.size());
  std::uint32_t next = 1;
  for (std::size_t k = 0; k < tree.children.size(); ++k) {
    first[k] = next;
    next += tree.children[k];
  }
  std::vector<std::size_t> word(tree.children.size());
  std::size_t words = 0;
  for (std::size_t k = 0; k < tree.children.size(); ++k)
    if (tree.children[k] == 0) word[k] = words++;
  std::ostringstream text;
  text << "10 3  0 0\n";
  std::uint32_t written = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack;  // node, id of its parent in the file
  for (int c = tree.children[0]; c-- > 0;) stack.emplace_back(first[0] + c, 0);
  while (!stack.empty()) {
    const auto [node, parent] = stack.back();
    stack.pop_back();
    const std::uint32_t id = ++written;
    text << parent << (tree.children[node] == 0 ? " 1 " : " 0 ");
    for (const std::uint8_t byte : tree.descriptors[node]) text << int(byte) << ' ';
    text << (tree.children[node] == 0 ? tree.weights[word[node]] : 0.f) << "\n";
    for (int c = tree.children[node]; c-- > 0;) stack.emplace_back(first[node] + c, id);
  }
  const Vocabulary read = parseTextVocabulary(text.str(), "test.txt");
  ASSERT_EQ(read.words(), vocabulary_.words());
  for (const Descriptor& d : stock_)
    EXPECT_NEAR(read.weight(read.word(d)), vocabulary_.weight(vocabulary_.word(d)), 1e-4);
  EXPECT_NEAR(bowScore(read.transform(images_[0]).bow, read.transform(images_[1]).bow),
              bowScore(vocabulary_.transform(images_[0]).bow, vocabulary_.transform(images_[1]).bow), 1e-4);

  const std::string good = text.str();
  for (const std::string& bad :
       {std::string(), std::string("10"), std::string("10 3 0 0\n"), std::string("10 3 0 0\n7 1 2 3\n"),
        std::string("300 3 0 0\n"), std::string("10 3 2 0\n"), good + "1 1 4 5\n", good + "nonsense\n"}) {
    try {
      parseTextVocabulary(bad, "bad.txt");
      FAIL() << bad.substr(0, 30);
    } catch (const std::runtime_error& e) {
      EXPECT_EQ(std::string(e.what()).rfind("bad.txt:", 0), 0u) << e.what();
    }
  }
}

TEST(Trainer, RefusesNothing) {
  EXPECT_THROW(trainVocabulary({}, {}), std::invalid_argument);
  EXPECT_THROW(trainVocabulary({{}, {}}, {}), std::invalid_argument);
}

TEST(Trainer, IdenticalDescriptorsMakeOneWord) {
  std::mt19937_64 random(3);
  const Vocabulary v = trainVocabulary({std::vector<Descriptor>(50, randomDescriptor(random))}, {});
  EXPECT_EQ(v.words(), 1u);
}

TEST(ShippedVocabulary, LoadsQuicklyAndIsSmall) {
  const auto start = std::chrono::steady_clock::now();
  const auto v = shippedVocabulary();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_TRUE(v);
  EXPECT_GT(v->words(), 1000u);
  EXPECT_LE(serialiseVocabulary(*v).size(), 5u << 20);
  EXPECT_LE(seconds, 0.2);
}

}  // namespace
}  // namespace vip_slam
