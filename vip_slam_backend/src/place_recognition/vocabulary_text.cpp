// SPDX-License-Identifier: BSD-3-Clause
// The text vocabulary format of ORB-SLAM: a header "k L scoring weighting" and one line per node,
// "parent is_leaf d0 ... d31 weight", nodes numbered from 1 in file order, node 0 being the root.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "vip_slam_backend/place_recognition/vocabulary_io.h"

namespace vip_slam {
namespace {

struct TextNode {
  std::uint32_t parent;
  bool leaf;
  float weight;
  Descriptor descriptor;
};

class TextReader {
 public:
  TextReader(const std::string& text, const std::string& source)
      : at_(text.data()), end_(text.data() + text.size()), source_(source) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(source_ + ":" + std::to_string(line_) + ": " + what);
  }
  /// Skips empty lines; false at the end.
  bool nextLine() {
    while (at_ < end_ && isSpace(*at_)) step();
    return at_ < end_;
  }
  long integer(const char* name, long min, long max) {
    skipBlanks();
    long value = 0;
    const auto r = std::from_chars(at_, end_, value);
    if (r.ec != std::errc() || value < min || value > max)
      fail(std::string("bad ") + name + word() + ", expected a number from " + std::to_string(min) + " to " +
           std::to_string(max));
    at_ = r.ptr;
    return value;
  }
  float number(const char* name) {
    skipBlanks();
    // Debian's and Noetic's standard libraries differ in from_chars for floats; strtod stops at the blank by itself.
    const std::size_t room = std::min<std::size_t>(48, static_cast<std::size_t>(end_ - at_));
    const std::string token(at_, room);
    char* stop = nullptr;
    const double value = std::strtod(token.c_str(), &stop);
    if (stop == token.c_str() || !std::isfinite(value))
      fail(std::string("bad ") + name + word() + ", expected a number");
    at_ += stop - token.c_str();
    return static_cast<float>(value);
  }

 private:
  /// What stands here, in quotes, to follow a name.
  std::string word() const {
    constexpr std::ptrdiff_t kMost = 20;
    const char* stop = std::find_if(at_, std::min(end_, at_ + std::min(kMost, end_ - at_)), isSpace);
    return " '" + std::string(at_, stop) + "'";
  }
  static bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  void step() {
    if (*at_ == '\n') ++line_;
    ++at_;
  }
  void skipBlanks() {
    while (at_ < end_ && (*at_ == ' ' || *at_ == '\t')) ++at_;
  }

  const char* at_;
  const char* end_;
  std::string source_;
  std::size_t line_ = 1;
};

}  // namespace

Vocabulary parseTextVocabulary(const std::string& text, const std::string& source) {
  TextReader in(text, source);
  if (!in.nextLine()) in.fail("empty file, expected a text vocabulary");
  Vocabulary::Tree tree;
  tree.branching = static_cast<std::uint32_t>(in.integer("branching factor", 2, 255));
  tree.levels = static_cast<std::uint32_t>(in.integer("number of levels", 1, 20));
  const long scoring = in.integer("scoring type", 0, 5);
  if (scoring != 0) in.fail("scoring type is " + std::to_string(scoring) + ", expected 0 (L1)");
  in.integer("weighting type", 0, 3);

  std::vector<TextNode> nodes(1);
  nodes[0] = {0, false, 0, {}};
  std::vector<std::vector<std::uint32_t>> children(1);
  while (in.nextLine()) {
    TextNode node;
    node.parent = static_cast<std::uint32_t>(in.integer("parent", 0, static_cast<long>(nodes.size()) - 1));
    node.leaf = in.integer("leaf flag", 0, 1) != 0;
    for (std::uint8_t& byte : node.descriptor) byte = static_cast<std::uint8_t>(in.integer("descriptor byte", 0, 255));
    node.weight = in.number("weight");
    if (nodes[node.parent].leaf) in.fail("parent " + std::to_string(node.parent) + " is a leaf");
    if (children[node.parent].size() >= 255)
      in.fail("parent " + std::to_string(node.parent) + " has over 255 children");
    children[node.parent].push_back(static_cast<std::uint32_t>(nodes.size()));
    nodes.push_back(node);
    children.emplace_back();
  }
  if (nodes.size() < 2) in.fail("no nodes, expected one per line");

  std::vector<std::uint32_t> order{0};
  order.reserve(nodes.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::uint32_t node = order[k];
    tree.children.push_back(static_cast<std::uint8_t>(children[node].size()));
    tree.descriptors.push_back(nodes[node].descriptor);
    if (children[node].empty()) tree.weights.push_back(std::max(0.f, nodes[node].weight));
    order.insert(order.end(), children[node].begin(), children[node].end());
  }
  try {
    return Vocabulary(std::move(tree));
  } catch (const std::invalid_argument& e) {
    in.fail(e.what());
  }
}

}  // namespace vip_slam
