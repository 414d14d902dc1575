// SPDX-License-Identifier: BSD-3-Clause
// The command line of a tool: a thin wrapper of Boost.Program_options, so that all tools behave alike: defaults in
// --help, one line for a mistake that names the option and what was expected, exit status 2.
#pragma once

#include <boost/program_options.hpp>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace vip_slam {

/// Returns what was expected ("a number above 0") when a value is refused; empty when it is accepted.
template <class T>
using ValueCheck = std::function<std::string(const T&)>;

template <class T>
ValueCheck<T> above(T bound) {
  return [bound](const T& v) {
    std::ostringstream text;
    if (!(v > bound)) text << "a number above " << bound;
    return text.str();
  };
}

template <class T>
ValueCheck<T> between(T low, T high) {
  return [low, high](const T& v) {
    std::ostringstream text;
    if (!(v >= low && v <= high)) text << "a number from " << low << " to " << high;
    return text.str();
  };
}

/// `names` separated by ", ".
ValueCheck<std::string> oneOf(const std::string& names);

/// Every element of a list has to pass.
template <class T>
ValueCheck<std::vector<T>> each(ValueCheck<T> check) {
  return [check](const std::vector<T>& values) {
    for (const T& v : values)
      if (const std::string expected = check(v); !expected.empty()) return expected;
    return std::string();
  };
}

/// A list has `low` to `high` elements, both inclusive.
template <class T>
ValueCheck<std::vector<T>> count(std::size_t low, std::size_t high) {
  return [low, high](const std::vector<T>& values) {
    std::ostringstream text;
    if (values.size() < low || values.size() > high) {
      if (low < high) text << low << " to ";
      text << high << (high == 1 ? " value" : " values");
    }
    return text.str();
  };
}

class CommandLine {
 public:
  /// `program` begins messages; `purpose` is the first line of --help.
  CommandLine(std::string program, std::string purpose);

  /// A positional argument; a vector takes all that follow. `required`: it may not be left out.
  template <class T>
  void argument(const std::string& name, T& value, const std::string& help, bool required = true) {
    positional_.add(name.c_str(), isList(value) ? -1 : 1);
    arguments_.push_back({name, help});
    hidden_.add_options()(name.c_str(), semantic(value), help.c_str());
    if (required) this->required(name);
  }

  /// `name` as "out" or "out,o". The variable's present value is the default; a vector takes several values at a time
  /// and may be repeated.
  template <class T>
  void option(const std::string& name, T& value, const std::string& help, ValueCheck<T> check = {}) {
    visible_.add_options()(name.c_str(), semantic(value), help.c_str());
    if (isList(value)) lists_.push_back(longName(name));
    if (check)
      checks_.emplace_back(longName(name), [name = longName(name), &value, check = std::move(check)] {
        if (const std::string expected = check(value); !expected.empty()) refuse(name, text(value), expected);
      });
  }

  void flag(const std::string& name, bool& value, const std::string& help);

  /// The long name without dashes must be given.
  void required(const std::string& name) { required_.push_back(name); }
  /// When `name` is given, `other` must be given too.
  void needs(const std::string& name, const std::string& other) { needs_.emplace_back(name, other); }

  /// Fills the variables. Returns an exit status when the program must end: 0 after --help, 2 after a mistake.
  std::optional<int> parse(int argc, const char* const* argv) const;
  /// Prints one line on what is wrong with the arguments as a whole; returns the exit status.
  int mistake(const std::string& what) const;

 private:
  template <class T>
  static constexpr bool isList(const std::vector<T>&) {
    return true;
  }
  template <class T>
  static constexpr bool isList(const T&) {
    return false;
  }

  template <class T>
  static std::string text(const T& value) {
    std::ostringstream out;
    out << value;
    return out.str();
  }
  template <class T>
  static std::string text(const std::vector<T>& values) {
    std::ostringstream out;
    for (const T& v : values) out << (out.tellp() > 0 ? " " : "") << v;
    return out.str();
  }

  template <class T>
  static auto semantic(T& value) {
    auto* semantic = boost::program_options::value<T>(&value);
    if (const std::string written = text(value); !written.empty()) semantic->default_value(value, written);
    addTokens(semantic, value);
    return semantic;
  }
  template <class S, class T>
  static void addTokens(S* semantic, const std::vector<T>&) {
    semantic->multitoken()->composing();
  }
  template <class S, class T>
  static void addTokens(S*, const T&) {}

  static std::string longName(const std::string& name) { return name.substr(0, name.find(',')); }
  [[noreturn]] static void refuse(const std::string& name, const std::string& value, const std::string& expected);
  void printHelp() const;
  bool isArgument(const std::string& name) const;
  std::string written(const std::string& name) const;

  std::string program_, purpose_;
  boost::program_options::options_description visible_, hidden_;
  boost::program_options::positional_options_description positional_;
  std::vector<std::pair<std::string, std::string>> arguments_;
  std::vector<std::string> required_;
  std::vector<std::string> lists_;  ///< options that take several values
  std::vector<std::pair<std::string, std::string>> needs_;
  std::vector<std::pair<std::string, std::function<void()>>> checks_;  ///< of the values given
};

/// Splits the values of a repeatable option like `--set group/key=value` into pairs for setOptions. Throws
/// std::invalid_argument naming a text without a key or an equals sign.
std::vector<std::pair<std::string, std::string>> splitSettings(const std::vector<std::string>& settings);

}  // namespace vip_slam
