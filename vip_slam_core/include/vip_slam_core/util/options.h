// SPDX-License-Identifier: BSD-3-Clause
// Option structs. One declaration per option gives name, default, range, unit and meaning; loading from YAML or ROS
// parameters, range checks, printing and the parameter reference are all derived from it:
//
//   struct TrackerOptions {
//     int max_features = 200;
//     double min_distance = 20.0;
//     void visit(OptionVisitor& v) {
//       v.field("max_features", max_features, 20, 2000, "features kept per image");
//       v.field("min_distance", min_distance, 2.0, 200.0, "smallest distance between features, px");
//     }
//   };
#pragma once

#include <string>
#include <vector>

namespace vip_slam {

/// Visits every option of a struct. Nested structs appear as "group/name".
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  virtual void field(const std::string& name, bool& value, const std::string& meaning) = 0;
  virtual void field(const std::string& name, int& value, int min, int max, const std::string& meaning) = 0;
  virtual void field(const std::string& name, double& value, double min, double max, const std::string& meaning) = 0;
  /// `choices` empty: any string.
  virtual void field(const std::string& name, std::string& value, const std::vector<std::string>& choices,
                     const std::string& meaning) = 0;

  template <class Options>
  void group(const std::string& name, Options& options) {
    prefix_.push_back(name);
    options.visit(*this);
    prefix_.pop_back();
  }

 protected:
  std::string fullName(const std::string& name) const;

 private:
  std::vector<std::string> prefix_;
};

/// One option as text, for printing and the reference.
struct OptionRow {
  std::string name, type, value, range, meaning;
};

/// All options of a struct with their present values.
template <class Options>
std::vector<OptionRow> listOptions(Options options);

/// Sets options from "group/name" -> text. Throws std::invalid_argument naming the key, the value and what was
/// expected: an unknown key (with the nearest known one), a value of the wrong type or out of range. All or nothing.
template <class Options>
void setOptions(Options& options, const std::vector<std::pair<std::string, std::string>>& values);

/// Same from a YAML file (nested maps become groups) below `section` ("" = root). `source` of errors is the file name.
template <class Options>
void loadOptions(Options& options, const std::string& yaml_path, const std::string& section);

/// Markdown table: name, default, range, meaning.
std::string optionReference(const std::string& title, const std::vector<OptionRow>& rows);

// ---- implementation details: visitors behind the templates ----

class OptionLister : public OptionVisitor {
 public:
  std::vector<OptionRow> rows;
  void field(const std::string& name, bool& value, const std::string& meaning) override;
  void field(const std::string& name, int& value, int min, int max, const std::string& meaning) override;
  void field(const std::string& name, double& value, double min, double max, const std::string& meaning) override;
  void field(const std::string& name, std::string& value, const std::vector<std::string>& choices,
             const std::string& meaning) override;
};

class OptionSetter : public OptionVisitor {
 public:
  explicit OptionSetter(std::vector<std::pair<std::string, std::string>> values, std::string source = "");
  void field(const std::string& name, bool& value, const std::string& meaning) override;
  void field(const std::string& name, int& value, int min, int max, const std::string& meaning) override;
  void field(const std::string& name, double& value, double min, double max, const std::string& meaning) override;
  void field(const std::string& name, std::string& value, const std::vector<std::string>& choices,
             const std::string& meaning) override;
  /// Throws when a value was given for a name that no field has.
  void finish() const;

 private:
  const std::string* take(const std::string& name);
  [[noreturn]] void fail(const std::string& name, const std::string& text, const std::string& expected) const;
  std::vector<std::pair<std::string, std::string>> values_;
  std::vector<bool> taken_;
  std::vector<std::string> known_;
  std::string source_;
};

/// Flattens a YAML file's maps into "group/name" -> text pairs.
std::vector<std::pair<std::string, std::string>> flattenYaml(const std::string& yaml_path, const std::string& section);

template <class Options>
std::vector<OptionRow> listOptions(Options options) {
  OptionLister lister;
  options.visit(lister);
  return lister.rows;
}

template <class Options>
void setOptions(Options& options, const std::vector<std::pair<std::string, std::string>>& values) {
  Options copy = options;
  OptionSetter setter(values);
  copy.visit(setter);
  setter.finish();
  options = copy;
}

template <class Options>
void loadOptions(Options& options, const std::string& yaml_path, const std::string& section) {
  Options copy = options;
  OptionSetter setter(flattenYaml(yaml_path, section), yaml_path);
  copy.visit(setter);
  setter.finish();
  options = copy;
}

}  // namespace vip_slam
