// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/options.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

#include "util/text.h"

namespace vip_slam {
namespace {

std::string joined(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : ", ") + part;
  return out;
}

std::string rangeText(const std::string& min, const std::string& max) { return min + " … " + max; }

void flatten(const YAML::Node& node, const std::string& prefix, const std::string& path,
             std::vector<std::pair<std::string, std::string>>& out) {
  for (const auto& entry : node) {
    const std::string name = prefix.empty() ? entry.first.Scalar() : prefix + "/" + entry.first.Scalar();
    if (entry.second.IsMap()) {
      flatten(entry.second, name, path, out);
    } else if (entry.second.IsScalar()) {
      out.emplace_back(name, entry.second.Scalar());
    } else {
      throw std::invalid_argument(path + ": " + name + ": expected a single value or a map");
    }
  }
}

}  // namespace

std::string OptionVisitor::fullName(const std::string& name) const {
  std::string full;
  for (const std::string& part : prefix_) full += part + "/";
  return full + name;
}

void OptionLister::field(const std::string& name, bool& value, const std::string& meaning) {
  rows.push_back({fullName(name), "bool", value ? "true" : "false", "true, false", meaning});
}
void OptionLister::field(const std::string& name, int& value, int min, int max, const std::string& meaning) {
  rows.push_back(
      {fullName(name), "int", std::to_string(value), rangeText(std::to_string(min), std::to_string(max)), meaning});
}
void OptionLister::field(const std::string& name, double& value, double min, double max, const std::string& meaning) {
  rows.push_back(
      {fullName(name), "double", formatDouble(value), rangeText(formatDouble(min), formatDouble(max)), meaning});
}
void OptionLister::field(const std::string& name, std::string& value, const std::vector<std::string>& choices,
                         const std::string& meaning) {
  rows.push_back({fullName(name), "string", value, choices.empty() ? "any text" : joined(choices), meaning});
}

OptionSetter::OptionSetter(std::vector<std::pair<std::string, std::string>> values, std::string source)
    : values_(std::move(values)), taken_(values_.size(), false), source_(std::move(source)) {}

const std::string* OptionSetter::take(const std::string& name) {
  const std::string full = fullName(name);
  known_.push_back(full);
  const std::string* found = nullptr;
  for (std::size_t k = 0; k < values_.size(); ++k) {
    if (values_[k].first != full) continue;
    taken_[k] = true;
    found = &values_[k].second;
  }
  return found;
}

void OptionSetter::fail(const std::string& name, const std::string& text, const std::string& expected) const {
  throw std::invalid_argument((source_.empty() ? "" : source_ + ": ") + fullName(name) + ": '" + text + "' is not " +
                              expected);
}

void OptionSetter::field(const std::string& name, bool& value, const std::string&) {
  if (const std::string* text = take(name))
    if (!parseBool(*text, &value)) fail(name, *text, "true or false");
}

void OptionSetter::field(const std::string& name, int& value, int min, int max, const std::string&) {
  const std::string* text = take(name);
  if (!text) return;
  int parsed = 0;
  if (!parseInt(*text, &parsed) || parsed < min || parsed > max)
    fail(name, *text, "a whole number from " + std::to_string(min) + " to " + std::to_string(max));
  value = parsed;
}

void OptionSetter::field(const std::string& name, double& value, double min, double max, const std::string&) {
  const std::string* text = take(name);
  if (!text) return;
  double parsed = 0;
  if (!parseDouble(*text, &parsed) || !(parsed >= min && parsed <= max))
    fail(name, *text, "a number from " + formatDouble(min) + " to " + formatDouble(max));
  value = parsed;
}

void OptionSetter::field(const std::string& name, std::string& value, const std::vector<std::string>& choices,
                         const std::string&) {
  const std::string* text = take(name);
  if (!text) return;
  if (!choices.empty() && std::find(choices.begin(), choices.end(), *text) == choices.end())
    fail(name, *text, "one of " + joined(choices));
  value = *text;
}

void OptionSetter::finish() const {
  for (std::size_t k = 0; k < values_.size(); ++k) {
    if (taken_[k]) continue;
    const std::string* nearest = nullptr;
    std::size_t best = std::numeric_limits<std::size_t>::max();
    for (const std::string& name : known_) {
      const std::size_t distance = editDistance(values_[k].first, name);
      if (distance < best) {
        best = distance;
        nearest = &name;
      }
    }
    // With an edit distance of the whole length any name would match.
    if (best >= values_[k].first.size()) nearest = nullptr;
    throw std::invalid_argument((source_.empty() ? "" : source_ + ": ") + "unknown option '" + values_[k].first + "'" +
                                (nearest ? ", did you mean '" + *nearest + "'?" : "") +
                                " (docs/parameters.md lists all; some of earlier versions are fixed values now)");
  }
}

std::vector<std::pair<std::string, std::string>> flattenYaml(const std::string& yaml_path, const std::string& section) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(yaml_path);
  } catch (const YAML::BadFile&) {
    throw std::invalid_argument(yaml_path + ": cannot be read");
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument(yaml_path + ": line " + std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
  if (!section.empty()) root = root[section];
  std::vector<std::pair<std::string, std::string>> out;
  if (!root || root.IsNull()) return out;
  if (!root.IsMap()) throw std::invalid_argument(yaml_path + ": expected a map of options");
  flatten(root, "", yaml_path, out);
  return out;
}

std::string optionReference(const std::string& title, const std::vector<OptionRow>& rows) {
  std::string out = "## " + title + "\n\n| name | default | range | meaning |\n|---|---|---|---|\n";
  for (const OptionRow& row : rows)
    out += "| `" + row.name + "` | " + row.value + " | " + row.range + " | " + row.meaning + " |\n";
  return out;
}

}  // namespace vip_slam
