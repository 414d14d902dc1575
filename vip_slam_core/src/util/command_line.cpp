// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/command_line.h"

#include <algorithm>
#include <iostream>
#include <stdexcept>

#include "text.h"

namespace vip_slam {
namespace po = boost::program_options;
namespace {

// "-0.5" is a value, not a bundle of short options.
std::vector<po::option> takeNegativeNumber(std::vector<std::string>& tokens) {
  double number;
  if (tokens.empty() || tokens.front().size() < 2 || tokens.front()[0] != '-' || !parseDouble(tokens.front(), &number))
    return {};
  po::option value;
  value.value.push_back(tokens.front());
  value.original_tokens.push_back(tokens.front());
  tokens.erase(tokens.begin());
  return {value};
}

}  // namespace

ValueCheck<std::string> oneOf(const std::string& names) {
  return [names](const std::string& v) {
    const bool known = !v.empty() && v.find(',') == std::string::npos &&
                       (", " + names + ", ").find(", " + v + ", ") != std::string::npos;
    return known ? std::string() : "one of " + names;
  };
}

CommandLine::CommandLine(std::string program, std::string purpose)
    : program_(std::move(program)), purpose_(std::move(purpose)), visible_("Options", 110) {
  visible_.add_options()("help,h", "print this and end");
}

void CommandLine::flag(const std::string& name, bool& value, const std::string& help) {
  visible_.add_options()(name.c_str(), po::bool_switch(&value), help.c_str());
}

void CommandLine::refuse(const std::string& name, const std::string& value, const std::string& expected) {
  throw std::invalid_argument("--" + name + " " + value + ": expected " + expected);
}

bool CommandLine::isArgument(const std::string& name) const {
  return std::any_of(arguments_.begin(), arguments_.end(), [&](const auto& a) { return a.first == name; });
}

std::string CommandLine::written(const std::string& name) const {
  for (const auto& [argument, help] : arguments_)
    if (argument == name) return name + " (" + help + ")";
  return "--" + name;
}

void CommandLine::printHelp() const {
  std::cout << purpose_ << "\n\nUsage: " << program_;
  for (const auto& [name, help] : arguments_) {
    const bool needed = std::find(required_.begin(), required_.end(), name) != required_.end();
    std::cout << (needed ? " " + name : " [" + name + "]");
  }
  for (const std::string& name : required_)
    if (!isArgument(name)) std::cout << " --" << name << " ...";
  std::cout << " [options]\n\n";
  for (const auto& [name, help] : arguments_) std::cout << "  " << name << ": " << help << "\n";
  if (!arguments_.empty()) std::cout << "\n";
  std::cout << visible_;
}

std::optional<int> CommandLine::parse(int argc, const char* const* argv) const {
  // roslaunch adds __name:=... and __log:=... to a program's arguments.
  std::vector<std::string> arguments;
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    if (argument.rfind("__", 0) != 0 || argument.find(":=") == std::string::npos) arguments.push_back(argument);
  }
  try {
    po::options_description all;
    all.add(visible_).add(hidden_);
    po::variables_map values;
    // No guessing of abbreviated options: a new option could change an abbreviation's meaning.
    po::command_line_parser parser(arguments);
    parser.options(all).positional(positional_).extra_style_parser(takeNegativeNumber);
    parser.style(po::command_line_style::default_style & ~po::command_line_style::allow_guessing);
    po::store(parser.run(), values);
    if (values.count("help")) {
      printHelp();
      return 0;
    }
    const auto given = [&](const std::string& name) { return values.count(name) && !values[name].defaulted(); };
    for (const std::string& name : required_)
      if (!given(name)) {
        // An option with a list takes all words that follow.
        const auto list = std::find_if(lists_.begin(), lists_.end(), given);
        const std::string hint =
            isArgument(name) && list != lists_.end() ? "; it has to stand before --" + *list : std::string();
        throw std::invalid_argument(written(name) + " is missing" + hint);
      }
    for (const auto& [name, other] : needs_)
      if (given(name) && !given(other)) throw std::invalid_argument("--" + name + " needs --" + other);
    po::notify(values);
    for (const auto& [name, check] : checks_)
      if (given(name)) check();
    return std::nullopt;
  } catch (const std::exception& error) {
    return mistake(error.what());
  }
}

int CommandLine::mistake(const std::string& what) const {
  std::cerr << program_ << ": " << what << " (see --help)\n";
  return 2;
}

std::vector<std::pair<std::string, std::string>> splitSettings(const std::vector<std::string>& settings) {
  std::vector<std::pair<std::string, std::string>> values;
  for (const std::string& setting : settings) {
    const auto equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw std::invalid_argument("--set " + setting + ": expected group/key=value");
    values.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
  }
  return values;
}

}  // namespace vip_slam
